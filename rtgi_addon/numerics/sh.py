"""Real spherical harmonics of any order (docs/physics.md §1): orthonormal, without the Condon-Shortley sign.

Coefficient l² + l + m belongs to Y_lm; the first nine basis functions are 1, y, z, x, xy, yz, 3z² − 1, xz, x² − y² times
.282095, .488603, 1.092548, .315392 and .546274. A probe stores the projection of incident radiance; convolving it with the
cosine lobe gives irradiance.

Sources: R. Ramamoorthi and P. Hanrahan, "An Efficient Representation for Irradiance Environment Maps", SIGGRAPH 2001; P.-P.
Sloan, "Stupid Spherical Harmonics (SH) Tricks", GDC 2008; the normalised Legendre recurrence: W. Press et al., "Numerical
Recipes", 3rd ed., §6.7.
"""

from functools import cache
from math import factorial, pi, sqrt

import numpy as np

from .. import kernels

_PROJECT_CHUNK = 1 << 16


def coefficient_count(order: int) -> int:
    """Number of coefficients (L + 1)² of ``order`` L."""
    return (order + 1) ** 2


def order_of(count: int) -> int:
    """Order L of ``count`` = (L + 1)² coefficients. Raises ValueError for any other count."""
    order = round(sqrt(count)) - 1
    if order < 0 or coefficient_count(order) != count:
        raise ValueError(f"{count} is not a number of SH coefficients (1, 4, 9, …)")
    return order


def bands(order: int) -> np.ndarray:
    """Band l (k,) int of every coefficient up to ``order``."""
    return np.repeat(np.arange(order + 1), 2 * np.arange(order + 1) + 1)


def evaluate(directions: np.ndarray, order: int) -> np.ndarray:
    """Basis functions (…, (order + 1)²) at unit ``directions`` (…, 3); float32 for float32 directions, else float64.

    The memory is laid out coefficient by coefficient (a transposed view): each basis function is one contiguous array.
    """
    directions = np.asarray(directions)
    if directions.dtype != np.float32:
        directions = directions.astype(np.float64, copy=False)
    x, y, z = np.moveaxis(directions, -1, 0)
    basis = np.empty((coefficient_count(order), *directions.shape[:-1]), directions.dtype)
    (_closed_forms if order <= 2 else _recurrence)(x, y, z, order, basis)
    return np.moveaxis(basis, 0, -1)


def evaluate_rows(directions: np.ndarray, order: int) -> np.ndarray:
    """As ``evaluate`` for ``directions`` (n, 3), direction by direction in memory."""
    if order <= 2 and directions.dtype == np.float32 and kernels.is_available():
        basis = np.empty((len(directions), coefficient_count(order)), np.float32)
        kernels.call("sh_basis", len(directions), np.ascontiguousarray(directions), order, basis)
        return basis
    return np.ascontiguousarray(evaluate(directions, order))


def project(directions: np.ndarray, values: np.ndarray, solid_angles, order: int) -> np.ndarray:
    """Coefficients ((order + 1)², c) float64 of the function with ``values`` (n, c) at ``directions`` (n, 3).

    ``solid_angles`` (n,) or a scalar is the weight of each sample [sr]: 4π/n for n uniform directions.
    """
    values = np.asarray(values)
    solid_angles = np.broadcast_to(np.asarray(solid_angles, np.float64), (len(values),))
    coefficients = np.zeros((coefficient_count(order), values.shape[1]))
    for start in range(0, len(values), _PROJECT_CHUNK):
        part = slice(start, start + _PROJECT_CHUNK)
        coefficients += evaluate(directions[part], order).T @ (values[part] * solid_angles[part, None])
    return coefficients


