"""Tiles of distances from what rays found in their cells."""

from functools import cache

import numpy as np

from ...numerics import octahedral

# What a cell of a probe's tile takes from those around it: by the cosine to this power, and so little that it counts only where the
# cell has no ray of its own.
SPREAD_POWER, SPREAD_WEIGHT = 64, 1e-4
# Less than this share of a cell is none: what is denormal in float32 would take fifteen times as long and say nothing.
LEAST_SPREAD = 1e-30


def mean_distances(sums: np.ndarray, weight: np.ndarray, resolution: int) -> np.ndarray:
    """Mean and mean squared distance (p, T², 2) from ``sums`` (p, T², 2) over the rays in each cell of a tile of ``resolution`` T
    and their numbers ``weight`` (p, T²)."""
    around = _spread(resolution)
    # Probe by probe: OpenBLAS starts threads of its own for larger products, which wait for each other longer than they work.
    spread = weight + np.matmul(around, weight[:, :, None])[:, :, 0]
    return (sums + np.matmul(around, sums)) / np.maximum(spread, LEAST_SPREAD)[:, :, None]


@cache
def _spread(resolution: int) -> np.ndarray:
    """What each cell of a tile of ``resolution`` T adds to each other (T², T²) float32."""
    directions = octahedral.texel_directions(resolution).reshape(-1, 3)
    around = np.maximum(directions @ directions.T, 0) ** SPREAD_POWER * SPREAD_WEIGHT
    return np.where(around < LEAST_SPREAD, 0.0, around).astype(np.float32)
