import numpy as np
import pytest

from rtgi_addon.numerics import sampling, sh
from rtgi_addon.techniques.lattice import reconstruction


def _delta(axis, order):
    """A delta light of unit normal irradiance: L_lm = Y_lm(axis), one channel."""
    axis = np.asarray(axis, np.float64) / np.linalg.norm(axis)
    return sh.evaluate(axis[None], order).T, axis


@pytest.mark.parametrize("name, order, rmse, lowest, peak", [
    ("linear", 1, 0.144, -0.250, 0.750),
    ("geomerics", 1, 0.057, 0.0, 1.000),
    ("zh3", 1, 0.041, -0.039, 1.021),
    ("linear", 2, 0.036, -0.040, 1.063),
    ("deringed", 2, 0.174, 0.0, 0.584),
])
@pytest.mark.parametrize("axis", [(0, 0, 1), (1, -2, 0.5)])
def test_ringing_table_of_a_delta(name, order, rmse, lowest, peak, axis):
    coefficients, axis = _delta(axis, order)
    if name == "deringed":
        coefficients = reconstruction.dering(coefficients)
    normals = np.concatenate([sampling.fibonacci_sphere(40000).astype(np.float64), [axis, -axis]])
    method = {"linear": reconstruction.linear, "deringed": reconstruction.linear, "geomerics": reconstruction.geomerics,
              "zh3": reconstruction.zh3}[name]
    got = method(coefficients, normals)[:, 0]
    exact = np.maximum(normals @ axis, 0)
    assert np.sqrt(np.mean((got - exact)[:-2] ** 2)) == pytest.approx(rmse, abs=6e-4)
    assert got.min() == pytest.approx(lowest, abs=6e-4)
    assert got.max() == pytest.approx(peak, abs=6e-4)
    assert reconstruction.reconstruct(name, coefficients, normals).min() >= 0


def test_window_of_a_delta_is_the_known_one():
    coefficients, _ = _delta((0, 0, 1), 2)
    share = reconstruction.dering(coefficients)[2, 0] / coefficients[2, 0]
    assert 1 / share - 1 == pytest.approx(4 * 0.178, rel=5e-3)


@pytest.mark.parametrize("order", [1, 2, 4])
def test_dering_never_leaves_negative_irradiance(order):
    rng = np.random.default_rng(order)
    coefficients = rng.normal(size=(300, (order + 1) ** 2, 3)).astype(np.float32)
    coefficients[:, 0] = np.abs(coefficients[:, 0]) + 0.05
    clean = reconstruction.dering(coefficients)
    assert clean.dtype == np.float32 and np.array_equal(clean[:, 0], coefficients[:, 0])
    dense = sh.irradiance(clean, sampling.fibonacci_sphere(8000))
    assert dense.min() >= 0


def test_dering_is_minimal_and_leaves_clean_probes_alone():
    rng = np.random.default_rng(0)
    coefficients = rng.normal(size=(400, 9, 3)).astype(np.float32) * 0.25
    coefficients[:, 0] = np.abs(coefficients[:, 0]) + rng.uniform(0.1, 2, (400, 1)).astype(np.float32)
    clean = reconstruction.dering(coefficients)
    normals = sampling.fibonacci_sphere(5000)
    rang = sh.irradiance(coefficients, normals).min(axis=(1, 2)) < 0
    assert 20 < rang.sum() < 380
    assert np.array_equal(clean[~rang], coefficients[~rang])
    touches_zero = sh.irradiance(clean[rang], normals).min(axis=(1, 2)) / (0.886 * clean[rang, 0].min(axis=1))
    assert np.median(touches_zero) < 5e-3 and touches_zero.max() < 0.05


def test_dering_commutes_with_rotation():
    rng = np.random.default_rng(5)
    coefficients = rng.normal(size=(50, 9, 3))
    coefficients[:, 0] = 1
    matrix = sh.rotation_matrix(sampling.random_rotations(1, rng)[0], 2)
    assert np.allclose(reconstruction.dering(matrix @ coefficients), matrix @ reconstruction.dering(coefficients), atol=2e-4)


def test_black_and_negative_probes_stay_finite():
    coefficients = np.zeros((3, 9, 3), np.float32)
    coefficients[1, :, 0] = 1
    coefficients[2] = -1
    clean = reconstruction.dering(coefficients)
    assert np.all(np.isfinite(clean)) and not clean[0].any() and not clean[2, 1:].any()
    for name in reconstruction.RECONSTRUCTIONS:
        value = reconstruction.reconstruct(name, clean, np.float32([[0, 0, 1]] * 3))
        assert np.all(np.isfinite(value)) and value.min() >= 0 and value[1, 0] > 0 and not value[0].any()


@pytest.mark.parametrize("name", reconstruction.RECONSTRUCTIONS)
def test_uniform_light_is_pi_l_and_channels_are_independent(name):
    coefficients = np.zeros((4, 3), np.float32)
    coefficients[0] = np.sqrt(4 * np.pi) * np.float32([1, 2, 3])
    normals = sampling.fibonacci_sphere(20)
    assert np.allclose(reconstruction.reconstruct(name, coefficients, normals), np.pi * np.float32([1, 2, 3]), rtol=1e-5)
    order_zero = reconstruction.reconstruct(name, coefficients[:1], normals)
    assert np.allclose(order_zero, np.pi * np.float32([1, 2, 3]), rtol=1e-5)


def test_geomerics_keeps_the_mean_of_the_sphere():
    rng = np.random.default_rng(6)
    coefficients = rng.normal(size=(20, 4, 3)) * 0.3
    coefficients[:, 0] = 1
    directions = sampling.fibonacci_sphere(5000).astype(np.float64)
    mean = reconstruction.geomerics(coefficients[:, None], directions).mean(axis=1)
    assert np.allclose(mean, np.sqrt(np.pi) / 2, rtol=2e-3)
