"""The irradiance functions of cones and rays through voxels on the GPU against ``VoxelField.irradiance``, relative to the largest
irradiance."""

from dataclasses import replace

import numpy as np
import pytest
import room_scenes as rooms
import scene_builders as build
from receivers import directions, points_in, relative_error, waited

from rtgi_addon import techniques
from rtgi_addon.progress import Progress
from rtgi_addon.scene import World
from rtgi_addon.scene.lights import NOT_AT_ALL
from rtgi_addon.scene.material import Channel

# Receivers whose rays meet the border of a cell or a sheet where rounding decides on which side that is.
EDGES = 0.01
ROOMS = rooms.two_rooms(resolution=(2, 2, 2), half_size=(2.0, 0.95, 0.95))


@pytest.fixture(scope="module")
def indirect(gpu_device):
    from rtgi_addon.preview import indirect
    return indirect


def irradiance(made, points, normals):
    from rtgi_addon.preview.indirect.base import irradiance
    return irradiance(made, points, normals)


def bake(name, scene, **settings):
    technique = techniques.get(name)
    return technique.bake(scene, technique.Settings(**{"resolution": 24, "light": "voxels", **settings}), np.random.default_rng(0),
                          Progress())


def on_walls(half_size, count, seed=3):
    """Points a little off the sides of a box, and the sides' normals."""
    rng = np.random.default_rng(seed)
    axis, sign = rng.integers(0, 3, count), rng.choice([-1.0, 1.0], count)
    points, normals = points_in(half_size, count, seed), np.zeros((count, 3), np.float32)
    rows = np.arange(count)
    points[rows, axis], normals[rows, axis] = (sign * np.asarray(half_size, np.float64)[axis] * 0.999).astype(np.float32), -sign
    return points, normals


def close(made, field, points, normals, tolerance=1e-5):
    found = relative_error(made, field, points, normals)
    assert np.mean(found > tolerance) < EDGES


@pytest.mark.parametrize("settings", [{"cones": 6}, {"cones": 16}, {"cones": 12, "step": 0.25, "near": 0.0}, {"resolution": 9}])
def test_cones(indirect, settings):
    field = bake("cone_tracing", ROOMS, **settings)
    made = indirect.make_indirect(field, ROOMS)
    close(made, field, *on_walls((1.98, 0.98, 0.98), 600))
    close(made, field, points_in((1.9, 0.9, 0.9), 600), directions(600))


@pytest.mark.parametrize("settings", [{}, {"opacity": "first hit", "rays": 16}])
def test_rays(indirect, settings):
    field = bake("voxel_march", ROOMS, **settings)
    made = indirect.make_indirect(field, ROOMS)
    close(made, field, *on_walls((1.98, 0.98, 0.98), 600))
    close(made, field, points_in((1.9, 0.9, 0.9), 600), directions(600))


def under(world, half_size=1.5):
    """A ball on the ground under ``world``."""
    meshes = [build.plane("ground", half_size), build.sphere("ball", 0.4, 3)]
    return replace(build.scene(meshes, volumes=[build.volume(center=(0, 0, 0.5), half_size=0.8)]), world=world)


def gradient(sun=0.0):
    """A sky that is brighter towards +x and up, with a sun."""
    y, x = np.mgrid[0:16, 0:32]
    pixels = np.stack([0.2 + x / 32.0, 0.3 + y / 16.0, np.ones(x.shape)], axis=-1).astype(np.float32)
    pixels[12, 9] += np.float32(sun)
    return World(pixels)


@pytest.mark.parametrize("world", [World.constant(0.7), gradient()], ids=["constant", "gradient"])
@pytest.mark.parametrize("name", ["cone_tracing", "voxel_march"])
def test_a_sky(indirect, name, world):
    scene = under(world)
    field = bake(name, scene)
    points = points_in((1.5, 1.5, 0.5), 500) + np.float32([0, 0, 0.6])
    close(indirect.make_indirect(field, scene), field, points, directions(500), 1e-4)


