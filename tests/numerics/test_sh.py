import numpy as np
import pytest

from rtgi_addon.numerics import sampling, sh


def _random_directions(n, seed=0):
    directions = np.random.default_rng(seed).normal(size=(n, 3))
    return directions / np.linalg.norm(directions, axis=1, keepdims=True)


def test_constants_and_order_of_the_convention():
    x, y, z = directions = _random_directions(100).T
    expected = np.stack([
        0.282095 * np.ones(100), 0.488603 * y, 0.488603 * z, 0.488603 * x, 1.092548 * x * y, 1.092548 * y * z,
        0.315392 * (3 * z * z - 1), 1.092548 * x * z, 0.546274 * (x * x - y * y),
    ], axis=1)
    assert np.allclose(sh.evaluate(directions.T, 2), expected, atol=2e-6)


@pytest.mark.parametrize("order", [0, 1, 2])
def test_closed_forms_equal_the_recurrence(order):
    directions = _random_directions(1000)
    assert np.allclose(sh.evaluate(directions, order), sh.evaluate(directions, 3)[:, : (order + 1) ** 2], atol=1e-14)


@pytest.mark.parametrize("order", [2, 5, 12])
def test_basis_is_orthonormal(order):
    directions, solid_angles = sh.quadrature(2 * order)
    basis = sh.evaluate(directions, order)
    assert np.allclose(basis.T @ (basis * solid_angles[:, None]), np.eye((order + 1) ** 2), atol=1e-12)


def test_addition_theorem_at_high_order():
    basis = sh.evaluate(_random_directions(50), 20)
    band = sh.bands(20)
    for l in (3, 11, 20):
        assert np.allclose((basis[:, band == l] ** 2).sum(1), (2 * l + 1) / (4 * np.pi))


def test_dtype_follows_the_directions_and_shape_is_free():
    directions = _random_directions(24)
    single = sh.evaluate(directions.astype(np.float32).reshape(2, 12, 3), 4)
    assert single.dtype == np.float32 and single.shape == (2, 12, 25)
    assert np.allclose(single.reshape(24, 25), sh.evaluate(directions, 4), atol=2e-6)
    assert sh.evaluate(directions.tolist(), 1).dtype == np.float64


def test_cosine_coefficients():
    a = sh.cosine_coefficients(6)[[0, 1, 4, 9, 16, 25, 36]]
    assert np.allclose(a, [np.pi, 2 * np.pi / 3, np.pi / 4, 0, -np.pi / 24, 0, np.pi / 64], atol=1e-7)
    z, weight = np.polynomial.legendre.leggauss(200)
    mu = (z + 1) / 2
    for l in range(12):
        legendre = np.polynomial.legendre.Legendre.basis(l)(mu)
        exact = 2 * np.pi * np.sum(weight / 2 * mu * legendre)
        assert sh.cosine_coefficients(11)[l * l] == pytest.approx(exact, abs=1e-6)


def _projected(function, order, degree=600):
    directions, solid_angles = sh.quadrature(degree)
    return sh.project(directions, function(directions)[:, None], solid_angles, order)


def test_uniform_sky_is_pi_l():
    coefficients = _projected(lambda d: np.full(len(d), 2.5), 4, degree=20)
    assert np.allclose(sh.irradiance(coefficients, _random_directions(100)), 2.5 * np.pi, atol=1e-6)


def test_hemisphere_sky_is_exact_at_l1():
    coefficients = np.array([[np.sqrt(np.pi)], [0], [np.sqrt(3 * np.pi) / 2], [0]])
    measured = _projected(lambda d: (d[:, 2] > 0).astype(float), 1)
    assert np.allclose(measured, coefficients, atol=1e-2)
    normals = _random_directions(100)
    assert np.allclose(sh.irradiance(coefficients, normals)[:, 0], np.pi * (1 + normals[:, 2]) / 2, atol=1e-6)


