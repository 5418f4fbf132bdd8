"""The irradiance function of light propagation volumes on the GPU against ``LpvField.irradiance``, relative to the largest
irradiance, and volumes that follow a lamp there."""

from dataclasses import replace

import numpy as np
import pytest
import room_scenes as rooms
import scene_builders as build
from receivers import directions, drawn, points_in, relative_error, waited

from rtgi_addon.progress import Progress
from rtgi_addon.scene import Medium, Phase, World
from rtgi_addon.techniques.lpv import TECHNIQUE, LpvSettings
from rtgi_addon.techniques.lpv.field import LpvField
from rtgi_addon.techniques.lpv.grid import LpvGrid

TOLERANCE = 1e-5


@pytest.fixture(scope="module")
def indirect(gpu_device):
    from rtgi_addon.preview import indirect
    return indirect


def random_field(cascades, resolution=(8, 9, 10), **params):
    """Cascades of any light, nested about (1, 1, 1)."""
    rng = np.random.default_rng(5)
    grids = tuple(LpvGrid(tuple(1.0 - 0.5 * 0.25 * 2**level * np.array(resolution)), 0.25 * 2**level, resolution)
                  for level in range(cascades))
    walls = tuple(np.concatenate([np.clip(rng.uniform(-0.5, 1.5, (3, *grid.shape)), 0, 1),
                                  rng.uniform(-0.5, 0.5, (3, *grid.shape))]).astype(np.float32) for grid in grids)
    return LpvField(grids, tuple(rng.normal(size=(4, 3, *resolution[::-1])).astype(np.float32) for _ in grids), walls,
                    params=params, stats={})


@pytest.mark.parametrize("dampening", [True, False])
@pytest.mark.parametrize("cascades", [1, 2, 3])
def test_cascades(indirect, cascades, dampening):
    field = random_field(cascades, dampening=dampening)
    points = points_in(4.0, 4000) + np.float32(1.0)
    assert relative_error(indirect.make_indirect(field, build.closed_box()), field, points, directions(4000)).max() < TOLERANCE


@pytest.mark.parametrize("resolution", [(1, 1, 1), (5, 1, 3), (33, 2, 40)])
def test_every_shape(indirect, resolution):
    field = random_field(2, resolution)
    points = points_in(4.0, 1000) + np.float32(1.0)
    assert relative_error(indirect.make_indirect(field, build.closed_box()), field, points, directions(1000)).max() < TOLERANCE


ROOMS = rooms.two_rooms(resolution=(2, 2, 2), half_size=(2.0, 0.95, 0.95))


def bake(scene, **settings):
    return TECHNIQUE.bake(scene, LpvSettings(**({"order": 1, "steps": 32, "map_resolution": 64} | settings)),
                          np.random.default_rng(0), Progress())


def moved(scene, offset=0.3, world=None):
    lights = tuple(replace(light, position_world=light.position_world + np.float32([offset, 0, 0])) for light in scene.lights)
    return replace(scene, lights=lights, world=scene.world if world is None else World.constant(world))


# Rays and rasters differ where a texel's centre lies on an edge, and its light falls into the next cell.
@pytest.mark.parametrize(("settings", "world"), [({}, 0.0), ({"cascades": 2, "cell_size": 0.15}, 0.3),
                                                 ({"cascades": 3, "cell_size": 0.08, "resolution": 12}, 0.0),
                                                 ({"further_bounces": False}, 0.3), ({"blocking": False}, 0.0)])
def test_a_moved_lamp_is_followed_on_the_gpu(indirect, settings, world):
    scene = replace(ROOMS, world=World.constant(world))
    field = bake(scene, **settings)
    made = indirect.make_indirect(field, scene)
    points, normals = points_in((1.9, 0.9, 0.9), 1500), directions(1500)
    for offset in (0.3, -0.2):
        assert made.capture(drawn(moved(scene, offset))) and not made.busy
        found = relative_error(made, field.relight(moved(scene, offset)), points, normals)
        assert found.max() < 0.005 and np.sqrt(np.mean(found**2)) < 5e-4
    assert relative_error(made, field, points, normals).max() > 0.02


