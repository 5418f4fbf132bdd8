"""Texels on arbitrary triangles: where the surface cache keeps its values.

A large triangle carries a grid along its two shorter edges; small triangles share texels with their neighbours in space that
face the same way. Cells grow with the distance from the probes, as √(1+(x/w)²), so that a kilometre of ground costs a few
hundred of them. Each texel has two sides. Slots number every texel there could be; only those that rays reach are used.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from ... import kernels
from ...numerics.blocks import blocks
from ...numerics.grid import CURVE_BITS, z_order
from ..surfaces.geometry import Geometry, dense
from ..vectors import dot
from .texel_kernels import LayoutTables

# Slots are addressed by a dense map of this many 32-bit entries at most (both sides): coarser texels beyond.
MAX_SLOTS = 1 << 24
# A cell's rim is drawn inwards by this share: a wall along an edge of the cell does not stand across it.
INSET = 1e-3
# Texels are nominal this many of their sides beyond the focus's sphere: a small one would make them grow within a room.
NOMINAL_BEYOND = 8.0
# A triangle of less than this share of a texel's area shares one with its neighbours.
SHARED_BELOW = 0.5
# Texels are not doubled beyond so many times what they are for, whatever does not fit then.
_LARGEST = 1e6
# How far above its surface one sees all of a texel, in its sides: over a group of small triangles, and on a flat cell.
_GROUP_LIFT, _CELL_LIFT = np.float32(0.1), np.float32(0.02)
# Cells along an edge at most, and by what share of one an edge may be longer without another.
_MOST_CELLS, _SLACK = 4096, 1e-3
# Edges no further from the focus than this, in its widths, are divided evenly: sizes grow by less than 12 % over them.
_WARPED_BEYOND = 0.5
# ``Axis`` and ``Cells`` of kernels/src/texels.h.
_AXIS = np.dtype([*((name, np.float32) for name in ("start", "scale", "low", "span")), ("cells", np.int32), ("warped", np.int32)])
_CELLS = np.dtype([("a", _AXIS), ("b", _AXIS), *((name, np.int32) for name in ("base", "stride", "corner", "unused")),
                   ("normal", np.float32, 3), ("size", np.float32)])


@dataclass(frozen=True, eq=False)
class Focus:
    """Where accuracy is wanted: ``center_world`` (3,) and ``radius`` [m] of a sphere around the probes, within which texels have
    their nominal ``size`` [m]; outside it they grow in proportion to the distance."""

    center_world: np.ndarray
    radius: float
    size: float


class TexelLayout:
    """Maps hits to slots and slots back to points on the surface.

    ``likely_texels`` is how many there would be if one side of every surface were seen and none split.

    Raises nothing: when ``focus.size`` would need more than MAX_SLOTS slots it is doubled until they fit; ``size`` says what
    was used.
    """

    def __init__(self, geometry: Geometry, focus: Focus, lit_alike: np.ndarray | None = None):
        self._geometry, self._lit_alike = geometry, lit_alike
        count = geometry.count
        self._corner = np.empty(count, np.int8)
        self._origin, self._edge_a, self._edge_b = (np.empty((count, 3), np.float32) for _ in range(3))
        for rows in blocks(count):
            corners = geometry.triangles_world[rows]
            first, second, third = (dot(edge, edge) for edge in (corners[:, (k + 1) % 3] - corners[:, k] for k in range(3)))
            # The corner opposite the longest edge: the grid runs along the two shorter edges from there.
            corner = np.where((first >= second) & (first >= third), 2, np.where(second >= third, 0, 1))
            every = np.arange(len(corners))
            origin = corners[every, corner]
            self._corner[rows], self._origin[rows] = corner, origin
            self._edge_a[rows] = corners[every, (corner + 1) % 3] - origin
            self._edge_b[rows] = corners[every, (corner + 2) % 3] - origin
        self.size = float(focus.size)
        while not self._grid(focus):
            self.size *= 2.0

    def _grid(self, focus: Focus) -> bool:
        width = np.float32(max(focus.radius, 1e-12) + NOMINAL_BEYOND * self.size)
        self._width = width
        center, count = np.asarray(focus.center_world, np.float32), self._geometry.count
        self._axis_a, self._axis_b = _Axis(count), _Axis(count)
        size, shared, own, halves = np.empty(count, np.float32), np.empty(count, bool), np.empty(count, np.int64), 0
        for rows in blocks(count):
            distance = _distance(self._geometry.triangles_world[rows], center)
            side = size[rows] = self.size * np.sqrt(1.0 + (distance / width) ** 2)
            for axis, edge in ((self._axis_a, self._edge_a), (self._axis_b, self._edge_b)):
                axis.lay(rows, edge[rows], self._origin[rows], center, width, side)
            a, b = (axis.cells[rows].astype(np.int64) for axis in (self._axis_a, self._axis_b))
            cells, alone = a * b, self._geometry.areas[rows] >= SHARED_BELOW * side**2
            alone &= cells > 1
            shared[rows], own[rows] = ~alone, np.where(alone, cells, 0)
            # Half of a triangle's parallelogram, and what its longest edge cuts.
            halves += int(((cells + np.minimum(cells, a + b)) // 2)[alone].sum())
        group, group_count = self._cluster(np.flatnonzero(shared), size)
        total = group_count + int(own.sum())
        if 2 * total > MAX_SLOTS and self.size < _LARGEST * max(focus.radius, focus.size):
            return False
        self._base = group_count + np.cumsum(own) - own
        self._base[shared] = group
        self._shared = shared
        self._stride = np.where(shared, 0, self._axis_b.cells).astype(np.int32)
        self._axis_a.cells[shared] = 1
        self._axis_b.cells[shared] = 1
        self._size = size
        self._any_warp = bool(np.any(self._axis_a.warped & ~shared) or np.any(self._axis_b.warped & ~shared))
        self._group_count = group_count
        self.likely_texels = group_count + halves
        self._own_triangles = np.flatnonzero(~shared)
        self._own_starts = self._base[self._own_triangles]
        self.slot_count = 2 * total
        self._base = self._base.astype(np.int32)
        return True

    def _cluster(self, triangles: np.ndarray, size: np.ndarray) -> tuple[np.ndarray, int]:
        """Group small triangles by cell in space, facing and material; remember each group's members for sampling."""
        if triangles.size == 0:
            self._members, self._member_cdf = triangles, np.zeros(1)
            self._group_starts = np.zeros(1, np.int64)
            return triangles, 0
        key = np.concatenate([self._group_key(triangles[rows], size) for rows in blocks(len(triangles))])
        order = np.argsort(key, kind="stable")
        key = key[order]
        starts = np.flatnonzero(np.concatenate(([True], key[1:] != key[:-1])))
        counts = np.diff(starts, append=len(order))
        # Neighbours get neighbouring numbers: texels trace their rays by eight in a packet, and all find what they need in caches.
        level, cell = self._place(triangles[order[starts]], size)
        in_space = np.lexsort((key[starts], _along_curve(cell, level)))
        starts, counts = starts[in_space], counts[in_space]
        ends = np.cumsum(counts)
        order = order[np.arange(len(order)) + np.repeat(starts - (ends - counts), counts)]
        group = np.empty(len(order), np.int32)
        group[order] = np.repeat(np.arange(len(counts), dtype=np.int32), counts)
        self._members = triangles[order]
        areas = self._geometry.areas[self._members].astype(np.float64)
        self._member_cdf = np.concatenate(([0.0], np.cumsum(np.maximum(areas, 1e-30))))
        self._group_starts = np.concatenate(([0], ends))
        return group, len(counts)

    def _place(self, triangles: np.ndarray, size: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """How often cells in space are doubled at ``triangles`` (n,), and the cell (n, 3) that each lies in, int64."""
        corners = self._geometry.triangles_world[triangles]
        level = np.round(np.log2(size[triangles] / self.size)).astype(np.int64)
        middle = (corners[:, 0] + corners[:, 1] + corners[:, 2]) / np.float32(3)
        return level, np.floor(middle / (self.size * 2.0**level)[:, None]).astype(np.int64)

    def _group_key(self, triangles: np.ndarray, size: np.ndarray) -> np.ndarray:
        """A hash (n,) uint64 that those of ``triangles`` (n,) share which share a texel."""
        level, cell = self._place(triangles, size)
        # 26 facings: each axis is −, 0 or + of the rounded normal.
        facing = np.rint(self._geometry.normals_world[triangles] * 1.2).astype(np.int64)
        parts = [facing[:, 0] + 3 * facing[:, 1] + 9 * facing[:, 2] + 13, self._geometry.material[triangles], level, *cell.T]
        if self._lit_alike is not None:
            parts.append(self._lit_alike[self._geometry.instance[triangles]])
        key = np.zeros(len(triangles), np.uint64)
        for part in parts:
            key = (key ^ part.astype(np.int64).astype(np.uint64)) * np.uint64(0x9E3779B97F4A7C15)
            key ^= key >> np.uint64(29)
        return key

    def slots(self, primitive: np.ndarray, u: np.ndarray, v: np.ndarray, front: np.ndarray) -> np.ndarray:
        """Slot (n,) int32 of hits at Embree barycentrics on the ``front`` (n,) bool side."""
        if kernels.is_available() and primitive.dtype == np.int32 and u.dtype == v.dtype == np.float32:
            n, slots = len(primitive), np.empty(len(primitive), np.int32)
            cells = self.cells  # held while the kernel reads it
            kernels.call("slots", len(cells), cells.ctypes.data, n, *dense(n, primitive, u, v, front), slots)
            return slots
        corner = self._corner[primitive]
        w = 1.0 - u - v
        # (a, b) are the barycentric weights of the two corners that follow the grid's own.
        a = np.where(corner == 0, u, np.where(corner == 1, v, w))
        b = np.where(corner == 0, v, np.where(corner == 1, w, u))
        column = self._axis_a.cell(primitive, a, self._any_warp)
        row = self._axis_b.cell(primitive, b, self._any_warp)
        slot = self._base[primitive] + column * self._stride[primitive] + row
        return 2 * slot + front

    @cached_property
    def cells(self) -> np.ndarray:
        """What ``slots`` looks up of each triangle (t,), its front's normal and its texels' side, as kernels read it: ``Cells`` of
        kernels/src/texels.h."""
        cells = np.zeros(self._geometry.count, _CELLS)
        for name, axis in (("a", self._axis_a), ("b", self._axis_b)):
            for field, values in axis.arrays().items():
                cells[name][field] = values
        cells["base"], cells["stride"], cells["corner"] = self._base, self._stride, self._corner
        cells["normal"], cells["size"] = self._geometry.normals_world, self._size
        return cells

    @cached_property
    def tables(self) -> LayoutTables:
        """All that places points on texels, as kernels read it."""
        return LayoutTables(self.cells, self._geometry.triangles_world, self._own_triangles, self._own_starts, self._members,
                            self._group_starts, self._member_cdf, np.array([_GROUP_LIFT, _CELL_LIFT]))

    def sizes(self, primitive: np.ndarray) -> np.ndarray:
        """Side (n,) float32 [m] that texels have on each triangle (n,), before they are fitted to its edges."""
        return self._size[primitive]

    def lift(self, slots: np.ndarray, primitive: np.ndarray) -> np.ndarray:
        """Height (n,) [m] above the surface at which points of one texel are expected to see each other: little on a flat cell,
        more over small triangles, which may bulge."""
        return self._size[primitive] * np.where(slots >> 1 < self._group_count, _GROUP_LIFT, _CELL_LIFT)

    def areas(self, slots: np.ndarray) -> np.ndarray:
        """Surface area (n,) float64 [m²] of each slot, as ``sample`` covers it."""
        slot = slots >> 1
        result = np.empty(len(slot), np.float64)
        grouped = slot < self._group_count
        group = slot[grouped]
        result[grouped] = self._member_cdf[self._group_starts[group + 1]] - self._member_cdf[self._group_starts[group]]
        triangle, a0, width, b0, height = self._cell(slot[~grouped])
        x1, x2, h1, slope = _trapezoid(width, height, np.maximum(1.0 - a0 - b0, 1e-9))
        clipped = x1 + (x2 - x1) * h1 - 0.5 * slope * (x2 - x1) ** 2
        result[~grouped] = 2.0 * self._geometry.areas[triangle] * width * height * clipped
        return result

    def rim(self, slots: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Indices (m,) into ``slots`` of cells of large triangles, the triangle of each, and the corners (m, 5, 3) in world space
        of what the triangle leaves of the cell, drawn a little inwards: what stands across a cell crosses its rim. Cells that the
        long edge does not cut have one corner twice."""
        rows = np.flatnonzero(slots >> 1 >= self._group_count)
        triangle, a0, width, b0, height = self._cell(slots[rows] >> 1)
        limit = np.maximum(1.0 - a0 - b0, 1e-9)
        x, y = np.minimum(limit / width, 1.0), np.minimum(limit / height, 1.0)
        x_top, y_right = np.clip((limit - height * y) / width, 0.0, x), np.clip((limit - width * x) / height, 0.0, y)
        none = np.zeros_like(x)
        a = np.stack([none, x, x, x_top, none], axis=1)
        b = np.stack([none, none, y_right, y, y], axis=1)
        a, b = (part + INSET * (part.mean(axis=1, keepdims=True) - part) for part in (a, b))
        a, b = a0[:, None] + width[:, None] * a, b0[:, None] + height[:, None] * b
        corners = (self._origin[triangle, None] + a[..., None] * self._edge_a[triangle, None]
                   + b[..., None] * self._edge_b[triangle, None])
        return rows, triangle, corners.astype(np.float32)

    def sample(self, slots: np.ndarray, xi: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Uniform points on the surfaces of ``slots`` (n,), ``m`` each, from ``xi`` (m, n, 2) in [0, 1).

        Returns primitive int32, u, v float32 (Embree barycentrics), each (m, n).
        """
        slot = slots >> 1
        primitive = np.empty(xi.shape[:2], np.int32)
        a, b = np.empty(xi.shape[:2], np.float32), np.empty(xi.shape[:2], np.float32)
        grouped = slot < self._group_count
        columns = np.flatnonzero(grouped)
        if columns.size:
            primitive[:, columns], a[:, columns], b[:, columns] = self._sample_group(slot[columns], xi[:, columns])
        columns = np.flatnonzero(~grouped)
        if columns.size:
            primitive[:, columns], a[:, columns], b[:, columns] = self._sample_cell(slot[columns], xi[:, columns])
        corner = self._corner[primitive]
        rest = 1 - a - b
        u = np.where(corner == 0, a, np.where(corner == 1, rest, b))
        v = np.where(corner == 0, b, np.where(corner == 1, a, rest))
        return primitive, u, v

    def _sample_group(self, group, xi):
        first, last = self._group_starts[group], self._group_starts[group + 1]
        low, high = self._member_cdf[first], self._member_cdf[last]
        target = low + xi[..., 0] * (high - low)
        index = np.clip(np.searchsorted(self._member_cdf, target, side="right") - 1, first, last - 1)
        # What is left of the first number within the chosen triangle is again uniform.
        span = self._member_cdf[index + 1] - self._member_cdf[index]
        root = np.sqrt(np.clip((target - self._member_cdf[index]) / span, 0.0, 1.0 - 1e-7))
        return self._members[index], 1.0 - root, root * xi[..., 1]

    def _sample_cell(self, slot, xi):
        triangle, a0, width, b0, height = self._cell(slot)
        x, y = clipped_square(width, height, np.maximum(1.0 - a0 - b0, 1e-9), xi)
        return triangle, a0 + width * x, b0 + height * y

    def _cell(self, slot):
        triangle = self._own_triangles[np.searchsorted(self._own_starts, slot, side="right") - 1]
        column, row = np.divmod(slot - self._base[triangle], self._stride[triangle])
        a0, a1 = self._axis_a.edges(triangle, column)
        b0, b1 = self._axis_b.edges(triangle, row)
        return triangle, a0, np.maximum(a1 - a0, 1e-9), b0, np.maximum(b1 - b0, 1e-9)


def size_for(geometry: Geometry, center_world: np.ndarray, radius: float, texels: float) -> float:
    """Side [m] of texels so that there are about so many ``texels`` around a sphere of ``radius`` [m] about ``center_world``
    (3,): a triangle counts by what of it lies within, or by how small it looks from there."""
    area = 0.0
    for rows in blocks(geometry.count):
        distance = _distance(geometry.triangles_world[rows], center_world)
        share = np.minimum(1.0, (radius / np.maximum(distance, radius)) ** 2)
        area += float(np.minimum(geometry.areas[rows] * share, 4.0 * np.pi * radius**2).sum(dtype=np.float64))
    return float(np.sqrt(max(area, 1e-12) / texels))


def _distance(triangles: np.ndarray, point: np.ndarray) -> np.ndarray:
    """From ``point`` (3,) to the boxes (n,) around ``triangles`` (n, 3, 3), 0 within."""
    squared = np.zeros(len(triangles), np.result_type(triangles, point))
    for axis in range(3):
        # By corner: reducing over an axis of three costs numpy several times as much.
        first, second, third = (triangles[:, corner, axis] for corner in range(3))
        low, high = (pick(pick(first, second), third) for pick in (np.minimum, np.maximum))
        squared += np.maximum(np.maximum(low - point[axis], point[axis] - high), 0) ** 2
    return np.sqrt(squared)


def _along_curve(cell: np.ndarray, level: np.ndarray) -> np.ndarray:
    """Codes (n,) uint64 that put ``cell`` (n, 3) int64, each of 2^``level`` (n,) cells of level 0 along an axis, in the order of a
    Z-order curve through them."""
    place = (cell << level[:, None]) - (cell << level[:, None]).min(axis=0)
    return z_order(place >> max(0, int(place.max()).bit_length() - CURVE_BITS))


def side_of(slots: np.ndarray) -> np.ndarray:
    """(n, 1) float32: 1 where ``slots`` (n,) are on the front of their triangles, −1 where on the back."""
    return np.where(slots & 1, np.float32(1), np.float32(-1))[:, None]


class _Axis:
    """Cells along one edge of every triangle: uniform in asinh(x/w), x the distance along the edge from the focus' foot."""

    def __init__(self, count: int):
        self._start, self._scale, self._low, self._span = (np.empty(count, np.float32) for _ in range(4))
        self.warped, self.cells = np.empty(count, bool), np.empty(count, np.int32)

    def lay(self, rows: slice, edge, origin, center, width, size) -> None:
        """Divide the ``edge`` (n, 3) of the triangles in ``rows``, from ``origin`` (n, 3) on, into cells of ``size`` (n,)."""
        length = np.maximum(np.sqrt(dot(edge, edge)), np.float32(1e-12))
        start = -(dot(center - origin, edge) / length) / width
        scale = length / width
        end = start + scale
        warped = np.maximum(np.abs(start), np.abs(end)) > _WARPED_BEYOND
        low, span = np.zeros_like(start), np.ones_like(start)
        bent = np.flatnonzero(warped)
        low[bent] = np.arcsinh(start[bent])
        span[bent] = np.arcsinh(end[bent]) - low[bent]
        reach = np.where(warped, span * width, length)
        self._start[rows], self._scale[rows], self._low[rows], self._span[rows], self.warped[rows] = start, scale, low, span, warped
        self.cells[rows] = np.clip(np.ceil(reach / size - _SLACK), 1, _MOST_CELLS)

    def cell(self, primitive, t, any_warp):
        cells = self.cells[primitive]
        if any_warp:
            rows = np.flatnonzero(self.warped[primitive])
            chosen = primitive[rows]
            position = np.arcsinh(self._start[chosen] + self._scale[chosen] * t[rows])
            t = t.copy()
            t[rows] = (position - self._low[chosen]) / self._span[chosen]
        return np.clip((t * cells).astype(np.int32), 0, cells - 1)

    def arrays(self) -> dict[str, np.ndarray]:
        """What ``cell`` reads, by name."""
        return {"start": self._start, "scale": self._scale, "low": self._low, "span": self._span, "cells": self.cells,
                "warped": self.warped}

    def edges(self, triangle, index):
        cells = self.cells[triangle]
        return self._edge(triangle, index / cells), self._edge(triangle, (index + 1) / cells)

    def _edge(self, triangle, t):
        unwarped = (np.sinh(self._low[triangle] + self._span[triangle] * t) - self._start[triangle]) / self._scale[triangle]
        return np.clip(np.where(self.warped[triangle], unwarped, t), 0.0, 1.0)


def clipped_square(width, height, limit, xi) -> tuple[np.ndarray, np.ndarray]:
    """Uniform points (x, y) of the unit square under x·width + y·height ≤ limit, by inverting the marginal in x.

    All arguments (n,), ``xi`` (..., n, 2) in [0, 1). The square's height at x is 1 up to x₁ and falls linearly until x₂.
    """
    x1, x2, h1, slope = _trapezoid(width, height, limit)
    run = x2 - x1
    area = x1 + run * h1 - 0.5 * slope * run * run
    target = xi[..., 0] * area
    beyond = target - x1
    # ½·slope·s² − h1·s + beyond = 0 solved for the smaller root in the form that is stable for small slopes.
    root = np.sqrt(np.maximum(h1 * h1 - 2.0 * slope * np.maximum(beyond, 0.0), 0.0))
    x = np.where(beyond <= 0.0, target, x1 + 2.0 * np.maximum(beyond, 0.0) / np.maximum(h1 + root, 1e-12))
    x = np.clip(x, 0.0, x2)
    y = xi[..., 1] * np.clip((limit - x * width) / height, 0.0, 1.0)
    return x, y


def _trapezoid(width, height, limit):
    x1 = np.clip((limit - height) / width, 0.0, 1.0)
    x2 = np.clip(limit / width, x1, 1.0)
    return x1, x2, np.clip((limit - x1 * width) / height, 0.0, 1.0), width / height
