"""A hierarchy as lists that any reader can hold: the row of every cell of all levels, and of each row what is in it and what it
shows."""

from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from .grid import FACES, VoxelGrid
from .hierarchy import Hierarchy, Level

# Numbers of what a voxel holds: optical depth along x, y, z, whether it adds (Level.adds), the sheet's shares along x, y, z, how
# much of its plane it fills, and that plane.
CELL_NUMBERS = 12
# Colours of what it shows: of six faces optical depth times radiance, and the radiance of a sheet's two sides.
COLOURS = FACES + 2


@dataclass(frozen=True, eq=False)
class VoxelTables:
    """All levels of ``grid`` one after the other. ``shapes`` (levels, 4) int64: cells along x, y, z with the empty layer around
    them, and where the level begins in ``rows`` (c,) int32, which are 0 for empty cells, and in ``wide`` (c,) bool (Level.wide).
    ``cells`` (r, CELL_NUMBERS) and ``light`` (r, COLOURS, 3): of each row; row 0 is that of all empty cells."""

    grid: VoxelGrid
    shapes: np.ndarray
    rows: np.ndarray
    cells: np.ndarray
    light: np.ndarray
    wide: np.ndarray


def pack(hierarchy: Hierarchy) -> VoxelTables:
    """The lists of ``hierarchy``, float32."""
    shapes, rows, first = [], [], 0
    begin, cells = 0, [np.zeros((1, CELL_NUMBERS), np.float32)]
    for level in hierarchy.levels:
        shapes.append((*level.shape[::-1], begin))
        begin += len(level.row)
        rows.append(np.where(level.row > 0, level.row + first, 0).astype(np.int32))
        first += len(level.depth) - 1
        cells.append(_cells(level)[1:])
    return VoxelTables(hierarchy.grid, np.array(shapes, np.int64), np.concatenate(rows), np.concatenate(cells),
                       pack_light(hierarchy), np.concatenate([level.wide for level in hierarchy.levels]))


def pack_light(hierarchy: Hierarchy) -> np.ndarray:
    """VoxelTables.light alone, which is what changes with the light."""
    light = [np.zeros((1, COLOURS, 3), np.float32)]
    light += [np.concatenate([level.glow.reshape(-1, FACES, 3), level.shown.reshape(-1, 2, 3)], axis=1)[1:] for level in
              hierarchy.levels]
    return np.concatenate(light)


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


def unpack(tables: VoxelTables) -> Hierarchy:
    """The hierarchy that ``tables`` are the lists of."""
    levels, first = [], 0
    ends = np.append(tables.shapes[:, 3], len(tables.rows))
    for index, (begin, end) in enumerate(pairwise(ends)):
        row = tables.rows[begin:end]
        count = int((row > 0).sum())
        chosen = np.append(0, np.arange(first + 1, first + 1 + count))
        cells, light = tables.cells[chosen].astype(np.float32), tables.light[chosen].astype(np.float32)
        plane = np.concatenate([cells[:, 8:12], cells[:, 7:8]], axis=1) if index == 0 else None
        levels.append(Level(2**index, tuple(int(count) for count in tables.shapes[index, 2::-1]),
                            np.where(row > 0, row - first, 0).astype(np.int32), cells[:, :3], light[:, :FACES].reshape(-1, 3),
                            cells[:, 4:7], light[:, FACES:].reshape(-1, 3), cells[:, 3] > 0.5, plane, tables.wide[begin:end]))
        first += count
    return Hierarchy(tables.grid, tuple(levels))


def _cells(level: Level) -> np.ndarray:
    cells = np.zeros((len(level.depth), CELL_NUMBERS), np.float32)
    cells[:, 0:3], cells[:, 3], cells[:, 4:7] = level.depth, level.adds, level.sheet
    if level.plane is not None:
        cells[:, 7], cells[:, 8:12] = level.plane[:, 4], level.plane[:, :4]
    return cells
