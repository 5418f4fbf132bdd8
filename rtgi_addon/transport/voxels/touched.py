"""Every cell that a triangle touches, however thin it is: what lines at distances can miss.

A triangle and a box have no point in common where one of thirteen directions keeps them apart: the three axes, the triangle's
normal, and the nine products of its edges with the axes (T. Akenine-Möller, "Fast 3D Triangle-Box Overlap Testing", Journal of
Graphics Tools 6(1), 2001). The nine are the edges of the triangle's pictures along the axes; so columns of cells along the
triangle's steepest axis are asked first, in its picture along that, then the few cells where its plane passes through each
(M. Schwarz and H.-P. Seidel, "Fast Parallel Surface and Solid Voxelization on GPUs", SIGGRAPH Asia 2010).
"""

from collections.abc import Iterator

import numpy as np

# How far, in cells, a triangle may be from a cell to touch it: what rounding makes of points between two cells.
TOUCH = 1e-9
# Columns of cells that are asked at once.
_COLUMNS = 1 << 20


def touched_cells(corners: np.ndarray, low, high) -> Iterator[tuple[np.ndarray, np.ndarray]]:
    """Which triangles with ``corners`` (t, 3 corners, 3) float64, in cells, touch which of the cells from ``low`` (3,) up to but
    not ``high`` (3,): rows (n,) of triangles and cells (n, 3) int64, of some triangles at a time. Cell i reaches from i to i + 1;
    what lies between two cells touches both."""
    corners, low, high = np.asarray(corners, np.float64), np.asarray(low, np.int64), np.asarray(high, np.int64)
    least, most = (extreme(extreme(corners[:, 0], corners[:, 1]), corners[:, 2]) for extreme in (np.minimum, np.maximum))
    first = np.maximum(np.ceil(least - TOUCH).astype(np.int64) - 1, low)
    last = np.minimum(np.floor(most + TOUCH).astype(np.int64), high - 1)
    lone = (first == last).all(axis=1)
    if lone.any():
        # What is in one cell touches it.
        yield np.flatnonzero(lone), first[lone]
    several = np.flatnonzero((last >= first).all(axis=1) & ~lone)
    corners, first, last = corners[several], first[several], last[several]
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    axis = np.abs(normal).argmax(axis=1)
    for steep in range(3):
        chosen = np.flatnonzero(axis == steep)
        across = [(steep + 1) % 3, (steep + 2) % 3]
        counts = (last - first + 1)[chosen]
        columns = counts[:, across[0]] * counts[:, across[1]]
        ends = np.cumsum(columns)
        begin = done = 0
        while begin < len(chosen):
            end = max(begin + 1, int(np.searchsorted(ends, done + _COLUMNS, side="right")))
            rows, cells = _touched(corners, normal, first, last, chosen[begin:end], steep)
            yield several[rows], cells
            begin, done = end, int(ends[end - 1])


def _touched(corners, normal, first, last, rows, steep: int) -> tuple[np.ndarray, np.ndarray]:
    """See touched_cells: of triangles ``rows`` (r,), whose plane is steepest along the axis ``steep``."""
    one, two = (steep + 1) % 3, (steep + 2) % 3
    count = last[rows] - first[rows] + 1
    owner, number = _counted(count[:, one] * count[:, two])
    cell = np.empty((len(owner), 3), np.int64)
    triangle = rows[owner]
    cell[:, one] = first[triangle, one] + number % count[owner, one]
    cell[:, two] = first[triangle, two] + number // count[owner, one]
    kept = _pictured(corners, triangle, cell, one, two)
    triangle, cell = triangle[kept], cell[kept]
    # Where the plane is over the column's middle, and by how much more or less over its corners.
    upward = normal[triangle]
    height = np.where(np.abs(upward[:, steep]) > 0, upward[:, steep], 1.0)
    offset = (upward * corners[triangle, 0]).sum(axis=1)
    middle = (offset - upward[:, one] * (cell[:, one] + 0.5) - upward[:, two] * (cell[:, two] + 0.5)) / height
    reach = 0.5 * (np.abs(upward[:, one]) + np.abs(upward[:, two])) / np.abs(height) + TOUCH
    flat = upward[:, steep] == 0
    lowest = np.where(flat, first[triangle, steep], np.maximum(np.ceil(middle - reach) - 1, first[triangle, steep]))
    highest = np.where(flat, last[triangle, steep], np.minimum(np.floor(middle + reach), last[triangle, steep]))
    owner, number = _counted(np.maximum(highest - lowest + 1, 0).astype(np.int64))
    triangle, cell = triangle[owner], cell[owner]
    cell[:, steep] = lowest[owner].astype(np.int64) + number
    for pair in ((one, steep), (two, steep)):
        kept = _pictured(corners, triangle, cell, *pair)
        triangle, cell = triangle[kept], cell[kept]
    return triangle, cell


def _pictured(corners, triangle, cell, one: int, two: int) -> np.ndarray:
    """(n,) bool: in the picture of the axes ``one`` and ``two`` no edge of the triangles keeps them off the cells."""
    x, y = corners[:, :, one].T, corners[:, :, two].T
    kept = np.ones(len(triangle), bool)
    for edge in range(3):
        after, over = (edge + 1) % 3, (edge + 2) % 3
        across, along = -(y[after] - y[edge]), x[after] - x[edge]
        inner = across * (x[over] - x[edge]) + along * (y[over] - y[edge])
        # The third corner is on the inner side of an edge; a cell is off where all of it is on the outer one.
        turn = np.where(inner < 0, -1.0, 1.0)
        across, along = turn * across, turn * along
        size = np.abs(across) + np.abs(along)
        reach = 0.5 * size + TOUCH * size - (across * x[edge] + along * y[edge])
        held = across[triangle] * (cell[:, one] + 0.5) + along[triangle] * (cell[:, two] + 0.5) + reach[triangle] >= 0
        kept &= held
        # Seen from its edge the triangle is a line, and ends on both sides of it.
        line = inner == 0
        if line.any():
            back = 0.5 * size + TOUCH * size + (across * x[edge] + along * y[edge])
            behind = -across[triangle] * (cell[:, one] + 0.5) - along[triangle] * (cell[:, two] + 0.5) + back[triangle] >= 0
            kept &= behind | ~line[triangle]
    return kept


def _counted(count: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Whole numbers from 0 below ``count`` (n,), for each in turn: who counts (m,), and the numbers (m,)."""
    owner = np.repeat(np.arange(len(count)), count)
    return owner, np.arange(len(owner)) - (np.cumsum(count) - count)[owner]
