"""Whole bakes of light propagation volumes: what lights what, determinism, relighting, cascades, bad input."""

from dataclasses import replace

import numpy as np
import pytest
import room_scenes as rooms
import scene_builders as build

from rtgi_addon import techniques
from rtgi_addon.errors import BakeError, Cancelled
from rtgi_addon.progress import Progress
from rtgi_addon.scene import Camera, SpotLight, World
from rtgi_addon.techniques.lpv.field import LpvField
from rtgi_addon.techniques.lpv.settings import LpvSettings

QUICK = {"resolution": 12, "steps": 80, "map_resolution": 48}


LAMP_INTO_THE_VOID = SpotLight("up", np.array([0, 0, 1.0]), np.array([0, 0, 1.0]), np.ones(3, np.float32), 0.5)


def bake(scene, seed=0, threads=None, **settings):
    method = techniques.get("lpv")
    return method.bake(scene, LpvSettings(**{**QUICK, **settings}), np.random.default_rng(seed), Progress(), threads=threads)


def walls(count=400, half=1.0, seed=3):
    """Points on the walls of a cube with normals inward, off its edges."""
    rng = np.random.default_rng(seed)
    axis, sign = rng.integers(3, size=count), rng.choice([-1.0, 1.0], count)
    points = rng.uniform(-0.8 * half, 0.8 * half, (count, 3))
    points[np.arange(count), axis] = sign * half
    normals = np.zeros((count, 3))
    normals[np.arange(count), axis] = -sign
    return points, normals


def test_light_in_a_grey_room_is_about_what_it_should_be():
    # Mean over a closed room: what a lamp of flux P gives is P/A·rho/(1 - rho), A = 24 m^2.
    field = bake(build.closed_box(albedo=0.5, intensity=1.0, light_position=(0.2, 0.1, 0.0)))
    mean = field.irradiance(*walls()).mean(axis=0)
    assert np.allclose(mean, mean[0], rtol=1e-4)
    assert mean[0] == pytest.approx(4 * np.pi / 24.0, rel=0.3)
    assert field.technique == "lpv" and not field.includes_direct and field.irradiance(*walls()).min() >= 0


def test_light_scales_with_the_lamp_and_takes_the_colour_of_the_walls():
    dim, bright = (bake(build.closed_box(albedo=(0.8, 0.4, 0.1), intensity=i)).irradiance(*walls()) for i in (1.0, 5.0))
    assert np.allclose(bright, 5 * dim, rtol=1e-3, atol=1e-5)
    red, green, blue = dim.mean(axis=0)
    assert red > 2 * green > 4 * blue > 0


def test_bounces_and_emission_and_the_world_are_in_it():
    scene = build.closed_box(albedo=0.7)
    once, often = (bake(scene, further_bounces=bounces).irradiance(*walls()).mean() for bounces in (False, True))
    assert often > 1.5 * once > 0
    furnace = bake(build.cube_furnace(0.5, 1.0), steps=200).irradiance(*walls())
    assert furnace.mean() == pytest.approx(2 * np.pi, rel=0.2)


def test_a_sky_is_seen_as_it_is_and_reflected_by_the_ground():
    points = np.random.default_rng(0).uniform([-0.3, -0.3, 0.7], [0.3, 0.3, 1.3], (50, 3))
    up, down = (np.tile([0.0, 0, z], (50, 1)) for z in (1.0, -1.0))
    black, grey = (bake(build.open_plane(albedo, world=(1.0, 2.0, 3.0), half_size=3000.0)) for albedo in (0.0, 0.5))
    assert np.allclose(black.irradiance(points, up), np.pi * np.array([1, 2, 3]), rtol=0.02)
    assert black.irradiance(points, down).max() < 0.02
    # An endless ground sends back 0.5 pi; what lies outside the volume is not known.
    assert 0.2 * np.pi < grey.irradiance(points, down)[:, 0].mean() < 0.6 * np.pi


def test_a_bright_spot_in_the_sky_shines_in():
    scene = rooms.courtyard()
    lit = bake(scene).irradiance(np.array([[-0.4, 0, 0.8]]), np.array([[0.0, 0, 1]]))
    plain = replace(scene, world=World.constant((0.2, 0.2, 0.2)))
    dark = bake(plain).irradiance(np.array([[-0.4, 0, 0.8]]), np.array([[0.0, 0, 1]]))
    assert lit[0, 0] > 3 * dark[0, 0] > 0


def test_the_dark_room_next_door_stays_dark():
    field = bake(rooms.two_rooms(), resolution=20, steps=200)
    normal = np.array([[0.0, 0, 1]])
    lit, dark = (field.irradiance(np.array([[x, 0.0, -1.0]]), normal)[0].mean() for x in (-1.0, 1.0))
    assert dark < 1e-6 * lit
    leaky = bake(rooms.two_rooms(), resolution=20, steps=200, blocking=False)
    assert leaky.irradiance(np.array([[1.0, 0.0, -1.0]]), normal)[0].mean() > 0.03 * lit


def test_lamps_and_cameras_as_the_only_views_give_similar_light():
    pose = np.eye(4)
    pose[2, 3] = 0.9
    projection = np.array([[1.0, 0, 0, 0], [0, 1.0, 0, 0], [0, 0, -1.002, -0.2002], [0, 0, -1.0, 0]])
    scene = replace(build.closed_box(), cameras=(Camera("camera", pose, projection, (64, 64)),))
    seen, known = (bake(scene, occluders=kind).irradiance(*walls()).mean() for kind in ("views", "surfaces"))
    assert seen == pytest.approx(known, rel=0.1)


