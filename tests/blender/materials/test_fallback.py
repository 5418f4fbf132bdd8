"""Materials that nodes do not tell: baked by Cycles, equal to Cycles, and nothing left behind."""

import numpy as np
import pytest

bpy = pytest.importorskip("bpy", reason="needs Blender or its Python module")
mathutils = pytest.importorskip("mathutils")

import scene_builders as build  # noqa: E402
from materials_testing import (  # noqa: E402
    arrays_of,
    at_corners,
    cycles_bake,
    enable_cycles,
    glowing_material,
    grid_object,
    names_in_file,
    new_material,
    random_image,
    read_object,
    said_of,
    sampled,
)

from rtgi_addon.blender.materials import MaterialReader, fallback, shaders  # noqa: E402
from rtgi_addon.errors import BakeError  # noqa: E402
from rtgi_addon.numerics.sampling import sobol_owen  # noqa: E402
from rtgi_addon.transport.lights.emitters import EmitterTable  # noqa: E402
from rtgi_addon.transport.surfaces.geometry import flatten  # noqa: E402
from rtgi_addon.transport.surfaces.materials import Surfaces  # noqa: E402

pytestmark = pytest.mark.blender


def noise(tree, scale=3.0):
    node = tree.nodes.new("ShaderNodeTexNoise")
    node.inputs["Scale"].default_value = scale
    return node.outputs["Color"]


def object_noise(tree):
    node = tree.nodes.new("ShaderNodeTexNoise")
    tree.links.new(tree.nodes.new("ShaderNodeTexCoord").outputs["Object"], node.inputs["Vector"])
    return node.outputs["Color"]


def ramp_of_noise(tree):
    node = tree.nodes.new("ShaderNodeValToRGB")
    node.color_ramp.elements[0].color = (0.9, 0.2, 0.1, 1.0)
    tree.links.new(noise(tree), node.inputs[0])
    return node.outputs["Color"]


def world_position(tree):
    node = tree.nodes.new("ShaderNodeVectorMath")
    node.operation = "SCALE"
    node.inputs["Scale"].default_value = 0.1
    tree.links.new(tree.nodes.new("ShaderNodeNewGeometry").outputs["Position"], node.inputs[0])
    return node.outputs[0]


def noise_in_groups(tree):
    """Noise within a group within a group."""
    trees = [tree]
    for name in ("outer", "inner"):
        group = bpy.data.node_groups.new(name, "ShaderNodeTree")
        group.interface.new_socket("Result", in_out="OUTPUT", socket_type="NodeSocketColor")
        trees.append(group)
    source = noise(trees[2])
    for group, user in ((trees[2], trees[1]), (trees[1], trees[0])):
        group.links.new(source, group.nodes.new("NodeGroupOutput").inputs[0])
        node = user.nodes.new("ShaderNodeGroup")
        node.node_tree = group
        source = node.outputs[0]
    return source


def screen_of_images(tree):
    node = tree.nodes.new("ShaderNodeMix")
    node.data_type, node.blend_type = "RGBA", "SCREEN"
    node.inputs[0].default_value = 0.7
    for identifier, seed in (("A_Color", 1), ("B_Color", 2)):
        image = tree.nodes.new("ShaderNodeTexImage")
        image.image = random_image(seed=seed, high=0.4)
        tree.links.new(image.outputs["Color"], next(socket for socket in node.inputs if socket.identifier == identifier))
    return next(socket for socket in node.outputs if socket.identifier == "Result_Color")


def box_projection(tree):
    node = tree.nodes.new("ShaderNodeTexImage")
    node.image, node.projection = random_image(), "BOX"
    tree.links.new(tree.nodes.new("ShaderNodeTexCoord").outputs["Generated"], node.inputs["Vector"])
    return node.outputs["Color"]


def constant_hue(tree):
    node = tree.nodes.new("ShaderNodeHueSaturation")
    node.inputs["Hue"].default_value = 0.3
    node.inputs["Color"].default_value = (0.8, 0.3, 0.1, 1.0)
    return node.outputs[0]


PROCEDURAL = {"noise": noise, "object noise": object_noise, "ramp": ramp_of_noise, "position": world_position,
              "groups": noise_in_groups, "screen": screen_of_images, "box": box_projection, "hue": constant_hue}


@pytest.fixture(params=["texture", "corners"])
def carrier(request, monkeypatch):
    """Both ways a bake can be carried: a texture over its own UV map, or corner attributes."""
    if request.param == "corners":
        monkeypatch.setattr(fallback, "RESOLUTIONS", {})
    return request.param


