"""Nested grids of voxels against one that is as fine everywhere, and what must not change when they move."""

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
import room_scenes as rooms
import scene_builders as build

from rtgi_addon import techniques
from rtgi_addon.errors import BakeError, UsageError
from rtgi_addon.progress import Progress
from rtgi_addon.techniques.voxels.field import hierarchies_of
from rtgi_addon.transport.context import LightContext
from rtgi_addon.transport.paths.reference import irradiance_at
from rtgi_addon.transport.voxels import VoxelGrid, voxelize
from rtgi_addon.transport.voxels.cascades import by_cascade, coarsest_needed, nested, outside
from rtgi_addon.transport.voxels.cones import cone_set, irradiance, trace_cones
from rtgi_addon.transport.voxels.rays import march_on
from rtgi_addon.transport.voxels.tables import pack, unpack

BOX = np.array([[-4.0, -4.0, -1.0], [4.0, 4.0, 3.0]])


def black(_points, directions, _spread):
    return np.zeros((len(directions), 3), np.float32)


def hierarchies(scene, grids, radiance=1.0):
    """All faces of voxels shine with ``radiance``."""
    context = LightContext(scene)
    cascades = tuple(voxelize(context.geometry, context.surfaces, grid) for grid in grids)
    return hierarchies_of(cascades, [np.full((len(part.seen.face), 3), radiance, np.float32) for part in cascades])


def test_grids_are_nested_and_lie_on_lattices_of_their_own_cells():
    grids = nested(BOX, 48, 3, np.array([1.234, -0.777, 0.5]))
    for inner, outer in pairwise(grids):
        assert outer.cell == 2.0 * inner.cell and inner.resolution == outer.resolution
        assert np.all(np.array(inner.corner) >= np.array(outer.corner) - 1e-9) and np.all(inner.high <= outer.high + 1e-9)
    for grid in grids:
        assert np.allclose(np.array(grid.corner) / grid.cell, np.round(np.array(grid.corner) / grid.cell), atol=1e-6)
    assert np.all(np.array(grids[-1].corner) <= BOX[0]) and np.all(grids[-1].high >= BOX[1])
    assert np.all(np.abs(grids[0].center[:2] - [1.234, -0.777]) <= 0.51 * grids[0].cell)
    # The finest has the size that was asked for.
    assert nested(BOX, 48, 3, BOX.mean(axis=0), 0.05)[0].cell == pytest.approx(0.05)


def test_grids_of_a_flat_courtyard_reach_the_floor_under_a_camera():
    court, eye = np.array([[-30.0, -30.0, 0.0], [30.0, 30.0, 10.0]]), np.array([3.0, -2.0, 1.6])
    grids = nested(court, 64, 4, eye)
    assert grids[0].cell == pytest.approx(60.0 / 62 / 8, rel=0.05) and min(grids[0].resolution) >= 28
    for grid in grids:
        assert np.all(np.array(grid.corner) < eye - 1.65) and np.all(grid.high > eye + 1.65)
    assert nested(court, 64, 1, eye)[0].resolution[2] < 18


def test_a_centre_that_moves_by_less_than_half_a_cell_changes_nothing():
    center = np.array([0.1, 0.1, 0.9])
    grids = nested(BOX, 48, 3, center)
    on_lattice = grids[0].center
    assert nested(BOX, 48, 3, on_lattice) == grids
    assert nested(BOX, 48, 3, on_lattice + 0.49 * grids[0].cell) == grids
    # By two of the outermost's cells, all but that follow by whole cells of their own.
    by = 2.0 * grids[-1].cell
    for grid, moved in zip(grids[:-1], nested(BOX, 48, 3, on_lattice + np.array([by, 0, 0])), strict=False):
        assert (moved.corner[0] - grid.corner[0]) / grid.cell == pytest.approx(by / grid.cell)
        assert moved.corner[1:] == grid.corner[1:]


def test_cells_that_stay_hold_what_they_held():
    scene = build.scene([build.sphere("ball", 0.5, 3), build.plane("floor", 2.0)])
    # Cells are powers of two, so that places in them are exact.
    context, near = LightContext(scene), VoxelGrid((-1.0, -1.0, -1.0), 0.0625, (32, 32, 32))
    far = replace(near, corner=(-0.75, -1.125, -1.0))
    first, second = (voxelize(context.geometry, context.surfaces, grid) for grid in (near, far))
    opacity = [part.dense(part.opacity) for part in (first, second)]
    light = [part.dense(part.by_face(np.ones((len(part.seen.face), 3)))) for part in (first, second)]
    for before, after in (opacity, light):
        assert np.array_equal(before[:, :-2, 4:], after[:, 2:, :-4])


def test_the_level_that_answers_rises_without_a_step():
    grids = nested(BOX, 48, 3, np.zeros(3))
    view = hierarchies(build.scene([build.plane("floor", 3.9)]), grids)[0]
    x = np.linspace(0.0, 3.9, 4000)
    place = np.zeros((len(x), 3))
    place[:, 0], place[:, 2] = x, 0.3
    least = coarsest_needed(view, grids[0].cells_of(place))
    assert least[0] == 0 and least.max() == 2.0 and np.all(np.diff(least) > -1e-9)
    assert np.abs(np.diff(least)).max() < 0.05
    assert np.all(least[outside(grids[0], place) == 0] == 0)


