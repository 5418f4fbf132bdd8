"""The irradiance function of virtual lights on the GPU: the very sum of ``VplField.irradiance`` where nothing is in the way, and
near it where planes stand for shadow rays."""

from dataclasses import replace

import numpy as np
import pytest
import room_scenes as rooms
import scene_builders as build
from receivers import directions, error, points_in, relative_error, waited

from rtgi_addon.progress import Progress
from rtgi_addon.techniques.vpl import TECHNIQUE, VplSettings
from rtgi_addon.techniques.vpl.gather import gather

# Float sums in another order.
TOLERANCE = 2e-5
BOX = build.closed_box(albedo=0.6, light_position=(0.2, -0.3, 0.4))


@pytest.fixture(scope="module")
def indirect(gpu_device):
    from rtgi_addon.preview import indirect
    return indirect


def bake(scene, **settings):
    options = {"lights": 600, "order": 1, "candidates": 4, "compensation": False} | settings
    return TECHNIQUE.bake(scene, VplSettings(**options), np.random.default_rng(0), Progress())


def on_surfaces(context, count=1500, half_size=0.9):
    """Points and normals of surfaces seen from anywhere in the first volume, on the side that is seen."""
    volume = np.asarray(context.scene.volumes[0].world_from_local)
    origins = (points_in(1.0, count) @ volume[:3, :3].T + volume[:3, 3]).astype(np.float32)
    along = directions(count)
    hits = context.tracer.intersect(origins, along)
    rows = np.flatnonzero(hits.primitive >= 0)
    normals = context.geometry.normals_world[hits.primitive[rows]]
    normals = normals * -np.sign(np.sum(normals * along[rows], axis=1))[:, None]
    return context.geometry.points(hits.primitive[rows], hits.u[rows], hits.v[rows]), normals


@pytest.mark.parametrize("clamp", [None, 0.0, 3.0])
def test_nothing_in_the_way(indirect, clamp):
    # Every wall of a box sees every point in it: no plane hides any.
    field = bake(BOX, clamp=clamp)
    points, normals = points_in(0.9, 1500), directions(1500)
    expected = gather(field.context, field.lights, points, normals, clamp=field.clamp)
    assert error(indirect.make_indirect(field, BOX), expected, points, normals).max() < TOLERANCE


def test_the_worlds_light_on_open_ground(indirect):
    scene = build.open_plane(world=1.0)
    field = bake(scene)
    assert field.lights.distant_count
    points, normals = on_surfaces(field.context)
    expected = gather(field.context, field.lights, points, normals, clamp=field.clamp)
    assert error(indirect.make_indirect(field, scene), expected, points, normals).max() < TOLERANCE


def test_planes_stand_for_shadow_rays(indirect):
    from rtgi_addon.preview.indirect.base import irradiance
    scene = rooms.two_rooms(resolution=(2, 2, 2), half_size=(2.0, 0.95, 0.95))
    field = bake(scene, lights=2000)
    points, normals = on_surfaces(field.context)
    found, expected = irradiance(indirect.make_indirect(field, scene), points, normals), field.irradiance(points, normals)
    difference = np.abs(found - expected).max(axis=1) / expected.max()
    assert np.median(difference) < 0.01 and np.sqrt(np.mean(difference**2)) < 0.05
    dark = points[:, 0] > 0.1
    assert found[~dark].mean() == pytest.approx(expected[~dark].mean(), rel=0.02)
    # Next to nothing comes through the wall.
    assert not expected[dark].any() and found[dark].mean() < 5e-3 * found[~dark].mean()


def test_a_roof_hides_the_sky(indirect):
    ground, roof = build.plane("ground", 4.0), build.plane("roof", 1.0, 1.0)
    scene = build.scene([ground, roof], [build.material(albedo=0.0)], world=1.0,
                        volumes=[build.volume(half_size=(2.0, 2.0, 0.5), center=(0, 0, 0.6))])
    field = bake(scene, lights=4096)
    points = points_in((2.0, 2.0, 0.0), 1000)
    normals = np.tile(np.float32([0, 0, 1]), (1000, 1))
    found = relative_error(indirect.make_indirect(field, scene), field, points, normals)
    expected = field.irradiance(points, normals)[:, 0]
    assert expected.min() < 0.5 * expected.max()
    assert np.sqrt(np.mean(found**2)) < 0.05


def test_a_part_of_the_lights_has_the_same_mean(indirect):
    from rtgi_addon.preview.indirect.base import irradiance
    field = bake(BOX)
    points, normals = points_in(0.9, 4000), directions(4000)
    found, expected = irradiance(indirect.make_indirect(field, BOX, samples=64), points, normals), field.irradiance(points, normals)
    assert not np.allclose(found, expected, rtol=1e-3)
    assert found.mean() == pytest.approx(expected.mean(), rel=0.02)


def test_a_compensated_bound_is_not_taken_without_compensation(indirect):
    from rtgi_addon.preview.indirect.base import irradiance
    field = bake(BOX, lights=2000, compensation=True)
    assert field.uncompensated_clamp > 2.0 * field.clamp
    points, normals = on_surfaces(field.context, 2000)
    found = irradiance(indirect.make_indirect(field, BOX), points, normals)
    assert found.mean() == pytest.approx(field.irradiance(points, normals).mean(), rel=0.03)


def test_lights_follow_a_moved_lamp(indirect):
    field = bake(BOX)
    moved = replace(BOX, lights=(build.point_light((-0.5, 0.4, 0.0)),))
    made = indirect.make_indirect(field, BOX)
    assert made.follow(moved) and waited(made)
    points, normals = points_in(0.9, 500), directions(500)
    assert relative_error(made, field.relight(moved), points, normals).max() < TOLERANCE
    made.close()


def test_lights_that_stay_are_not_traced_again(monkeypatch):
    from rtgi_addon.preview.indirect import vpl_shadows
    field = bake(rooms.two_rooms(resolution=(2, 2, 2), half_size=(2.0, 0.95, 0.95)))
    lights, traced, seen = field.lights, [], vpl_shadows.SeenPlanes()
    light_planes = vpl_shadows.light_planes
    monkeypatch.setattr(vpl_shadows, "light_planes", lambda context, positions, *rest:
                        traced.append(len(positions)) or light_planes(context, positions, *rest))
    whole = seen.of_lights(field.context, lights.positions, lights.normals)
    # Another order, ten of them gone and five new.
    rows = np.random.default_rng(0).permutation(lights.count)[10:]
    positions, normals = lights.positions[rows].copy(), lights.normals[rows]
    positions[:5] += 0.01 * normals[:5]
    again = seen.of_lights(field.context, positions, normals)
    assert traced == [lights.count, 5]
    assert np.array_equal(again[5:], whole[rows[5:]]) and not np.array_equal(again[:5], whole[rows[:5]])