@pytest.mark.parametrize("name", PROCEDURAL)
def test_a_baked_material_equals_cycles(empty_blend, carrier, name):
    thing = grid_object(glowing_material(PROCEDURAL[name]), cells=7)
    thing.location, thing.rotation_euler, thing.scale = (2.0, 3.0, 4.0), (0.2, 0.4, 0.6), (1.2, 0.9, 1.0)
    bpy.context.view_layer.update()
    (material,), mesh, reader, loops = read_object(thing)
    assert material.extraction == "cycles-bake" and material.albedo.is_constant == (name == "hue")
    assert [note for note in reader.notes if "material" in note and "Cycles" in note]
    for channel, kind in ((material.albedo, "DIFFUSE"), (material.emission, "EMIT")):
        difference = np.abs(at_corners(channel, mesh) - cycles_bake(thing, kind)[loops])
        assert difference.max() < 0.04 and difference.mean() < 8e-3  # half a texel at the rim of a patch


def test_a_texture_resolves_what_corners_cannot(empty_blend):
    def checker(tree):
        node = tree.nodes.new("ShaderNodeTexChecker")
        node.inputs["Scale"].default_value = 10.0
        node.inputs["Color1"].default_value, node.inputs["Color2"].default_value = (0.8, 0.1, 0.1, 1.0), (0.1, 0.2, 0.7, 1.0)
        tree.links.new(tree.nodes.new("ShaderNodeTexCoord").outputs["Object"], node.inputs["Vector"])
        return node.outputs["Color"]

    thing = grid_object(glowing_material(checker), cells=1)
    thing.data.transform(mathutils.Matrix.Translation((0.0, 0.0, 0.05)))  # off the boundary of the checker's cells
    (material,), mesh, _reader, _loops = read_object(thing)
    point = np.random.default_rng(0).uniform(-0.95, 0.95, (400, 2))
    cell = np.floor(point * 10.0).astype(int)
    point = point[np.all(np.abs(point * 10.0 - cell - 0.5) < 0.4, axis=1)]
    cell = np.floor(point * 10.0).astype(int)
    corners = mesh.vertices_local[mesh.triangles].reshape(-1, 3)[:, :2]
    corner_uv = mesh.uv_layers[fallback.BAKE_UV].reshape(-1, 2)
    uv_of_point = np.linalg.lstsq(np.c_[corners, np.ones(len(corners))], corner_uv, rcond=None)[0]
    got = sampled(material.albedo.texture, "rgb", np.c_[point, np.ones(len(point))] @ uv_of_point)
    even = (cell.sum(axis=1) % 2 == 0)[:, None]
    assert np.abs(got - np.where(even, (0.1, 0.2, 0.7), (0.8, 0.1, 0.1))).max() < 0.02


def test_what_was_baked_is_filtered_linear(empty_blend):
    """A checker finer than the texels that hold it keeps its mean: filtered as sRGB it would lose a quarter of its light."""
    def checker(tree):
        node = tree.nodes.new("ShaderNodeTexChecker")
        node.inputs["Scale"].default_value = 60.01
        node.inputs["Color1"].default_value, node.inputs["Color2"].default_value = (0.9, 0.9, 0.9, 1.0), (0.0, 0.0, 0.0, 1.0)
        tree.links.new(tree.nodes.new("ShaderNodeTexCoord").outputs["Object"], node.inputs["Vector"])
        return node.outputs["Color"]

    thing = grid_object(glowing_material(checker), cells=1)
    thing.data.transform(mathutils.Matrix.Translation((0.0, 0.0, 0.005)))
    (material,), _mesh, _reader, _loops = read_object(thing)
    uv = np.random.default_rng(1).uniform(0.1, 0.9, (20_000, 2))
    for channel in (material.albedo, material.emission):
        assert channel.texture.pixels.dtype == np.float16 and not channel.texture.srgb
        assert np.isclose(sampled(channel.texture, "rgb", uv).mean(), 0.45, rtol=0.02)


def disc(tree, radius, strength):
    """A disc that shines, as a number."""
    distance, inside, times = (tree.nodes.new(f"ShaderNode{kind}") for kind in ("VectorMath", "Math", "Math"))
    distance.operation, inside.operation, times.operation = "DISTANCE", "LESS_THAN", "MULTIPLY"
    distance.inputs[1].default_value = (0.25, -0.25, 0.0)
    inside.inputs[1].default_value, times.inputs[1].default_value = radius, strength
    tree.links.new(tree.nodes.new("ShaderNodeTexCoord").outputs["Object"], distance.inputs[0])
    tree.links.new(distance.outputs["Value"], inside.inputs[0])
    tree.links.new(inside.outputs[0], times.inputs[0])
    return times.outputs[0]


