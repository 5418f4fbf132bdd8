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
    ("deringed", 2, 0.056, 0.0, 0.963),
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


def test_shares_of_a_delta_are_the_nearest_that_leave_nothing_negative():
    coefficients, _ = _delta((0, 0, 1), 2)
    first, second = (reconstruction.dering(coefficients) / np.where(coefficients == 0, 1, coefficients))[[2, 6], 0]
    # Irradiance over the cosine x is 1/4 + w1·x/2 + w2·5(3x² − 1)/32: its least is 0 on w1² = w2·(15/32)·(4 − 5w2/2)/2.
    w2 = np.linspace(0.5, 1.0, 100_001)
    w1 = np.sqrt(15.0 / 8.0 * w2 * (0.25 - 5.0 / 32.0 * w2) / 0.25)
    # In squares over all normals band 1 counts (1/2)²/3 and band 2 (5/32)²·4/5.
    best = np.argmin((1.0 - w1) ** 2 / 12.0 + (1.0 - w2) ** 2 * (5.0 / 32.0) ** 2 * 0.8)
    assert (first, second) == pytest.approx((w1[best], w2[best]), abs=2e-4)


def test_deringing_is_the_least_change_that_serves():
    rng = np.random.default_rng(3)
    coefficients = rng.normal(size=(40, 9, 3)) * 0.5
    coefficients[:, 0] = np.abs(coefficients[:, 0]) + 0.3
    clean, normals, band = reconstruction.dering(coefficients), sampling.fibonacci_sphere(4000), sh.bands(2)
    power = [np.sum((coefficients * sh.cosine_coefficients(2)[:, None])[:, band == l] ** 2, axis=(1, 2)) for l in (1, 2)]

    def cost(w1, w2):
        return power[0] * (1 - w1) ** 2 + power[1] * (1 - w2) ** 2

    found = cost(*(np.median((clean / coefficients)[:, band == l], axis=(1, 2)) for l in (1, 2)))
    least = np.full(40, np.inf)
    for w1 in np.linspace(0, 1, 41):
        for w2 in np.linspace(0, 1, 41):
            serves = sh.irradiance(coefficients * np.array([1, w1, w2])[band][:, None], normals).min(axis=(1, 2)) >= 0
            least = np.where(serves, np.minimum(least, cost(w1, w2)), least)
    assert np.all(found <= least + 1e-3 * sum(power)) and np.median(found / np.maximum(least, 1e-9)) > 0.8


@pytest.mark.parametrize("order", [1, 2, 4])
def test_a_last_digit_changes_deringing_by_a_last_digit(order):
    rng = np.random.default_rng(7)
    coefficients = rng.normal(size=(3000 if order < 4 else 200, (order + 1) ** 2, 3)) * 0.5
    coefficients[:, 0] = np.abs(coefficients[:, 0]) + 0.3
    other = coefficients * (1.0 + 1e-7 * rng.normal(size=coefficients.shape))
    # Directions that are sampled, above order 2, are themselves off by some 1e-5.
    assert np.abs(reconstruction.dering(other) - reconstruction.dering(coefficients)).max() < (1e-5 if order < 4 else 2e-3)


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