def test_one_grid_is_read_as_before():
    scene = build.scene([build.sphere("ball", 0.5, 3), build.plane("floor", 2.0)])
    context, grid = LightContext(scene), VoxelGrid((-2.2, -2.2, -0.6), 0.1, (44, 44, 24))
    voxels = voxelize(context.geometry, context.surfaces, grid)
    shown = np.ones((len(voxels.seen.face), 3), np.float32)
    (only,) = hierarchies_of((voxels,), [shown])
    assert only.cascades == () and only.outermost is grid and [level.size for level in only.levels][:3] == [1, 2, 4]


@pytest.mark.parametrize("center", [(0.0, 0.0, 0.5), (1.5, -1.0, 0.5)])
def test_a_plane_gives_all_of_its_light_at_any_height_across_borders(center):
    """Above a wide bright floor E = π L, whichever grids its parts lie in."""
    scene = build.scene([build.plane("floor", 60.0)])
    grids = nested(np.array([[-12.0, -12.0, -2.0], [12.0, 12.0, 8.0]]), 64, 3, np.array(center))
    views = hierarchies(scene, grids, 2.0)
    points = np.array([[x, 0.1, height] for height in (0.3, 0.6, 1.0) for x in (-2.0, -0.7, 0.0, 0.9, 2.3, 3.1)])
    down = np.tile([0.0, 0.0, -1.0], (len(points), 1))
    # Half a voxel before its own plane a receiver sees nothing of what lies along it.
    found = by_cascade(views, points, lambda hierarchy, rows: irradiance(hierarchy, points[rows], down[rows], cone_set(32), black))
    assert found == pytest.approx(2.0 * np.pi, rel=0.03)
    rng = np.random.default_rng(0)
    way = rng.normal(size=(400, 3))
    way[:, 2] = -np.abs(way[:, 2]) - 0.3
    way /= np.linalg.norm(way, axis=1)[:, None]
    start = np.column_stack([rng.uniform(-3, 3, (400, 2)), rng.uniform(0.2, 2.0, 400)])
    # Rays from one grid into the next meet the floor once, and nothing passes it.
    for first in range(3):
        within = np.flatnonzero(outside(grids[first], start) < 1)[:100]
        seen = march_on(views[first:], start[within], way[within])
        assert np.abs(seen.radiance - 2.0).max() < 0.02 and seen.passed.max() == 0


def test_a_wall_in_the_next_grid_hides_what_is_behind_it():
    """A wall at any place about the border of the finest grid lets no more through than it does amid one grid."""
    finest = nested(BOX, 48, 2, np.array([0.0, 0.0, 1.0]))[0]
    border, leak = finest.high[0], []
    for off in np.linspace(-4.0, 4.0, 17):
        wall = rooms.quad("wall", (border + off * finest.cell, -3.5, -0.9), (0, 7.0, 0), (0, 0, 3.8))
        mark = rooms.quad("mark", (-0.5, -0.5, 0.0), (0.1, 0, 0), (0, 0.1, 0))
        views = hierarchies(build.scene([wall, mark]), nested(BOX, 48, 2, np.array([0.0, 0.0, 1.0])), 0.0)
        start = np.array([[0.3, 0.05 * k, 1.0] for k in range(-3, 4)])
        way = np.tile([1.0, 0.0, 0.0], (len(start), 1))
        leak.append(trace_cones(views[0], start, way, np.full(len(start), 0.05)).passed.max())
        assert march_on(views, start, way).passed.max() == 0
    assert np.max(leak) < 0.02


def room(volumes):
    """A room with a block in a corner."""
    return replace(rooms.two_rooms(resolution=(2, 2, 2), half_size=(2.0, 0.95, 0.95)), volumes=tuple(volumes))


CORNER = build.volume(center=(-1.0, 0.0, -0.85), half_size=0.3)


def bake(scene, name="cone_tracing", **settings):
    technique = techniques.get(name)
    return technique.bake(scene, technique.Settings(**{"reach": 20.0, "light": "voxels", **settings}), np.random.default_rng(0),
                          Progress())


def plate(at=(-1.0, 0.0, -0.8)):
    """A small glowing box over the floor of a room, of two coarse voxels."""
    box = build.cube("plate", 0.08, material_index=1)
    scene = room([CORNER])
    made = replace(scene, meshes=(*scene.meshes, box),
                   materials=(scene.materials[0], build.material("glow", 0.5, 8.0)), lights=())
    placed = replace(scene.instances[0], name="plate", mesh=len(scene.meshes), world_from_local=build.transform(at))
    return replace(made, instances=(*scene.instances, placed))


