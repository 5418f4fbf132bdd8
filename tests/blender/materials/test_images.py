"""Images: packed, external, generated, float, missing, large; and the way through glTF and back."""

import numpy as np
import pytest

bpy = pytest.importorskip("bpy", reason="needs Blender or its Python module")

from materials_testing import (  # noqa: E402
    at_corners,
    cycles_bake,
    glowing_material,
    grid_object,
    new_principled,
    random_image,
    read_object,
    said_of,
)

from rtgi_addon.blender.extract import extract_scene  # noqa: E402
from rtgi_addon.blender.materials import images  # noqa: E402

pytestmark = pytest.mark.blender


def shown(image, **settings):
    """A grid that shows an image."""
    def build(tree):
        node = tree.nodes.new("ShaderNodeTexImage")
        node.image = image
        for name, value in settings.items():
            setattr(node, name, value)
        return node.outputs["Color"]

    return grid_object(glowing_material(build))


def equals_cycles(thing, tolerance=4e-3):
    (material,), mesh, reader, loops = read_object(thing)
    difference = np.abs(at_corners(material.albedo, mesh) - cycles_bake(thing, "DIFFUSE")[loops]).max()
    assert difference < tolerance, difference
    return material, reader


def saved(image, path, kind="PNG"):
    """An image written to a file and loaded from it."""
    image.filepath_raw, image.file_format = str(path), kind
    image.save()
    return bpy.data.images.load(str(path))


def test_packed_bytes_stay_bytes(empty_blend):
    material, _reader = equals_cycles(shown(random_image()))
    assert material.albedo.texture.pixels.dtype == np.uint8 and material.albedo.texture.srgb


def test_external_file(empty_blend, tmp_path):
    material, _reader = equals_cycles(shown(saved(random_image(), tmp_path / "picture.png")))
    assert material.albedo.texture.pixels.shape == (6, 8, 3)


def test_relative_path(empty_blend, tmp_path):
    image = saved(random_image(), tmp_path / "picture.png")
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "scene.blend"))
    image.filepath = "//picture.png"
    assert equals_cycles(shown(image))[0].albedo.texture.pixels.shape == (6, 8, 3)


def test_float_exr_keeps_its_range(empty_blend, tmp_path):
    image = saved(random_image(float_buffer=True, high=0.99), tmp_path / "picture.exr", "OPEN_EXR")
    material, _reader = equals_cycles(shown(image))
    assert material.albedo.texture.pixels.dtype == np.float32 and not material.albedo.texture.srgb


def test_generated_image(empty_blend):
    image = bpy.data.images.new("grid", 64, 64)
    image.generated_type = "COLOR_GRID"
    equals_cycles(shown(image, interpolation="Closest"))


def test_another_colour_space_takes_the_bake(empty_blend):
    image = random_image()
    image.colorspace_settings.name = "Linear Rec.2020"
    thing = shown(image, interpolation="Closest")
    (material,), *_, reader, _loops = read_object(thing)
    assert material.extraction == "cycles-bake" and any("Rec.2020" in note for note in reader.notes)


def test_a_missing_image_is_magenta_and_named_with_its_path(empty_blend, tmp_path):
    image = saved(random_image(), tmp_path / "picture.png")
    image.filepath = str(tmp_path / "gone.png")
    image.reload()
    thing = shown(image)
    material, reader = equals_cycles(thing)
    assert np.allclose(material.albedo.texture.pixels, (1.0, 0.0, 1.0))
    assert f"image '{image.name}' is missing" in said_of(reader) and "gone.png" in said_of(reader)


def test_every_material_of_a_missing_image_is_named(empty_blend, tmp_path):
    """A click on the line selects what is magenta, and the share of the light is that of all of it."""
    image = saved(random_image(), tmp_path / "picture.png")
    image.filepath = str(tmp_path / "gone.png")
    image.reload()
    shown(image).name = "first"
    second = shown(image)
    second.name, second.location = "second", (3, 0, 0)
    scene = extract_scene()
    said, = [omission for omission in scene.omissions if "is missing" in omission.text]
    assert set(said.materials) == {slot.material.name for obj in bpy.context.scene.objects for slot in obj.material_slots}
    assert len(said.materials) == 2


