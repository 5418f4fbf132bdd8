"""The light atlas in Blender's own materials: what they show, drawn by Cycles, and that bakes do not notice."""

import bpy
import numpy as np
import pytest

import rtgi_addon
from rtgi_addon.blender.atlas_materials import MARK, PLACE
from rtgi_addon.blender.extract import extract_scene
from rtgi_addon.blender.fingerprint import fingerprint
from rtgi_addon.effects.atlas.settings import AtlasSettings
from rtgi_addon.exchange.bundle import read_bundle
from rtgi_addon.jobs.bake import bake_scene
from rtgi_addon.scene.content import content_hash


@pytest.fixture
def baked(empty_blend, tmp_path):
    """A floor in the atlas beside a wall under a lamp, a ball with the same material beside it, and the bundle."""
    rtgi_addon.register()
    scene, paint = bpy.context.scene, bpy.data.materials.new("Paint")
    paint.use_nodes = True
    paint.node_tree.nodes["Principled BSDF"].inputs["Base Color"].default_value = (0.8, 0.5, 0.3, 1.0)
    bpy.ops.mesh.primitive_plane_add(size=2.0)
    floor = bpy.context.object
    floor.name = "Floor"
    bpy.ops.mesh.primitive_cube_add(size=1.0, location=(0.9, 0.0, 0.51))
    for obj in (floor, bpy.context.object):
        obj.data.materials.append(paint)
    lamp = bpy.data.objects.new("Lamp", bpy.data.lights.new("Lamp", "POINT"))
    lamp.location, lamp.data.energy, lamp.data.rtgi.bake = (-0.4, 0.2, 0.8), 20.0, "ALL"
    bpy.ops.object.lightprobe_add(type="VOLUME", location=(0, 0, 1.0))
    scene.collection.objects.link(lamp)
    floor.rtgi.atlas, floor.rtgi.atlas_uv = True, "UVMap"
    bpy.context.view_layer.update()
    bake_scene(extract_scene(), "probes", {"rays": 16}, out=tmp_path / "out", atlas=AtlasSettings(density=6.0, rays=64))
    scene.rtgi.last_bake.folder = str(tmp_path / "out")
    yield floor, paint, read_bundle(tmp_path / "out").atlas
    rtgi_addon.unregister()


def drawn_from_above(size=24):
    """(size, size, 3) radiance of the floor's square, row 0 at the bottom."""
    scene = bpy.context.scene
    camera = bpy.data.objects.new("Above", bpy.data.cameras.new("Above"))
    camera.data.type, camera.data.ortho_scale, camera.location = "ORTHO", 2.0, (0, 0, 3)
    scene.collection.objects.link(camera)
    scene.camera, scene.render.engine = camera, "CYCLES"
    scene.cycles.samples, scene.cycles.use_denoising, scene.cycles.pixel_filter_type = 4, False, "BOX"
    scene.render.resolution_x = scene.render.resolution_y = size
    scene.render.resolution_percentage, scene.render.image_settings.file_format = 100, "OPEN_EXR"
    scene.render.filepath = bpy.app.tempdir + "atlas.exr"
    bpy.ops.render.render(write_still=True)
    image = bpy.data.images.load(scene.render.filepath)
    return np.array(image.pixels[:], np.float32).reshape(size, size, 4)[..., :3]


def test_materials_show_the_atlas_and_bakes_do_not_notice(baked):
    floor, paint, atlas = baked
    scene, layer = bpy.context.scene, bpy.context.view_layer
    before = fingerprint(scene, bpy.context.evaluated_depsgraph_get()), content_hash(extract_scene().materials)
    assert bpy.ops.rtgi.show_atlas() == {"FINISHED"}
    layer.update()
    assert before == (fingerprint(scene, bpy.context.evaluated_depsgraph_get()), content_hash(extract_scene().materials))
    output = paint.node_tree.get_output_node("EEVEE")
    assert output.get(MARK) and not paint.node_tree.get_output_node("CYCLES").get(MARK)
    # Cycles stands in for EEVEE, which needs a GPU.
    output.target = "CYCLES"
    part, size = atlas.part("Floor"), 24
    found = drawn_from_above(size)
    y, x = np.meshgrid(*[(np.arange(size) + 0.5) / size] * 2, indexing="ij")
    places = np.stack([x, 1.0 - y], axis=-1).reshape(-1, 2) * part.scale + part.offset
    expected = atlas.read(places, np.tile([0.0, 0.0, 1.0], (size**2, 1))) * [0.8, 0.5, 0.3] / np.pi
    free = (x < 0.6).reshape(-1)
    assert np.abs(found.reshape(-1, 3) - expected)[free].max() < 0.03 * expected.max()
    assert np.ptp(expected[free][:, 0]) > 0.3 * expected.max()
    assert bpy.ops.rtgi.hide_atlas() == {"FINISHED"}
    assert not any(node.get(MARK) for node in paint.node_tree.nodes) and PLACE not in floor


def test_without_an_atlas_it_says_so(empty_blend):
    rtgi_addon.register()
    try:
        with pytest.raises(RuntimeError, match="No light atlas is baked"):
            bpy.ops.rtgi.show_atlas()
        assert not bpy.ops.rtgi.hide_atlas.poll()
    finally:
        rtgi_addon.unregister()