@pytest.mark.parametrize(("name", "settings", "less"), [("cone_tracing", {"cones": 32}, 1.2), ("voxel_march", {"rays": 256}, 0.7)])
def test_near_the_middle_light_is_nearer_to_the_truth_for_few_more_voxels(name, settings, less):
    scene = plate()
    rng = np.random.default_rng(3)
    points = np.column_stack([-1.0 + rng.uniform(-0.35, 0.35, 80), rng.uniform(-0.35, 0.35, 80), np.full(80, -0.999)])
    points = points.astype(np.float32)
    up = np.tile(np.float32([0, 0, 1]), (80, 1))
    expected = irradiance_at(LightContext(scene), points, up, 2048, seed=1).mean
    coarse, cascades = (bake(scene, name, light="surfaces", resolution=48, cascades=count, **settings) for count in (1, 3))
    off = [np.sqrt(np.mean((field.irradiance(points, up) - expected) ** 2)) / expected.mean() for field in (coarse, cascades)]
    # By cones one grid is near already.
    assert off[1] < less * off[0] and max(off) < 0.25
    assert cascades.stats["voxels"] < 2 * coarse.stats["voxels"]
    assert not any("cascades" in omission.text for omission in cascades.omissions)


def test_no_step_at_a_border():
    field = bake(room([CORNER]), light="surfaces", resolution=48, cascades=2)
    border = field.cascades[0].grid.high[0]
    x = np.linspace(border - 8 * field.cascades[0].grid.cell, border + 2 * field.cascades[0].grid.cell, 200)
    points = np.column_stack([x, np.full(200, 0.02), np.full(200, -0.999)]).astype(np.float32)
    light = field.irradiance(points, np.tile(np.float32([0, 0, 1]), (200, 1)))[:, 0]
    # A twentieth of a cell a step; nothing steps by more than light itself changes over a whole cell.
    change, over_a_cell = np.abs(np.diff(light)), np.abs(light[20:] - light[:-20]).max()
    assert change.max() < max(0.5 * over_a_cell, 0.02 * light.mean())


def test_light_that_voxels_send_each_other_comes_through_the_borders():
    """A lamp far outside the finest grid lights walls there by reflection alone."""
    scene = room([build.volume(center=(-1.7, -0.6, -0.7), half_size=0.2)])
    points = np.array([[-1.7 + 0.05 * k, -0.6, -0.999] for k in range(-3, 4)], np.float32)
    up = np.tile(np.float32([0, 0, 1]), (len(points), 1))
    one, two = (bake(scene, resolution=48, cascades=count, bounces=2).irradiance(points, up) for count in (1, 2))
    assert two.mean() == pytest.approx(one.mean(), rel=0.1)


def test_lists_of_nested_grids_stand_for_the_same_light():
    scene = room([CORNER])
    field = bake(scene, resolution=60, cascades=3, cones=12)
    tables = pack(field.hierarchies)
    # Each grid once, and what is filtered from the last; corners are whole numbers of the finest cells.
    assert tables.grids == tuple(part.grid for part in field.cascades)
    assert len(tables.shapes) == 2 + len(field.hierarchies[-1].levels)
    assert np.allclose(tables.origins, np.round(tables.origins), atol=1e-6)
    again, rng = unpack(tables), np.random.default_rng(7)
    points, normals = rng.uniform([-1.9, -0.95, -0.95], [1.9, 0.95, 0.95], (300, 3)).astype(np.float32), rng.normal(size=(300, 3))
    normals = (normals / np.linalg.norm(normals, axis=1)[:, None]).astype(np.float32)
    found, expected = (by_cascade(views, points, lambda view, rows: irradiance(
        view, points[rows], normals[rows], cone_set(12), black)) for views in (again, field.hierarchies))
    # Opacity that was 1 is 1 - e^-12.
    assert np.abs(found - expected).max() < 2e-5 * expected.max()
    # Of the outer grids' cells some add for those within, and none of the finest.
    adds = [view.levels[1].adds.any() for view in again[:-1]]
    assert all(adds) and not any(view.levels[0].adds.any() for view in again)


def test_relit_voxels_stay_where_they_are():
    scene = room([CORNER])
    field = bake(scene, resolution=48, cascades=2)
    brighter = replace(scene, lights=tuple(replace(light, intensity=2.0 * light.intensity) for light in scene.lights))
    again = field.relight(brighter)
    assert again.cascades is field.cascades
    points = np.array([[-1.0, 0.0, -0.999]], np.float32)
    up = np.float32([[0, 0, 1]])
    assert again.irradiance(points, up) == pytest.approx(2.0 * field.irradiance(points, up), rel=1e-4)
    assert {"grid", "grid_1", "cells_1"} <= set(field.arrays())


def test_what_cannot_be_is_refused():
    with pytest.raises(UsageError, match="gather is voxels and cascades is 2"):
        bake(room([CORNER]), "voxel_march", gather="voxels", cascades=2)
    with pytest.raises(BakeError, match="leave nothing between their borders"):
        bake(room([CORNER]), resolution=24, cascades=2)
    with pytest.raises(BakeError, match="the scene's camera, and it has none"):
        bake(room([CORNER]), cascades=2, center="camera")
