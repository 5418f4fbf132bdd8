"""Points on surfaces into cells: what a map of what a lamp sees lights, and how much of a cell's faces a camera sees filled.

A point stands for a piece of its surface. Each face of its cell that looks the way its normal does shows that piece by what it
covers of the face, dA·|nₐ|/s²: put in with its area, points say how much of a cell's lines they block; with the flux that it
reflects, Φ/π, what the face shows of its light.

Source: A. Kaplanyan and C. Dachsbacher, "Cascaded Light Propagation Volumes for Real-Time Indirect Illumination", I3D 2010, and
the lecture's injection of reflective shadow maps and camera points. Apart from it: they move points by half a cell along
their normals, so that light starts before its surface; here light belongs to faces, and stays in the cell that its surface is in.
"""

import numpy as np

from .crossings import TIE
from .grid import FACES, VoxelGrid

# Where points are looked for whose cell is empty, in cells: rounding puts some beyond their surface, and where it cuts a corner or
# an edge off a cell, lines may find it in that cell's neighbours alone.
_ROUNDING, _CUT = 1e-3, 0.25


def inject(grid: VoxelGrid, row: np.ndarray, positions: np.ndarray, normals: np.ndarray, amount: np.ndarray) -> np.ndarray:
    """(r, 6, c) float64: what faces show of points at ``positions`` (n, 3) [m] on surfaces with unit ``normals`` (n, 3), each of
    which holds ``amount`` (n, c), per face area. ``row`` (count,) int32 is where a cell is in the result, less than 0 for cells
    that take nothing in; what falls there is left out."""
    place, at = grid.cells_of(positions), np.full(len(positions), -1, np.int64)
    turns = [end * _CUT * turn for turn in np.eye(3) for end in (-1.0, 1.0)]
    for along, aside in ((0.0, 0.0), (-_ROUNDING, 0.0), (_ROUNDING, 0.0), *((0.0, turn) for turn in turns)):
        missing = np.flatnonzero(at < 0)
        column = np.floor(place[missing] + along * normals[missing] + aside + TIE).astype(np.int64)
        within = np.all((column >= 0) & (column < grid.resolution), axis=1)
        x, y, z = np.where(within[:, None], column, 0).T
        at[missing] = np.where(within, row[(z * grid.resolution[1] + y) * grid.resolution[0] + x], -1)
    known = np.flatnonzero(at >= 0)
    count, normal = FACES * (int(row.max(initial=-1)) + 1), np.asarray(normals, np.float64)[known]
    total = np.zeros((count, amount.shape[1]))
    for axis in range(3):
        # A face is seen by who looks against its normal.
        face = FACES * at[known] + 2 * axis + (normal[:, axis] > 0)
        share = np.abs(normal[:, axis]) / grid.cell**2
        for channel, values in enumerate(np.asarray(amount, np.float64)[known].T):
            total[:, channel] += np.bincount(face, share * values, count)
    return total.reshape(-1, FACES, amount.shape[1])
