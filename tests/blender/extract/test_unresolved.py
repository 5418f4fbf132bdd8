"""What a file refers to and Blender could not bring is said, and refuses a bake, where the scene needs it."""

import os

import pytest

bpy = pytest.importorskip("bpy", reason="needs Blender or its Python module")

from blend_builders import cube_mesh, link, material  # noqa: E402

from rtgi_addon.blender.extract import extract_scene  # noqa: E402
from rtgi_addon.errors import BakeError  # noqa: E402
from rtgi_addon.scene.checks import check_scene  # noqa: E402


def save_library(path):
    """A .blend with a slab of its own material, in a collection."""
    slab = link("slab", cube_mesh("slab mesh"))
    slab.data.materials.append(material("slab paint", (0.1, 0.1, 0.1)))
    kit = bpy.data.collections.new("kit")
    bpy.context.scene.collection.children.link(kit)
    kit.objects.link(slab)
    bpy.ops.wm.save_as_mainfile(filepath=str(path))


def load(path, **names):
    with bpy.data.libraries.load(str(path), link=True) as (_, wanted):
        for kind, name in names.items():
            setattr(wanted, kind, [name])
    return [getattr(wanted, kind)[0] for kind in names]


def by_object(path):
    link("slab", load(path, objects="slab")[0].data)


def by_mesh(path):
    link("own", load(path, meshes="slab mesh")[0])


def by_material(path):
    link("own", cube_mesh()).data.materials.append(load(path, materials="slab paint")[0])


def by_collection(path):
    bpy.context.scene.collection.children.link(load(path, collections="kit")[0])


def by_instance(path):
    holder = link("holder", None)
    holder.instance_type, holder.instance_collection = "COLLECTION", load(path, collections="kit")[0]


def by_override(path):
    slab, = load(path, objects="slab")
    bpy.context.scene.collection.objects.link(slab)
    slab.override_create(remap_local_usages=True)


def by_excluded_collection(path):
    by_collection(path)
    bpy.context.view_layer.layer_collection.children["kit"].exclude = True


def by_nothing_in_the_scene(path):
    load(path, materials="slab paint")[0].use_fake_user = True


@pytest.mark.parametrize(("use", "lost", "concerned"), [
    (by_object, "slab mesh (for slab)", "slab"), (by_mesh, "slab mesh (for own)", "own"),
    (by_material, "slab paint (for own)", "own"),
    (by_collection, "kit (for Scene)", "Scene"), (by_instance, "kit (for holder)", "holder"), (by_override, "slab", "slab"),
    (by_excluded_collection, None, None), (by_nothing_in_the_scene, None, None)])
def test_a_missing_library_is_named_with_what_needs_it(empty_blend, tmp_path, use, lost, concerned):
    save_library(tmp_path / "library.blend")
    bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
    link("wall", cube_mesh())
    use(tmp_path / "library.blend")
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "scene.blend"))
    assert not extract_scene().omissions
    (tmp_path / "library.blend").unlink()
    bpy.ops.wm.open_mainfile(filepath=str(tmp_path / "scene.blend"))
    scene = extract_scene()
    if lost is None:
        assert not scene.omissions
        return
    omission, = scene.omissions
    assert omission.text.startswith("library") and f"library.blend is missing, and {lost}" in omission.text
    assert concerned in omission.objects
    error = check_scene(scene)[0]
    assert (error.severity, error.cause) == ("error", omission.text) and error.subject == (omission.objects, ())


def test_what_a_library_no_longer_holds_is_named(empty_blend, tmp_path):
    save_library(tmp_path / "library.blend")
    bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
    link("wall", cube_mesh())
    by_mesh(tmp_path / "library.blend")
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "scene.blend"))
    bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "library.blend"))
    bpy.ops.wm.open_mainfile(filepath=str(tmp_path / "scene.blend"))
    omission, = extract_scene().omissions
    assert "library.blend has changed, and slab mesh (for own) is not there" in omission.text


def test_a_scene_that_is_all_missing_is_not_called_empty(empty_blend, tmp_path):
    save_library(tmp_path / "library.blend")
    bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
    by_collection(tmp_path / "library.blend")
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "scene.blend"))
    (tmp_path / "library.blend").unlink()
    bpy.ops.wm.open_mainfile(filepath=str(tmp_path / "scene.blend"))
    with pytest.raises(BakeError, match=r"library.blend is missing"):
        extract_scene()


