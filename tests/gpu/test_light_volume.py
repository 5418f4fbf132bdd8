"""Light propagation volumes on the GPU against numpy. Sums of some hundred floats: relative to the largest coefficient."""

from dataclasses import replace

import numpy as np
import pytest

from rtgi_addon.errors import Cancelled
from rtgi_addon.progress import Progress
from rtgi_addon.techniques.lpv.gather import gather
from rtgi_addon.techniques.lpv.geometry_volume import Surfels, face_blocking, inject_surfels, vacuum
from rtgi_addon.techniques.lpv.grid import LpvGrid, total_flux
from rtgi_addon.techniques.lpv.injection import inject
from rtgi_addon.techniques.lpv.propagation import propagate

TOLERANCE = 3e-6
GRID = LpvGrid((-1.0, 2.0, 3.0), 0.25, (11, 8, 14))


def lights(count=3000, seed=0, beyond=0.1):
    """Random lights, some of them outside the volume."""
    rng = np.random.default_rng(seed)
    low, size = np.array(GRID.corner), GRID.cell * np.array(GRID.resolution)
    normals = rng.normal(size=(count, 3))
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    positions = low + (rng.random((count, 3)) * (1 + 2 * beyond) - beyond) * size
    return tuple(part.astype(np.float32) for part in (positions, normals, rng.random((count, 3))))


def agrees(found, expected, tolerance=TOLERANCE):
    return np.abs(found - expected).max() <= tolerance * np.abs(expected).max()


def test_injection(gpu_device):
    found, expected = gpu_device.lpv_inject(GRID, *lights()), inject(GRID, *lights())
    assert found.shape == expected.shape == (4, 3, 14, 8, 11)
    assert agrees(found, expected)
    assert np.allclose(total_flux(found), total_flux(expected), rtol=1e-5)


def test_injection_of_nothing_is_dark(gpu_device):
    assert not gpu_device.lpv_inject(GRID, *(part[:0] for part in lights())).any()


@pytest.mark.parametrize("resolution", [(11, 8, 14), (1, 1, 1), (32, 32, 32), (5, 1, 3)])
def test_propagation_in_vacuum(gpu_device, resolution):
    coefficients = np.random.default_rng(1).normal(size=(4, 3, *resolution[::-1])).astype(np.float32)
    blocking = vacuum(LpvGrid((0.0, 0.0, 0.0), 1.0, resolution))
    assert agrees(gpu_device.lpv_propagate(coefficients, blocking, 8), propagate(coefficients, blocking, 8))


@pytest.mark.parametrize("bounces", [True, False])
def test_propagation_among_blockers(gpu_device, bounces):
    rng = np.random.default_rng(3)
    positions, normals, albedo = lights(seed=3)
    surfels = Surfels(positions, normals, (0.04 * rng.random(len(positions))).astype(np.float32), albedo)
    blocking = face_blocking(inject_surfels(GRID, surfels), bounces)
    coefficients = inject(GRID, *lights(seed=4))
    expected = propagate(coefficients, blocking, 12)
    assert agrees(gpu_device.lpv_propagate(coefficients, blocking, 12), expected)
    # The blockers do something.
    assert not agrees(expected, propagate(coefficients, vacuum(GRID), 12), 0.05)


def test_propagation_in_media(gpu_device):
    kept = np.random.default_rng(5).random((2, 3, GRID.count), np.float32)
    blocking, coefficients = replace(vacuum(GRID), kept=kept), inject(GRID, *lights(seed=4))
    expected = propagate(coefficients, blocking, 12)
    assert agrees(gpu_device.lpv_propagate(coefficients, blocking, 12), expected)
    assert not agrees(expected, propagate(coefficients, vacuum(GRID), 12), 0.05)


def test_flux_is_kept_in_vacuum(gpu_device):
    grid = LpvGrid((0.0, 0.0, 0.0), 1.0, (9, 9, 9))
    coefficients = inject(grid, np.float32([[4.2, 4.6, 4.4]]), np.float32([[0, 0.6, 0.8]]), np.float32([[1, 2, 3]]))
    steps = gpu_device.lpv_propagate(coefficients, vacuum(grid), 3)
    # Nothing has left the volume: four volumes' worth of the same flux.
    assert total_flux(steps) == pytest.approx([4, 8, 12], rel=1e-5)


def test_cancel_is_felt_between_steps(gpu_device):
    progress = Progress()
    progress.cancel()
    with pytest.raises(Cancelled):
        gpu_device.lpv_propagate(GRID.empty(), vacuum(GRID), 4, progress=progress)


def walls(grid, seed=6):
    """Faces of which some are closed, in part or whole, and are crossed anywhere."""
    rng = np.random.default_rng(seed)
    let_through = np.clip(rng.uniform(-0.5, 1.5, (3, *grid.shape)), 0, 1)
    return np.concatenate([let_through, rng.uniform(-0.5, 0.5, (3, *grid.shape))]).astype(np.float32)


def test_injection_among_walls(gpu_device):
    found, expected = (inject(GRID, *lights(seed=8), walls(GRID)) for inject in (gpu_device.lpv_inject, inject))
    assert agrees(found, expected) and not agrees(expected, inject(GRID, *lights(seed=8)), 0.1)


@pytest.mark.parametrize("dampening", [True, False])
def test_gather_from_cascades(gpu_device, dampening):
    rng = np.random.default_rng(5)
    grids = (LpvGrid((0.0, 0.0, 0.0), 0.25, (8, 9, 10)), LpvGrid((-1.0, -1.0, -1.0), 0.5, (8, 9, 10)))
    volumes = tuple(rng.normal(size=(4, 3, 10, 9, 8)).astype(np.float32) for _ in grids)
    points = (rng.random((5000, 3)) * 5.5 - 1.5).astype(np.float32)
    normals = lights(5000)[1]
    for faces in (None, tuple(walls(grid) for grid in grids)):
        expected = gather(grids, volumes, points, normals, dampening, faces)
        assert expected.any()
        assert agrees(gpu_device.lpv_gather(grids, volumes, points, normals, dampening, faces), expected, 1e-5)


def test_gather_at_no_point(gpu_device):
    assert gpu_device.lpv_gather((GRID,), (GRID.empty(),), np.zeros((0, 3)), np.zeros((0, 3))).shape == (0, 3)
