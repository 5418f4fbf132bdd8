"""Techniques that see the scene in voxels: what they say, refuse, and hold to beside their accuracy (test_matrix.py)."""

from dataclasses import replace

import numpy as np
import pytest
import room_scenes as rooms
import scene_builders as build

from rtgi_addon import techniques
from rtgi_addon.errors import BakeError, UsageError
from rtgi_addon.evaluate.stability.leaks import HALF, leak, two_rooms
from rtgi_addon.evaluate.stability.parts import moved, rotation, turned, volume
from rtgi_addon.numerics.sampling import fibonacci_sphere
from rtgi_addon.progress import Progress
from rtgi_addon.scene import SunLight, World
from rtgi_addon.techniques.voxels.lighting import kept_share

NAMES = ("cone_tracing", "voxel_march")
NORMALS = fibonacci_sphere(24).astype(np.float32)
POINTS = np.random.default_rng(2).uniform(-0.4, 0.4, (24, 3)).astype(np.float32)


def baked(name, scene, threads=None, **settings):
    technique = techniques.get(name)
    return technique.bake(scene, technique.Settings(**{"resolution": 24, **settings}), np.random.default_rng(1), Progress(),
                          threads=threads)


@pytest.mark.parametrize("name", NAMES)
def test_any_number_of_threads_gives_the_same_bytes(name):
    scene = build.closed_box()
    one, two = (baked(name, scene, threads) for threads in (1, 2))
    assert np.array_equal(one.irradiance(POINTS, NORMALS), two.irradiance(POINTS, NORMALS))
    assert all(np.array_equal(value, two.arrays()[key]) for key, value in one.arrays().items())


@pytest.mark.parametrize("name", NAMES)
def test_relighting_is_a_bake_under_the_new_light(name):
    before = build.closed_box(light_position=(0.3, 0.2, 0.1))
    after = build.closed_box(intensity=3.0, light_position=(-0.4, 0.1, 0.3))
    relit = baked(name, before).relight(after)
    assert np.allclose(relit.irradiance(POINTS, NORMALS), baked(name, after).irradiance(POINTS, NORMALS), rtol=1e-5)
    mapped, expected = baked(name, before, light="shadow maps").relight(after), baked(name, after, light="shadow maps")
    assert np.allclose(mapped.irradiance(POINTS, NORMALS), expected.irradiance(POINTS, NORMALS), rtol=1e-5)
    with pytest.raises(BakeError, match="geometry has changed"):
        relit.relight(build.integrating_sphere(subdivisions=1))


@pytest.mark.parametrize("name", NAMES)
def test_light_that_voxels_send_each_other_nears_all_light(name):
    scene = build.closed_box(albedo=0.5)
    whole = baked(name, scene).irradiance(POINTS, NORMALS).mean()
    part = [baked(name, scene, light="voxels", bounces=bounces, further_bounces=False).irradiance(POINTS, NORMALS).mean()
            for bounces in (0, 1, 6)]
    # Half of the light is of the first bounce, a quarter of the second.
    assert part[0] == pytest.approx(0.5 * whole, rel=0.1) and part[0] < part[1] < part[2]
    assert part[1] == pytest.approx(0.75 * whole, rel=0.1) and part[2] == pytest.approx(whole, rel=0.1)
    # All others go on as one has begun.
    assert baked(name, scene, light="voxels").irradiance(POINTS, NORMALS).mean() == pytest.approx(whole, rel=0.07)


def test_further_bounces_keep_no_more_than_surfaces_reflect():
    weight, sent = np.float32([1, 3]), np.ones((2, 3), np.float32)
    # What escapes is known; what a sweep spreads may seem more than what was sent.
    assert kept_share(weight, sent, 0.4 * np.pi * sent, 0.2 * sent) == pytest.approx(np.full(3, 0.2))
    assert kept_share(weight, sent, 2.0 * np.pi * sent, 1.2 * sent) == pytest.approx(np.full(3, 0.6))


def test_what_escapes_elsewhere_takes_no_further_bounces_from_a_closed_room():
    # Nearly all light falls on the ground and is gone; what is in the room stays.
    room = build.closed_box(albedo=0.8)
    ground = rooms.moved(build.plane("ground", 1.5), (0.0, 0.0, 1.8))
    sun = SunLight("sun", np.float32([0, 0, -1]), np.float32([500, 500, 500]), angle=0.01)
    scene = build.scene([*room.meshes, ground], list(room.materials), [*room.lights, sun], volumes=list(room.volumes))
    cached = baked("cone_tracing", scene, light="surfaces").irradiance(POINTS, NORMALS).mean()
    assert baked("cone_tracing", scene, light="voxels").irradiance(POINTS, NORMALS).mean() == pytest.approx(cached, rel=0.05)


def test_voxels_reflect_the_sky_as_they_do_lamps():
    scene = replace(build.scene([build.plane(half_size=2.0), rooms.quad("wall", (1, -1, 0), (0, 2, 0), (0, 0, 1.5))]),
                    world=World.constant(1.0), volumes=(build.volume(center=(0, 0, 0.5)),))
    points, normals = np.float32([[0.6, 0, 0.05], [0.9, 0.2, 0.5]]), np.float32([[0, 0, 1], [-1, 0, 0]])
    cached = baked("voxel_march", scene, rays=512, light="surfaces").irradiance(points, normals)
    assert baked("voxel_march", scene, rays=512, light="voxels").irradiance(points, normals) == pytest.approx(cached, rel=0.05)


