"""Propagation between cells: against a plain loop over faces, conservation, walls, threads."""

import numpy as np
import pytest

from rtgi_addon.errors import Cancelled
from rtgi_addon.numerics import sh
from rtgi_addon.progress import Progress
from rtgi_addon.techniques.lpv import grid as lattice
from rtgi_addon.techniques.lpv.geometry_volume import GeometryVolume, face_blocking, vacuum
from rtgi_addon.techniques.lpv.grid import LpvGrid, face_directions, step_matrices, total_flux
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
    """A geometry volume of surfaces that face any way, some corners empty and some more than covered."""
    rng = np.random.default_rng(seed)
    shape = tuple(count + 1 for count in grid.shape)
    normals = rng.normal(size=(3, *shape))
    normals /= np.linalg.norm(normals, axis=0)
    coverage = rng.uniform(0, 1.6, shape) * (rng.random(shape) < 0.6)
    values = np.concatenate([coverage[None], np.abs(normals) * coverage, normals * coverage, rng.random((3, *shape)) * coverage])
    return GeometryVolume(grid, values.astype(np.float32))


def box(grid, albedo):
    """A geometry volume whose border is closed."""
    values = np.zeros((10, *(count + 1 for count in grid.shape)), np.float32)
    for axis in range(3):
        for end, inward in ((0, 1.0), (-1, -1.0)):
            at = [slice(None)] * 3
            at[2 - axis] = end
            values[(0, *at)] += 1.0
            values[(1 + axis, *at)] = 1.0
            values[(4 + axis, *at)] = inward
            values[(slice(7, 10), *at)] += np.float32(albedo)
    return GeometryVolume(grid, values)


def one_step_by_loops(volume, geometry, bounces):
    """The same step, face by face, as the papers write it down."""
    result = np.zeros(volume.shape)
    nz, ny, nx = volume.shape[2:]
    corners = geometry.values.astype(np.float64)
    offsets, directions, normals, solid_angles = face_directions()
    basis = sh.evaluate(directions, 1)
    for z, y, x in np.ndindex(nz, ny, nx):
        stopped = {}
        for offset, direction, normal, solid_angle, row in zip(offsets, directions, normals, solid_angles, basis, strict=True):
            axis = int(np.flatnonzero(offset)[0])
            low = np.array([x, y, z]) + np.where(offset > 0, offset, 0)
            spread = [[0, 1] if other != axis else [0] for other in range(3)]
            face = np.mean([corners[:, low[2] + k, low[1] + j, low[0] + i] for k in spread[2] for j in spread[1]
                            for i in spread[0]], axis=0)
            blocked = min(1.0, float(np.abs(direction) @ face[1:4]) / abs(direction[axis]))
            flux = solid_angle * (row @ volume[:, :, z, y, x].astype(np.float64))
            total, _ = stopped.get(tuple(offset), (np.zeros(3), None))
            stopped[tuple(offset)] = total + blocked * flux, face
            into = np.array([x, y, z]) + offset
            if np.all(into >= 0) and np.all(into < [nx, ny, nz]):
                lobe = np.array([lattice.PER_FLUX, *(lattice.PER_VECTOR * normal[[1, 2, 0]])])
                result[:, :, into[2], into[1], into[0]] += lobe[:, None] * (1.0 - blocked) * flux
        for offset, (flux, face) in stopped.items() if bounces else ():
            back = np.where(flux > 0, flux * face[7:10] / max(face[0], 1e-30), flux)
            normal, along = face[4:7], float(face[4:7] @ np.array(offset))
            length = float(np.linalg.norm(normal))
            # A blocker faces where its light comes from.
            normal = -np.array(offset) if length < 0.25 * face[0] or length == 0 else normal / length * (-1 if along > 0 else 1)
            lobe = np.array([lattice.PER_FLUX, *(lattice.PER_VECTOR * normal[[1, 2, 0]])])
            result[:, :, z, y, x] += lobe[:, None] * back
    return result


@pytest.mark.parametrize("bounces", [False, True])
def test_a_step_is_the_papers_loop_over_faces(bounces):
    volume = light_in_the_middle(GRID, margin=0)
    geometry = random_geometry(GRID)
    expected = one_step_by_loops(volume, geometry, bounces)
    stepped = propagate(volume, face_blocking(geometry, bounces), 1) - volume
    assert np.allclose(stepped, expected, atol=2e-6 * np.abs(expected).max())


def test_vacuum_is_six_matrices():
    volume = light_in_the_middle(GRID, margin=1)
    expected = np.zeros(volume.shape)
    for offset, matrix in zip(*step_matrices(), strict=True):
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


def test_a_wall_lets_nothing_through():
    grid = LpvGrid((0.0, 0.0, 0.0), 1.0, (8, 8, 8))
    values = np.zeros((10, 9, 9, 9), np.float32)
    values[[0, 1], :, :, 4] = 1.0
    values[4, :, :, 4] = -1.0
    volume = grid.empty()
    volume[0, :, 3:5, 3:5, 2] = 1.0
    lit = propagate(volume, face_blocking(GeometryVolume(grid, values), bounces=False), 12)
    assert lit[0, :, :, :, 3].min() > 0
    assert not lit[:, :, :, :, 4:].any()


def test_superposition_holds_without_bounces():
    blocking = face_blocking(random_geometry(GRID), bounces=False)
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
