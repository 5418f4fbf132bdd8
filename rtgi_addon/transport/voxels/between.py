"""What stands between the middles of neighbouring cells: surfaces as stairs of the lattice, for light that goes from cell to cell.

Who goes from middle to middle meets all of a wall at once, between the two that it parts, and nothing of it elsewhere. So a wall
lets nothing through, however thin it is and however flat light comes in, and sends what its area does, A·|cos|: of a slanted one
the stairs along one axis hide what those along another show too much.

Of a sheet in a plane it is known which middles it parts. Of other cells, as where a wall meets a floor, what lines along an axis
meet lies in the mean before the cell's middle or behind it; they are blocked as those lines are that lie on the middle's side of
what stands across the other axes.
"""

from typing import NamedTuple

import numpy as np

from ..surfaces.geometry import Geometry
from .crossings import TIE
from .grid import FACES, VoxelGrid
from .hierarchy import filled, planes_of
from .voxelize import LINES, NO_PLATE, ROOKS, Voxels

# A plane that goes through middles is taken to lie this far beyond them, in cells: rounding must not make it go in and out. And
# this much over the half of a cell it may cut: neighbours know the same plane each by its own lines.
_BEYOND, _OVER = 2e-3, 1e-2
# Shares that sum to less say nothing: then a point's own cell answers alone.
_LEAST = 1e-3
# What blocks less of an axis is no wall across it; and surfaces whose normals are nearer than this cosine are one.
_STANDS, _OWN = 0.5, 0.7
_TINY = np.finfo(np.float32).tiny


class Faces(NamedTuple):
    """Where something stands between cells along one axis: ``place`` (f, 3) int64 (x, y, z) of the cell above, whose index along
    the axis is from 0 to one more than the last. Below and above, ``rows`` (2, f) int64 are those of the cells that hold it (0
    where none does) and ``blocked`` (2, f) float32 the share of the light that each does not let through."""

    place: np.ndarray
    rows: np.ndarray
    blocked: np.ndarray

    @property
    def passed(self) -> np.ndarray:
        """(f,) float32: the share of the light that gets through."""
        return (1 - self.blocked[0]) * (1 - self.blocked[1])


class Between(NamedTuple):
    """``faces`` along x, y and z between the cells of ``grid``. ``row`` (nz·ny·nx,) int32 says which of ``cells`` one is, -1 for
    empty ones; of those ``plane`` (m, 4) float64 is the normal of the plane that all in it lies in, and how far off that is in
    cells, 0 where it is none, and then ``depth`` (m, 3) float64 where along each axis things stand, 0 where none does."""

    grid: VoxelGrid
    faces: tuple[Faces, Faces, Faces]
    row: np.ndarray
    plane: np.ndarray
    depth: np.ndarray


def between(voxels: Voxels, geometry: Geometry) -> Between:
    """What stands between the cells of ``voxels``, which are of ``geometry``."""
    blocked, depth = _by_lines(voxels, geometry)
    normal, flat = planes_of(voxels)
    offset = (normal * voxels.middle).sum(axis=1) + np.where(normal.sum(axis=1) < 0, -_BEYOND, _BEYOND)
    with np.errstate(divide="ignore", invalid="ignore"):
        cut = np.where(normal != 0, offset[:, None] / normal, np.inf)
    depth = np.where(flat[:, None], cut, depth + _BEYOND)
    whole = np.where(np.abs(depth) < 0.5 + _OVER, filled(voxels.area / voxels.grid.cell**2, normal, offset)[:, None], 0.0)
    blocked = np.where(flat[:, None], whole, blocked).astype(np.float32)
    row = np.full(voxels.grid.count, -1, np.int32)
    row[voxels.cells] = np.arange(len(voxels.cells), dtype=np.int32)
    return Between(voxels.grid, tuple(_faces(voxels, depth[:, axis] >= 0, blocked[:, axis], axis) for axis in range(3)), row,
                   np.where(flat[:, None], np.column_stack([normal, offset]), 0.0),
                   np.where(flat[:, None] | (blocked < _STANDS), 0.0, depth))


