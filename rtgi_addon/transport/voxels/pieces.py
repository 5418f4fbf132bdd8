"""Parts of triangles in cells that lines hardly meet, cut out exactly: rods and blades, and corners that surfaces cut off cells.

Lines at distances miss what is thinner, and find by chance what it blocks. So where few lines meet anything, every cell that a
triangle touches (`touched`) holds what of it lies there, cut to the cell's six planes (I. Sutherland and G. Hodgman, "Reentrant
Polygon Clipping", Communications of the ACM 17(1), 1974), in the triangle's own barycentrics: areas of all parts sum to its own.
"""

from typing import NamedTuple

import numpy as np

from .crossings import TIE, extremes
from .grid import VoxelGrid
from .touched import touched_cells

# What is smaller, in faces of a cell, is left out.
_NOTHING = 1e-5
# Corners that a triangle has at most when it is cut by six planes.
_CORNERS = 9


class Pieces(NamedTuple):
    """Parts of triangles in cells: the flat indices ``cell`` (p,) int64, the triangle, ``primitive`` (p,) int32, which ``share``
    (p,) float64 of its area each is, and its centre as Embree's ``u``, ``v`` (p,) float32 and as ``place`` (p, 3) float64, in cells
    from the cell's centre."""

    cell: np.ndarray
    primitive: np.ndarray
    share: np.ndarray
    u: np.ndarray
    v: np.ndarray
    place: np.ndarray

    def take(self, rows: np.ndarray) -> "Pieces":
        """Those of ``rows``."""
        return Pieces(*(part[rows] for part in self))

    def places(self, lines: int) -> list[np.ndarray]:
        """As Crossings.places, whatever ``lines`` there were."""
        return list(self.place.T)

    def and_also(self, others: "Pieces") -> "Pieces":
        """These and the ``others``."""
        return Pieces(*(np.concatenate(pair) for pair in zip(self, others, strict=True)))


class Touching(NamedTuple):
    """Where what lines tell is not enough: ``sparse`` (nz·ny·nx,) bool; and of triangles that reach into such cells which ``row``
    (p,) of the triangles touches which ``cell`` (p, 3) int64."""

    sparse: np.ndarray
    row: np.ndarray
    cell: np.ndarray


def find_sparse(grid: VoxelGrid, corners: np.ndarray, met: np.ndarray, few: np.ndarray, spacing: float) -> Touching:
    """Of triangles with ``corners`` (3 axes, 3 corners, t) float64 in cells from the corner of ``grid`` those in cells that lines
    have not ``met`` (nz·ny·nx,) bool, or of which ``few`` (nz·ny·nx,) bool have met anything where a triangle is thinner than their
    ``spacing`` in cells, and longer."""
    size = np.reshape(grid.resolution, (3, 1))
    low, high = (np.stack(edges) for edges in zip(*(extremes(axis) for axis in corners), strict=True))
    first = np.clip(np.floor(low + TIE).astype(np.int64), 0, size - 1)
    last = np.clip(np.floor(high + TIE).astype(np.int64), 0, size - 1)
    empty = (~met | few).reshape(grid.shape)
    rows = np.flatnonzero(_any(empty, first, last))
    chosen = _settled(corners[:, :, rows])
    parts = list(touched_cells(chosen, (0, 0, 0), grid.resolution))
    row, cell = (np.concatenate([part[index] for part in parts]) if parts else np.zeros((0, *shape), np.int64)
                 for index, shape in enumerate(((), (3,))))
    flat = (cell[:, 2] * grid.resolution[1] + cell[:, 1]) * grid.resolution[0] + cell[:, 0]
    edges = np.linalg.norm(chosen - np.roll(chosen, -1, axis=1), axis=2).max(axis=1)
    width = 2.0 * _area(chosen) / np.maximum(edges, np.finfo(np.float64).tiny)
    thin = (width < spacing) & (edges > spacing)
    sparse = np.zeros(grid.count, bool)
    sparse[flat[~met[flat] | (few[flat] & thin[row])]] = True
    reaches = np.zeros(len(rows), bool)
    reaches[row[sparse[flat]]] = True
    kept = np.flatnonzero(reaches[row])
    return Touching(sparse, rows[row[kept]], cell[kept])


def cut(grid: VoxelGrid, corners: np.ndarray, primitive: np.ndarray, touching: Touching, met: np.ndarray) -> Pieces:
    """Of triangles with ``corners`` (3 axes, 3 corners, t), called ``primitive`` (t,), all that lies in sparse cells; and of those
    that reach into any such cell and are not ``met`` (t,) bool elsewhere, what lies in other cells as well."""
    cell = touching.cell
    flat = (cell[:, 2] * grid.resolution[1] + cell[:, 1]) * grid.resolution[0] + cell[:, 0]
    kept = np.flatnonzero(touching.sparse[flat] | ~met[touching.row])
    row, flat, cell = touching.row[kept], flat[kept], cell[kept]
    chosen = _settled(corners[:, :, row])
    within = chosen - cell[:, None]
    share, uv, center = np.ones(len(row)), np.full((len(row), 2), 1.0 / 3.0), within.mean(axis=1)
    across = np.flatnonzero(((within < 0) | (within > 1)).any(axis=(1, 2)))
    share[across], uv[across], center[across] = _cut(within[across])
    kept = share * _area(chosen) > _NOTHING
    # What is left out is made up for by the rest.
    whole, left = (np.bincount(row, weight, len(primitive)) for weight in (share, share * kept))
    share *= (whole / np.where(left > 0, left, 1.0))[row]
    return Pieces(flat, primitive[row], share, *uv.astype(np.float32).T, center - 0.5).take(np.flatnonzero(kept))


