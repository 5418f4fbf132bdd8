"""One-dimensional densities as tables: cells of equal width, sampled by inverting their sums."""

import numpy as np

CELLS = 2048
# No cell is left out, however dim: what its middle misses may lie at its edge. It has this share of the brightest at least.
_DIMMEST = 1e-4


def cumulated(profile: np.ndarray) -> np.ndarray:
    """Sums (cells + 1,) from 0 to 1 over ``profile`` (cells,), the density in the middle of each cell."""
    profile = profile + _DIMMEST * profile.max()
    return np.concatenate([[0.0], np.cumsum(profile)]) / profile.sum()


def invert(edges: np.ndarray, cdf: np.ndarray, u: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Values (n,) float64 with the piecewise constant density of ``cdf`` over ``edges``, and that density (n,)."""
    u = u.astype(np.float64)
    cell = np.clip(np.searchsorted(cdf, u, side="right") - 1, 0, len(edges) - 2)
    width, mass = edges[cell + 1] - edges[cell], cdf[cell + 1] - cdf[cell]
    return edges[cell] + width * (u - cdf[cell]) / mass, mass / width
