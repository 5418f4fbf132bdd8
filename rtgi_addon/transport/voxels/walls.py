"""Where walls of few cells stand, which a filtered hierarchy cannot tell what is before them from what is behind.

A coarse cell that such a wall passes through holds ceiling and floor of both sides, and each of its faces shows their mean; no
directions keep those apart, for both look the same way. A wall is a front that looks one way along an axis and, next on the same
column of cells, one that looks the other way: what is between is its inside. (What faces itself, as a corridor's walls do, is
none.) Samples that would read cells which are wide for the walls among them go to finer ones.
"""

from typing import NamedTuple

import numpy as np

# Of a cell's face such a share must be a front for it to be a wall's: slanted walls share columns among few cells.
_FRONT = 0.2
# Cells are read that are up to so many times as wide as the walls among them are thick, and cells of this side in any case: what
# is thinner is better told apart by narrower cones, but those see less of all else.
WIDTHS, LEAST = 2, 4


class Walls(NamedTuple):
    """Cells at ``place`` (w, 3) (x, y, z) that hold a side of a wall, and how thick it is there, ``thickness`` (w,) int64, in
    cells."""

    place: np.ndarray
    thickness: np.ndarray


def find_walls(place: np.ndarray, fronts: np.ndarray) -> Walls:
    """The walls among cells at ``place`` (m, 3), of whose six faces the shares ``fronts`` (m, 6) show the front of a surface."""
    places, thicknesses = [np.zeros((0, 3), np.int64)], [np.zeros(0, np.int64)]
    for axis in range(3):
        low, high = fronts[:, 2 * axis] > _FRONT, fronts[:, 2 * axis + 1] > _FRONT
        rows = np.flatnonzero(low | high)
        first, second = place[rows, (axis + 1) % 3], place[rows, (axis + 2) % 3]
        rows = rows[np.lexsort((place[rows, axis], first, second))]
        # What is within one cell.
        alone = rows[low[rows] & high[rows]]
        near, far = rows[:-1], rows[1:]
        same = np.all(np.delete(place[near], axis, axis=1) == np.delete(place[far], axis, axis=1), axis=1)
        pair = same & low[near] & ~high[near] & high[far]
        near, far = near[pair], far[pair]
        thick = place[far, axis] - place[near, axis] + 1
        places += [place[alone], place[near], place[far]]
        thicknesses += [np.ones(len(alone), np.int64), thick, thick]
    return Walls(np.concatenate(places), np.concatenate(thicknesses))


def too_wide(walls: Walls, size: int, shape: tuple[int, int, int]) -> np.ndarray:
    """(nz·ny·nx,) bool of a level of cells of side ``size`` in an array of ``shape`` (nz, ny, nx) with an empty layer around: where
    the cell, or one of the seven up, is too wide for the walls in it."""
    result = np.zeros(shape, bool)
    x, y, z = (walls.place[np.maximum(walls.thickness * WIDTHS, LEAST) < size] // size + 1).T
    result[z, y, x] = True
    for axis in range(3):
        here, up = (np.moveaxis(result, axis, 0)[part] for part in (slice(None, -1), slice(1, None)))
        here |= up.copy()
    return result.ravel()
