"""Propagation between cells: against a plain loop over faces, conservation, closed rooms, walls, threads."""

import numpy as np
import pytest

from rtgi_addon.errors import Cancelled
from rtgi_addon.progress import Progress
from rtgi_addon.techniques.lpv import grid as lattice
from rtgi_addon.techniques.lpv.gather import gather
from rtgi_addon.techniques.lpv.geometry_volume import (
    ABOVE,
    ALBEDO,
    BELOW,
    CLOSED,
    NORMAL,
    ROWS,
    SPREAD,
    GeometryVolume,
    face_blocking,
    plane_shape,
    vacuum,
)
from rtgi_addon.techniques.lpv.grid import LINEAR, LpvGrid, direction_kept, step_matrices, total_flux
from rtgi_addon.techniques.lpv.propagation import propagate

GRID = LpvGrid((0.0, 0.0, 0.0), 1.0, (5, 4, 6))


def light_in_the_middle(grid, seed=0, margin=2):
    """Random intensities away from the border."""
    volume = grid.empty()
    inside = tuple(slice(margin, count - margin) for count in grid.shape)
    part = volume[(slice(None), slice(None), *inside)]
    part[:] = np.random.default_rng(seed).normal(size=part.shape)
    part[0] = np.abs(part[0]) + 1.0
    return volume


def random_geometry(grid, seed=1):
    """A geometry volume of surfaces that face any way, some faces open and some closed."""
    rng = np.random.default_rng(seed)
    planes = []
    for axis in range(3):
        shape = plane_shape(grid, axis)
        plane = rng.random((ROWS, *shape)).astype(np.float32)
        plane[CLOSED] = np.clip(rng.uniform(-0.6, 1.4, shape), 0, 1)
        for side in (plane[BELOW], plane[ABOVE]):
            normals = rng.normal(size=(3, *shape))
            normals /= np.linalg.norm(normals, axis=0)
            side[NORMAL], side[SPREAD] = normals * np.where(normals[axis] < 0, -1, 1), np.abs(normals).sum(axis=0)
        planes.append(plane)
    return GeometryVolume(grid, tuple(planes), rng.random(grid.shape).astype(np.float32))


def box(grid, albedo):
    """A geometry volume whose border is closed."""
    planes, area = [], np.zeros(grid.shape, np.float32)
    for axis in range(3):
        plane = np.zeros((ROWS, *plane_shape(grid, axis)), np.float32)
        for end in (0, -1):
            at = [slice(None)] * 3
            at[2 - axis] = end
            plane[(CLOSED, *at)] = 1.0
            for side in (plane[BELOW], plane[ABOVE]):
                side[(SPREAD, *at)] = side[(1 + axis, *at)] = 1.0
                side[(ALBEDO, *at)] = albedo
            area[tuple(at)] += 1.0
        planes.append(plane)
    return GeometryVolume(grid, tuple(planes), area)


def one_step_by_loops(volume, geometry, bounces):
    """The same step, face by face."""
    grid = geometry.grid
    kept = direction_kept(grid.resolution)
    flux = volume[0] / lattice.PER_FLUX
    vector = np.stack([volume[row] for row in LINEAR]) / lattice.PER_VECTOR
    new_flux, new_vector = np.zeros(flux.shape), np.zeros(vector.shape)
    for z, y, x in np.ndindex(grid.shape):
        for axis in range(3):
            for sign in (1, -1):
                face = [x, y, z]
                face[axis] += sign > 0
                row = geometry.planes[axis][(slice(None), *face[::-1])].astype(np.float64)
                way = np.eye(3)[axis] * sign
                p, f = flux[:, z, y, x], vector[:, :, z, y, x]
                passing = (1.0 - row[CLOSED]) * (p / 6.0 + way @ f / 3.0)
                into = np.array([x, y, z]) + way.astype(int)
                if np.all(into >= 0) and np.all(into < grid.resolution):
                    carried = 5.0 / 36.0 * f + (2.0 / 9.0 - 5.0 / 36.0) * np.outer(way, way @ f) + np.outer(way, p / 9.0)
                    new_flux[(slice(None), *into[::-1])] += passing
                    new_vector[(slice(None), slice(None), *into[::-1])] += (1.0 - row[CLOSED]) * kept * carried
                if bounces:
                    side = row[BELOW] if sign > 0 else row[ABOVE]
                    met = p / 6.0 / side[SPREAD] + way @ f / 3.0
                    back = row[CLOSED] * side[ALBEDO] * met
                    new_flux[:, z, y, x] += back + row[CLOSED] * p / 6.0 * (1.0 - 1.0 / side[SPREAD])
                    new_vector[:, :, z, y, x] -= 2.0 / 3.0 * sign * np.outer(side[NORMAL], back)
    result = np.zeros(volume.shape)
    result[0] = new_flux * lattice.PER_FLUX
    for axis, row in enumerate(LINEAR):
        result[row] = new_vector[axis] * lattice.PER_VECTOR
    return result


