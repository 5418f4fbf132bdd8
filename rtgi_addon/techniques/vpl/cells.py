"""Voronoi cells in a lamp's domain, counted by samples: which point is the nearest to each, and where the largest holes are."""

from itertools import product

import numpy as np

from ...transport.parallel import chunks
from ...transport.vectors import dot

# Points that a cell of the search grid is to hold, about.
_OCCUPANCY = 2.0
# Cells of the search grid along its longest side.
_MAX_SIDE = 96
# Distances that are held at once where samples are far from every point.
_PAIRS = 1 << 20
_AROUND = list(product((-1, 0, 1), repeat=3))


class Cells:
    """The nearest of ``points`` (n, 3) to each of ``samples`` (k, 3): its index ``owner`` (k,).

    With ``known``, an older instance for the same samples, and ``kept``, the indices of its points that ``points`` consists of,
    only the samples of points that are gone look for another.
    """

    def __init__(self, samples: np.ndarray, points: np.ndarray, known: "Cells | None" = None, kept: np.ndarray | None = None):
        self.samples, self.points = samples, points
        if known is None:
            self.owner, self._squared = nearest(samples, points)
            return
        number = np.full(len(known.points), -1, np.int64)
        number[kept] = np.arange(len(kept))
        self.owner, self._squared = number[known.owner], known._squared.copy()
        rows = np.flatnonzero(self.owner < 0)
        self.owner[rows], self._squared[rows] = nearest(samples[rows], points)

    def fill(self, count: int) -> np.ndarray:
        """Make ``count`` samples points, one after the other that which lies farthest from all; their indices (count,)."""
        taken = np.empty(count, np.int64)
        for i in range(count):
            taken[i] = self._squared.argmax()
            squared = _squared(self.samples, self.samples[taken[i]])
            nearer = squared < self._squared
            self.owner[nearer], self._squared[nearer] = len(self.points) + i, squared[nearer]
        self.points = np.concatenate([self.points, self.samples[taken]])
        return taken


def nearest(samples: np.ndarray, points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Index (k,) int64 of the nearest of ``points`` (n, 3) to each of ``samples`` (k, 3), and its squared distance (k,) float32."""
    owner, squared = np.zeros(len(samples), np.int64), np.full(len(samples), np.inf, np.float32)
    low = points.min(axis=0)
    extent = max(float((points.max(axis=0) - low).max()), 1e-12)
    # Points lie on a surface: as many cells as there are points make a grid of their square root along a side.
    side = int(np.clip(np.sqrt(len(points) / _OCCUPANCY), 1, _MAX_SIDE))
    width = extent / side
    of_point = np.clip((points - low) / width, 0, side - 1).astype(np.int64) + 1
    shape = (side + 2,) * 3
    flat = np.ravel_multi_index(tuple(of_point.T), shape)
    order = np.argsort(flat, kind="stable")
    count = np.bincount(flat, minlength=np.prod(shape)).astype(np.int32)
    start = (np.cumsum(count) - count).astype(np.int32)
    base = np.ravel_multi_index(tuple((np.clip((samples - low) / width, 0, side - 1).astype(np.int64) + 1).T), shape)
    for step in _AROUND:
        cell = base + (step[0] * shape[1] + step[1]) * shape[2] + step[2]
        rows = np.flatnonzero(count[cell])
        turn = 0
        while rows.size:
            candidate = order[start[cell[rows]] + turn]
            distance = _squared(samples[rows], points[candidate])
            nearer = distance < squared[rows]
            owner[rows[nearer]], squared[rows[nearer]] = candidate[nearer], distance[nearer]
            turn += 1
            rows = rows[count[cell[rows]] > turn]
    # Farther than a cell away there may be a nearer one beyond those that were looked at.
    rows = np.flatnonzero(squared > np.float32(width * width))
    for span in chunks(len(rows), max(1, _PAIRS // len(points))):
        far = rows[span]
        distance = sum(np.square(samples[far, axis, None] - points[:, axis]) for axis in range(3))
        owner[far] = distance.argmin(axis=1)
        squared[far] = distance[np.arange(len(far)), owner[far]]
    return owner, squared


def _squared(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Squared distances (k,) of points ``a`` (k, 3) from ``b`` (k, 3) or (3,)."""
    return dot(a - b, a - b)
