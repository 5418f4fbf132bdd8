"""The render engine without a GPU: its panels, its passes, its border, and which bake it shows."""

from types import SimpleNamespace

import numpy as np
import pytest

bpy = pytest.importorskip("bpy", reason="needs Blender or its Python module")

import rtgi_addon  # noqa: E402
from rtgi_addon.errors import Cancelled  # noqa: E402
from rtgi_addon.progress import Progress  # noqa: E402
from rtgi_addon.scene import Camera  # noqa: E402


@pytest.fixture
def scene(empty_blend, tmp_path):
    """The add-on in a lit room with one small volume, baked to a folder of the test."""
    rtgi_addon.register()
    bpy.ops.mesh.primitive_cube_add(size=4)
    bpy.ops.object.light_add(type="POINT", location=(0.5, 0.0, 0.5))
    bpy.context.object.data.energy = 100
    bpy.ops.object.lightprobe_add(type="VOLUME")
    probe = bpy.context.object.data
    probe.resolution_x = probe.resolution_y = probe.resolution_z = 2
    scene = bpy.context.scene
    scene.rtgi.output, scene.rtgi.mode, scene.rtgi.technique_probes.rays = str(tmp_path / "bake"), "RAYS", 16
    yield scene
    rtgi_addon.unregister()


def test_the_engine_is_in_the_list_while_the_add_on_is_on(scene):
    scene.render.engine = "RTGI"
    rtgi_addon.unregister()
    try:
        scene.render.engine = "BLENDER_WORKBENCH"
        with pytest.raises(TypeError):
            scene.render.engine = "RTGI"
    finally:
        rtgi_addon.register()
    scene.render.engine = "RTGI"


def test_no_panel_is_shown_twice(scene):
    """Where EEVEE has a panel of its own for what every engine has, one of the two is shown."""
    shown = {name for name in dir(bpy.types) if "RTGI" in (getattr(getattr(bpy.types, name), "COMPAT_ENGINES", None) or ())}
    assert {"DATA_PT_EEVEE_light", "EEVEE_MATERIAL_PT_surface", "EEVEE_WORLD_PT_surface"} <= shown
    # Of light probes ours is: EEVEE's has settings that do nothing here.
    assert not {"DATA_PT_light", "DATA_PT_lightprobe", "DATA_PT_lightprobe_eevee", "DATA_PT_lightprobe_eevee_next",
                "RENDER_PT_eevee_sampling", "RENDER_PT_eevee_next_sampling"} & shown


def test_the_settings_come_from_the_scene(scene):
    from rtgi_addon.blender.ui.preview_settings import preview_settings
    scene.rtgi_preview.samples, scene.rtgi_preview.render_samples = 5, 7
    scene.rtgi_preview.mode, scene.rtgi_preview.resolution_scale = "normal", 0.5
    scene.render.film_transparent = True
    viewport, final = preview_settings(scene, final=False), preview_settings(scene, final=True)
    assert (viewport.samples, viewport.mode, viewport.resolution_scale) == (5, "normal", 0.5)
    assert (final.samples, final.mode, final.resolution_scale) == (7, "combined", 1.0)
    assert viewport.film_transparent and final.film_transparent


def test_a_view_layer_gets_the_passes_it_asks_for(scene):
    from rtgi_addon.blender.engine.passes import passes_of
    layer = scene.view_layers[0]
    layer.use_pass_z = layer.use_pass_normal = layer.use_pass_diffuse_color = False
    assert [entry.name for entry in passes_of(layer)] == ["Combined"]
    layer.use_pass_z = layer.rtgi.use_irradiance = True
    assert [entry.name for entry in passes_of(layer)] == ["Combined", "Depth", "Irradiance"]


def test_a_border_sees_what_the_whole_picture_sees_there():
    from rtgi_addon.blender.engine.final import cropped
    clip = np.array([[1.5, 0, 0.1, 0], [0, 2.0, -0.2, 0], [0, 0, -1.01, -0.2], [0, 0, -1, 0]])
    camera = Camera("Camera", np.eye(4), clip, (64, 48))
    border = SimpleNamespace(use_border=True, border_min_x=0.25, border_max_x=0.75, border_min_y=0.5, border_max_y=1.0)
    part = cropped(camera, border, (32, 24))
    points = np.random.default_rng(3).uniform((-1, -1, -5), (1, 1, -2), (50, 3))

    def pixels(camera):
        seen = np.c_[points, np.ones(len(points))] @ camera.clip_from_camera.T
        return (seen[:, :2] / seen[:, 3:] * 0.5 + 0.5) * camera.resolution

    np.testing.assert_allclose(pixels(part), pixels(camera) - (16, 24), atol=1e-9)
    assert cropped(camera, SimpleNamespace(use_border=False), (64, 48)) is camera


def test_escape_stops_a_render_at_its_next_step():
    from rtgi_addon.blender.engine.final import _progress
    pressed = []
    engine = SimpleNamespace(test_break=lambda: bool(pressed), update_progress=lambda fraction: None,
                             update_stats=lambda stats, info: None)
    progress = _progress(engine)
    progress.span(0.0, 0.5).step(0.1, "drawing")
    pressed.append(True)
    with pytest.raises(Cancelled):
        progress.span(0.5, 1.0).step(0.1, "drawing")


def test_nothing_baked_is_said(scene):
    from rtgi_addon.blender.engine.shown import shown_for
    shown = shown_for(scene)
    assert shown.field is None and "Nothing baked" in shown.note and "direct light and world only" in shown.note