@pytest.mark.parametrize("cells, radius", [(1, 0.004), (72, 0.013)])
def test_a_small_bright_spot_keeps_its_light(empty_blend, cells, radius):
    """A disc of a few texels, and one smaller than the polygons of a mesh that bakes to its corners: off by 7 and 64 % alone."""
    material, output = new_material()
    emission = material.node_tree.nodes.new("ShaderNodeEmission")
    material.node_tree.links.new(disc(material.node_tree, radius, 1e5), emission.inputs["Strength"])
    material.node_tree.links.new(emission.outputs[0], output.inputs["Surface"])
    (material,), mesh, _reader, _loops = read_object(grid_object(material, cells=cells))
    scene = build.scene([mesh], [material])
    geometry = flatten(scene)
    table = EmitterTable(geometry, Surfaces(scene, geometry))
    emitted = table.sample(sobol_owen(4096, 3, 1))
    assert (table.mean_radiance(emitted, 1)[:, 0] / emitted.pdf_area).mean() == pytest.approx(np.pi * radius**2 * 1e5, rel=0.01)


def test_images_combined_texel_by_texel_stay_coded(empty_blend):
    material, output = new_material()
    tree = material.node_tree
    image, gamma, diffuse = (tree.nodes.new(f"ShaderNode{kind}") for kind in ("TexImage", "Gamma", "BsdfDiffuse"))
    image.image, gamma.inputs["Gamma"].default_value = random_image(), 1.3
    tree.links.new(image.outputs["Color"], gamma.inputs["Color"])
    tree.links.new(gamma.outputs[0], diffuse.inputs["Color"])
    tree.links.new(diffuse.outputs[0], output.inputs["Surface"])
    (read,), *_rest = read_object(grid_object(material))
    assert read.albedo.texture.srgb and read.albedo.texture.pixels.dtype == np.uint8


def test_a_closure_without_a_formula_is_baked_by_its_diffuse_colour(empty_blend, monkeypatch):
    monkeypatch.delitem(shaders._READERS, "ShaderNodeBsdfToon")
    material, output = new_material()
    toon = material.node_tree.nodes.new("ShaderNodeBsdfToon")
    toon.inputs["Color"].default_value = (0.3, 0.5, 0.2, 1.0)
    material.node_tree.links.new(toon.outputs[0], output.inputs["Surface"])
    (read,), _mesh, reader, _loops = read_object(grid_object(material))
    assert np.allclose(read.albedo.constant, (0.3, 0.5, 0.2), atol=1e-4) and not read.is_emissive
    assert any("Toon" in note for note in reader.notes) and "its Toon BSDF has no formula here" in said_of(reader)


def test_unreadable_coverage_and_factor_are_baked_too(empty_blend):
    material, output = new_material()
    tree = material.node_tree
    mix, clear, diffuse = (tree.nodes.new(f"ShaderNode{kind}") for kind in ("MixShader", "BsdfTransparent", "BsdfDiffuse"))
    tree.links.new(noise(tree), mix.inputs[0])
    tree.links.new(clear.outputs[0], mix.inputs[1])
    tree.links.new(diffuse.outputs[0], mix.inputs[2])
    tree.links.new(mix.outputs[0], output.inputs["Surface"])
    diffuse.inputs["Color"].default_value = (0.7, 0.6, 0.5, 1.0)
    thing = grid_object(material)
    (read,), mesh, _reader, loops = read_object(thing)
    assert np.allclose(read.albedo.constant, (0.7, 0.6, 0.5)) and not read.is_opaque
    premultiplied = cycles_bake(thing, "DIFFUSE")[loops]
    assert np.abs(at_corners(read.alpha, mesh) * read.albedo.constant - premultiplied).max() < 0.02


def test_only_the_slots_that_need_it_are_baked(empty_blend):
    thing = grid_object(glowing_material(noise))
    plain = glowing_material(lambda tree: tree.nodes.new("ShaderNodeRGB").outputs[0])
    for material in (plain, None, glowing_material(object_noise)):
        thing.data.materials.append(material)
    thing.data.polygons.foreach_set("material_index", np.arange(len(thing.data.polygons), dtype=np.int32) % 5)
    materials, mesh, _reader, loops = read_object(thing)
    assert [material.extraction for material in materials] == ["cycles-bake", "nodes", "nodes", "cycles-bake"]
    expected = cycles_bake(thing, "DIFFUSE")[loops]
    for slot in (0, 3):
        chosen = np.minimum(mesh.triangle_material, 3) == slot  # a slot beyond the last means the last
        assert np.abs(at_corners(materials[slot].albedo, mesh) - expected)[chosen].max() < 0.04