def test_large_images_are_averaged_in_linear_light_and_it_is_said(empty_blend, monkeypatch):
    monkeypatch.setattr(images, "MAXIMUM_SIDE", 8)
    image = bpy.data.images.new("stripes", 16, 12)
    pixels = np.ones((12, 16, 4), np.float32)
    pixels[:, ::2, :3] = 0.0
    image.pixels.foreach_set(pixels.ravel())
    (material,), _mesh, reader, _loops = read_object(shown(image))
    texture = material.albedo.texture
    assert texture.pixels.shape == (6, 8, 3) and texture.srgb and np.all(texture.pixels == 188)
    assert any("stripes" in note and "16×12" in note for note in reader.notes)


def test_an_image_used_twice_is_one_texture(empty_blend):
    image = random_image()
    things = [shown(image), shown(image)]
    things[0].data.materials.append(things[1].data.materials[0])
    (first, second), *_ = read_object(things[0])
    assert first.albedo.texture is second.albedo.texture is first.emission.texture


def test_gltf_round_trip(empty_blend, tmp_path):
    material, node = new_principled("painted", Metallic=0.0, Roughness=0.5, Emission_Strength=4.0)
    tree = material.node_tree
    image = tree.nodes.new("ShaderNodeTexImage")
    image.image = random_image(alpha=True)
    tree.links.new(image.outputs["Color"], node.inputs["Base Color"])
    cut = tree.nodes.new("ShaderNodeMath")
    cut.operation = "GREATER_THAN"
    cut.inputs[1].default_value = 0.4
    tree.links.new(image.outputs["Alpha"], cut.inputs[0])
    tree.links.new(cut.outputs[0], node.inputs["Alpha"])
    glow = tree.nodes.new("ShaderNodeTexImage")
    glow.image = random_image("glow", seed=7)
    tree.links.new(glow.outputs["Color"], node.inputs["Emission Color"])
    grid_object(material)
    (before,), mesh, _reader, _loops = read_object(bpy.data.objects["grid"])
    path = str(tmp_path / "painted.glb")
    bpy.ops.export_scene.gltf(filepath=path)
    bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
    bpy.ops.import_scene.gltf(filepath=path)
    (after,), *_ = read_object(next(thing for thing in bpy.data.objects if thing.type == "MESH"))
    assert after.extraction == "nodes" and after.is_emissive
    assert np.isclose(after.alpha_threshold, before.alpha_threshold, atol=1e-3)
    mesh = grid_object(None).data
    from materials_testing import arrays_of

    mesh, _loops = arrays_of(mesh)
    for name in ("albedo", "emission", "alpha"):
        one, two = at_corners(getattr(before, name), mesh), at_corners(getattr(after, name), mesh)
        assert np.abs(one - two).max() < 0.02 * max(1.0, one.max()), name


def shown_by(image):
    """(material, mesh, what Cycles bakes of it at the corners) of a grid that emits and reflects an image."""
    def build(tree):
        node = tree.nodes.new("ShaderNodeTexImage")
        node.image, node.interpolation = image, "Closest"
        return node.outputs["Color"]

    thing = grid_object(glowing_material(build), cells=5)
    (material,), mesh, _reader, loops = read_object(thing)
    return material, mesh, cycles_bake(thing, "EMIT")[loops]


@pytest.mark.skipif(not hasattr(bpy.types, "BlendFileColorspace"), reason="files have one working space before 5.0")
@pytest.mark.parametrize("space", ["ACEScg", "Linear Rec.2020"])
def test_images_are_brought_into_the_working_space(empty_blend, space):
    bpy.ops.wm.set_working_color_space(working_space=space, convert_colors=False)
    image = random_image(high=1.0, low=0.0)
    material, mesh, expected = shown_by(image)
    assert material.extraction == "nodes" and material.emission.texture.pixels.dtype == np.float16
    assert np.abs(at_corners(material.emission, mesh) - expected).max() < 2e-3
    image.colorspace_settings.name = "Non-Color"
    material, mesh, expected = shown_by(image)
    assert np.abs(at_corners(material.emission, mesh) - expected).max() < 2e-3


def test_bytes_that_are_premultiplied_are_read_by_cycles(empty_blend, tmp_path):
    """Blender divides them by their alpha and clips what comes out."""
    image = bpy.data.images.new("straight", 4, 4, alpha=True)
    image.pixels.foreach_set(np.tile(np.float32([1.0, 0.5, 0.2, 0.25]), 16))
    image.filepath_raw, image.file_format = str(tmp_path / "image.png"), "PNG"
    image.save()
    loaded = bpy.data.images.load(str(tmp_path / "image.png"), check_existing=False)
    loaded.alpha_mode = "PREMUL"
    material, mesh, expected = shown_by(loaded)
    assert material.extraction == "cycles-bake"
    assert np.abs(at_corners(material.emission, mesh) - expected).max() < 0.02
