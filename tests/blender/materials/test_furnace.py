"""What closures reflect of even light, held to Cycles' white furnace."""

import numpy as np
import pytest

bpy = pytest.importorskip("bpy", reason="needs Blender or its Python module")

from materials_testing import closures, enable_cycles, new_principled, only  # noqa: E402

from rtgi_addon.blender.extract import extract_scene  # noqa: E402

pytestmark = pytest.mark.blender


def furnace(material, path):
    """Bihemispherical albedo (3,) of a smooth sphere under a uniform sky of radiance 1, rendered by Cycles."""
    enable_cycles()
    scene = bpy.context.scene
    scene.render.engine = "CYCLES"
    scene.cycles.samples, scene.cycles.use_denoising, scene.cycles.use_adaptive_sampling = 64, False, False
    scene.render.resolution_x = scene.render.resolution_y = 40
    scene.render.film_transparent = True
    scene.render.image_settings.file_format, scene.render.image_settings.color_depth = "OPEN_EXR", "32"
    scene.render.filepath = str(path / "furnace.exr")
    scene.world = bpy.data.worlds.new("sky")
    if scene.world.node_tree is None:
        scene.world.use_nodes = True
    background = next(node for node in scene.world.node_tree.nodes if node.bl_idname == "ShaderNodeBackground")
    background.inputs["Color"].default_value = (1.0, 1.0, 1.0, 1.0)
    camera = bpy.data.objects.new("camera", bpy.data.cameras.new("camera"))
    camera.data.type, camera.data.ortho_scale, camera.location.z = "ORTHO", 2.1, 5.0
    scene.collection.objects.link(camera)
    scene.camera = camera
    bpy.ops.mesh.primitive_uv_sphere_add(segments=96, ring_count=48, radius=1.0)
    bpy.ops.object.shade_smooth()
    if material is not None:
        bpy.context.object.data.materials.append(material)
    bpy.ops.render.render(write_still=True)
    image = bpy.data.images.load(scene.render.filepath)
    pixels = np.array(image.pixels[:]).reshape(-1, 4)
    return pixels[:, :3].sum(axis=0) / pixels[:, 3].sum()


@pytest.mark.parametrize("inputs", [
    {},
    {"Metallic": 1.0},
    {"Metallic": 0.5, "Roughness": 0.7},
    {"Metallic": 1.0, "Roughness": 0.9},
    {"Roughness": 0.1},
    {"IOR": 1.2},
    {"IOR": 1.9, "Roughness": 0.8},
    {"Specular_IOR_Level": 0.2},
    {"Specular_IOR_Level": 0.9, "Roughness": 0.35},
    {"Subsurface_Weight": 0.0, "Coat_Weight": 1.0},
    {"Coat_Weight": 1.0, "Coat_Tint": (0.9, 0.4, 0.1, 1.0)},
    {"Coat_Weight": 0.5, "Coat_Tint": (0.5, 0.5, 0.5, 1.0), "Coat_IOR": 1.8, "Metallic": 1.0},
    {"Metallic": 1.0, "Specular_Tint": (0.2, 0.9, 0.3, 1.0)},
    {"IOR": 2.0, "Specular_Tint": (0.2, 0.9, 0.3, 1.0)},
    {"IOR": 2.0, "Specular_Tint": (2.0, 2.0, 2.0, 1.0)},
    {"IOR": 3.5, "Roughness": 0.3},
    {"IOR": 3.0, "Specular_IOR_Level": 1.0},
    {"Diffuse_Roughness": 1.0},
], ids=str)
def test_principled_albedo_is_that_of_the_white_furnace(empty_blend, tmp_path, inputs):
    material, _node = new_principled(Base_Color=(0.8, 0.5, 0.2, 1.0), **inputs)
    expected = furnace(material, tmp_path)
    tolerance = 0.02 if "Coat_Weight" in inputs else 0.006
    assert np.abs(only(material).albedo.constant - expected).max() < tolerance


def test_a_mesh_without_a_material_reflects_what_cycles_gives_it(empty_blend, tmp_path):
    expected = furnace(None, tmp_path)
    (read,) = extract_scene().materials
    assert np.abs(read.albedo.constant - expected).max() < 0.004
    assert np.allclose(read.base_color.constant, 0.8)


@pytest.mark.parametrize("kind, color", [("ShaderNodeBsdfAnisotropic", "Color"), ("ShaderNodeBsdfMetallic", "Base Color")])
@pytest.mark.parametrize("distribution", ["MULTI_GGX", "GGX"])
def test_glossy_and_metallic_albedo_is_that_of_the_white_furnace(empty_blend, tmp_path, kind, color, distribution):
    material, (node,), output = closures((kind, {color: (0.9, 0.6, 0.3, 1.0), "Roughness": 0.6}))
    node.distribution = distribution
    material.node_tree.links.new(node.outputs[0], output.inputs["Surface"])
    if kind == "ShaderNodeBsdfMetallic":
        node.inputs["Edge Tint"].default_value = (1.0, 1.0, 1.0, 1.0)
    expected = furnace(material, tmp_path)
    assert np.abs(only(material).albedo.constant - expected).max() < 0.01


@pytest.mark.parametrize("inputs, kind", [
    ({"Base Color": (0.9, 0.5, 0.2, 1.0), "Edge Tint": (0.3, 0.6, 0.9, 1.0)}, "F82"), ({"Roughness": 0.1}, "F82"),
    ({"Roughness": 0.3}, "PHYSICAL_CONDUCTOR"), ({"Roughness": 0.8}, "PHYSICAL_CONDUCTOR")], ids=str)
def test_a_metal_of_two_colours_or_an_index_has_the_albedo_of_the_white_furnace(empty_blend, tmp_path, inputs, kind):
    material, (node,), output = closures(("ShaderNodeBsdfMetallic", inputs))
    if not hasattr(node, "fresnel_type") or "Edge Tint" not in node.inputs:
        pytest.skip("this Blender's Metallic BSDF is another one")
    node.fresnel_type = kind
    material.node_tree.links.new(node.outputs[0], output.inputs["Surface"])
    expected = furnace(material, tmp_path)
    assert np.abs(only(material).albedo.constant - expected).max() < 0.01


@pytest.mark.parametrize("roughness", [0.25, 1.0])
def test_rough_diffuse_reflection_has_the_albedo_of_the_white_furnace(empty_blend, tmp_path, roughness):
    material, (node,), output = closures(("ShaderNodeBsdfDiffuse", {"Color": (0.9, 0.5, 0.2, 1.0), "Roughness": roughness}))
    material.node_tree.links.new(node.outputs[0], output.inputs["Surface"])
    expected = furnace(material, tmp_path)
    assert np.abs(only(material).albedo.constant - expected).max() < 0.003
