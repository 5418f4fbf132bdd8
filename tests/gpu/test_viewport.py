"""What a viewport puts into its region: one technique or two with a line between, and overlays on top."""

import time
from types import SimpleNamespace

import numpy as np
import pytest

import rtgi_addon

SIZE = 48, 32


@pytest.fixture
def scene(gpu_device, empty_blend, tmp_path):
    """A room with a lamp, a camera and a lattice, baked with probes."""
    bpy = empty_blend
    rtgi_addon.register()
    bpy.ops.mesh.primitive_cube_add(size=4)
    bpy.ops.object.light_add(type="POINT", location=(0.5, 0.0, 1.0))
    bpy.context.object.data.energy = 100
    bpy.ops.object.lightprobe_add(type="VOLUME")
    bpy.context.object.scale = (1.6, 1.6, 1.6)
    probe = bpy.context.object.data
    probe.resolution_x = probe.resolution_y = probe.resolution_z = 2
    bpy.ops.object.camera_add(location=(0, -1.9, 0), rotation=(np.pi / 2, 0, 0))
    scene = bpy.context.scene
    scene.camera = bpy.context.object
    scene.camera.data.lens = 18
    scene.render.resolution_x, scene.render.resolution_y = SIZE
    scene.rtgi.output, scene.rtgi.mode, scene.rtgi.technique_probes.rays = str(tmp_path / "bake"), "RAYS", 64
    bpy.ops.rtgi.bake()
    scene.rtgi_preview.samples, scene.rtgi_preview.shadow_resolution = 1, 128
    yield scene
    scene.render.engine = "BLENDER_WORKBENCH"
    rtgi_addon.unregister()


class Engine:
    """What a viewport asks of Blender's engine object."""

    def __init__(self):
        self.stats, self.redraws = "", 0

    def update_stats(self, _name, text):
        self.stats = text

    def tag_redraw(self):
        self.redraws += 1


def drawn(viewport=None):
    """The region (h, w, 4) that a viewport through the scene's camera fills, row 0 at the bottom, and the engine's line."""
    import bpy

    from rtgi_addon.blender.engine.live import live_scene
    from rtgi_addon.blender.engine.viewport import Viewport
    from rtgi_addon.preview.device import RenderTarget
    from rtgi_addon.preview.textures import download
    depsgraph, camera = bpy.context.evaluated_depsgraph_get(), bpy.context.scene.camera
    live = live_scene(depsgraph)
    if live.scene is None:
        live.read(depsgraph)
    projection = camera.calc_matrix_camera(depsgraph, x=SIZE[0], y=SIZE[1])
    view = SimpleNamespace(view_matrix=camera.matrix_world.inverted(), window_matrix=projection)
    context = SimpleNamespace(region=SimpleNamespace(width=SIZE[0], height=SIZE[1]), region_data=view, space_data=None)
    engine, target, viewport = Engine(), RenderTarget(*SIZE, ("RGBA32F",)), viewport or Viewport()
    with target.drawing():
        viewport.draw(engine, context, depsgraph)
    assert not viewport._broken
    return download(target.colors[0]), engine.stats


def test_two_techniques_with_a_line_between(scene):
    alone, _ = drawn()
    assert alone[..., :3].min() > 0
    scene.rtgi_preview.compare, scene.rtgi_preview.compare_technique, scene.rtgi_preview.split = True, "vpl", 0.25
    both, stats = drawn()
    assert "Right of the line: " in stats and "of the technique probes" in stats
    np.testing.assert_allclose(both[:, :12], alone[:, :12], atol=1e-5)
    assert np.all(both[:, 12:14] == 1.0)
    # No bake of it: direct light alone.
    assert both[:, 14:, :3].mean() < 0.9 * alone[:, 14:, :3].mean()
    scene.rtgi_preview.compare_technique = "probes"
    same, stats = drawn()
    np.testing.assert_allclose(same[:, 14:], alone[:, 14:], atol=1e-5)
    assert "Right of the line" not in stats