def test_evaluated_geometry_is_baked(empty_blend):
    thing = grid_object(glowing_material(object_noise), cells=2)
    thing.shape_key_add(name="Basis")
    raised = thing.shape_key_add(name="raised")
    raised.data[0].co.z, raised.value = 0.8, 0.5
    thing.modifiers.new("array", "ARRAY").count = 3
    bpy.context.view_layer.update()
    before = names_in_file()
    (material,), mesh, _reader, loops = read_object(thing)
    assert len(mesh.triangles) == 3 * 8 and np.isclose(mesh.vertices_local[:, 2].max(), 0.4) and names_in_file() == before
    applied = bpy.data.objects.new("applied", bpy.data.meshes.new_from_object(
        thing.evaluated_get(bpy.context.evaluated_depsgraph_get())))
    bpy.context.scene.collection.objects.link(applied)
    assert np.abs(at_corners(material.albedo, mesh) - cycles_bake(applied, "DIFFUSE")[loops]).max() < 0.04


def test_generated_coordinates_are_those_before_modifiers(empty_blend):
    """From 0 to 1 over the mesh as it is modelled: further copies of an array lie beyond."""
    def generated(tree):
        apart = tree.nodes.new("ShaderNodeSeparateXYZ")
        tree.links.new(tree.nodes.new("ShaderNodeTexCoord").outputs["Generated"], apart.inputs[0])
        return apart.outputs["X"]

    thing = grid_object(glowing_material(generated), cells=2)
    thing.modifiers.new("array", "ARRAY").count = 3
    bpy.context.view_layer.update()
    (material,), mesh, _reader, _loops = read_object(thing)
    across = 0.5 * (mesh.vertices_local[mesh.triangles][..., 0] + 1.0)
    assert across.max() > 2.9 and np.abs(at_corners(material.emission, mesh)[..., 0] - across).max() < 0.05


def test_curves_and_instanced_geometry_are_baked(empty_blend):
    material = glowing_material(noise)
    text = bpy.data.objects.new("text", bpy.data.curves.new("text", "FONT"))
    text.data.body, text.data.extrude = "probe", 0.1
    text.data.materials.append(material)
    tree = bpy.data.node_groups.new("instances", "GeometryNodeTree")
    tree.interface.new_socket("Geometry", in_out="OUTPUT", socket_type="NodeSocketGeometry")
    cube, line, place, dress = (tree.nodes.new(f"GeometryNode{kind}") for kind in (
        "MeshCube", "MeshLine", "InstanceOnPoints", "SetMaterial"))
    end = tree.nodes.new("NodeGroupOutput")
    dress.inputs["Material"].default_value = material
    tree.links.new(cube.outputs["Mesh"], dress.inputs["Geometry"])
    tree.links.new(line.outputs["Mesh"], place.inputs["Points"])
    tree.links.new(dress.outputs["Geometry"], place.inputs["Instance"])
    tree.links.new(place.outputs["Instances"], end.inputs[0])
    cubes = grid_object(None, name="cubes")
    cubes.modifiers.new("nodes", "NODES").node_group = tree
    bpy.context.scene.collection.objects.link(text)
    depsgraph = bpy.context.evaluated_depsgraph_get()
    with MaterialReader(bpy.context.scene, depsgraph) as reader:
        requests = []
        for instance in depsgraph.object_instances:
            thing = instance.object
            data = thing.data
            if thing.type != "MESH" or not len(data.polygons):
                continue
            requests.append((reader.request_bake(thing, list(data.materials), instance.matrix_world), *arrays_of(data)))
        assert {request.name for request, *_rest in requests} == {"text", "cubes"}
        for request, mesh, loops in requests:
            mesh, materials = reader.bake(request, mesh, loops)
            values = at_corners(next(iter(materials.values())).albedo, mesh)
            assert 0.1 < values.mean() < 0.9 and values.std() > 0.01


def test_nothing_is_left_behind(empty_blend, carrier, monkeypatch):
    enable_cycles()
    thing, other = grid_object(glowing_material(noise_in_groups)), grid_object(None, name="other")
    other.select_set(True)
    bpy.context.view_layer.objects.active = other
    bpy.context.scene.render.engine = "BLENDER_WORKBENCH"
    before, attributes = names_in_file(), thing.data.attributes.keys()
    read_object(thing)
    assert names_in_file() == before and thing.data.attributes.keys() == attributes
    monkeypatch.setattr(fallback._Stage, "results", lambda *_: 1 / 0)
    with pytest.raises(ZeroDivisionError):
        read_object(thing)
    assert names_in_file() == before and thing.data.attributes.keys() == attributes
    assert bpy.context.view_layer.objects.active == other and bpy.context.selected_objects == [other]
    assert bpy.context.scene.render.engine == "BLENDER_WORKBENCH" and thing.mode == "OBJECT"