def test_a_missing_cache_of_geometry_is_named(empty_blend, tmp_path):
    link("cloud", bpy.data.volumes.new("smoke")).data.filepath = str(tmp_path / "gone.vdb")
    wall = link("wall", cube_mesh())
    texts = [omission.text for omission in extract_scene().omissions if omission.remedy]
    assert texts == [f"file {tmp_path / 'gone.vdb'} is missing, and with it smoke (for cloud)"]
    assert wall.name not in texts[0]


@pytest.fixture
def driven(empty_blend, tmp_path):
    """A file with a lamp and an unused material that Python drives, and a lamp that a plain expression drives."""
    def drive(owner, path, expression):
        driver = owner.driver_add(path).driver
        driver.type, driver.expression = "SCRIPTED", expression

    lamp, simple = (link(name, bpy.data.lights.new(name, "POINT")) for name in ("lamp", "simple"))
    drive(lamp.data, "energy", "sum([25 for x in range(2)])")
    drive(simple.data, "energy", "10 + 5")
    unused = material("unused", (1, 1, 1))
    unused.use_fake_user = True
    drive(unused, "pass_index", "len([1 for x in range(3)])")
    link("wall", cube_mesh())
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "driven.blend"))
    return tmp_path / "driven.blend"


def test_drivers_whose_python_was_not_run_are_named(driven):
    bpy.ops.wm.open_mainfile(filepath=str(driven), use_scripts=False)
    scene = extract_scene()
    omission, = scene.omissions
    assert omission.text == "lamp is driven by Python that was not run: sum([25 for x in range(2)])"
    assert omission.objects == ("lamp",) and "--enable-scripts" in omission.remedy
    assert any(finding.cause == omission.text for finding in check_scene(scene) if finding.severity == "error")


def test_with_scripts_allowed_drivers_are_followed(driven):
    bpy.ops.wm.open_mainfile(filepath=str(driven), use_scripts=True)
    scene = extract_scene()
    assert not scene.omissions
    intensity = {light.name: light.intensity[0] for light in scene.lights}
    assert intensity["lamp"] / intensity["simple"] == pytest.approx(50 / 15, rel=1e-4)


def test_a_text_that_was_not_run_is_told_and_refuses_nothing(driven):
    bpy.ops.wm.open_mainfile(filepath=str(driven), use_scripts=True)
    text = bpy.data.texts.new("handlers.py")
    text.use_module, text.name = True, "handlers.py"
    bpy.ops.wm.save_mainfile()
    bpy.ops.wm.open_mainfile(filepath=str(driven), use_scripts=False)
    told, = [omission for omission in extract_scene().omissions if "handlers.py" in omission.text]
    assert not told.remedy


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="this system has no named pipes")
@pytest.mark.parametrize("make", [os.mkfifo, lambda path: path.symlink_to("/dev/zero")])
def test_a_pipe_or_a_device_in_the_place_of_an_image_is_not_waited_for(empty_blend, tmp_path, make):
    image = bpy.data.images.new("wood", 4, 4)
    image.filepath_raw, image.file_format = str(tmp_path / "wood.png"), "PNG"
    image.save()
    bpy.data.images.remove(image)
    image = bpy.data.images.load(str(tmp_path / "wood.png"))
    make((tmp_path / "wood.png").unlink() or tmp_path / "wood.png")
    paint = material("paint", (0.5, 0.5, 0.5))
    paint.node_tree.nodes.new("ShaderNodeTexImage").image = image
    link("box", cube_mesh()).data.materials.append(paint)
    with pytest.raises(BakeError, match=r"image 'wood\.png' is read from .*wood\.png, a pipe, a device or a socket"):
        extract_scene()


def test_images_that_cycles_would_make_smaller_are_named(empty_blend):
    scene = bpy.context.scene
    paint = material("paint", (0.5, 0.5, 0.5))
    node = paint.node_tree.nodes.new("ShaderNodeTexImage")
    node.image = bpy.data.images.new("large", 256, 64)
    surface = next(other for other in paint.node_tree.nodes if other.type.startswith("BSDF"))
    paint.node_tree.links.new(node.outputs["Color"], surface.inputs[0])
    link("box", cube_mesh()).data.materials.append(paint)
    bpy.data.images.new("of nobody", 512, 512)

    def named():
        return [(omission.text, omission.objects) for omission in extract_scene().omissions if "Texture Limit" in omission.text]

    scene.cycles.texture_limit_render = "128"
    assert not named()
    scene.render.use_simplify = True
    (text, objects), = named()
    assert text.startswith("image large is read whole") and "than 128 pixels" in text and objects == ("box",)
    scene.cycles.texture_limit_render = "256"
    assert not named()
