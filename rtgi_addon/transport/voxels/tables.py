"""A hierarchy as lists that any reader can hold: the row of every cell of all levels, and of each row what is in it and what it
shows. Nested grids are its first levels, one after the other, and who is in one of them begins at its own."""

from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np

from . import cascades, cones, rays
from .cascades import clipmap
from .grid import FACES, VoxelGrid
from .hierarchy import Hierarchy, Level
from .voxelize import NO_PLATE

# Numbers of what a voxel holds: optical depth along x, y, z, whether it adds (Level.adds), the sheet's shares along x, y, z, how
# much of its plane it fills, and that plane.
CELL_NUMBERS = 12
# Colours of what it shows: of six faces optical depth times radiance, and the radiance of a sheet's two sides.
COLOURS = FACES + 2
# What readers in other languages call the numbers of rays, cones and nested grids.
NUMBERS = {"VOXEL_SPENT": rays.SPENT, "VOXEL_GAP": rays.GAP, "VOXEL_PLATE": rays.PLATE, "VOXEL_NO_PLATE": NO_PLATE,
           "VOXEL_TOUCHING": rays.TOUCHING, "VOXEL_OWN_AXIS": rays.OWN_AXIS, "VOXEL_OWN_PLANE": rays.OWN_PLANE,
           "VOXEL_EDGE": cascades.EDGE, "VOXEL_BLEND": cascades.BLEND, "CONE_TIGHT": cones.TIGHT, "CONE_SUPPORT": cones.SUPPORT}


@dataclass(frozen=True, eq=False)
class VoxelTables:
    """All levels of ``grids``, finest first: one of each, and then those that are filtered from the last. ``shapes`` (levels, 4)
    int64: cells along x, y, z with the empty layer around them, and where the level begins in ``rows`` (c,) int32, which are 0 for
    empty cells, and in ``wide`` (c,) bool (Level.wide). ``cells`` (r, CELL_NUMBERS) and ``light`` (r, COLOURS, 3): of each row; row
    0 is that of all empty cells.

    Cells of grids hold optical depth. From the grids within them those that add block 1 - e^-τ, and show as much less.
    """

    grids: tuple[VoxelGrid, ...]
    shapes: np.ndarray
    rows: np.ndarray
    cells: np.ndarray
    light: np.ndarray
    wide: np.ndarray

    @property
    def grid(self) -> VoxelGrid:
        """The finest."""
        return self.grids[0]

    @property
    def origins(self) -> np.ndarray:
        """(levels, 3) float64: corners of the levels from the finest grid's, in its cells. Whole numbers, as grids are nested."""
        corners = [(np.asarray(grid.corner) - self.grid.corner) / self.grid.cell for grid in self.grids]
        return np.array([*corners, *[corners[-1]] * (len(self.shapes) - len(corners))])


def pack(hierarchies: tuple[Hierarchy, ...]) -> VoxelTables:
    """The lists, float32, of what receivers in each of nested grids read (cascades.py, ``clipmap``), or in the only one."""
    levels, shapes, rows, first = _levels(hierarchies), [], [], 0
    begin, cells, light = 0, [np.zeros((1, CELL_NUMBERS), np.float32)], [np.zeros((1, COLOURS, 3), np.float32)]
    for index, level in enumerate(levels):
        shapes.append((*level.shape[::-1], begin))
        begin += len(level.row)
        rows.append(np.where(level.row > 0, level.row + first, 0).astype(np.int32))
        first += len(level.depth) - 1
        # What adds from afar does not to those who are in the grid itself.
        adds = hierarchies[index - 1].levels[1].adds if 0 < index < len(hierarchies) else level.adds
        cells.append(_cells(level, adds)[1:])
        light.append(np.concatenate([level.glow.reshape(-1, FACES, 3), level.shown.reshape(-1, 2, 3)], axis=1)[1:])
    return VoxelTables(tuple(hierarchy.grid for hierarchy in hierarchies), np.array(shapes, np.int64), np.concatenate(rows),
                       np.concatenate(cells), np.concatenate(light), np.concatenate([level.wide for level in levels]))


def _levels(hierarchies: tuple[Hierarchy, ...]) -> list[Level]:
    return [*(hierarchy.levels[0] for hierarchy in hierarchies), *hierarchies[-1].levels[1:]]


def row_numbers(tables: VoxelTables) -> np.ndarray:
    """(c,) float32 for shaders: the row of every cell of every level, and a half where it or one of the seven cells up from it,
    which samples between them read, is not empty; and a quarter where those are too wide for the walls in them."""
    numbers, ends = tables.rows.astype(np.float32), np.append(tables.shapes[:, 3], len(tables.rows))
    for (nx, ny, nz, _), (begin, end) in zip(tables.shapes, pairwise(ends), strict=True):
        any_of_eight = (tables.rows[begin:end] > 0).reshape(nz, ny, nx)
        for axis in range(3):
            here, up = (np.moveaxis(any_of_eight, axis, 0)[part] for part in (slice(None, -1), slice(1, None)))
            here |= up
        numbers[begin:end] += np.float32(0.5) * any_of_eight.ravel()
    numbers += np.float32(0.25) * tables.wide
    return numbers


def unpack(tables: VoxelTables) -> tuple[Hierarchy, ...]:
    """What ``tables`` are the lists of."""
    levels, flags, first, count = [], [], 0, len(tables.grids)
    ends = np.append(tables.shapes[:, 3], len(tables.rows))
    for index, (begin, end) in enumerate(pairwise(ends)):
        row = tables.rows[begin:end]
        held = int((row > 0).sum())
        chosen = np.append(0, np.arange(first + 1, first + 1 + held))
        cells, light = tables.cells[chosen].astype(np.float32), tables.light[chosen].astype(np.float32)
        plane = np.concatenate([cells[:, 8:12], cells[:, 7:8]], axis=1) if index < count else None
        adds = cells[:, 3] > 0.5
        flags.append(adds)
        levels.append(Level(2 ** max(index - count + 1, 0), tuple(int(extent) for extent in tables.shapes[index, 2::-1]),
                            np.where(row > 0, row - first, 0).astype(np.int32), cells[:, :3], light[:, :FACES].reshape(-1, 3),
                            cells[:, 4:7], light[:, FACES:].reshape(-1, 3), adds if index >= count else np.zeros_like(adds), plane,
                            tables.wide[begin:end]))
        first += held
    finest = tuple(Hierarchy(grid, (level,)) for grid, level in zip(tables.grids[:-1], levels, strict=False))
    coarse = tuple(Hierarchy(grid, (_from_afar(level, adds),))
                   for grid, level, adds in zip(tables.grids[1:], levels[1:], flags[1:], strict=False))
    return clipmap((*finest, Hierarchy(tables.grids[-1], tuple(levels[count - 1:]))), coarse)


def _from_afar(level: Level, adds: np.ndarray) -> Level:
    """A grid's own ``level`` as those see it who are in a finer one."""
    taken = np.where(adds[:, None], -np.expm1(-level.depth), level.depth)
    share = taken / np.maximum(level.depth, np.finfo(np.float32).tiny)
    return replace(level, depth=taken, glow=level.glow * np.repeat(share, 2, axis=1).reshape(-1, 1), adds=adds, plane=None)


def _cells(level: Level, adds: np.ndarray) -> np.ndarray:
    cells = np.zeros((len(level.depth), CELL_NUMBERS), np.float32)
    cells[:, 0:3], cells[:, 3], cells[:, 4:7] = level.depth, adds, level.sheet
    if level.plane is not None:
        cells[:, 7], cells[:, 8:12] = level.plane[:, 4], level.plane[:, :4]
    return cells
