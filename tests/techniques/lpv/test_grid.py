"""The numbers of a light propagation volume's lattice, against docs/physics.md §2: what crosses faces, lobes, matrices, flux."""

import numpy as np
import pytest

from rtgi_addon.numerics import sh
from rtgi_addon.techniques.lpv import grid as lattice
from rtgi_addon.techniques.lpv.grid import LpvGrid, direction_kept, step_matrices, total_flux
from rtgi_addon.techniques.lpv.injection import inject


def test_what_crosses_a_face_are_half_range_moments():
    directions, solid_angles = sh.quadrature(400)
    ahead = np.maximum(directions[:, 0], 0.0) * solid_angles * 2.0 / 3.0
    even = np.full(len(directions), 1.0 / (4 * np.pi))
    along = 3.0 * directions[:, 0] / (4 * np.pi)
    assert ahead @ even == pytest.approx(lattice.FLUX_OUT, rel=1e-3)
    assert ahead @ along == pytest.approx(lattice.VECTOR_OUT, rel=1e-3)
    assert (ahead * directions[:, 0]) @ even == pytest.approx(lattice.VECTOR_OF_FLUX, rel=1e-3)
    # Light that a plane sends out, evenly over half the sphere, of vector flux 1: along it, and across.
    for normal, share in ((directions[:, 0], lattice.VECTOR_AHEAD), (directions[:, 2], lattice.VECTOR_ACROSS)):
        half = np.sign(normal) / (2 * np.pi)
        assert (half * normal) @ solid_angles == pytest.approx(1.0, rel=1e-3)
        assert (ahead * normal) @ half == pytest.approx(share, rel=0.02)


def test_lobe_is_the_clamped_cosine():
    assert (lattice.COSINE_0, lattice.COSINE_1) == (pytest.approx(0.886227, abs=1e-6), pytest.approx(1.023327, abs=1e-6))
    directions, solid_angles = sh.quadrature(400)
    cosine = np.maximum(directions[:, 2:], 0.0)
    projected = sh.project(directions, cosine, solid_angles, 1)[:, 0]
    assert np.allclose(projected, [lattice.COSINE_0, 0, lattice.COSINE_1, 0], atol=1e-4)
    assert lattice.LOBE_VECTOR * lattice.PER_VECTOR == pytest.approx(lattice.COSINE_1 / np.pi)
    assert (directions[:, 2] * cosine[:, 0]) @ solid_angles / np.pi == pytest.approx(lattice.LOBE_VECTOR, rel=1e-3)


def test_matrices_lose_and_gain_nothing_and_stay_bounded():
    offsets, matrices = step_matrices(0.75)
    whole = matrices.sum(axis=0)
    assert np.allclose(whole, np.diag([1.0, 0.75, 0.75, 0.75]), atol=1e-12)
    # No wave of any length grows.
    _, matrices = step_matrices()
    for wave in np.random.default_rng(0).uniform(-np.pi, np.pi, (500, 3)):
        turned = np.einsum("k,kij->ij", np.exp(-1j * offsets @ wave), matrices)
        assert np.abs(np.linalg.eigvals(turned)).max() < 1.0 + 1e-9


@pytest.mark.parametrize("count", [4, 16, 100])
def test_light_keeps_its_way_over_the_mean_chord(count):
    # Where P falls by 1 a cell along x, F settles at what a step makes of itself.
    kept = direction_kept((count, 3, 2))
    vector = -2.0 * kept * lattice.VECTOR_OF_FLUX / (1.0 - kept * (2.0 * lattice.VECTOR_AHEAD + 4.0 * lattice.VECTOR_ACROSS))
    flux = -lattice.FLUX_OUT + 2.0 * lattice.VECTOR_OUT * vector
    # A path m gives a flux of m/3; a step is 2/3 of the physical one.
    assert -1.5 * flux == pytest.approx(count * 2.0 / 3.0 / 3.0, rel=1e-12)


def test_injection_puts_each_light_into_the_cell_before_its_surface():
    grid = LpvGrid((-1.0, 0.0, 2.0), 0.5, (4, 3, 2))
    positions = np.array([[-0.5, 0.7, 2.2], [-0.5, 0.7, 2.2], [9.0, 0.0, 2.0], [-1.0, 0.2, 2.2]])
    normals = np.array([[1.0, 0, 0], [-1.0, 0, 0], [1.0, 0, 0], [-1.0, 0, 0]])
    flux = np.array([[1.0, 2, 3], [4.0, 5, 6], [7.0, 7, 7], [8.0, 8, 8]])
    volume = inject(grid, positions, normals, flux)
    assert volume.shape == (4, 3, 2, 3, 4) and volume.dtype == np.float32
    assert np.allclose(total_flux(volume), [5, 7, 9], rtol=1e-6)
    right, left = volume[:, :, 0, 1, 1], volume[:, :, 0, 1, 0]
    assert np.allclose(right[0], np.array([1, 2, 3]) * lattice.COSINE_0 / np.pi, rtol=1e-6)
    assert np.allclose(right[3], np.array([1, 2, 3]) * lattice.COSINE_1 / np.pi, rtol=1e-6)
    assert np.allclose(left[3], -np.array([4, 5, 6]) * lattice.COSINE_1 / np.pi, rtol=1e-6)
    assert np.count_nonzero(volume[0, 0]) == 2 and not volume[1].any() and not volume[2].any()


def test_no_lights_make_darkness():
    empty = np.zeros((0, 3), np.float32)
    assert not inject(LpvGrid((0, 0, 0), 1.0, (4, 4, 4)), empty, empty, empty).any()
