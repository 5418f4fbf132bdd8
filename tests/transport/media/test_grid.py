"""Grids of density: optical depth is exact, look-ups are those of the lattice, and height fog follows from it."""

import numpy as np
import pytest
from scene_builders import transform

from rtgi_addon.numerics.sampling import fibonacci_sphere
from rtgi_addon.scene import DensityGrid, Medium
from rtgi_addon.transport.media.grid import GridTable
from rtgi_addon.transport.media.table import MediaTable

TURN = np.linalg.qr(np.random.default_rng(2).normal(size=(3, 3)))[0]
MATRIX = transform((0.5, -1, 2), (1.5, 0.7, -1), TURN)


def smoke(coloured, shape=(5, 4, 6)):
    rng = np.random.default_rng(7)
    arrays = {name: rng.uniform(0, 2, (*shape, 3)).astype(np.float32) for name in ("scattering", "absorption", "emission")}
    grid = DensityGrid(MATRIX, rng.uniform(0, 3, shape).astype(np.float32), **(arrays if coloured else {}))
    return Medium("smoke", np.array([0.2, 0.3, 0.4]), np.array([0.1, 0, 0.5]), np.ones(3), grid=grid)


def rays(n):
    origins = np.random.default_rng(1).uniform(-3, 3, (n, 3))
    return origins + MATRIX[:3, 3], fibonacci_sphere(n).astype(np.float64)


@pytest.mark.parametrize("coloured", [False, True])
def test_optical_depth_is_what_a_thousand_steps_give(coloured):
    table = MediaTable([smoke(coloured)])
    filling, (origins, directions) = table.fillings[0], rays(60)
    spans = filling.spans(origins, directions, np.full(60, np.inf))
    t = spans.enter + (spans.leave - spans.enter) * (np.arange(4000) + 0.5) / 4000
    points = origins[:, None] + directions[:, None] * t[:, :, None]
    sampled = filling.coefficients(points.reshape(-1, 3)).extinction.reshape(60, 4000, 3).mean(axis=1)
    expected = sampled * (spans.leave - spans.enter)
    assert np.any(expected > 0.5)
    assert filling.optical_depth(origins, directions, np.full(60, np.inf)) == pytest.approx(expected, abs=2e-5)
    assert table.transmittance(origins, directions) == pytest.approx(np.exp(-expected), abs=2e-5)


def test_a_ray_along_a_plane_of_samples_ends():
    table = GridTable(Medium("smoke", np.ones(3), grid=DensityGrid(np.eye(4), np.ones((4, 4, 4), np.float32))))
    start = np.array([[-1, 0.25, 0.25], [-1, -1, -1]], np.float64)
    depth = table.optical_depth(start, np.array([[1.0, 0, 0], [1 / np.sqrt(3)] * 3]), np.zeros(2), np.array([2, 2 * 3**0.5]))
    assert depth[:, 0] == pytest.approx([2, 2 * 3**0.5])


def test_values_at_samples_are_those_of_the_arrays_and_nothing_exceeds_the_majorant():
    medium = smoke(True)
    table, grid = GridTable(medium), medium.grid
    z, y, x = np.indices(grid.density.shape)
    local = (2 * np.stack([x, y, z], -1).reshape(-1, 3) + 1) / np.array(grid.resolution) - 1
    found = table.coefficients(local @ MATRIX[:3, :3].T + MATRIX[:3, 3])
    scattering = medium.scattering * grid.density[..., None] * grid.scattering
    assert found.scattering == pytest.approx(scattering.reshape(-1, 3), rel=1e-5)
    assert found.emission == pytest.approx(grid.emission.reshape(-1, 3), rel=1e-5)
    assert np.all(found.extinction <= table.majorant + 1e-9)


def test_there_is_nothing_outside_the_box():
    table = MediaTable([smoke(False)])
    assert np.all(table.transmittance(np.array([[9.0, 9, 9]]), np.array([[1.0, 0, 0]])) == 1.0)
    assert np.all(table.at(np.array([[9.0, 9, 9]]))[0].extinction == 0)


def test_height_fog():
    """σ₀e^(−bz): σ₀e^(−bz₀)(1 − e^(−b·d_z·D))/(b·d_z) (C. Wenzel, "Real-time Atmospheric Effects in Games", SIGGRAPH 2006)."""
    z = np.linspace(0, 5, 401)[:-1] + 5 / 800
    density = np.broadcast_to(np.exp(-0.25 * z)[:, None, None], (400, 1, 1)).astype(np.float32)
    fog = Medium("fog", np.full(3, 0.3), grid=DensityGrid(transform((0, 0, 2.5), (20, 20, 2.5)), density))
    direction = np.array([[np.sqrt(1 - 0.16), 0, 0.4]])
    depth = -np.log(MediaTable([fog]).transmittance(np.array([[0.0, 0, 1]]), direction, np.array([7.0])))
    assert depth[0] == pytest.approx([1.1761793] * 3, rel=2e-5)
