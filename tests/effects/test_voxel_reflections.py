"""Reflections by one cone through lit voxels: its width, a white furnace, a wall beside the picture, and the bake's own voxels."""

from dataclasses import replace

import numpy as np
import pytest
import room_scenes as rooms
import scene_builders as build
from picture_stage import view

from rtgi_addon import techniques
from rtgi_addon.effects import Chosen, get, notes_of
from rtgi_addon.effects.lit import draw_frame
from rtgi_addon.effects.voxel_reflections import voxels_of
from rtgi_addon.progress import Progress
from rtgi_addon.scene import Channel, World
from rtgi_addon.transport.voxels.cones import specular_spread

EFFECT = get("voxel_reflections")
DEFAULT = replace(EFFECT.Settings(), resolution=32)


def metal(roughness):
    return replace(build.material("metal", 1.0), base_color=Channel.of(1.0), metallic=Channel.of(1.0),
                   roughness=Channel.of(roughness))


def glowing(strength=1.0):
    return replace(build.material("glow", 0.0, strength), specular=Channel.of(0.0))


def before_a_wall(roughness, world=0.0):
    """A metal floor, and a glowing wall behind the eye of `view`, which looks along +y and down: its mirror image is not there."""
    floor = build.plane("floor", 2.0)
    wall = rooms.quad("wall", (-2, 2, 0), (4, 0, 0), (0, 0, 3), 1)
    return replace(build.scene([floor, wall], [metal(roughness), glowing()], [], 0.0), world=World.constant(world))


def test_the_cone_holds_half_of_the_lobe():
    alpha = np.array([0.1, 0.25, 0.5])
    assert np.degrees(np.arctan(specular_spread(alpha))) == pytest.approx(np.degrees(2 * np.arctan(alpha)))
    # Directions that a layer of α mirrors head-on: half vectors of the distribution D·cosθ.
    u = (np.arange(20000) + 0.5) / 20000
    for value in alpha:
        half = np.arctan(value * np.sqrt(u / (1 - u)))
        assert np.mean(np.tan(np.minimum(2 * half, 1.57)) < specular_spread(value)) == pytest.approx(0.5, abs=0.01)


@pytest.mark.parametrize("roughness", [0.1, 0.4, 0.9])
def test_in_a_white_furnace_metal_is_as_bright(roughness):
    frame = draw_frame(before_a_wall(roughness, world=1.0), None, view(), (24, 16))
    floor = frame.gbuffer.instance == 0
    found = EFFECT.apply(frame, None, DEFAULT)[floor][:, :3]
    # A layer's own losses between its bumps, which a single bounce leaves out, are the frame's, too.
    layer = np.clip(found.mean(), 0.0, 1.0)
    assert floor.sum() > 40 and 0.6 < layer <= 1.02 and (roughness > 0.5 or layer == pytest.approx(1.0, abs=0.04))


def test_a_smooth_floor_shows_the_wall_and_a_rough_one_its_blur():
    spread = []
    for roughness in (0.05, 0.6):
        frame = draw_frame(before_a_wall(roughness), None, view(), (48, 32))
        shown = EFFECT.apply(frame, None, DEFAULT)[frame.gbuffer.instance == 0][:, 0]
        assert shown.max() > 0.4 and np.isfinite(shown).all()
        spread.append(np.mean((shown > 0.1) & (shown < 0.7)))
    assert spread[1] > spread[0] + 0.1


def test_the_bakes_own_voxels_are_read_and_others_are_kept():
    scene = replace(build.closed_box(), volumes=(build.volume(),))
    technique = techniques.get("cone_tracing")
    field = technique.bake(scene, technique.Settings(resolution=16, light="voxels"), np.random.default_rng(1), Progress())
    points = np.random.default_rng(1).uniform(-1.0, 1.0, (50, 3))
    assert voxels_of(field.context, field, points, DEFAULT) is field
    made = voxels_of(field.context, None, points, DEFAULT)
    assert made is voxels_of(field.context, None, points, DEFAULT) and max(made.voxels.grid.resolution) == 32


def test_two_that_mirror_are_named():
    chosen = [Chosen(get(name), get(name).Settings()) for name in ("screen_reflections", "voxel_reflections")]
    assert any("switch all but one off" in note for note in notes_of(chosen, before_a_wall(0.1)))
