"""Mist: closed forms of its falloffs, what it leaves alone, and Cycles' own mist pass."""

from dataclasses import replace

import numpy as np
import pytest
from picture_stage import SIZE, stage, view

from rtgi_addon.effects import get
from rtgi_addon.effects.lit import draw_frame
from rtgi_addon.scene import Mist, World

MIST = get("mist")
LOOKS = {"linear": 1.0, "quadratic": 2.0, "inverse_quadratic": 0.5}


def scene(**mist):
    return replace(stage(), mist=Mist(**{"start": 2.5, "depth": 3.0, **mist}))


def applied(frame, **settings):
    return MIST.apply(frame, None, MIST.Settings(**settings))


@pytest.mark.parametrize("falloff", LOOKS)
@pytest.mark.parametrize("orthographic", [False, True])
def test_the_share_of_mist_is_the_formulas(falloff, orthographic):
    frame = draw_frame(scene(falloff=falloff), None, view(orthographic=orthographic), SIZE)
    found = applied(frame, fade_to="color", color=(1.0, 2.0, 3.0), over_world=False)
    seen = frame.gbuffer.seen
    away = np.linalg.norm(frame.gbuffer.position[seen][:, :3] - frame.view.position, axis=1)
    if orthographic:
        away = (frame.gbuffer.position[seen][:, :3] - frame.view.position) @ frame.view.forward
    share = np.clip((away - 2.5) / 3.0, 0, 1)[:, None] ** LOOKS[falloff]
    assert np.any(share == 0) or np.any(share > 0.3)
    assert np.allclose(found[seen][:, :3], frame.light[seen][:, :3] * (1 - share) + share * [1, 2, 3], atol=1e-5)
    assert np.array_equal(found[~seen], frame.light[~seen]) and np.all(found[seen][:, 3] == 1)


def test_settings_stand_in_for_the_worlds_own():
    frame = draw_frame(scene(), None, view(), SIZE)
    same = draw_frame(scene(start=1.0, depth=6.0, falloff="linear"), None, view(), SIZE)
    assert np.allclose(applied(frame, start=1.0, depth=6.0, falloff="linear"), applied(same), atol=1e-6)
    assert not np.allclose(applied(frame), applied(same), atol=1e-3)


def test_things_vanish_into_what_the_world_shows_above_the_horizon():
    sky = np.zeros((64, 4, 3), np.float32)
    sky[32:] = np.arange(1, 33)[:, None, None]
    frame = draw_frame(replace(scene(start=0.0, depth=0.01), world=World(sky)), None, view(), SIZE)
    found, down = applied(frame), frame.directions[..., 2] < 0
    # Black below the horizon, where the row above it is seen instead; above that row it is the world itself.
    assert down.any() and np.allclose(found[down], 1.0, atol=1e-5)
    up = frame.directions[..., 2] > np.sin(np.pi / 128) + 1e-3
    assert up.any() and np.allclose(found[up], frame.background[up], atol=1e-5)
    assert frame.background[down][..., 0].min() < 0.1


def test_on_a_transparent_film_things_vanish_into_nothing():
    # Over a world that is the same everywhere it is the opaque picture.
    clear = draw_frame(scene(), None, view(), SIZE, transparent=True)
    opaque = draw_frame(scene(), None, view(), SIZE)
    found, behind = applied(clear), opaque.background
    assert np.allclose(found[..., :3] + behind[..., :3] * (1 - found[..., 3:]), applied(opaque)[..., :3], atol=1e-5)
    assert np.any((found[..., 3] > 0.01) & (found[..., 3] < 0.99))


def test_a_colour_covers_the_world_unless_it_is_told_not_to():
    opaque, clear = (draw_frame(scene(), None, view(), SIZE, transparent=transparent) for transparent in (False, True))
    beyond = ~opaque.gbuffer.seen
    assert beyond.any()
    assert np.allclose(applied(opaque, fade_to="color", color=(1, 0, 0), strength=0.5)[beyond], (0.65, 0.15, 0.15, 1.0))
    assert np.array_equal(applied(opaque, fade_to="color", over_world=False)[beyond], opaque.light[beyond])
    assert not applied(clear, fade_to="color")[beyond].any()


def test_no_strength_and_no_depth_are_no_mist():
    frame = draw_frame(scene(), None, view(), SIZE)
    assert np.array_equal(applied(frame, strength=0.0), frame.light)
    flat = draw_frame(scene(depth=0.0), None, view(), SIZE)
    assert np.array_equal(applied(flat), flat.light)


@pytest.mark.parametrize("falloff", LOOKS)
def test_it_is_cycles_mist_pass(empty_blend, tmp_path, falloff):
    """A plane that runs into the distance, rendered by Cycles with its mist pass."""
    OpenEXR = pytest.importorskip("OpenEXR", reason="needs OpenEXR")
    import addon_utils

    from rtgi_addon.blender.extract import extract_scene
    from rtgi_addon.transport.views.camera import CameraView
    bpy = empty_blend
    addon_utils.enable("cycles")
    bpy.ops.mesh.primitive_plane_add(size=60)
    bpy.ops.object.camera_add(location=(0, 0, 2), rotation=(1.35, 0, 0.2))
    found, size = bpy.context.scene, (32, 24)
    found.camera, found.world = bpy.context.object, bpy.data.worlds.new("world")
    found.world.mist_settings.start, found.world.mist_settings.depth = 4.0, 16.0
    found.world.mist_settings.falloff = falloff.upper()
    found.render.engine, found.render.resolution_x, found.render.resolution_y = "CYCLES", *size
    found.cycles.samples, found.cycles.filter_width, found.cycles.pixel_filter_type = 1, 0.01, "BOX"
    found.cycles.use_denoising = False
    bpy.context.view_layer.use_pass_mist = True
    shown = extract_scene()
    assert shown.mist == Mist(4.0, 16.0, falloff)
    if hasattr(found.render.image_settings, "media_type"):
        found.render.image_settings.media_type = "MULTI_LAYER_IMAGE"
    found.render.image_settings.file_format = "OPEN_EXR_MULTILAYER"
    found.render.filepath = str(tmp_path / "mist.exr")
    bpy.ops.render.render(write_still=True)
    file = OpenEXR.File(found.render.filepath, separate_channels=True)
    expected = np.flipud(next(channel.pixels for part in file.parts for name, channel in part.channels.items() if "Mist" in name))
    frame = draw_frame(shown, None, CameraView.of(shown.cameras[0]), size)
    black = replace(frame, light=np.zeros_like(frame.light))
    share = applied(black, fade_to="color", color=(1.0, 1.0, 1.0))[..., 0]
    assert 0.2 < share.mean() < 0.95 and np.mean((share > 0.01) & (share < 0.99)) > 0.3
    # Cycles shifts its one sample within the pixel.
    assert np.median(np.abs(share - expected)) < 2e-3 and np.abs(share - expected).mean() < 0.02