def test_the_skys_sun_casts_shadows_of_voxels(indirect):
    scene = under(gradient(300.0))
    field = bake("cone_tracing", scene, resolution=48)
    assert field.context.environment.bright.count
    points = points_in((1.5, 1.5, 0.0), 800) + np.float32([0, 0, 1e-3])
    up = np.tile(np.float32([0, 0, 1]), (800, 1))
    found = relative_error(indirect.make_indirect(field, scene), field, points, up)
    # A shadow's edge lies a voxel further in or out.
    assert np.mean(found > 0.02) < 0.12 and found.mean() < 0.05
    assert np.ptp(field.irradiance(points, up)[:, 0]) > 0.5 * field.irradiance(points, up)[:, 0].max()


def test_what_stands_beyond_the_grid_hides_the_sky(indirect):
    scene = under(gradient(), half_size=40.0)
    field = bake("cone_tracing", scene)
    points, normals = on_walls((1.2, 1.2, 1.2), 500)
    points, normals = points[points[:, 2] > 0.1], -normals[points[:, 2] > 0.1]
    found = relative_error(indirect.make_indirect(field, scene), field, points, normals)
    assert found.mean() < 0.02 and np.quantile(found, 0.95) < 0.06
    open_sky = relative_error(indirect.make_indirect(field, scene), bake("cone_tracing", under(gradient())), points, normals)
    assert found.mean() < 0.3 * open_sky.mean()


def test_cells_that_hand_on_light_are_shown_through_probes(indirect):
    field = bake("voxel_march", ROOMS, gather="voxels", resolution=16, order=1)
    made = indirect.make_indirect(field, ROOMS)
    assert "indirect_probes" in made.samplers


def nested(name, count, world=None, **settings):
    """A scene and its field in ``count`` grids about a corner of a room, off the lattices' middle; points in it as far as it goes,
    most of them about the borders of grids."""
    scene = replace(ROOMS, volumes=(build.volume(resolution=(2, 2, 2), center=(-0.9, 0.07, -0.9), half_size=0.3),))
    scene = scene if world is None else replace(under(world), volumes=(build.volume(center=(0.4, 0.1, 0.3), half_size=0.2),))
    few = {"cones": 6} if name == "cone_tracing" else {"rays": 16}
    field = bake(name, scene, **{"cascades": count, "resolution": 60, "reach": 20.0, "order": 1, **few, **settings})
    assert len(field.cascades) == count
    rng, points = np.random.default_rng(5), [points_in((1.9, 0.9, 0.9), 200, 5)]
    for part in field.cascades[:-1]:
        inside = rng.uniform(part.grid.corner, part.grid.high, (200, 3))
        axis, low = rng.integers(3, size=200), np.asarray(part.grid.corner) + 3.5 * part.grid.cell
        inside[np.arange(200), axis] = low[axis] - rng.uniform(0.0, 3.0, 200) * part.grid.cell
        points.append(inside.astype(np.float32))
    return scene, field, np.concatenate(points)


@pytest.mark.parametrize(("name", "count", "settings"), [
    ("cone_tracing", 2, {}), ("cone_tracing", 3, {"cones": 12}), ("voxel_march", 3, {"opacity": "first hit"})])
def test_nested_grids(indirect, name, count, settings):
    scene, field, points = nested(name, count, **settings)
    made = indirect.make_indirect(field, scene)
    assert "voxel_rows" in made.samplers
    close(made, field, points, directions(len(points)), 2e-5)
    close(made, field, *on_walls((1.98, 0.98, 0.98), 300), 2e-5)
    # By the outermost alone it is another light.
    outer = type(field)(field.context, field.settings, field.seed, field.cascades[-1:], Progress())
    assert np.mean(relative_error(made, outer, points, directions(len(points))) > 1e-3) > 0.05


@pytest.mark.parametrize("name", ["cone_tracing", "voxel_march"])
def test_nested_grids_under_a_sky(indirect, name):
    scene, field, points = nested(name, 2, gradient())
    close(indirect.make_indirect(field, scene), field, points, directions(len(points)), 1e-4)


