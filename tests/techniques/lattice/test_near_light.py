"""Emissive surfaces nearer to others than probes are apart: whose light is taken out of probes, and what takes its place."""

from dataclasses import replace

import numpy as np
import pytest
import scene_builders as build
from picture_stage import view

from rtgi_addon.effects.lit import draw_frame, light_context
from rtgi_addon.evaluate.receivers import Receivers
from rtgi_addon.evaluate.references import PathReference
from rtgi_addon.progress import Progress
from rtgi_addon.scene.linking import Linking
from rtgi_addon.techniques import get
from rtgi_addon.techniques.lattice.field import ProbeField
from rtgi_addon.techniques.lattice.near_light import direct_coefficients, may_have_near_light, near_light
from rtgi_addon.transport.context import LightContext
from rtgi_addon.transport.rays.tracer import offset_origins


def room(place=(0.0, 0.92, 0.1), size=(0.5, 0.02, 0.03), emission=5.0, albedo=0.5):
    """A closed room 2 m wide with a glowing bar in it, by default 6 cm off a wall, and probes half a metre apart."""
    scene = build.scene([build.cube("room", 1.0, inward=True), build.cube("bar", 1.0, material_index=1)],
                        [build.material("wall", albedo), build.material("glow", 0.0, emission)],
                        volumes=[build.volume(resolution=(4, 4, 4), half_size=1.0)])
    bar = replace(scene.instances[1], world_from_local=build.transform(place, size))
    return replace(scene, instances=(scene.instances[0], bar))


def baked(scene, **settings):
    technique = get("probes")
    return technique.bake(scene, technique.Settings(**{"rays": 2048, **settings}), np.random.default_rng(1), Progress())


@pytest.fixture(scope="module")
def by_the_wall():
    scene = room()
    context, field = LightContext(scene, 2, whole=True), baked(scene)
    return scene, context, field, near_light(context, field)


def wall_points(count=12):
    """Points on the wall behind the bar, beside it, with their normals."""
    side = np.linspace(-0.75, 0.75, count)
    x, z = (part.ravel() for part in np.meshgrid(side, side))
    points = np.stack([x, np.ones_like(x), z], axis=1).astype(np.float32)
    return points, np.tile(np.float32([0, -1, 0]), (len(points), 1))


def mean_light(near, context, points, normals, samples=64):
    own = np.mean([near.irradiance(context, points, normals, normals, index) for index in range(samples)], axis=0)
    return near.left.irradiance(points, normals) + own


def test_it_is_known_for_what_stands_by_a_wall_alone(by_the_wall):
    _scene, context, field, near = by_the_wall
    assert near.names == ("bar",) and near.panes.count == 6
    assert near_light(context, field) is near
    middle = room((0.0, 0.0, 0.1))
    assert may_have_near_light(middle, field) and near_light(LightContext(middle, 1, whole=True), baked(middle, rays=64)) is None


def test_it_is_the_light_that_probes_hold(by_the_wall):
    scene, _, _, near = by_the_wall
    direct = baked(scene, bounces=0, rays=8192)
    held = near.held[0].reshape(direct.grids()[0].sh.shape)
    # Without bounces there is nothing else in them.
    assert np.sqrt(np.mean((held - direct.grids()[0].sh) ** 2)) < 0.02 * np.sqrt(np.mean(held**2))


def off(light, true):
    """Relative RMSE."""
    return np.sqrt(np.mean((light[:, 1] - true[:, 1]) ** 2)) / true[:, 1].mean()


@pytest.mark.parametrize("side", [1, -1])
def test_walls_are_lit_as_paths_light_them(by_the_wall, side):
    scene, context, field, near = by_the_wall
    points, normals = (part * np.float32([1, side, 1]) for part in wall_points(12 if side > 0 else 6))
    receivers = Receivers(offset_origins(points, normals, normals), normals, np.ones(len(points), bool))
    true = PathReference(LightContext(scene, 2), 0.02, 1_000_000).irradiance(receivers).mean
    before, after = (off(light, true) for light in (field.irradiance(points, normals), mean_light(near, context, points, normals)))
    # Beside the bar, and on the wall across, where no more than order 2 was in the way.
    assert (before > 1.0 and after < 0.08) if side > 0 else after < 0.6 * before


