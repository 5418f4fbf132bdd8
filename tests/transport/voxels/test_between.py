"""Light from cell to cell: what goes out arrives, as much as surfaces send, and none of it behind a wall."""

import numpy as np
import pytest
import room_scenes as rooms
import scene_builders as build

from rtgi_addon.evaluate.stability.parts import moved, rotation
from rtgi_addon.transport.context import LightContext
from rtgi_addon.transport.voxels import VoxelGrid, grid_around, voxelize
from rtgi_addon.transport.voxels.between import between, cells_before
from rtgi_addon.transport.voxels.sweeps import irradiance_of_cells, sweep


def black(directions):
    return np.zeros((len(directions), 3), np.float32)


def swept(scene, grid, glows):
    """What stands in ``grid`` and what arrives in its cells where points glow by 1 that ``glows``((e, 3)) → (e,) chooses, and those
    points: world places, normals of the sides that are seen, and areas."""
    context = LightContext(scene, 1)
    geometry = context.geometry
    voxels = voxelize(geometry, context.surfaces, grid, 1)
    seen = voxels.seen
    normals = geometry.normals_world[seen.primitive] * seen.side[:, None]
    points, areas = geometry.points(seen.primitive, seen.u, seen.v), seen.weight * grid.cell**2 / np.abs(normals).sum(axis=1)
    light = np.repeat((glows(points) & (seen.side > 0))[:, None], 3, axis=1).astype(np.float32)
    standing = between(voxels, geometry)
    return standing, sweep(standing, voxels.opacity, voxels.by_face(light), 64, 2, black, 1), points, normals, areas


@pytest.mark.parametrize(("turn", "resolution", "within"), [(0.0, 12, 0.01), (0.0, 21, 0.01), (23.0, 21, 0.05)])
def test_walls_of_a_closed_room_that_send_alike_receive_what_they_send(turn, resolution, within):
    scene = moved(build.closed_box(), rotation((1, 2, 3), turn))
    grid = grid_around(np.array(LightContext(scene, 1).geometry.bounds()), resolution)
    standing, light, points, normals, areas = swept(scene, grid, lambda points: np.ones(len(points), bool))
    received, inside = irradiance_of_cells(standing, light, points, normals)[:, 0], (normals * points).sum(axis=1) < 0
    assert np.average(received[inside], weights=areas[inside]) == pytest.approx(np.pi, rel=within)
    assert np.average(received[~inside], weights=areas[~inside]) < 0.01 * np.pi


@pytest.mark.parametrize("phase", [0.0, 0.5, 0.8])
def test_no_light_gets_through_a_wall_that_is_thinner_than_a_voxel(phase):
    cell = 0.125
    grid = VoxelGrid((-2.3 + phase * cell, -1.3, -1.3), cell, (38, 21, 21))
    # What shines in the wall's own voxels is of both rooms.
    standing, light, points, normals, _ = swept(rooms.two_rooms(thickness=0.04), grid, lambda points: points[:, 0] < -0.25)
    received = irradiance_of_cells(standing, light, points, normals)[:, 0]
    inner = np.abs(points[:, 1:]).max(axis=1) < 0.9
    dark, lit = (inner & (sign * points[:, 0] > 0.02) & (sign * normals[:, 0] != 0) for sign in (1, -1))
    assert received[lit].mean() > 1.0 and received[dark].max() < 1e-3


def test_eight_cells_before_a_surface_all_lie_before_it():
    scene = moved(build.closed_box(), rotation((1, 2, 3), 17.0))
    grid = grid_around(np.array(LightContext(scene, 1).geometry.bounds()), 16)
    standing, _, points, normals, _ = swept(scene, grid, lambda points: points[:, 0] > 0)
    cells, weights = cells_before(standing, points, normals)
    assert weights.sum(axis=1) == pytest.approx(np.ones(len(points)), abs=1e-5) and weights.min() >= 0
    ahead = ((grid.centers_of(cells.ravel()).reshape(-1, 8, 3) - points[:, None]) * normals[:, None]).sum(axis=2)
    # But for edges, whose voxels hold no plane.
    assert (weights * (ahead < -0.01 * grid.cell)).sum(axis=1).mean() < 0.01