def test_emissive_surfaces_stay_and_lamps_go_out(indirect):
    scene = build.cube_furnace(albedo=0.4, emission=0.2)
    scene = replace(scene, lights=(build.point_light((0.2, 0.1, 0.0), 2.0),))
    field = bake(scene)
    made = indirect.make_indirect(field, scene)
    dark = replace(scene, lights=())
    assert made.capture(drawn(dark))
    assert relative_error(made, field.relight(dark), points_in(0.9, 500), directions(500)).max() < 1e-4


def test_a_changed_world_is_traced_beside_the_picture(indirect):
    field = bake(replace(ROOMS, world=World.constant(0.3)))
    made = indirect.make_indirect(field, ROOMS)
    points, normals = points_in((1.9, 0.9, 0.9), 500), directions(500)
    other = moved(ROOMS, 0.2, 1.0)
    assert made.capture(drawn(other)) and waited(made)
    assert relative_error(made, field.relight(other), points, normals).max() < TOLERANCE
    # The next lamp is followed on the GPU again.
    again = moved(other, -0.3)
    assert made.capture(drawn(again)) and not made.busy
    assert relative_error(made, field.relight(again), points, normals).max() < 0.005
    made.close()


def test_a_moved_wall_is_met_at_once_and_blocks_soon(indirect):
    field, thick = bake(ROOMS), rooms.two_rooms(resolution=(2, 2, 2), half_size=(2.0, 0.95, 0.95), thickness=0.6)
    made = indirect.make_indirect(field, ROOMS)
    points, normals = points_in((1.9, 0.9, 0.9), 500), directions(500)
    assert made.captures and made.capture(drawn(thick)) and made.busy
    # What the lamp lights has moved already; blocking has not.
    assert relative_error(made, field, points, normals).max() > 0.01
    assert waited(made) and made.error is None
    assert relative_error(made, bake(thick), points, normals).max() < TOLERANCE
    # The next lamp is followed in the new rooms.
    lamp = moved(thick, 0.2)
    assert made.capture(drawn(lamp)) and not made.busy
    assert relative_error(made, bake(lamp), points, normals).max() < 0.005
    made.close()


def test_volumes_need_no_bake(indirect):
    settings = LpvSettings(order=1, steps=32, map_resolution=64)
    made = indirect.make_indirect(None, ROOMS, live=settings)
    points, normals = points_in((1.9, 0.9, 0.9), 500), directions(500)
    assert indirect.needs_no_bake(settings) and made.captures and made.capture(drawn(ROOMS))
    # The lamp moves while the worker makes the first volumes: it is followed as soon as they are there.
    after = moved(ROOMS, 0.3)
    assert made.capture(drawn(after)) and waited(made) and made.error is None
    assert relative_error(made, bake(after), points, normals).max() < 0.005
    made.close()


def test_volumes_follow_media(indirect):
    fog = replace(ROOMS, media=(Medium("fog", np.full(3, 0.3), np.array([0.1, 0.4, 0.8]), phase=Phase(anisotropy=0.4)),))
    field, points, normals = bake(fog), points_in((1.9, 0.9, 0.9), 500), directions(500)
    assert field.irradiance(points, normals).mean() < 0.8 * bake(ROOMS).irradiance(points, normals).mean()
    made, lamp = indirect.make_indirect(field, fog), moved(fog, 0.2)
    assert made.capture(drawn(lamp)) and not made.busy
    assert relative_error(made, bake(lamp), points, normals).max() < 0.005
    # Without its media a scene has other volumes.
    assert made.capture(drawn(ROOMS)) and made.busy and waited(made)
    assert relative_error(made, bake(ROOMS), points, normals).max() < 0.005
    made.close()


def test_what_cannot_be_followed_is_said(indirect):
    field = bake(ROOMS)
    made = indirect.make_indirect(field, ROOMS)
    empty = replace(ROOMS, instances=())
    assert made.capture(drawn(empty)) and not waited(made) and "no geometry" in made.error
    made.close()
    made = indirect.make_indirect(LpvField.from_arrays(field.arrays(), params=field.params), ROOMS)
    assert not made.captures and not made.follow(moved(ROOMS)) and "bake again" in made.error