@pytest.mark.parametrize("name", NAMES)
def test_walls_thinner_than_a_voxel_are_said_with_their_thickness(name):
    scene = rooms.two_rooms(thickness=0.05)
    note, = baked(name, scene, light="voxels", bounces=0, voxel_size=0.1).notes
    assert "0.1 m is larger than the thinnest wall (0.05 m)" in note and "0.025 m" in note
    assert not baked(name, scene, light="voxels", bounces=0, voxel_size=0.04).notes


@pytest.mark.parametrize("name", NAMES)
def test_bad_grids_are_refused_in_a_line(name):
    far = replace(build.closed_box(), volumes=(build.volume(center=(50.0, 0.0, 0.0)),))
    with pytest.raises(BakeError, match=r"holds no geometry: nothing lies within 0.5 m"):
        baked(name, far)
    with pytest.raises(BakeError, match="is beyond 67,108,864 cells"):
        baked(name, build.closed_box(), voxel_size=1e-4)
    with pytest.raises(UsageError, match="resolution is 4"):
        baked(name, build.closed_box(), resolution=4)


def test_cones_that_cannot_have_the_moments_are_refused():
    with pytest.raises(UsageError, match="cones is 8: give 6, or at least 12"):
        baked("cone_tracing", build.closed_box(), cones=8)


@pytest.mark.parametrize("name", NAMES)
def test_what_lies_beyond_the_grid_hides_the_sky_and_is_named(name):
    roof = build.plane("roof", half_size=50.0, z=30.0)
    open_, covered = (replace(build.scene(meshes), world=World.constant(1.0), volumes=(build.volume(center=(0, 0, 1.0)),))
                      for meshes in ([build.plane(half_size=2.0)], [build.plane(half_size=2.0), roof]))
    up = np.float32([[0, 0, 1]]), np.float32([[0, 0, 1]])
    field = baked(name, covered)
    assert baked(name, open_).irradiance(*up) == pytest.approx(np.pi, rel=0.01)
    assert field.irradiance(*up).max() < 1.0
    assert [str(said) for said in field.omissions] == [f"{name} takes what of 'roof' lies beyond the voxel grid for black"]


def test_cells_hand_on_what_rays_find():
    scene = build.cube_furnace(0.5, 1.0)
    rays, cells = (baked("voxel_march", scene, gather=gather).irradiance(POINTS, NORMALS) for gather in ("receivers", "voxels"))
    assert cells == pytest.approx(rays, rel=0.1)


def test_radiance_about_a_point_is_what_its_irradiance_says():
    from rtgi_addon.numerics import sh
    field = baked("voxel_march", build.closed_box(), rays=256)
    by_sh = sh.irradiance(field.radiance_sh(POINTS, 2), NORMALS[:, None])[:, 0]
    assert by_sh.mean() == pytest.approx(field.irradiance(POINTS, NORMALS).mean(), rel=0.03)


@pytest.mark.parametrize("name", NAMES)
def test_shadow_maps_light_voxels_as_shadow_rays_do(name):
    scene = rooms.two_rooms()
    points = (0.6 * POINTS + np.float32([-1.0, 0.0, 0.0])).astype(np.float32)
    rays, maps = (baked(name, scene, light=light, resolution=48, bounces=1) for light in ("voxels", "shadow maps"))
    expected = rays.irradiance(points, NORMALS)
    assert maps.irradiance(points, NORMALS).mean() == pytest.approx(expected.mean(), rel=0.01)
    assert np.sqrt(np.mean((maps.irradiance(points, NORMALS) - expected) ** 2)) < 0.03 * expected.mean()


def test_emitters_and_sky_light_voxels_beside_shadow_maps():
    scene = replace(rooms.panel_room(), world=World.constant(1.0))
    one, two = (baked("cone_tracing", scene, light=light) for light in ("voxels", "shadow maps"))
    assert np.allclose(one.irradiance(POINTS, NORMALS), two.irradiance(POINTS, NORMALS), rtol=1e-5)


def test_what_shadow_maps_do_not_light_is_named():
    scene = rooms.two_rooms()
    ghost = replace(scene.instances[6], visible_shadow=False)
    scene = replace(scene, instances=(*scene.instances[:6], ghost, *scene.instances[7:]))
    said, = baked("cone_tracing", scene, light="shadow maps").omissions
    assert str(said) == f"cone_tracing leaves {ghost.name!r} unlit: a map holds the nearest surface that casts a shadow"
    assert not baked("cone_tracing", scene, light="voxels").omissions


@pytest.mark.parametrize("degrees", [0.0, 20.0, 45.0])
def test_walls_of_two_voxels_let_a_thousandth_through_however_they_are_turned(degrees):
    field, lit, dark = two_rooms_at(degrees, 2)
    assert leak(field, lit, dark) < 1e-3
    # And nothing is said to be too wide where there is no wall.
    level = field.hierarchy.levels[3]
    assert 0 < level.wide.mean() < 0.5 and not field.hierarchy.levels[0].wide.any()


def two_rooms_at(degrees, voxels, size=0.1):
    """Cones' field of two rooms with a wall of so many voxels between them, turned; receivers of the lit one, and of the dark."""
    built, lit, dark = two_rooms(2.0 * voxels * size)
    turn = rotation((0.2, 0.1, 1.0), degrees)
    turn[:3, 3] = 0.03, 0.017, 0.041
    reach = np.abs(turn[:3, :3]) @ HALF
    scene = replace(moved(built, turn), volumes=(volume(-reach, reach, (4, 4, 4)),))
    return baked("cone_tracing", scene, voxel_size=size, light="voxels", bounces=0), turned(*lit, turn), turned(*dark, turn)
