"""The four numbers a colour that a texel holds: SH of order 1 of the radiance that arrives there, made exact for its own normal.

From a surface half of all directions are hidden, and a band limit of 1 turns that edge into an error of several per cent. So the
coefficients c are moved by the least that gives E(n̄) = Σ A_l·c_lm·Y_lm(n̄) = E of the rays for the texel's mean normal n̄:
c ← c + w·(E − w·c)/(w·w) with w_lm = A_l·Y_lm(n̄). All of it is linear in the light. Other normals, of a normal map say, are read
with the error of order 1, as directional lightmaps of Frostbite and Unity are (Y. O'Donnell, "Precomputed Global Illumination in
Frostbite", GDC 2018).
"""

import numpy as np

from ...numerics import sh

ORDER = 1
COUNT = sh.coefficient_count(ORDER)
# Directions nearer to the horizon than this cosine count in the coefficients as if they were so far above it: their share of what
# falls on the surface is nothing, that of their noise is not.
LEAST_COSINE = 0.02


def irradiance_weights(normals: np.ndarray) -> np.ndarray:
    """(n, COUNT): what irradiance under unit ``normals`` (n, 3) takes of each coefficient."""
    bands = np.array([np.pi, 2.0 * np.pi / 3.0])[sh.bands(ORDER)]
    return sh.evaluate(np.asarray(normals, np.float64), ORDER) * bands


def exact_for(coefficients: np.ndarray, normals: np.ndarray, irradiance: np.ndarray) -> np.ndarray:
    """``coefficients`` (n, COUNT, c) moved by the least that makes irradiance under ``normals`` (n, 3) be ``irradiance`` (n, c)."""
    weights = irradiance_weights(normals)
    missing = irradiance - np.einsum("nk,nkc->nc", weights, coefficients)
    return coefficients + weights[:, :, None] * (missing / np.sum(weights**2, axis=1)[:, None])[:, None]


def projected(directions: np.ndarray, irradiance: np.ndarray, cosine: np.ndarray) -> np.ndarray:
    """(n, COUNT, 3): what ``irradiance`` (n, 3) from ``directions`` (n, 3), under ``cosine`` (n,) to the surface, has of each
    coefficient."""
    radiance = irradiance / np.maximum(cosine, np.float32(LEAST_COSINE))[:, None]
    return sh.evaluate(directions, ORDER)[:, :, None] * radiance[:, None]
