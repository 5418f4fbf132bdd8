"""Where walls of few cells stand, which a filtered hierarchy cannot tell what is before them from what is behind.

A coarse cell that such a wall passes through holds ceiling and floor of both sides, and each of its faces shows their mean; no
directions keep those apart, for both look the same way. A wall is a front that looks one way along an axis and, next on the same
column of cells, one that looks the other way: what is between is its inside. (What faces itself, as a corridor's walls do, is
none.) It matters where more fronts look one and the same way across it before it and behind it. Samples that would read cells which
are wide for such walls among them go to finer ones; outer walls with nothing behind them stay as they are.
"""

from typing import NamedTuple

import numpy as np

# Of a cell's face such a share must be a front for it to be a wall's: slanted walls share columns among few cells.
_FRONT = 0.2
# Cells are read that are up to so many times as wide as the walls among them are thick, and cells of this side in any case: what
# is thinner is better told apart by narrower cones, but those see less of all else.
WIDTHS, LEAST = 2, 4


class Walls(NamedTuple):
    """Sides of walls: cells at ``place`` (w, 3) (x, y, z), the ``axis`` (w,) across which the wall stands, its ``first`` and
    ``last`` (w,) cell along that. ``fronts``: cells (f, 3) and ``faces`` (f,) of all that shows a front."""

    place: np.ndarray
    axis: np.ndarray
    first: np.ndarray
    last: np.ndarray
    fronts: np.ndarray
    faces: np.ndarray

    @property
    def thickness(self) -> np.ndarray:
        """(w,) int64: of the wall, in cells."""
        return self.last - self.first + 1


def find_walls(place: np.ndarray, fronts: np.ndarray) -> Walls:
    """The walls among cells at ``place`` (m, 3), of whose six faces the shares ``fronts`` (m, 6) show the front of a surface."""
    found, (rows, faces) = [np.zeros((0, 6), np.int64)], np.nonzero(fronts > _FRONT)
    for axis in range(3):
        low, high = fronts[:, 2 * axis] > _FRONT, fronts[:, 2 * axis + 1] > _FRONT
        there = np.flatnonzero(low | high)
        first, second = place[there, (axis + 1) % 3], place[there, (axis + 2) % 3]
        there = there[np.lexsort((place[there, axis], first, second))]
        # What is within one cell.
        alone = there[low[there] & high[there]]
        near, far = there[:-1], there[1:]
        same = np.all(np.delete(place[near], axis, axis=1) == np.delete(place[far], axis, axis=1), axis=1)
        pair = same & low[near] & ~high[near] & high[far]
        near, far = near[pair], far[pair]
        for side, begin, end in ((alone, alone, alone), (near, near, far), (far, near, far)):
            found.append(np.column_stack([place[side], np.full(len(side), axis), place[begin, axis], place[end, axis]]))
    found = np.concatenate(found)
    return Walls(found[:, :3], found[:, 3], found[:, 4], found[:, 5], place[rows], faces)


def too_wide(walls: Walls, size: int, shape: tuple[int, int, int]) -> np.ndarray:
    """(nz·ny·nx,) bool of a level of cells of side ``size`` in an array of ``shape`` (nz, ny, nx) with an empty layer around: where
    the cell, or one of the seven up, is too wide for the walls in it."""
    result, strides = np.zeros(int(np.prod(shape)), bool), np.array([1, shape[2], shape[1] * shape[2]])
    thin = np.maximum(walls.thickness * WIDTHS, LEAST) < size
    for axis in range(3):
        rows = np.flatnonzero(thin & (walls.axis == axis))
        if not rows.size:
            continue
        at, first, last = (walls.place[rows] // size + 1) @ strides, walls.first[rows], walls.last[rows]
        # Where most of what stands across the axis is thin: a block is so at its edges alone.
        across = (walls.place[walls.axis == axis] // size + 1) @ strides
        mostly = 2 * _sum(at, shape) >= _sum(across, shape)
        for face in range(6):
            if face // 2 == axis:
                continue
            fronts = walls.fronts[walls.faces == face]
            least, most = _spread((fronts // size + 1) @ strides, fronts[:, axis], shape)
            for corner in range(8):
                # A wall's cell is one of eight in each of eight samples.
                sample = at - np.array([corner & 1, corner >> 1 & 1, corner >> 2]) @ strides
                result[sample[mostly[sample] & (least[sample] < first) & (most[sample] > last)]] = True
    return result


def _spread(at: np.ndarray, values: np.ndarray, shape: tuple[int, int, int]) -> tuple[np.ndarray, np.ndarray]:
    """Least and largest (nz·ny·nx,) of ``values`` (f,) in cells with the indices ``at`` (f,), and the seven up from each."""
    ends = []
    for extreme, none in ((np.minimum, np.iinfo(np.int64).max), (np.maximum, np.iinfo(np.int64).min)):
        found = np.full(int(np.prod(shape)), none)
        extreme.at(found, at, values)
        found = found.reshape(shape)
        for axis in range(3):
            here, up = (np.moveaxis(found, axis, 0)[part] for part in (slice(None, -1), slice(1, None)))
            here[...] = extreme(here, up.copy())
        ends.append(found.ravel())
    return tuple(ends)


def _sum(at: np.ndarray, shape: tuple[int, int, int]) -> np.ndarray:
    """How many (nz·ny·nx,) of ``at`` (f,) are in each cell and the seven up from it."""
    found = np.bincount(at, minlength=int(np.prod(shape))).reshape(shape)
    for axis in range(3):
        here, up = (np.moveaxis(found, axis, 0)[part] for part in (slice(None, -1), slice(1, None)))
        here += up.copy()
    return found.ravel()