@pytest.mark.parametrize("bounces", [False, True])
def test_a_step_is_a_loop_over_faces(bounces):
    volume = light_in_the_middle(GRID, margin=0)
    geometry = random_geometry(GRID)
    expected = one_step_by_loops(volume, geometry, bounces)
    blocking = face_blocking(geometry, bounces)
    # What accumulates is multiplied by how much larger the walls of cells are.
    stepped = propagate(volume, blocking, 1) / blocking.area.reshape(GRID.shape) - volume
    assert np.allclose(stepped, expected, atol=5e-6 * np.abs(expected).max())


def test_vacuum_is_six_matrices():
    volume = light_in_the_middle(GRID, margin=1)
    expected = np.zeros(volume.shape)
    for offset, matrix in zip(*step_matrices(direction_kept(GRID.resolution)), strict=True):
        expected += np.roll(np.einsum("ij,jczyx->iczyx", matrix, volume), tuple(offset[::-1]), axis=(2, 3, 4))
    assert np.allclose(propagate(volume, vacuum(GRID), 1) - volume, expected, atol=1e-6)


def test_flux_is_conserved_in_vacuum_to_float_precision():
    grid = LpvGrid((0.0, 0.0, 0.0), 0.3, (20, 20, 20))
    volume = light_in_the_middle(grid, margin=9)
    flux, last = total_flux(volume), volume
    for steps in range(1, 9):
        accumulated = propagate(volume, vacuum(grid), steps)
        assert np.allclose(total_flux(accumulated), (steps + 1) * flux, rtol=2e-6)
        last = accumulated
    assert np.all(np.isfinite(last))


def test_a_closed_white_box_keeps_its_flux_and_a_grey_one_loses_its_share():
    grid = LpvGrid((0.0, 0.0, 0.0), 1.0, (6, 6, 6))
    volume = grid.empty()
    volume[0, :, 2:4, 2:4, 2:4] = lattice.PER_FLUX
    white = face_blocking(box(grid, 1.0))
    # Edges of the box are covered once along either axis, so nothing gets out.
    before, after = (total_flux(propagate(volume, white, steps)) for steps in (39, 40))
    assert np.allclose(after - before, total_flux(volume), rtol=1e-4)
    grey = face_blocking(box(grid, 0.5))
    early, late = (total_flux(propagate(volume, grey, steps + 1)) - total_flux(propagate(volume, grey, steps))
                   for steps in (0, 300))
    assert np.all(late < 1e-3 * early) and np.all(late > -1e-6)