def test_this_sessions_bake_is_shown_and_then_the_one_on_disk(scene):
    from rtgi_addon.blender.engine.shown import shown_for
    from rtgi_addon.blender.session import session
    bpy.ops.rtgi.bake()
    points, normals = np.array([[0.2, 0.1, -1.9]]), np.array([[0.0, 0.0, 1.0]])
    now = shown_for(scene)
    assert now.baked is session.baked[scene.name, "probes"] and not now.note
    assert shown_for(scene).field is now.field
    session.baked.clear()
    stored = shown_for(scene)
    assert stored.field is not now.field and stored.baked is None and shown_for(scene).field is stored.field
    np.testing.assert_allclose(stored.field.irradiance(points, normals), now.field.irradiance(points, normals), rtol=1e-5)


def test_a_bake_of_another_technique_is_not_shown(scene):
    from rtgi_addon.blender.engine.shown import shown_for
    from rtgi_addon.blender.session import session
    bpy.ops.rtgi.bake()
    scene.rtgi.technique = "vpl"
    assert shown_for(scene).field is None and "of the technique probes" in shown_for(scene).note
    session.baked.clear()
    scene.rtgi.technique = "probes"
    assert shown_for(scene).field is not None


@pytest.mark.parametrize("technique", ["rsm", "lpv"])
def test_techniques_without_a_bake_are_live(scene, technique):
    from rtgi_addon.blender.engine.shown import LIVE, shown_for
    from rtgi_addon.blender.engine.viewport import is_stale
    from rtgi_addon.blender.session import session
    scene.rtgi.technique = technique
    before = shown_for(scene)
    assert before.field is None and before.note == LIVE and before.live.order == getattr(scene.rtgi, f"technique_{technique}").order
    scene.rtgi.technique_rsm.resolution, scene.rtgi.technique_lpv.resolution = 32, 8
    bpy.ops.rtgi.bake()
    shown = shown_for(scene)
    assert shown.field is not None and not shown.note and shown.live.resolution == {"rsm": 32, "lpv": 8}[technique]
    session.stale[scene.name] = True
    assert not is_stale(scene, shown)
    scene.rtgi.technique_rsm.visibility = True
    if technique == "rsm":
        session.baked.clear()
        assert shown_for(scene).live is None


def test_a_bundle_that_is_lost_or_damaged_is_survived(scene, tmp_path):
    import shutil

    from rtgi_addon.blender.engine.shown import shown_for
    from rtgi_addon.blender.session import session
    bpy.ops.rtgi.bake()
    session.baked.clear()
    next((tmp_path / "bake").rglob("sh0.exr")).write_bytes(b"no picture")
    shown = shown_for(scene)
    assert shown.field is None and "sh0.exr" in shown.note
    shutil.rmtree(tmp_path / "bake")
    assert "Nothing baked" in shown_for(scene).note


def test_a_render_relights_what_was_baked_in_this_session(scene):
    from rtgi_addon.blender.engine.shown import lit_for, shown_for
    from rtgi_addon.blender.extract import extract_scene
    points, normals = np.array([[0.2, 0.1, -1.9]]), np.array([[0.0, 0.0, 1.0]])
    bpy.ops.rtgi.bake()
    shown = shown_for(scene)
    assert lit_for(shown, extract_scene(), Progress()) is shown.field
    bpy.data.lights[0].energy = 300
    # Something else has changed as well: the old geometry goes on reflecting.
    bpy.data.objects["Cube"].location.x = 0.01
    relit = lit_for(shown, extract_scene(), Progress())
    before, after = shown.field.irradiance(points, normals), relit.irradiance(points, normals)
    # The relit light is that of texels' means, the baked one that of hits.
    np.testing.assert_allclose(after, 3.0 * before, rtol=0.1)


def test_the_panels_and_the_header_can_be_drawn(scene):
    from panel_layout import Layout

    from rtgi_addon.blender.ui import preview_panels
    context = SimpleNamespace(scene=scene, engine="RTGI", region=SimpleNamespace(width=300), view_layer=scene.view_layers[0],
                              space_data=SimpleNamespace(type="VIEW_3D", shading=SimpleNamespace(type="RENDERED"),
                                                         overlay=SimpleNamespace(show_overlays=True)))
    shown = []
    for name in ("RTGI_PT_preview", "RTGI_PT_preview_shadows", "RTGI_PT_film", "RTGI_PT_passes"):
        panel, layout = getattr(preview_panels, name), Layout()
        assert panel.poll(context) and not panel.poll(SimpleNamespace(engine="CYCLES"))
        panel.draw(SimpleNamespace(layout=layout), context)
        shown += layout.shown
    assert {"technique", "samples", "render_samples", "mode", "shadow_cascades", "film_transparent",
            "use_irradiance"} <= set(shown)
    popover = Layout()
    preview_panels.draw_overlays(SimpleNamespace(layout=popover), context)
    assert {"probes", "bounds", "leaks", "overlays_in_renders"} <= set(popover.shown)
    other = SimpleNamespace(**{**vars(context), "engine": "CYCLES"})
    popover = Layout()
    preview_panels.draw_overlays(SimpleNamespace(layout=popover), other)
    assert {"probes", "bounds"} <= set(popover.shown) and "leaks" not in popover.shown
    scene.rtgi_preview.compare, scene.rtgi_preview.compare_technique, layout = True, "vpl", Layout()
    preview_panels.RTGI_PT_preview_compare.draw(SimpleNamespace(layout=layout), context)
    assert {"compare_technique", "split"} <= set(layout.shown) and "Nothing baked" in " ".join(layout.texts)
    scene.rtgi_preview.compare = False
    header = Layout()
    preview_panels.draw_header(SimpleNamespace(layout=header), context)
    assert header.shown == ["technique", "mode", "RTGI_PT_preview_compare", "rtgi.bake"]
    context.space_data.shading.type = "SOLID"
    empty = Layout()
    preview_panels.draw_header(SimpleNamespace(layout=empty), context)
    assert not empty.shown
