"""Triangles into cells: the crossing opacity of each along each axis, what one sees of surfaces by each of its faces, and their
area, mean normal and albedo.

Of the k² lines along an axis that pass through a cell (`crossings`) each is blocked by what it meets, with its coverage there: the
cell's opacity along that axis is the mean of 1 - Π(1 - α) over its lines. An opaque sheet across the cell has 1, half a sheet ½, n
sheets of coverage α have 1 - (1 - α)^n. A sum of areas, as occupancy is often made of, cannot tell two halves of one sheet from two
sheets. What a face shows is each line's first surface, and what is behind it as far as it is seen: both sides of a thin wall are
kept apart.

Source: the lecture's multi-channel full-scene voxelization (occupancy by coverage and alpha, directional data, mean normals and
albedo); C. Crassin and S. Green, "Octree-Based Sparse Voxelization Using the GPU Hardware Rasterizer", OpenGL Insights, 2012.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from ...errors import BakeError
from ..parallel import parallel_for
from ..surfaces.geometry import Geometry
from ..surfaces.materials import Surfaces
from .crossings import TIE, Crossings, crossings, extremes
from .grid import FACES, VoxelGrid
from .pieces import Pieces, cut, find_sparse, undivided
from .walls import Walls, find_walls

# Lines along each side of a column of cells.
LINES = 4
# Of the lines of a face so many carry its light, spread as rooks on a chess board: one of each row and column.
ROOKS = {1: (0,), 2: (0, 1), 3: (1, 2, 0), 4: (1, 3, 0, 2)}
# Where no more than this share of the lines along any axis meet something, what there is is cut out.
FEW = 0.25
# How far, RMS in cells, the places where lines meet a cell's surfaces may lie about a plane across them; where there is none.
_LEVEL, NO_PLATE = 0.003, np.float32(9.0)
# Coverage from which on a surface lets nothing through.
_COVERED = 0.999
# Surfaces in one column of one cell that are told apart; further ones are behind so many.
_LAYERS = 32


@dataclass(frozen=True, eq=False)
class Seen:
    """What the faces of cells show, as a sum over points on surfaces: ``face`` (e,) int64 is 6·(row of the cell in Voxels.cells) +
    2·axis (+ 1 for the high face), ``weight`` (e,) float32 the share of the face's lines that see the point. ``primitive`` (e,)
    int32 with Embree's ``u``, ``v`` (e,) float32; ``side`` (e,) float32: 1 where the front is seen, -1 where the back."""

    face: np.ndarray
    weight: np.ndarray
    primitive: np.ndarray
    u: np.ndarray
    v: np.ndarray
    side: np.ndarray