@pytest.mark.parametrize("order, error", [(1, 0.125), (2, 0.0078), (4, 0.0020)])
def test_cosine_sky_errors(order, error):
    """E = ⅔[sinθ + (π − θ)cosθ] for L = max(0, cosθ): the error, as a share of the peak 2π/3, falls with the order."""
    coefficients = _projected(lambda d: np.maximum(d[:, 2], 0), order)
    theta = np.linspace(0, np.pi, 721)
    normals = np.stack([np.sin(theta), np.zeros_like(theta), np.cos(theta)], axis=1)
    exact = 2 / 3 * (np.sin(theta) + (np.pi - theta) * np.cos(theta))
    worst = np.abs(sh.irradiance(coefficients, normals)[:, 0] - exact).max() / (2 * np.pi / 3)
    assert worst == pytest.approx(error, rel=0.03)


def test_irradiance_broadcasts_over_probes():
    coefficients = np.random.default_rng(1).normal(size=(4, 5, 9, 3)).astype(np.float32)
    normals = _random_directions(7).astype(np.float32)
    everywhere = sh.irradiance(coefficients, normals)
    assert everywhere.shape == (4, 5, 7, 3) and everywhere.dtype == np.float32
    own = sh.irradiance(coefficients.reshape(20, 9, 3), np.tile(normals[:4], (5, 1))[:, None, :])
    assert np.allclose(own[3, 0], everywhere.reshape(20, 7, 3)[3, 3], atol=1e-5)


def test_projection_recovers_coefficients_and_sums_in_chunks():
    rng = np.random.default_rng(2)
    truth = rng.normal(size=(16, 3))
    directions, solid_angles = sh.quadrature(500)
    assert len(directions) > 65536
    assert np.allclose(sh.project(directions, sh.evaluate(directions, 3) @ truth, solid_angles, 3), truth, atol=1e-10)
    fibonacci = sampling.fibonacci_sphere(20000)
    values = sh.evaluate(fibonacci, 3) @ truth.astype(np.float32)
    assert np.allclose(sh.project(fibonacci, values, 4 * np.pi / 20000, 3), truth, atol=1e-3)


@pytest.mark.parametrize("order", [1, 2, 6])
def test_rotation_commutes_with_projection(order):
    """project(rotate f) = rotate(project f), for a batch of rotations and one reflection."""
    rotations = sampling.random_rotations(5, np.random.default_rng(3))
    rotations[4] = rotations[4] @ np.diag([1.0, 1.0, -1.0])
    coefficients = np.random.default_rng(4).normal(size=((order + 1) ** 2, 3))
    matrices = sh.rotation_matrix(rotations, order)
    directions = _random_directions(200)
    for rotation, matrix in zip(rotations, matrices, strict=True):
        rotated_function = sh.evaluate(directions @ rotation, order) @ coefficients
        assert np.allclose(sh.evaluate(directions, order) @ (matrix @ coefficients), rotated_function, atol=1e-10)
    assert np.allclose(matrices @ np.swapaxes(matrices, 1, 2), np.eye((order + 1) ** 2), atol=1e-12)
    assert np.allclose(sh.rotation_matrix(rotations[0], order), matrices[0])
    assert np.allclose(sh.rotation_matrix(rotations[0] @ rotations[1], order), matrices[0] @ matrices[1], atol=1e-12)


def test_rotation_of_a_lobe_by_hand():
    """A quarter turn about z carries +x to +y."""
    quarter = np.array([[0.0, -1, 0], [1, 0, 0], [0, 0, 1]])
    assert np.allclose(sh.rotation_matrix(quarter, 1) @ [0, 0, 0, 1], [0, 1, 0, 0])


def test_order_of_refuses_other_counts():
    assert [sh.order_of(k) for k in (1, 4, 9, 121)] == [0, 1, 2, 10]
    with pytest.raises(ValueError, match="not a number of SH"):
        sh.order_of(8)