@cache
def _cosine_coefficients(order: int) -> np.ndarray:
    per_band = np.zeros(order + 1)
    for l in range(order + 1):
        if l == 1:
            per_band[l] = 2.0 * pi / 3.0
        elif l % 2 == 0:
            sign = -1.0 if (l // 2) % 2 == 0 else 1.0
            per_band[l] = 2.0 * pi * sign / ((l + 2) * (l - 1)) * factorial(l) / (2**l * factorial(l // 2) ** 2)
    table = per_band[bands(order)].astype(np.float32)
    table.setflags(write=False)
    return table


def cosine_coefficients(order: int) -> np.ndarray:
    """A_l per coefficient ((order + 1)²,) float32: π, 2π/3, π/4, 0, −π/24, … (Ramamoorthi & Hanrahan 2001, eq. 8).

    E(n) = Σ A_l·L_lm·Y_lm(n) is the irradiance of radiance L.
    """
    return _cosine_coefficients(order)


def irradiance(coefficients: np.ndarray, normals: np.ndarray) -> np.ndarray:
    """Linear irradiance (…, n, c) of radiance ``coefficients`` (…, k, c) at every one of ``normals`` (n, 3).

    Leading dimensions broadcast as in a matrix product: normals (p, n, 3) give each of p probes its own. May be negative
    where the expansion rings.
    """
    coefficients = np.asarray(coefficients)
    order = order_of(coefficients.shape[-2])
    convolved = coefficients * cosine_coefficients(order)[:, None]
    return evaluate(normals, order) @ convolved


def quadrature(degree: int) -> tuple[np.ndarray, np.ndarray]:
    """Directions (q, 3) and solid angles (q,), float64, that integrate every SH up to band ``degree`` exactly.

    Gauss-Legendre in z times equal steps in azimuth: products of two functions of order L need ``degree`` 2L.
    """
    z, weight = np.polynomial.legendre.leggauss(degree // 2 + 1)
    steps = degree + 1
    azimuth = 2.0 * pi * (np.arange(steps) + 0.5) / steps
    ring = np.sqrt(1.0 - z * z)
    directions = np.stack([
        np.outer(ring, np.cos(azimuth)), np.outer(ring, np.sin(azimuth)), np.outer(z, np.ones(steps)),
    ], axis=-1).reshape(-1, 3)
    return directions, np.repeat(weight * (2.0 * pi / steps), steps)


def rotation_matrix(rotation: np.ndarray, order: int) -> np.ndarray:
    """Matrix M (…, k, k) float64 of ``rotation`` R (…, 3, 3), orthogonal: M @ f gives the coefficients of d ↦ f(R⁻¹d).

    M_ij = ∫ Y_i(d)·Y_j(R⁻¹d) dω, taken by an exact quadrature; bands never mix. Reflections are allowed.
    """
    rotation = np.asarray(rotation, np.float64)
    directions, solid_angles = quadrature(2 * order)
    weighted = evaluate(directions, order) * solid_angles[:, None]
    matrix = weighted.T @ evaluate(directions @ rotation, order)
    band = bands(order)
    return np.where(band[:, None] == band[None, :], matrix, 0.0)


def _closed_forms(x, y, z, order: int, basis: np.ndarray) -> None:
    """The polynomials of bands 0 to 2, written into ``basis`` (k, …)."""
    basis[0] = sqrt(1.0 / (4.0 * pi))
    if order >= 1:
        c1 = sqrt(3.0 / (4.0 * pi))
        for row, axis in ((1, y), (2, z), (3, x)):
            np.multiply(axis, c1, out=basis[row])
    if order >= 2:
        c2 = sqrt(15.0 / (4.0 * pi))
        scaled = c2 * z
        np.multiply(scaled, y, out=basis[5])
        np.multiply(scaled, x, out=basis[7])
        np.multiply(c2 * x, y, out=basis[4])
        np.multiply(z, z, out=basis[6])
        basis[6] *= 3.0 * sqrt(5.0 / (16.0 * pi))
        basis[6] -= sqrt(5.0 / (16.0 * pi))
        np.multiply(x + y, x - y, out=basis[8])
        basis[8] *= c2 / 2.0


def _recurrence(x, y, z, order: int, basis: np.ndarray) -> None:
    """Any order: Y_lm = N_lm(z)·Re or Im (x + iy)^|m|, where N_lm is the normalised Legendre function over sin^|m|θ.

    N_mm follows from N_(m−1)(m−1) and N_lm from the two bands below it, upwards in l, which is stable.
    """
    real, imaginary = np.ones_like(x), np.zeros_like(x)
    diagonal = sqrt(1.0 / (4.0 * pi))
    for m in range(order + 1):
        if m > 0:
            real, imaginary = x * real - y * imaginary, x * imaginary + y * real
            diagonal *= sqrt((2.0 * m + 1.0) / (2.0 * m))
        below, current = None, np.full_like(z, diagonal * (sqrt(2.0) if m else 1.0))
        for l in range(m, order + 1):
            if l > m:
                a = sqrt((4.0 * l * l - 1.0) / (l * l - m * m))
                following = a * z * current
                if below is not None:
                    following -= a * sqrt(((l - 1.0) ** 2 - m * m) / (4.0 * (l - 1.0) ** 2 - 1.0)) * below
                below, current = current, following
            np.multiply(current, real, out=basis[l * l + l + m])
            if m > 0:
                np.multiply(current, imaginary, out=basis[l * l + l - m])
