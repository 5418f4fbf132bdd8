"""Where lines along the axes meet triangles: a regular bundle of k×k lines through every column of cells, along x, y and z.

Each triangle is scan-converted three times, as by a rasterizer that looks along an axis (the lecture's sweep of maximum projection
takes the dominant one only). A line meets exactly one of two triangles that share an edge: the same end points give the same
crossing of a row of lines, to the bit. So a sheet that spans a column is met by all of its lines, however it is divided into
triangles, and sheets that lie behind one another are told apart.

Lines per area of a triangle with unit normal n: k²·(|nx| + |ny| + |nz|)/s² in cells of side s.
"""

from dataclasses import dataclass

import numpy as np

from .grid import VoxelGrid

# A plane between two cells belongs to the upper one, as a whole: rounding would share it out. In cells.
TIE = 1e-5


@dataclass(frozen=True, eq=False)
class Crossings:
    """Where the lines along one ``axis`` meet triangles: the flat index ``cell`` (n,) int64 of the cell, which of its k² lines,
    ``line`` (n,) int32, the ``depth`` (n,) float32 along the axis in cells from the grid's corner, the triangle, ``primitive``
    (n,) int32, and the place on it as Embree's ``u``, ``v`` (n,) float32."""

    axis: int
    cell: np.ndarray
    line: np.ndarray
    depth: np.ndarray
    primitive: np.ndarray
    u: np.ndarray
    v: np.ndarray

    def take(self, rows: np.ndarray) -> "Crossings":
        """Those of ``rows``."""
        return Crossings(self.axis, *(getattr(self, name)[rows] for name in ("cell", "line", "depth", "primitive", "u", "v")))

    @property
    def within(self) -> np.ndarray:
        """Where in their cells the crossings are along the axis (n,), in cells from the centres."""
        return self.depth - np.floor(self.depth + np.float32(TIE)) - np.float32(0.5)

    def places(self, lines: int) -> list[np.ndarray]:
        """Where in their cells the crossings are along x, y and z (n,), in cells from the centres; ``lines`` as they were made
        with."""
        row = self.line // lines
        within = (self.within,
                  (self.line - row * lines + np.float32(0.5)) * np.float32(1.0 / lines) - np.float32(0.5),
                  (row + np.float32(0.5)) * np.float32(1.0 / lines) - np.float32(0.5))
        return [within[(axis - self.axis) % 3] for axis in range(3)]


def crossings(grid: VoxelGrid, corners: np.ndarray, primitive: np.ndarray, axis: int, lines: int) -> Crossings:
    """What ``lines``² lines through every column of ``grid`` along ``axis`` meet of triangles with ``corners`` (3 axes, 3 corners,
    t) float64 in cells from the grid's corner, called ``primitive`` (t,)."""
    first, second = (axis + 1) % 3, (axis + 2) % 3
    across, along = grid.resolution[first] * lines, grid.resolution[second] * lines
    # Rows of lines have their lines at whole numbers and a half.
    bottom, top = (np.ceil(edge * lines - 0.5) for edge in extremes(corners[second]))
    left, right = (np.ceil(edge * lines - 0.5) for edge in extremes(corners[first]))
    bottom, top = np.maximum(bottom, 0), np.minimum(top, along)
    chosen = np.flatnonzero((top > bottom) & (right > left))
    corners = corners[:, :, chosen]
    x, y, bottom = corners[first] * lines, corners[second] * lines, bottom[chosen].astype(np.int64)
    owner, row = _counted((top[chosen]).astype(np.int64) - bottom, bottom)
    left, right = _span(x, y, owner, row + 0.5)
    start = np.maximum(np.ceil(left - 0.5), 0).astype(np.int64)
    stop = np.minimum(np.ceil(right - 0.5), across).astype(np.int64)
    span, column = _counted(np.maximum(stop - start, 0), start)
    row, triangle = row[span], owner[span]
    u, v, depth = _places(corners[axis], x, y, triangle, column + 0.5, row + 0.5)
    slab = np.floor(depth + TIE).astype(np.int64)
    inside = (slab >= 0) & (slab < grid.resolution[axis])
    if not inside.all():
        slab, depth, column, row, triangle, u, v = (part[inside] for part in (slab, depth, column, row, triangle, u, v))
    strides = (1, grid.resolution[0], grid.resolution[0] * grid.resolution[1])
    at_column, at_row = column // lines, row // lines
    cell = slab * strides[axis] + at_column * strides[first] + at_row * strides[second]
    line = ((row - at_row * lines) * lines + column - at_column * lines).astype(np.int32)
    return Crossings(axis, cell, line, depth.astype(np.float32), primitive[chosen[triangle]], u.astype(np.float32),
                     v.astype(np.float32))


def extremes(three: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Least and largest (t,) of ``three`` (3, t)."""
    a, b, c = three
    return np.minimum(np.minimum(a, b), c), np.maximum(np.maximum(a, b), c)


def _counted(count: np.ndarray, start: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """``count`` (n,) whole numbers from ``start`` (n,) on, for each in turn: who counts (m,), and the numbers (m,)."""
    owner = np.repeat(np.arange(len(count)), count)
    return owner, np.arange(len(owner)) + (start - (np.cumsum(count) - count))[owner]


def _span(x, y, owner, row) -> tuple[np.ndarray, np.ndarray]:
    """Where the two edges of triangles ``owner`` (r,) cross ``row`` (r,), from left to right."""
    order = np.argsort(y, axis=0)
    x, y = np.take_along_axis(x, order, axis=0), np.take_along_axis(y, order, axis=0)
    slope = [(x[b] - x[a]) / np.where(y[b] > y[a], y[b] - y[a], 1.0) for a, b in ((0, 2), (0, 1), (1, 2))]
    upper = row >= y[1][owner]
    from_low = row - y[0][owner]
    long_edge = x[0][owner] + from_low * slope[0][owner]
    short_edge = np.where(upper, x[1][owner] + (row - y[1][owner]) * slope[2][owner], x[0][owner] + from_low * slope[1][owner])
    return np.minimum(long_edge, short_edge), np.maximum(long_edge, short_edge)


def _places(z, x, y, triangle, column, row) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Barycentrics u, v and the depth of the points of triangles that project to (``column``, ``row``)."""
    ux, uy, vx, vy = x[1] - x[0], y[1] - y[0], x[2] - x[0], y[2] - y[0]
    area = ux * vy - uy * vx
    scale = 1.0 / np.where(np.abs(area) > 0, area, 1.0)
    dx, dy = column - x[0][triangle], row - y[0][triangle]
    u = np.clip(dx * (vy * scale)[triangle] - dy * (vx * scale)[triangle], 0.0, 1.0)
    v = np.clip(dy * (ux * scale)[triangle] - dx * (uy * scale)[triangle], 0.0, 1.0)
    # A triangle seen from its edge is steep: what rounding makes of its depth stays within it.
    depth = z[0][triangle] + u * (z[1] - z[0])[triangle] + v * (z[2] - z[0])[triangle]
    lowest, highest = extremes(z)
    return u, v, np.clip(depth, lowest[triangle], highest[triangle])