@dataclass(frozen=True, eq=False)
class Voxels:
    """The cells of ``grid`` that hold surfaces: flat indices ``cells`` (m,) int64, ascending. ``opacity`` (m, 3) float32: the share
    of lines along x, y, z that what is in the cell blocks. ``area`` (m,) float64 [m²]; ``normal`` (m, 3) float64 the mean of the
    fronts' normals, ``albedo`` (m, 3) float64 the mean of both sides' and ``lie`` (m, 6) float64 of nx², ny², nz², ny·nz, nx·nz,
    nx·ny over that area, by coverage; ``solid`` (m,) bool: nothing in the cell lets anything through by its coverage. ``plates``
    (m, 3) float32: where along x, y, z, in cells from the centre, all lies that lines along that axis meet, NO_PLATE where that is
    no plane across it. ``seen`` is what the faces show."""

    grid: VoxelGrid
    cells: np.ndarray
    opacity: np.ndarray
    area: np.ndarray
    normal: np.ndarray
    albedo: np.ndarray
    lie: np.ndarray
    middle: np.ndarray
    solid: np.ndarray
    plates: np.ndarray
    seen: Seen

    @property
    def place(self) -> np.ndarray:
        """(m, 3) int64: where the cells are along x, y and z."""
        nx, ny, _ = self.grid.resolution
        return np.stack([self.cells % nx, self.cells // nx % ny, self.cells // (nx * ny)], axis=1)

    @cached_property
    def walls(self) -> Walls:
        """Walls of which both sides are here."""
        return find_walls(self.place, self.by_face((self.seen.side > 0)[:, None])[..., 0])

    def by_face(self, values: np.ndarray) -> np.ndarray:
        """(m, 6, c) float32: sums over what each face shows of ``values`` (e, c) at the points of ``seen``, by weight. Of radiance
        they are premultiplied: what reaches an eye that looks through the whole cell."""
        count = FACES * len(self.cells)
        sums = [np.bincount(self.seen.face, self.seen.weight * column, count) for column in np.asarray(values, np.float64).T]
        return np.stack(sums, axis=-1).astype(np.float32).reshape(len(self.cells), FACES, -1)

    def dense(self, values: np.ndarray) -> np.ndarray:
        """``values`` (m, …) of the cells in an array (nz, ny, nx, …) of all, which is 0 elsewhere."""
        full = np.zeros((self.grid.count, *values.shape[1:]), values.dtype)
        full[self.cells] = values
        return full.reshape(*self.grid.shape, *values.shape[1:])


def voxelize(geometry: Geometry, surfaces: Surfaces, grid: VoxelGrid, threads: int | None = None, lines: int = LINES,
             meet=None) -> Voxels:
    """The surfaces of ``geometry`` that diffuse rays meet, in ``grid``. ``meet`` is what finds where lines meet triangles in the
    place of ``crossings``, for one axis after the other. Raises BakeError where there are none."""
    columns = (np.ascontiguousarray(geometry.triangles_world.T, np.float64) - np.reshape(grid.corner, (3, 1, 1))) / grid.cell
    low, high = (np.stack(edges) for edges in zip(*(extremes(axis) for axis in columns), strict=True))
    size, met = np.reshape(grid.resolution, (3, 1)), _met(geometry, grid, low, high)
    chosen = np.flatnonzero(met).astype(np.int32)
    if not chosen.size:
        raise BakeError(f"the voxel grid ({_box(grid)}) holds no geometry", "place the probe volumes where surfaces are")
    whole = ((low >= 0) & (high <= size)).all(axis=0)
    corners = columns[:, :, chosen]
    if meet is None:
        parts = parallel_for(lambda axis: crossings(grid, corners, chosen, axis, lines), 3, threads)
    else:
        parts = [meet(grid, corners, chosen, axis, lines) for axis in range(3)]
    touching = find_sparse(grid, corners, *_met_by(parts, grid, lines), 1.0 / lines)
    parts = [part.take(np.flatnonzero(~touching.sparse[part.cell])) for part in parts]
    count = sum(np.bincount(part.primitive, minlength=geometry.count) for part in parts)
    pieces = cut(grid, corners, chosen, touching, count[chosen] > 0)
    share = np.bincount(pieces.primitive, pieces.share, geometry.count)
    lone = np.flatnonzero((count[chosen] == 0) & (share[chosen] == 0))
    area = _areas(geometry, 1.0 - share, count, chosen[~whole[chosen]], grid, lines)
    pieces = pieces.and_also(undivided(grid, corners[:, :, lone], chosen[lone]))
    held = np.zeros(grid.count, bool)
    for part in (*parts, pieces):
        held[part.cell] = True
    cells = np.flatnonzero(held)
    row = np.zeros(grid.count, np.int32)
    row[cells] = np.arange(len(cells), dtype=np.int32)
    axes = parallel_for(lambda axis: _along(parts[axis], geometry, surfaces, row, len(cells), lines), 3, threads)
    few, seen_few = _by_pieces(pieces.take(np.flatnonzero(touching.sparse[pieces.cell])), geometry, surfaces, grid, row, len(cells))
    opacity = np.stack([opacity for opacity, _ in axes], axis=1) + few
    plates = np.stack([_plates(part, row, len(cells)) for part in parts], axis=1)
    found = [*(seen for _, seen in axes), seen_few]
    seen = Seen(*(np.concatenate([getattr(part, name) for part in found]) for name in Seen.__dataclass_fields__))
    shares = [*((part, area[part.primitive]) for part in parts), (pieces, pieces.share * geometry.areas[pieces.primitive])]
    sums = _sums(geometry, surfaces, shares, row, len(cells), lines)
    covered = np.maximum(sums[:, 1:2], np.finfo(np.float64).tiny)
    means = (sums[:, columns] / covered for columns in (slice(2, 5), slice(5, 8), slice(8, 14), slice(14, 17)))
    return Voxels(grid, cells, opacity, sums[:, 0], *means, sums[:, 17] == 0, plates, seen)


def holds_geometry(geometry: Geometry, grid: VoxelGrid) -> bool:
    """Whether the boxes of any triangles that diffuse rays meet reach into ``grid``."""
    columns = (np.ascontiguousarray(geometry.triangles_world.T, np.float64) - np.reshape(grid.corner, (3, 1, 1))) / grid.cell
    low, high = (np.stack(edges) for edges in zip(*(extremes(axis) for axis in columns), strict=True))
    return bool(_met(geometry, grid, low, high).any())


def _met(geometry: Geometry, grid: VoxelGrid, low: np.ndarray, high: np.ndarray) -> np.ndarray:
    """Which (t,) bool of the triangles whose boxes reach from ``low`` to ``high`` (3, t) in cells are put into ``grid``."""
    size = np.reshape(grid.resolution, (3, 1))
    return geometry.visibility.diffuse[geometry.instance] & ((high >= -TIE) & (low <= size)).all(axis=0)


def _met_by(parts: list[Crossings], grid: VoxelGrid, lines: int) -> tuple[np.ndarray, np.ndarray]:
    """(nz·ny·nx,) bool twice: cells in which lines meet anything, and those of them where that is no more than FEW of those along
    each axis."""
    most = np.zeros(grid.count, np.uint16)
    for part in parts:
        cells = np.flatnonzero(np.bincount(part.cell, minlength=grid.count))
        row = np.zeros(grid.count, np.int32)
        row[cells] = np.arange(len(cells), dtype=np.int32)
        met = np.zeros(len(cells) * lines**2, bool)
        met[row[part.cell].astype(np.int64) * lines**2 + part.line] = True
        most[cells] = np.maximum(most[cells], met.reshape(-1, lines**2).sum(axis=1, dtype=np.uint16))
    return most > 0, (most > 0) & (most <= FEW * lines**2)


def _areas(geometry: Geometry, left: np.ndarray, count: np.ndarray, border, grid: VoxelGrid, lines: int) -> np.ndarray:
    """Area (t,) float64 [m²] that one of the ``count`` (t,) crossings of each triangle stands for: an equal part of the share
    ``left`` (t,) of it, and of those at the grid's ``border`` (c,) what the density of lines says."""
    area = geometry.areas * left / np.maximum(count, 1)
    if border.size:
        density = np.abs(geometry.normals_world[border].astype(np.float64)).sum(axis=1) * (lines / grid.cell) ** 2
        area[border] = 1.0 / np.maximum(density, np.finfo(np.float64).tiny)
    return area


def _coverage(surfaces: Surfaces, part) -> np.ndarray | None:
    """Coverage (n,) at crossings, the mean of both sides; None where all of it is 1."""
    if not surfaces.has_transparency:
        return None
    sides = [surfaces.coverage(part.primitive, part.u, part.v, np.full(len(part.u), side, np.float32)) for side in (1, -1)]
    return np.float32(0.5) * (sides[0] + sides[1])


def _along(part: Crossings, geometry: Geometry, surfaces: Surfaces, row, cells: int, lines: int) -> tuple[np.ndarray, Seen]:
    """Opacity (m,) float32 along one axis, and what the two faces across it show."""
    cell, per_line = row[part.cell], np.float32(1.0 / lines**2)
    key = cell.astype(np.int64) * lines**2 + part.line
    coverage = _coverage(surfaces, part)
    alpha = np.ones(len(key), np.float32) if coverage is None else coverage
    low = high = alpha
    layers = np.bincount(key, minlength=cells * lines**2)
    several = np.flatnonzero(layers[key] > 1)
    if several.size:
        # By line, then by depth.
        order = several[np.lexsort((part.depth[several], key[several]))]
        low, high = alpha.copy(), alpha.copy()
        low[order] = _composite(key[order], alpha[order])
        high[order[::-1]] = _composite(key[order[::-1]], alpha[order[::-1]])
    opacity = np.bincount(cell, low * per_line, cells).astype(np.float32)
    front = np.where(geometry.normals_world[part.primitive, part.axis] < 0, np.float32(1), np.float32(-1))
    light = _carriers(part.line, lines)
    faces = []
    for end, (weight, side) in enumerate(((low, front), (high, -front))):
        face = cell.astype(np.int64) * FACES + 2 * part.axis + end
        rows = _chosen(face, weight, light, FACES * cells)
        shown = np.bincount(face, weight * per_line, FACES * cells)
        carried = np.bincount(face[rows], weight[rows], FACES * cells)
        scaled = weight[rows] * (shown / np.maximum(carried, 1e-30))[face[rows]]
        faces.append(Seen(face[rows], scaled.astype(np.float32), part.primitive[rows], part.u[rows], part.v[rows], side[rows]))
    return opacity, Seen(*(np.concatenate([getattr(seen, name) for seen in faces]) for name in Seen.__dataclass_fields__))


def _by_pieces(pieces: Pieces, geometry: Geometry, surfaces: Surfaces, grid: VoxelGrid, row, cells: int) -> tuple[np.ndarray, Seen]:
    """Opacity (m, 3) float32 of cells that lines hardly meet, and what their faces show: what looks one way along an axis lies side
    by side, in front of what looks the other way."""
    cell, coverage = row[pieces.cell], _coverage(surfaces, pieces)
    area = pieces.share * geometry.areas[pieces.primitive] / grid.cell**2
    area = area if coverage is None else area * coverage
    opacity, faces = np.zeros((cells, 3), np.float32), []
    for axis in range(3):
        across = area * geometry.normals_world[pieces.primitive, axis]
        fronts = [np.bincount(cell, np.maximum(turn * across, 0), cells) for turn in (-1, 1)]
        most = np.minimum(np.maximum(*fronts), 1.0)
        opacity[:, axis] = most
        for end, turn in enumerate((-1, 1)):
            # Of fronts as much as there is room for, and of backs what they leave.
            of_front, of_back = np.minimum(fronts[end], most), np.maximum(most - fronts[end], 0.0)
            scale = [part / np.maximum(whole, 1e-30) for part, whole in zip((of_front, of_back), (fronts[end], fronts[1 - end]),
                                                                          strict=True)]
            front = turn * across > 0
            weight = np.abs(across) * np.where(front, scale[0][cell], scale[1][cell])
            rows = np.flatnonzero(weight > 0)
            faces.append(Seen(cell[rows].astype(np.int64) * FACES + 2 * axis + end, weight[rows].astype(np.float32),
                              pieces.primitive[rows], pieces.u[rows], pieces.v[rows],
                              np.where(front[rows], np.float32(1), np.float32(-1))))
    return opacity, Seen(*(np.concatenate([getattr(seen, name) for seen in faces]) for name in Seen.__dataclass_fields__))


def _plates(part: Crossings, row, cells: int) -> np.ndarray:
    """Voxels.plates (m,) along one axis."""
    cell, place = row[part.cell], part.within
    count = np.bincount(cell, minlength=cells)
    mean, square = (np.bincount(cell, values, cells) / np.maximum(count, 1) for values in (place, place * place))
    plane = (count > 0) & (square - mean * mean < _LEVEL**2)
    return np.where(plane, mean, NO_PLATE).astype(np.float32)


def _composite(key: np.ndarray, alpha: np.ndarray) -> np.ndarray:
    """What is seen (n,) of each of layers with coverage ``alpha`` (n,), front to back within runs of one ``key`` (n,)."""
    begins = np.flatnonzero(np.diff(key, prepend=-1))
    rank = np.arange(len(key)) - np.repeat(begins, np.diff(np.append(begins, len(key))))
    seen, left = np.zeros(len(key), np.float32), np.ones(len(begins), np.float32)
    run = np.repeat(np.arange(len(begins)), np.diff(np.append(begins, len(key))))
    for layer in range(min(int(rank.max(initial=0)) + 1, _LAYERS)):
        rows = np.flatnonzero(rank == layer)
        seen[rows] = left[run[rows]] * alpha[rows]
        left[run[rows]] *= 1.0 - alpha[rows]
    return seen


def _carriers(line: np.ndarray, lines: int) -> np.ndarray:
    """Which (n,) bool of the crossings of ``line`` (n,) carry light: as many lines of a cell as it has rows of them."""
    rooks = ROOKS.get(lines)
    if rooks is None:
        return np.ones(len(line), bool)
    table = np.zeros(lines**2, bool)
    table[np.arange(lines) * lines + np.array(rooks)] = True
    return table[line]


def _chosen(face, weight, light, faces: int) -> np.ndarray:
    """The crossings whose light stands for their face's: those that carry it, and all that show of faces where none does."""
    visible = weight > 0
    carried = np.bincount(face[visible & light], minlength=faces) > 0
    return np.flatnonzero(visible & (light | ~carried[face]))


def _sums(geometry: Geometry, surfaces: Surfaces, parts, row, cells: int, lines: int) -> np.ndarray:
    """(m, 18) float64: area, covered area A·α, A·α·n, A·α·albedo, A·α of products of n (Voxels.lie) and of where it lies, and how
    much is not covered. ``parts`` are crossings or pieces, each with the area (n,) that they stand for."""
    table, total = surfaces.albedo_by_triangle(), np.zeros((cells, 18))
    for part, share in parts:
        index, primitive = row[part.cell], part.primitive
        coverage = _coverage(surfaces, part)
        covered = share if coverage is None else share * coverage
        for axis, place in enumerate(part.places(lines)):
            total[:, 14 + axis] += np.bincount(index, covered * place, cells)
        if table is not None and coverage is None and isinstance(part, Crossings):
            # Neighbours along a row are mostly alike.
            begins = np.flatnonzero((np.diff(index, prepend=-1) != 0) | (np.diff(primitive, prepend=-1) != 0))
            index, primitive = index[begins], primitive[begins]
            share = share[begins] * np.diff(np.append(begins, len(share)))
        covered = share if coverage is None else share * coverage
        albedo = _mean_albedo(surfaces, part) if table is None else table[primitive]
        x, y, z = geometry.normals_world[primitive].T
        rows = (np.ones(len(index)), x, y, z, *albedo.T, x * x, y * y, z * z, y * z, x * z, x * y)
        total[:, 0] += np.bincount(index, share, cells)
        for column, values in enumerate(rows, start=1):
            total[:, column] += np.bincount(index, covered * values, cells)
        if coverage is not None:
            total[:, 17] += np.bincount(index, coverage < _COVERED, cells)
    return total


def _mean_albedo(surfaces: Surfaces, part: Crossings) -> np.ndarray:
    """(n, 3): the mean of both sides at crossings."""
    sides = [np.full(len(part.u), side, np.float32) for side in (1, -1)]
    return np.mean([surfaces.albedo_of_side(part.primitive, part.u, part.v, side) for side in sides], axis=0, dtype=np.float32)


def _box(grid: VoxelGrid) -> str:
    low, high = (", ".join(f"{value:.3g}" for value in corner) for corner in (grid.corner, grid.high))
    return f"from ({low}) to ({high})"