def test_a_viewport_follows_the_switches(scene):
    from rtgi_addon.blender.engine.viewport import Viewport
    viewport = Viewport()
    plain, _ = drawn(viewport)
    assert viewport.other.renderer is None
    scene.rtgi_preview.compare = True
    drawn(viewport)
    assert viewport.other.renderer is not None
    scene.rtgi_preview.compare, scene.rtgi_preview.probes, scene.rtgi_preview.probe_size = False, "validity", 0.8
    spheres, _ = drawn(viewport)
    assert viewport.other.renderer is None
    green = (spheres[..., 1] > 2 * spheres[..., 0]) & (spheres[..., 1] > 2 * spheres[..., 2])
    assert 0.01 < green.mean() < 0.5
    assert 0.3 < np.isclose(spheres, plain, atol=1e-5).all(axis=-1).mean() < 0.99
    scene.rtgi_preview.probes = "none"
    again, _ = drawn(viewport)
    np.testing.assert_allclose(again, plain, atol=1e-5)


@pytest.mark.parametrize("technique", ["rsm", "lpv", "cone_tracing"])
def test_techniques_that_need_no_bake_follow_objects(scene, technique):
    import bpy

    from rtgi_addon.blender.engine.live import live_scene
    from rtgi_addon.blender.engine.viewport import Viewport
    from rtgi_addon.blender.extract.refresh import refresh_scene
    bpy.ops.mesh.primitive_cube_add(size=1.2, location=(-1.2, 1.2, -1.4))
    scene.rtgi.technique, scene.rtgi_preview.mode = technique, "indirect"
    scene.rtgi_preview.samples = 4
    scene.rtgi.technique_rsm.resolution, scene.rtgi.technique_lpv.steps = 64, 32
    scene.rtgi.technique_cone_tracing.resolution, scene.rtgi.technique_cone_tracing.light = 16, "voxels"
    viewport, live = Viewport(), live_scene(bpy.context.evaluated_depsgraph_get())
    live.wants_all = True
    live.read(bpy.context.evaluated_depsgraph_get())

    def settled():
        until = time.monotonic() + 60
        image, stats = drawn(viewport)
        while viewport.unsettled and time.monotonic() < until:
            image, stats = drawn(viewport)
        assert not viewport.unsettled and not viewport.picture.renderer.error
        return image[..., :3], stats

    before, stats = settled()
    assert "Live, without a bake" in stats and "out of date" not in stats
    assert np.median(before) > 0
    bpy.data.objects["Cube.001"].location.x = 1.2
    depsgraph = bpy.context.evaluated_depsgraph_get()
    live.scene = refresh_scene(live.scene, depsgraph)
    after, stats = settled()
    assert "out of date" not in stats
    viewport.close()
    fresh, _ = settled()
    assert np.abs(before - fresh).mean() > 0.03 * fresh.mean()
    np.testing.assert_allclose(after, fresh, rtol=1e-3, atol=1e-3 * fresh.max())
    viewport.close()


def settled(viewport, seconds=120):
    """What is drawn once nothing more is made."""
    until = time.monotonic() + seconds
    image, stats = drawn(viewport)
    while viewport.unsettled and time.monotonic() < until:
        image, stats = drawn(viewport)
    assert not viewport.unsettled
    return image[..., :3], stats


