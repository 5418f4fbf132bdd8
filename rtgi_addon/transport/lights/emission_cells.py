"""Emissive triangles cut where their emission varies, so that a bright texel is sampled by its power and not found by luck.

Every triangle's barycentric square [0, 1)² ∋ (u, v) is a quadtree of cells; those that the edge u + v = 1 cuts are halves. A cell
is split while its share of all power times the variance within it is worth a further one, first by what its texture holds within
its bounds, where nothing can hide, and then by its emission itself at points in it.
"""

from collections.abc import Callable
from dataclasses import dataclass, fields

import numpy as np

from .texture_power import TexturePower

# Cells are at most this deep: some 8,000 along a triangle's edge.
MAX_DEPTH = 13
# A cell is split while its part of the relative variance of sampling by cells is more than this, and the most cells there are.
WORTH_A_SPLIT, MAX_CELLS = 3e-5, 1 << 16
# Rounds of splitting by the emission at POINTS² points of each cell.
ROUNDS, POINTS = 4, 4
# Cells whose points are looked up at once.
_CELLS_AT_ONCE = 1 << 14
# A cell that looks black at all of its points keeps this share of what its texture's texels around them have.
FLOOR = 0.02


@dataclass(frozen=True, eq=False)
class Cells:
    """Quadtree cells: ``triangle`` (n,) int64, in the order of whoever made them, ``level`` (n,) and ``column``, ``row`` (n,) int64
    on the grid of 2^level cells a side."""

    triangle: np.ndarray
    level: np.ndarray
    column: np.ndarray
    row: np.ndarray

    @staticmethod
    def whole(count: int) -> "Cells":
        """One cell for each of ``count`` triangles."""
        none = np.zeros(count, np.int64)
        return Cells(np.arange(count), none, none, none)

    @property
    def is_half(self) -> np.ndarray:
        """(n,) bool: cells on the triangle's long side, of which the half towards the corner counts."""
        return self.column + self.row == (1 << self.level) - 1

    @property
    def share(self) -> np.ndarray:
        """Share (n,) float64 of the triangle's area."""
        return np.where(self.is_half, 1.0, 2.0) * 4.0 ** -self.level

    @property
    def key(self) -> np.ndarray:
        """(n,) int64: where the cell begins along a Z-order curve through all triangles at MAX_DEPTH."""
        return (self.triangle << 2 * MAX_DEPTH) | (interleaved(self.column, self.row) << 2 * (MAX_DEPTH - self.level))

    def take(self, rows) -> "Cells":
        """The given rows."""
        return Cells(*(getattr(self, item.name)[rows] for item in fields(self)))

    def split(self) -> "Cells":
        """The quarters of every cell, without those beyond the long side."""
        parts = [Cells(self.triangle, self.level + 1, 2 * self.column + x, 2 * self.row + y) for y in (0, 1) for x in (0, 1)]
        parts[3] = parts[3].take(~self.is_half)
        return joined(parts)

    def corners(self) -> tuple[np.ndarray, np.ndarray]:
        """Lowest and highest (u, v) (n, 2) of each."""
        side = 0.5**self.level
        low = np.stack([self.column * side, self.row * side], axis=1)
        return low, low + side[:, None]

    def place(self, x: np.ndarray, y: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Embree's u, v (n,) float32 of places (x, y) (n,) in [0, 1)², uniform over each cell's area."""
        beyond = self.is_half & (x + y > 1.0)
        x, y = np.where(beyond, 1.0 - x, x), np.where(beyond, 1.0 - y, y)
        side = 0.5**self.level
        return ((self.column + x) * side).astype(np.float32), ((self.row + y) * side).astype(np.float32)


def joined(parts: list[Cells]) -> Cells:
    """All cells of ``parts``."""
    return Cells(*(np.concatenate([getattr(part, item.name) for part in parts]) for item in fields(Cells)))


def interleaved(column: np.ndarray, row: np.ndarray) -> np.ndarray:
    """Z-order codes (n,) int64 of places on a grid of up to 2^16 cells a side."""
    code = np.zeros(len(column), np.int64)
    for bit in range(MAX_DEPTH):
        code |= ((column >> bit) & 1) << 2 * bit | ((row >> bit) & 1) << 2 * bit + 1
    return code


def cell_key(triangle: np.ndarray, u: np.ndarray, v: np.ndarray) -> np.ndarray:
    """The key (n,) of the finest cell at u, v (n,) of ``triangle`` (n,): not before the cell around it, and before the next."""
    side = 1 << MAX_DEPTH
    column = np.clip((u.astype(np.float64) * side).astype(np.int64), 0, side - 1)
    row = np.clip((v.astype(np.float64) * side).astype(np.int64), 0, side - 1 - column)
    return (triangle << 2 * MAX_DEPTH) | interleaved(column, row)


def by_texture(cells: Cells, areas: np.ndarray, power: TexturePower, uv: np.ndarray) -> tuple[Cells, np.ndarray]:
    """``cells`` split where ``power`` varies, and its mean (m,) over the bounds of each of them. ``areas`` (t,) of the triangles,
    ``uv`` (t, 3, 2) of their corners."""
    settled, means = [], []
    total = None
    while True:
        low, high = cells.corners()
        origin, first, second = (uv[cells.triangle, corner] for corner in range(3))
        a, b = first - origin, second - origin
        ends = np.stack([origin + a * x[:, None] + b * y[:, None] for x, y in (
            (low[:, 0], low[:, 1]), (high[:, 0], low[:, 1]), (low[:, 0], high[:, 1]), (high[:, 0], high[:, 1]))])
        # Halves have no corner beyond the long side.
        ends[3] = np.where(cells.is_half[:, None], ends[0], ends[3])
        low, high = ends.min(axis=0), ends.max(axis=0)
        mean, square = power.moments(low, high)
        flux = mean * cells.share * areas[cells.triangle]
        total = flux.sum() if total is None else total
        variance = np.maximum(square / np.maximum(mean * mean, 1e-300) - 1.0, 0.0)
        split = (cells.level < MAX_DEPTH) & np.any(high - low > power.texel, axis=1)
        worth = _worth(np.where(split, flux * variance, 0.0) / max(total, 1e-300), len(cells.level) + sum(map(len, means)))
        settled.append(cells.take(~worth))
        means.append(mean[~worth])
        if not worth.any():
            return joined(settled), np.concatenate(means)
        cells = cells.take(worth).split()


def by_emission(cells: Cells, areas: np.ndarray, expected: np.ndarray, emitted: Callable) -> tuple[Cells, np.ndarray]:
    """``cells`` split where their emission varies, and its mean luminance (m,). ``emitted(triangle, u, v)`` is the luminance (k,)
    at points; ``expected`` (n,) what it is thought to be, which a cell that looks black keeps a little of."""
    mean, variance = _sampled(cells, emitted)
    mean = np.maximum(mean, FLOOR * expected)
    for _ in range(ROUNDS):
        flux = mean * cells.share * areas[cells.triangle]
        worth = _worth(np.where(cells.level < MAX_DEPTH, flux * variance, 0.0) / max(flux.sum(), 1e-300) / POINTS**2, len(mean))
        if not worth.any():
            break
        parts = cells.take(worth).split()
        floor = FLOOR * _of_parents(parts, cells.take(worth), mean[worth])
        part_mean, part_variance = _sampled(parts, emitted)
        cells = joined([cells.take(~worth), parts])
        mean = np.concatenate([mean[~worth], np.maximum(part_mean, floor)])
        variance = np.concatenate([variance[~worth], part_variance])
    return cells, mean


def _worth(gain: np.ndarray, count: int) -> np.ndarray:
    """(n,) bool: cells to split by what each adds to the relative variance (n,), of ``count`` in all; the most worthwhile ones, and
    no more than half of what there is room for, since the next level may need it more."""
    worth = gain > WORTH_A_SPLIT
    most = max(0, MAX_CELLS - count) // 6
    if worth.sum() > most:
        worth &= gain > np.partition(gain, len(gain) - most - 1)[len(gain) - most - 1]
    return worth


def _of_parents(parts: Cells, parents: Cells, values: np.ndarray) -> np.ndarray:
    """``values`` (n,) of the ``parents`` for each of their ``parts``."""
    order = np.argsort(parents.key)
    return values[order][np.searchsorted(parents.key[order], parts.key, side="right") - 1]


def _sampled(cells: Cells, emitted: Callable) -> tuple[np.ndarray, np.ndarray]:
    """Mean (n,) and relative variance (n,) of the luminance at POINTS² points in each cell."""
    n, count = len(cells.level), POINTS * POINTS
    grid = (np.arange(POINTS) + 0.5) / POINTS
    x, y = (coordinate.reshape(-1) for coordinate in np.meshgrid(grid, grid))
    values = np.empty((n, count))
    for start in range(0, n, _CELLS_AT_ONCE):
        some = cells.take(slice(start, start + _CELLS_AT_ONCE))
        size = len(some.level)
        repeated = some.take(np.repeat(np.arange(size), count))
        u, v = repeated.place(np.tile(x, size), np.tile(y, size))
        values[start:start + size] = emitted(repeated.triangle, u, v).reshape(size, count)
    mean = values.mean(axis=1)
    return mean, values.var(axis=1) / np.maximum(mean * mean, 1e-300)