def test_nested_grids_follow_the_eye_and_what_moves(indirect):
    _, field, points = nested("cone_tracing", 2)
    settings, cell, eye = replace(field.settings, center="camera"), field.voxels.grid.cell, np.array([-0.9, 0.07, -0.9])
    made = indirect.make_indirect(None, ROOMS, live=settings)
    assert not waited(made) and "add a camera" in made.error
    made.look_from(eye)
    assert waited(made) and made.error is None and made.field.cascades[0].grid == field.cascades[0].grid
    # A step aside is none; further off grids come along, in whole cells.
    made.look_from(eye + 3.9 * cell)
    assert not made.busy
    made.look_from(eye + np.array([6.3 * cell, 0.0, 0.0]))
    assert waited(made)
    assert made.field.cascades[0].grid.corner == pytest.approx(field.cascades[0].grid.corner + np.array([6.0 * cell, 0, 0]))
    close(made, made.field, points, directions(len(points)), 2e-5)
    # What is gone is taken out of all grids, until the worker is done.
    without = replace(ROOMS, instances=ROOMS.instances[1:])
    made.follow(without)
    assert made.moved is not None
    made.put_in(None)
    assert waited(made)
    made.close()


def moved(scene, offset):
    lights = tuple(replace(light, position_world=light.position_world + np.float32([offset, 0, 0])) for light in scene.lights)
    return replace(scene, lights=lights)


@pytest.mark.parametrize("name", ["cone_tracing", "voxel_march"])
def test_voxels_need_no_bake_and_follow_lamps_walls_and_materials(indirect, name):
    settings = techniques.get(name).Settings(resolution=16, light="voxels")
    made = indirect.make_indirect(None, ROOMS, live=settings)
    points, normals = points_in((1.9, 0.9, 0.9), 300), directions(300)
    assert indirect.needs_no_bake(settings) and made.busy
    # The lamp, the wall and the paint are followed one after the other.
    thick = rooms.two_rooms(resolution=(2, 2, 2), half_size=(2.0, 0.95, 0.95), thickness=0.6)
    red = replace(thick, materials=(replace(build.material("wall", 0.4), albedo=Channel.of((0.6, 0.2, 0.1))),))
    for scene in (ROOMS, moved(ROOMS, 0.3), thick, red):
        assert made.follow(scene) and waited(made) and made.error is None
        # One thread or two put the same light into voxels.
        close(made, bake(name, scene, resolution=16), points, normals, 1e-4)
    made.close()


def test_lamps_that_no_bake_knows_light_no_voxels(indirect):
    unknown = replace(ROOMS, lights=tuple(replace(light, bake=NOT_AT_ALL) for light in ROOMS.lights))
    made = indirect.make_indirect(None, unknown, live=techniques.get("cone_tracing").Settings(resolution=16, light="voxels"))
    assert waited(made) and irradiance(made, points_in(0.9, 50), directions(50)).max() == 0
    made.close()


def test_what_cannot_be_followed_is_said(indirect):
    made = indirect.make_indirect(None, ROOMS, live=techniques.get("cone_tracing").Settings(resolution=16, light="voxels"))
    assert waited(made) and made.follow(replace(ROOMS, instances=())) and not waited(made)
    assert "no geometry" in made.error
    made.follow(ROOMS)
    assert waited(made) and made.error is None
    made.close()


def test_turns_of_receivers_have_the_light_of_all_cones(indirect):
    field = bake("cone_tracing", ROOMS, cones=16)
    points, normals = on_walls((1.98, 0.98, 0.98), 400)
    whole = field.irradiance(points, normals)
    few = indirect.make_indirect(field, ROOMS, samples=32)
    rng = np.random.default_rng(4)
    # As frames move a pixel's point on its surface.
    frames = [irradiance(few, (points + rng.normal(0.0, 1e-5, points.shape)).astype(np.float32), normals) for _ in range(48)]
    assert np.abs(frames[0] - whole).mean() > 0.02 * whole.mean()
    assert np.abs(np.mean(frames, axis=0) - whole).mean() < 0.12 * np.abs(frames[0] - whole).mean() + 0.01 * whole.mean()
    assert np.mean(frames) == pytest.approx(whole.mean(), rel=0.01)