def test_requests_never_baked_are_removed(empty_blend):
    thing = grid_object(glowing_material(noise))
    before = names_in_file()
    depsgraph = bpy.context.evaluated_depsgraph_get()
    with MaterialReader(bpy.context.scene, depsgraph) as reader:
        reader.request_bake(thing.evaluated_get(depsgraph), [thing.data.materials[0]], thing.matrix_world)
        assert names_in_file() != before
    assert names_in_file() == before


def test_a_failed_bake_is_an_error_that_names_the_object(empty_blend, monkeypatch):
    thing = grid_object(glowing_material(noise))
    before = names_in_file()
    monkeypatch.setattr(fallback._Stage, "_add_target", lambda stage, *_: stage._images.clear())
    with pytest.raises(BakeError, match="grid"):
        read_object(thing)
    assert names_in_file() == before


def test_patches_of_the_atlas_do_not_overlap():
    from rtgi_addon.blender.materials.atlas import MINIMUM, PADDING, polygon_uv

    rng = np.random.default_rng(3)
    size = rng.uniform(0.01, 2.0, (200, 2))
    quad = np.array([[0, 0], [1, 0], [1, 1], [0, 1]])
    turn, _upper = np.linalg.qr(rng.normal(size=(3, 3)))
    corners = (np.c_[(quad[None] * size[:, None]).reshape(-1, 2), np.zeros(800)]) @ turn.T
    normals = np.repeat(np.cross(turn[:, 0], turn[:, 1])[None], 200, axis=0)
    uv = polygon_uv(corners, normals, np.arange(200) * 4, np.full(200, 4), 512).reshape(200, 4, 2) * 512
    low, high = uv.min(axis=1) - PADDING, uv.max(axis=1) + PADDING
    assert low.min() >= -1e-3 and high.max() <= 512 + 1e-3
    apart = np.any((low[:, None] >= high[None] - 1e-3) | (high[:, None] <= low[None] + 1e-3), axis=-1)
    assert np.all(apart | np.eye(200, dtype=bool))
    extent = np.sort(high - low - 2 * PADDING, axis=1)
    scale = extent[:, 1].max() / size.max()
    assert np.allclose(extent, np.maximum(np.sort(size, axis=1) * scale, MINIMUM), rtol=1e-3)
    assert np.prod(extent, axis=1).sum() > 0.4 * 512**2


def test_polygons_far_smaller_than_a_texel_are_baked_too(empty_blend):
    thing = grid_object(glowing_material(object_noise), cells=24)
    for vertex in thing.data.vertices:  # all but the outermost cells shrink to a speck
        if max(abs(vertex.co.x), abs(vertex.co.y)) < 0.99:
            vertex.co *= 1e-3
    bpy.context.view_layer.update()
    (material,), mesh, _reader, loops = read_object(thing)
    assert material.albedo.texture is not None
    difference = np.abs(at_corners(material.albedo, mesh) - cycles_bake(thing, "DIFFUSE")[loops])
    assert difference.mean() < 0.01


@pytest.mark.parametrize("cells, side", [(32, 512), (64, 1024), (65, None)])
def test_dense_meshes_get_larger_textures_and_then_corners(empty_blend, cells, side):
    thing = grid_object(glowing_material(noise), cells=cells)
    (material,), mesh, _reader, loops = read_object(thing)
    assert (material.albedo.attribute is None) == (side is not None)
    assert side is None or material.albedo.texture.pixels.shape == (side, side, 3)
    assert np.abs(at_corners(material.albedo, mesh) - cycles_bake(thing, "DIFFUSE")[loops]).mean() < 5e-3


def test_a_very_long_chain_of_nodes_is_baked(empty_blend):
    def chain(tree):
        source = noise(tree)
        for _ in range(300):
            gamma = tree.nodes.new("ShaderNodeGamma")
            source = tree.links.new(source, gamma.inputs[0]).to_node.outputs[0]
        return source

    (material,), _mesh, reader, _loops = read_object(grid_object(glowing_material(chain)))
    assert material.extraction == "cycles-bake" and any("in a row" in note for note in reader.notes)