def shown_between(standing: Between, opacity: np.ndarray, radiance: np.ndarray, axis: int, up: bool) -> np.ndarray:
    """Radiance (f, 3) float32 that light which goes ``up`` along ``axis``, or down, gets at what is ``standing`` across it, where
    cells of ``opacity`` (m, 3) show ``radiance`` (m, 6, 3), premultiplied."""
    faces, normal = standing.faces[axis], standing.plane[:, :3]
    # Who looks against light that goes up sees high faces, and of a sheet the side that they are of: along an axis that it hardly
    # crosses no line may have met it.
    end = np.zeros(normal.shape, np.int64) + up
    end = np.where((normal < 0) == (normal[:, axis, None] < 0), end, 1 - end)
    weight = np.where((normal != 0).any(axis=1)[:, None], 1.0, np.arange(3) == axis).astype(np.float32)
    rows = np.arange(len(opacity))[:, None]
    sides = (radiance[rows, 2 * np.arange(3) + end] * weight[:, :, None]).sum(axis=1)
    shown = sides / np.maximum((opacity * weight).sum(axis=1), _TINY)[:, None]
    below, above = (shown[rows] * share[:, None] for rows, share in zip(faces.rows, faces.blocked, strict=True))
    if up:
        return above + below * (1 - faces.blocked[1])[:, None]
    return below + above * (1 - faces.blocked[0])[:, None]