@pytest.mark.parametrize("albedo", [0.0, 0.5, 0.8])
@pytest.mark.parametrize("count", [3, 6, 12])
def test_the_walls_of_a_closed_room_take_what_its_lights_give_at_any_resolution(count, albedo):
    # All light is met by a wall, and the share of it that is reflected by another: Φ/(1 - albedo).
    grid = LpvGrid((0.0, 0.0, 0.0), 2.0 / count, (count,) * 3)
    volume = grid.empty()
    volume[0, :, 1, 1, 1] = lattice.PER_FLUX
    blocking = face_blocking(box(grid, albedo))
    lit = propagate(volume, blocking, 400)
    steps = (np.arange(24) + 0.5) / 12
    across = np.stack(np.meshgrid(steps, steps, indexing="ij"), axis=-1).reshape(-1, 2)
    across = across[np.all(across < 2.0, axis=1)]
    received = 0.0
    for axis in range(3):
        for end in (0.0, 2.0):
            points, normals = np.zeros((len(across), 3)), np.zeros((len(across), 3))
            points[:, [(axis + 1) % 3, (axis + 2) % 3]], points[:, axis] = across, end
            normals[:, axis] = 1.0 - end
            received += 4.0 * gather((grid,), (lit,), points, normals, faces=(blocking.faces,)).mean(axis=0)
    assert np.allclose(received, 1.0 / (1.0 - albedo), rtol=0.02)


def test_an_endless_plane_hardly_lights_itself_and_all_its_light_leaves():
    # A lobe of 1 W from every cell before a floor: 1 W per cell goes up, however the light spreads on its way.
    grid = LpvGrid((0.0, 0.0, 0.0), 1.0, (60, 60, 12))
    values = [np.zeros((ROWS, *plane_shape(grid, axis)), np.float32) for axis in range(3)]
    values[2][CLOSED, 0] = 1.0
    volume = grid.empty()
    volume[0, :, 0], volume[2, :, 0] = lattice.PER_FLUX, lattice.LOBE_VECTOR * lattice.PER_VECTOR
    geometry = GeometryVolume(grid, tuple(values), np.zeros(grid.shape, np.float32))
    lit = propagate(volume, face_blocking(geometry, bounces=False), 400)
    flux, upward = lit[0, 0, :, 30, 30] / lattice.PER_FLUX, lit[2, 0, :, 30, 30] / lattice.PER_VECTOR
    back = flux[0] / 6.0 - upward[0] / 3.0
    # None at all came back if light kept all of its direction.
    assert 0 < back < 0.12
    net = flux[0] / 6.0 + upward[0] / 3.0 - flux[1] / 6.0 + upward[1] / 3.0
    assert net == pytest.approx(1.0 - back, abs=0.02)


def test_a_wall_lets_nothing_through():
    grid = LpvGrid((0.0, 0.0, 0.0), 1.0, (8, 8, 8))
    planes = [np.zeros((ROWS, *plane_shape(grid, axis)), np.float32) for axis in range(3)]
    planes[0][CLOSED, :, :, 4] = 1.0
    volume = grid.empty()
    volume[0, :, 3:5, 3:5, 2] = 1.0
    lit = propagate(volume, face_blocking(GeometryVolume(grid, tuple(planes), np.zeros(grid.shape, np.float32)), bounces=False), 12)
    assert lit[0, :, :, :, 3].min() > 0
    assert not lit[:, :, :, :, 4:].any()


@pytest.mark.parametrize("bounces", [False, True])
def test_superposition_holds(bounces):
    blocking = face_blocking(random_geometry(GRID), bounces)
    one, other = light_in_the_middle(GRID, 1, 0), light_in_the_middle(GRID, 2, 0)
    both = propagate(one + 2 * other, blocking, 6)
    assert np.allclose(both, propagate(one, blocking, 6) + 2 * propagate(other, blocking, 6), rtol=1e-4, atol=1e-4)


def test_any_number_of_threads_gives_the_same_bytes():
    grid = LpvGrid((0.0, 0.0, 0.0), 1.0, (40, 40, 30))
    volume, blocking = light_in_the_middle(grid), face_blocking(random_geometry(grid))
    results = [propagate(volume, blocking, 3, threads=threads) for threads in (1, 2, 5)]
    assert all(result.tobytes() == results[0].tobytes() for result in results[1:])
    assert np.all(np.isfinite(results[0]))


def test_it_stops_when_asked():
    progress = Progress()
    progress.cancel()
    with pytest.raises(Cancelled):
        propagate(light_in_the_middle(GRID, margin=1), vacuum(GRID), 4, progress=progress)