def undivided(grid: VoxelGrid, corners: np.ndarray, primitive: np.ndarray) -> Pieces:
    """Triangles with ``corners`` (3 axes, 3 corners, t), called ``primitive`` (t,), each as one piece in the cell of its middle, of
    those that have it in ``grid``: they are small."""
    middle = corners.mean(axis=1).T
    column = np.floor(middle + TIE).astype(np.int64)
    rows = np.flatnonzero(((column >= 0) & (column < grid.resolution)).all(axis=1))
    column, third = column[rows], np.full(len(rows), 1.0 / 3.0, np.float32)
    cell = (column[:, 2] * grid.resolution[1] + column[:, 1]) * grid.resolution[0] + column[:, 0]
    return Pieces(cell, primitive[rows], np.ones(len(rows)), third, third, middle[rows] - column - 0.5)


def _settled(corners: np.ndarray) -> np.ndarray:
    """``corners`` (3 axes, 3 corners, t) as (t, 3 corners, 3), of which a plane between two cells belongs to the upper one."""
    low, high = (np.stack(edges) for edges in zip(*(extremes(axis) for axis in corners), strict=True))
    return np.moveaxis(corners + np.where(high - low < TIE, TIE, 0.0)[:, None], 2, 0).swapaxes(1, 2)


def _area(corners: np.ndarray) -> np.ndarray:
    """(t,) of triangles with ``corners`` (t, 3, 3)."""
    return 0.5 * np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1)


def _any(cells: np.ndarray, first: np.ndarray, last: np.ndarray) -> np.ndarray:
    """(t,) bool: whether any of the ``cells`` (nz, ny, nx) bool between ``first`` and ``last`` (3, t), both included, is True."""
    total = np.zeros(tuple(extent + 1 for extent in cells.shape), np.int32)
    total[1:, 1:, 1:] = np.cumsum(np.cumsum(np.cumsum(cells, axis=0, dtype=np.int32), axis=1), axis=2)
    (ax, ay, az), (bx, by, bz) = first, last + 1
    return (total[bz, by, bx] - total[az, by, bx] - total[bz, ay, bx] - total[bz, by, ax]
            + total[az, ay, bx] + total[az, by, ax] + total[bz, ay, ax] - total[az, ay, ax]) > 0


def _cut(corners: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Of triangles with ``corners`` (p, 3 corners, 3) the share (p,) of the area that lies in the cell from 0 to 1, and the middle
    of that as barycentrics (p, 2) and as a place (p, 3)."""
    count = len(corners)
    points, number = np.zeros((count, _CORNERS, 5)), np.full(count, 3)
    points[:, :3, :3], points[:, 1, 3], points[:, 2, 4] = corners, 1.0, 1.0
    for axis in range(3):
        for end in (0.0, 1.0):
            before = points[:, :, axis] if end == 0.0 else 1.0 - points[:, :, axis]
            rows = np.flatnonzero((before < 0).any(axis=1) & (number > 0))
            if rows.size:
                points[rows], number[rows] = _cut_off(points[rows], number[rows], before[rows])
    u, v = points[:, :, 3], points[:, :, 4]
    u, v = u - u[:, :1], v - v[:, :1]
    real = np.arange(_CORNERS - 1) + 1 < number[:, None] - 1
    fan = np.where(real, u[:, 1:] * np.roll(v[:, 1:], -1, axis=1) - v[:, 1:] * np.roll(u[:, 1:], -1, axis=1), 0.0)
    share = fan.sum(axis=1)
    weight = fan / np.where(share > 0, share, 1.0)[:, None]
    thirds = (points[:, :1] + points[:, 1:] + np.roll(points[:, 1:], -1, axis=1)) / 3.0
    center = np.einsum("pk,pkc->pc", weight, thirds)
    return share, center[:, 3:], center[:, :3]


def _cut_off(points: np.ndarray, number: np.ndarray, before: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Polygons of the first ``number`` (p,) of ``points`` (p, k, 5), without what is ``before`` (p, k) a plane by less than 0."""
    rows, index = np.arange(len(points))[:, None], np.arange(_CORNERS)
    after = np.where(index + 1 < number[:, None], index + 1, 0)
    real, following = index < number[:, None], before[rows, after]
    inside = real & (before >= 0)
    crossed = real & ((before >= 0) != (following >= 0))
    way = before / np.where(crossed, before - following, 1.0)
    between = points + way[:, :, None] * (points[rows, after] - points)
    both = np.stack([points, between], axis=2).reshape(len(points), 2 * _CORNERS, -1)
    kept = np.stack([inside, crossed], axis=2).reshape(len(points), 2 * _CORNERS)
    order = np.argsort(~kept, axis=1, kind="stable")[:, :_CORNERS]
    return both[rows, order], np.minimum(kept.sum(axis=1), _CORNERS)
