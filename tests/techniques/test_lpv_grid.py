"""The numbers of a light propagation volume's lattice, against PHYSICS: solid angles, lobes, matrices, flux."""

import numpy as np
import pytest

from rtgi_addon.numerics import sh
from rtgi_addon.techniques.lpv import grid as lattice
from rtgi_addon.techniques.lpv.grid import LpvGrid, face_directions, step_matrices, total_flux
from rtgi_addon.techniques.lpv.injection import inject


def test_face_solid_angles_are_exact():
    assert lattice.FRONT_SOLID_ANGLE == pytest.approx(0.4006696846, abs=5e-11)
    assert lattice.SIDE_SOLID_ANGLE == pytest.approx(0.4234313544, abs=5e-11)
    assert lattice.FRONT_SOLID_ANGLE + 4 * lattice.SIDE_SOLID_ANGLE == pytest.approx(2 * np.pi / 3, rel=1e-14)
    offsets, directions, normals, solid_angles = face_directions()
    assert len(offsets) == 30 and solid_angles.sum() == pytest.approx(4 * np.pi, rel=1e-14)
    assert np.allclose(np.linalg.norm(directions, axis=1), 1.0)
    assert np.allclose(solid_angles @ directions, 0.0, atol=1e-14) and np.allclose(solid_angles @ normals, 0.0, atol=1e-14)


def test_side_solid_angle_agrees_with_counting_directions():
    directions = np.random.default_rng(0).normal(size=(400_000, 3))
    directions /= np.abs(directions).max(axis=1, keepdims=True)
    # What leaves through the +x face and then meets the neighbour's +y face before its far one.
    ahead = directions[directions[:, 0] == 1.0]
    at_side = 0.5 / np.maximum(ahead[:, 1], 1e-9)
    share = np.mean((at_side < 1.5) & (at_side >= 0.5) & (ahead[:, 1] > np.abs(ahead[:, 2]))) * 2 * np.pi / 3
    assert share == pytest.approx(lattice.SIDE_SOLID_ANGLE, rel=0.02)


def test_lobe_is_the_clamped_cosine():
    assert (lattice.COSINE_0, lattice.COSINE_1) == (pytest.approx(0.886227, abs=1e-6), pytest.approx(1.023327, abs=1e-6))
    directions, solid_angles = sh.quadrature(400)
    cosine = np.maximum(directions[:, 2:], 0.0)
    projected = sh.project(directions, cosine, solid_angles, 1)[:, 0]
    assert np.allclose(projected, [lattice.COSINE_0, 0, lattice.COSINE_1, 0], atol=1e-4)


def test_matrices_conserve_flux_and_clamping_would_not():
    _, matrices = step_matrices()
    assert np.allclose(matrices.sum(axis=0)[0], [1, 0, 0, 0], atol=1e-12)
    _, directions, _, solid_angles = face_directions()
    lobe = np.array([lattice.PER_FLUX, 0.0, lattice.PER_VECTOR, 0.0])
    sent = solid_angles * (sh.evaluate(directions, 1) @ lobe)
    assert sent.sum() == pytest.approx(1.0, rel=1e-12)
    # All of the negative flux of a lobe along an axis leaves through the one face behind it.
    assert np.maximum(sent.reshape(6, 5).sum(axis=1), 0.0).sum() == pytest.approx(1.138, abs=5e-4)


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