def cells_before(standing: Between, points: np.ndarray, normals: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Eight cells (n, 8) before surfaces at ``points`` (n, 3) under unit ``normals`` (n, 3), and their shares (n, 8) float32: those
    about a place so far before the surface that no middle behind it is among them, as trilinear shares are but for cells that
    something parts from the first one before the surface."""
    size, normals = np.array(standing.grid.resolution), np.asarray(normals, np.float64)
    place = standing.grid.cells_of(points)
    own = np.clip(np.floor(place + TIE), 0, size - 1).astype(np.int64)
    # To the first middle before the surface, by the axes that it faces most.
    rows, upward = np.arange(len(own)), np.where(normals < 0, -1, 1)
    beyond = np.where(normals.sum(axis=1) < 0, -_BEYOND, _BEYOND)
    for axis in np.argsort(-np.abs(normals), axis=1).T:
        behind = ((own + 0.5 - place) * normals).sum(axis=1) < beyond
        own[rows, axis] += np.where(behind, upward[rows, axis], 0)
    own = _beside(standing, np.clip(own, 0, size - 1), place, normals, size)
    place = np.clip(place + normals * np.abs(normals).sum(axis=1, keepdims=True), 0.5, size - 0.5)
    within = place - own - 0.5
    to, share = np.where(within < 0, -1, 1), np.minimum(np.abs(within), 1.0)
    for axis in range(3):
        upper = own.copy()
        upper[:, axis] += to[:, axis] > 0
        share[:, axis] *= _passed(standing.faces[axis], upper, axis, size)
    near = 1.0 - np.minimum(np.abs(within), 1.0)
    cells, weights = np.empty((len(points), 8), np.int64), np.empty((len(points), 8), np.float32)
    for corner in range(8):
        chosen = np.array([corner & 1, corner >> 1 & 1, corner >> 2])
        x, y, z = np.clip(own + to * chosen, 0, size - 1).T
        cells[:, corner], weights[:, corner] = (z * size[1] + y) * size[0] + x, np.where(chosen, share, near).prod(axis=1)
    whole = weights.sum(axis=1, keepdims=True)
    weights[whole[:, 0] < _LEAST, 0], weights[whole[:, 0] < _LEAST, 1:] = 1.0, 0.0
    return cells, weights / np.where(whole < _LEAST, 1.0, whole)


def _beside(standing: Between, own: np.ndarray, place: np.ndarray, normals: np.ndarray, size: np.ndarray) -> np.ndarray:
    """The cells ``own`` (n, 3) before surfaces at ``place`` (n, 3), or those beside them whose middles are on the same side of what
    else stands there."""
    row = standing.row[(own[:, 2] * size[1] + own[:, 1]) * size[0] + own[:, 0]]
    there = np.flatnonzero(row >= 0)
    within, step = place[there] - own[there] - 0.5, np.zeros((len(there), 3), np.int64)
    plane, depth = standing.plane[row[there]], standing.depth[row[there]]
    # Of the surface's own plane, or axis, it is known.
    off, upward = plane[:, 3], np.where(plane[:, :3] < 0, -1, 1)
    other = np.abs((plane[:, :3] * normals[there]).sum(axis=1)) < _OWN
    across = other & (off * ((plane[:, :3] * within).sum(axis=1) - off) > 0)
    steepest, rows = np.abs(plane[:, :3]).argmax(axis=1), np.arange(len(there))
    step[rows, steepest] = np.where(across, np.sign(off) * upward[rows, steepest], 0)
    step += np.where((depth * (within - depth) > 0) & (np.abs(normals[there]) < _OWN), np.sign(depth), 0).astype(np.int64)
    own[there] += step
    return np.clip(own, 0, size - 1)


def _passed(faces: Faces, place: np.ndarray, axis: int, size: np.ndarray) -> np.ndarray:
    """(n,) float32: what gets through from cells at ``place`` (n, 3) to those below them."""
    size = size.copy()
    size[axis] += 1
    keys, wanted = ((at[:, 2] * size[1] + at[:, 1]) * size[0] + at[:, 0] for at in (faces.place, place))
    if not keys.size:
        return np.ones(len(place), np.float32)
    found = np.minimum(np.searchsorted(keys, wanted), len(keys) - 1)
    return np.where(keys[found] == wanted, faces.passed[found], np.float32(1))


def _faces(voxels: Voxels, above: np.ndarray, blocked: np.ndarray, axis: int) -> Faces:
    """What stands along ``axis`` ``above`` (m,) bool the middles of cells, or below them."""
    place, size = voxels.place, np.array(voxels.grid.resolution)
    size[axis] += 1
    held = []
    for side in (True, False):
        rows = np.flatnonzero((blocked > 0) & (above == side))
        where = place[rows]
        where[:, axis] += side
        held.append((rows, (where[:, 2] * size[1] + where[:, 1]) * size[0] + where[:, 0]))
    keys = np.union1d(held[0][1], held[1][1])
    both, share = np.zeros((2, len(keys)), np.int64), np.zeros((2, len(keys)), np.float32)
    for side, (rows, key) in enumerate(held):
        at = np.searchsorted(keys, key)
        both[side, at], share[side, at] = rows, blocked[rows]
    return Faces(np.stack([keys % size[0], keys // size[0] % size[1], keys // (size[0] * size[1])], axis=1), both, share)


def _by_lines(voxels: Voxels, geometry: Geometry) -> tuple[np.ndarray, np.ndarray]:
    """The share (m, 3) that is blocked of the lines along each axis on the middle's side of what stands across the others, and
    where (m, 3) what they meet lies in the mean."""
    seen, cells = voxels.seen, len(voxels.cells)
    row = seen.face // FACES
    points = voxels.grid.cells_of(geometry.points(seen.primitive, seen.u, seen.v)) - voxels.place[row] - 0.5
    plates, there = voxels.plates, voxels.plates != NO_PLATE
    blocked, depth = voxels.opacity.copy(), np.zeros((cells, 3))

    def beside(values: np.ndarray, rows, axis: int) -> np.ndarray:
        return ~there[rows, axis] | (np.where(plates[rows, axis] < 0, 1, -1) * (values - plates[rows, axis]) > 0)

    across = (np.arange(LINES) + 0.5) / LINES - 0.5
    for axis in range(3):
        first, second = (axis + 1) % 3, (axis + 2) % 3
        mine = np.flatnonzero(seen.face % FACES == 2 * axis)
        weight = np.bincount(row[mine], seen.weight[mine], cells)
        depth[:, axis] = np.bincount(row[mine], seen.weight[mine] * points[mine, axis], cells) / np.maximum(weight, _TINY)
        edge = np.flatnonzero(voxels.solid & (there[:, first] | there[:, second]) & (blocked[:, axis] > 0))
        held = mine[beside(points[mine, first], row[mine], first) & beside(points[mine, second], row[mine], second)]
        met = np.bincount(row[held], minlength=cells)[edge]
        lines = sum(beside(across[ROOKS[LINES][line]], edge, first) & beside(across[line], edge, second) for line in range(LINES))
        blocked[edge, axis] = np.where(lines > 0, np.minimum(met / np.maximum(lines, 1), 1), blocked[edge, axis])
    return blocked, depth