def test_the_same_seed_gives_the_same_bytes_for_any_number_of_threads():
    scene = rooms.panel_room()
    arrays = [bake(scene, threads=threads).arrays() for threads in (1, 3)]
    assert all(np.array_equal(arrays[0][name], arrays[1][name]) for name in arrays[0])
    other = bake(scene, seed=9).arrays()
    assert not np.array_equal(other["cascade0.coefficients"], arrays[0]["cascade0.coefficients"])


def test_relighting_is_a_fresh_bake_without_new_geometry():
    scene = build.closed_box(light_position=(0.4, 0.0, 0.0))
    moved = replace(scene, lights=(build.point_light((-0.3, 0.2, 0.1), (1.0, 0.5, 0.2)),))
    field = bake(scene)
    relit, fresh = field.relight(moved), bake(moved)
    assert np.array_equal(relit.volumes[0], fresh.volumes[0]) and not np.array_equal(relit.volumes[0], field.volumes[0])
    with pytest.raises(BakeError, match="materials"):
        field.relight(replace(scene, materials=(build.material("other", 0.9),)))


def test_probe_grids_hold_the_field():
    field = bake(build.closed_box(resolution=(2, 3, 2)), order=2)
    grid, = field.grids()
    assert grid.sh.shape == (2, 3, 2, 9, 3) and np.all(grid.validity == 1) and np.isfinite(grid.sh).all()
    assert not grid.sh[..., 4:, :].any() and grid.sh[..., 0, :].min() > 0
    assert field.grids()[0] is grid


def test_arrays_give_the_field_back():
    field = bake(build.closed_box(), cascades=2)
    back = LpvField.from_arrays(field.arrays(), params=field.params)
    assert np.array_equal(back.irradiance(*walls()), field.irradiance(*walls()))
    for ask in (back.grids, lambda: back.relight(build.closed_box())):
        with pytest.raises(BakeError, match="read from files"):
            ask()


def test_a_fine_cascade_gets_light_from_beyond_its_border():
    scene = build.closed_box(light_position=(-0.5, 0, 0), half_size=1.0)
    # A cascade must hold something that blocks: a pebble at its edge.
    pebble = rooms.moved(build.cube("pebble", 0.02), (0.5, 0.5, 0.5))
    near = build.scene([*scene.meshes, pebble], scene.materials, scene.lights, volumes=[build.volume(half_size=0.2)])
    whole = bake(near, cell_size=0.2, resolution=12)
    nested = bake(near, cell_size=0.1, resolution=12, cascades=2)
    point, normals = np.zeros((6, 3)), np.concatenate([np.eye(3), -np.eye(3)])
    assert nested.volume_grids[1].cell == pytest.approx(0.2)
    assert nested.irradiance(point, normals).mean() == pytest.approx(whole.irradiance(point, normals).mean(), rel=0.5)


@pytest.mark.parametrize(("scene", "settings", "words"), [
    (replace(build.closed_box(), volumes=()), {}, "no probe volume"),
    (build.scene([rooms.moved(build.cube("far", 0.1), (0, 0, 50))], world=1.0), {}, "cascade 0 .* holds no geometry"),
    (build.scene([build.cube("room")], lights=[build.point_light((0, 0, 9.0))]), {"center": "nobody"}, "center is 'nobody'"),
    (build.scene([build.plane("floor", 3.0)], lights=[LAMP_INTO_THE_VOID]), {}, "no lamp lights any surface"),
    (build.closed_box(), {"cell_size": 1e-3}, "lights nothing inside|holds no geometry"),
    (build.scene([build.cube("room", 1.0, inward=True), rooms.moved(build.cube("other", 1.0, inward=True), (50, 0, 0))],
                 lights=[build.point_light(), build.point_light((50, 0, 0), name="far lamp")]), {},
     "lamp 'far lamp' lights nothing inside"),
])
def test_bad_input_is_one_clear_line(scene, settings, words):
    with pytest.raises(BakeError, match=words) as raised:
        bake(scene, **settings)
    assert "\n" not in str(raised.value) and raised.value.remedy


def test_no_light_is_darkness_and_cancel_stops():
    field = bake(build.closed_box(intensity=0.0))
    assert not field.irradiance(*walls()).any()
    progress = Progress()
    progress.cancel()
    with pytest.raises(Cancelled):
        techniques.get("lpv").bake(build.closed_box(), LpvSettings(**QUICK), np.random.default_rng(0), progress)


def test_a_lamp_that_creeps_does_not_flicker():
    points, normals = walls(60)
    frames = []
    for step in range(6):
        field = bake(build.closed_box(light_position=(0.11 + 0.002 * step, 0.03, 0.07)))
        frames.append(field.irradiance(points, normals)[:, 0])
    frames = np.array(frames)
    # A lamp that moves by a hundredth of a cell a frame changes the light by about as much.
    assert np.abs(np.diff(frames, axis=0)).mean() < 0.02 * frames.mean()


def test_a_turned_wall_keeps_most_light_out():
    # A wall through the room under 30 degrees, wherever the lattice lies.
    direction = np.array([np.sin(np.pi / 6), np.cos(np.pi / 6), 0.0])
    corner = -3 * direction - [0, 0, 3]
    wall = rooms.quad("wall", corner, 6 * direction, (0, 0, 6), 0)
    scene = build.scene([build.cube("room", 1.0, inward=True), wall], [build.material("grey", 0.5)],
                        [build.point_light((0.6, -0.3, 0.2))])
    field = bake(scene, resolution=20, steps=150)
    floor = np.array([[0.55, -0.4, -1.0], [-0.55, 0.4, -1.0]])
    lit, dark = field.irradiance(floor, np.tile([0.0, 0, 1], (2, 1)))[:, 0]
    # What lamps light where that wall meets the room's may be put into a cell behind it.
    assert dark < 0.01 * lit