def test_live_probes_follow_lamps_and_objects_and_take_the_place_of_a_bake(scene):
    import bpy

    from rtgi_addon.blender.engine.live import live_scene
    from rtgi_addon.blender.engine.viewport import Viewport
    from rtgi_addon.blender.extract.refresh import refresh_scene
    bpy.ops.mesh.primitive_cube_add(size=1.2, location=(-1.2, 1.2, -1.4))
    scene.rtgi_preview.mode, scene.rtgi_preview.live_probes, scene.rtgi_preview.live_hysteresis = "indirect", True, 0.5
    viewport, live = Viewport(), live_scene(bpy.context.evaluated_depsgraph_get())
    live.wants_all = True
    live.read(bpy.context.evaluated_depsgraph_get())
    before, stats = settled(viewport)
    assert "Live, without a bake" in stats and "out of date" not in stats and np.median(before) > 0
    bpy.data.objects["Cube.001"].location.x = 1.2
    bpy.data.objects["Point"].data.energy = 300
    live.scene = refresh_scene(live.scene, bpy.context.evaluated_depsgraph_get())
    after, _ = settled(viewport)
    viewport.close()
    fresh, _ = settled(viewport)
    assert np.abs(before - fresh).mean() > 0.3 * fresh.mean()
    assert np.abs(after - fresh).mean() < 0.06 * fresh.mean()
    # Spheres in the light of now, and the bake again.
    scene.rtgi_preview.probes = "light"
    spheres, _ = settled(viewport)
    assert np.abs(spheres - fresh).mean() > 0.01 * fresh.mean()
    scene.rtgi_preview.probes, scene.rtgi_preview.live_probes = "none", False
    baked, stats = settled(viewport)
    assert "Live" not in stats and np.abs(baked - fresh).mean() > 0.05 * fresh.mean()
    viewport.close()


def test_a_render_in_the_place_of_live_probes_is_baked_for_its_frame(scene, tmp_path):
    import bpy

    from rtgi_addon.blender.engine.shown import lit_for, shown_for
    from rtgi_addon.blender.extract import extract_scene
    from rtgi_addon.progress import Progress
    scene.rtgi_preview.live_probes = True
    shown = shown_for(scene)
    assert shown.field is None and shown.live.rays == scene.rtgi_preview.live_rays and shown.live.probes.rays == 64
    bpy.data.objects["Point"].data.energy = 300
    read = extract_scene(bpy.context.evaluated_depsgraph_get())
    field = lit_for(shown, read, Progress())
    scene.rtgi_preview.live_probes = False
    baked = shown_for(scene).field
    assert field.grids()[0].sh[..., 0, :].mean() > 2.0 * baked.grids()[0].sh[..., 0, :].mean()


def test_what_is_shown_changes_without_reading_the_scene_again(scene):
    from rtgi_addon.blender.engine.viewport import Viewport
    viewport = Viewport()
    drawn(viewport)
    renderer = viewport.picture.renderer
    for name, value in (("mode", "indirect"), ("shadow_resolution", 64), ("resolution_scale", 0.5), ("mode", "albedo")):
        setattr(scene.rtgi_preview, name, value)
        kept, _ = drawn(viewport)
        assert viewport.picture.renderer is renderer
        fresh, _ = drawn()
        np.testing.assert_allclose(kept, fresh, atol=1e-5)
    viewport.close()


def test_leaks_are_shown_of_the_bake_that_has_them(scene):
    import bpy
    scene.rtgi_preview.leaks = True
    plain, _ = drawn()
    bpy.ops.rtgi.find_leaks(points=200)
    marked, _ = drawn()
    assert np.abs(marked - plain).mean() > 0.01
    bpy.ops.rtgi.bake()
    after, _ = drawn()
    np.testing.assert_allclose(after, plain, rtol=0.2, atol=0.05)


def test_renders_have_overlays_where_they_are_asked_for(scene, tmp_path):
    import bpy
    scene.render.engine = "RTGI"
    scene.rtgi_preview.render_samples, scene.rtgi_preview.probes, scene.rtgi_preview.probe_size = 1, "validity", 0.8

    def rendered():
        settings = scene.render.image_settings
        if hasattr(settings, "media_type"):
            settings.media_type = "IMAGE"
        settings.file_format, settings.color_depth = "OPEN_EXR", "32"
        scene.render.filepath = str(tmp_path / "picture.exr")
        bpy.ops.render.render(write_still=True)
        image = bpy.data.images.load(scene.render.filepath)
        pixels = np.array(image.pixels, np.float32).reshape(*SIZE[::-1], 4)
        bpy.data.images.remove(image)
        return pixels

    plain = rendered()
    scene.rtgi_preview.overlays_in_renders = True
    marked = rendered()
    green = (marked[..., 1] > 2 * marked[..., 0]) & (marked[..., 1] > 2 * marked[..., 2])
    assert 0.01 < green.mean() < 0.5 and 0.3 < (plain == marked).all(axis=-1).mean() < 0.99