def test_what_stands_in_between_throws_a_shadow(by_the_wall):
    scene, _, _field, _ = by_the_wall
    plate = build.cube("plate", 1.0, material_index=2)
    scene = replace(scene, meshes=(*scene.meshes, plate), materials=(*scene.materials, build.material("black", 0.0)), instances=(
        *scene.instances, replace(scene.instances[1], name="plate", mesh=2,
                                  world_from_local=build.transform((0.0, 0.97, 0.1), (0.6, 0.005, 0.1)))))
    context, direct = LightContext(scene, 2, whole=True), baked(scene, bounces=0)
    near, points = near_light(context, direct), np.float32([[0.0, 1.0, 0.1], [0.3, 1.0, 0.08], [0.0, 1.0, 0.7]])
    normals = np.tile(np.float32([0, -1, 0]), (3, 1))
    own = np.mean([near.irradiance(context, points, normals, normals, index) for index in range(32)], axis=0)
    assert near.panes.irradiance(points, normals)[:2].min() > 0.5 and not own[:2].any()
    assert own[2] == pytest.approx(near.panes.irradiance(points[2:], normals[2:])[0], rel=0.05)


def test_both_sides_of_a_sheet_shine():
    scene = room()
    sheet = build.plane("sheet", 0.5, material_index=1)
    scene = replace(scene, meshes=(scene.meshes[0], sheet), instances=(scene.instances[0], replace(
        scene.instances[1], world_from_local=build.transform((0.0, 0.0, 0.95)))))
    context = LightContext(scene, 1, whole=True)
    near = near_light(context, baked(scene, rays=256))
    assert near.panes.count == 2 and np.allclose(near.panes.normals.sum(axis=0), 0.0)
    held = direct_coefficients(context, near.panes, np.array([[0.0, 0.0, 0.97], [0.0, 0.0, 0.0], [0.9, 0.9, 0.95]]), 1)
    assert held[0, 0, 1] > held[1, 0, 1] > 0 and abs(held[2, 0, 1]) < 1e-3 * held[1, 0, 1]


def test_pictures_show_it_and_no_other_field_s(by_the_wall):
    scene, context, field, near = by_the_wall
    frame = draw_frame(scene, field, view((0.0, -0.9, 0.1), lens=1.0), (24, 16))
    seen = frame.gbuffer.seen
    points, normals, faces = (getattr(frame.gbuffer, name)[seen][:, :3] for name in ("position", "normal", "geometry"))
    expected = near.left.irradiance(points, normals) + near.irradiance(context, points, normals, faces, 0)
    assert np.allclose(frame.irradiance[seen][:, :3], expected, rtol=1e-4, atol=1e-4 * expected.max())
    fitted = ProbeField([replace(grid, fitted=True) for grid in field.grids()])
    plain = draw_frame(scene, fitted, view((0.0, -0.9, 0.1), lens=1.0), (24, 16))
    assert np.allclose(plain.irradiance[seen][:, :3], field.irradiance(points, normals), atol=1e-5)
    assert expected.max() > 2 * field.irradiance(points, normals).max()


def test_where_it_is_not_known_probes_keep_all_light(by_the_wall):
    scene, _context, field, _ = by_the_wall
    grid = field.grids()[0]
    dim = replace(grid, volume=replace(grid.volume, intensity=0.5))
    linked = replace(scene.instances[1], linking=Linking(np.ones(2, bool), None))
    uneven = replace(scene.materials[1], emission=replace(scene.materials[1].emission, attribute="glow"))
    for case, of in ((scene, ProbeField([replace(grid, fitted=True)])), (scene, ProbeField([dim])), (scene, None),
                     (replace(scene, instances=(scene.instances[0], linked)), field),
                     (replace(scene, materials=(scene.materials[0], uneven)), field)):
        assert not may_have_near_light(case, of)
    # Probes of a time at which it shone less.
    assert near_light(light_context(room(emission=10.0)), field) is None


def test_relit_probes_lose_the_same_light(by_the_wall):
    scene, _, field, near = by_the_wall
    lamp = build.point_light((0.0, -0.5, 0.0), 2.0)
    relit = field.relight(replace(scene, lights=(lamp,)))
    left = near.left_of(relit).grids()[0].sh
    assert np.allclose(left + near.held[0].reshape(left.shape), relit.grids()[0].sh, atol=1e-3 * relit.grids()[0].sh.max())
