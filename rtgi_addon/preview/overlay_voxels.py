"""Lit voxels as cubes, as arrays; knows no GPU."""

import numpy as np

from ..transport.voxels.grid import FACES
from ..transport.voxels.hierarchy import Hierarchy, Level

# Side of a cube in shares of its voxel's: gaps tell neighbours apart.
SIDE = 0.9


def cube_triangles() -> np.ndarray:
    """(36, 3) float32: corners of the triangles of the cube [-1, 1]³, six for each face in the order of FACES: those that eyes see
    which look along +x, along -x, along +y and so on."""
    square = np.float32([[-1, -1], [1, -1], [1, 1], [-1, -1], [1, 1], [-1, 1]])
    corners = np.empty((FACES, 6, 3), np.float32)
    for face in range(FACES):
        axis = face // 2
        corners[face][:, axis], corners[face][:, [(axis + 1) % 3, (axis + 2) % 3]] = 2 * (face % 2) - 1, square
    return corners.reshape(-1, 3)


def voxel_rows(hierarchy: Hierarchy, number: int, what: str, size: float = SIDE) -> np.ndarray:
    """(n, 28) float32, what overlay_voxel.vert.glsl reads of the voxels of a level (the coarsest for numbers beyond it): centre and
    half the side of a cube, and what its faces show, with 1 where there is anything: 'light' the radiance that they send out,
    'opacity' what is blocked along their axis."""
    level = hierarchy.levels[min(number, len(hierarchy.levels) - 1)]
    index = np.flatnonzero(level.row)
    row, (_, ny, nx) = level.row[index], level.shape
    # The array begins with an empty layer.
    place = np.stack([index % nx, index // nx % ny, index // (nx * ny)], axis=1) - 0.5 + level.offset
    opacity = opacity_of(level)[row]
    rows = np.zeros((len(row), 4 + 4 * FACES), np.float32)
    rows[:, :3] = np.asarray(hierarchy.grid.corner) + hierarchy.grid.cell * level.size * place
    rows[:, 3] = 0.5 * size * hierarchy.grid.cell * level.size
    faces = rows[:, 4:].reshape(len(row), FACES, 4)
    along = np.repeat(opacity, 2, axis=1)
    faces[..., :3] = radiance_of(level)[row] if what == "light" else along[..., None]
    faces[..., 3] = along > 0
    return rows


def opacity_of(level: Level) -> np.ndarray:
    """(r, 3) float32: what of lines along x, y, z the cells in the rows of ``level`` block."""
    return np.where(level.sheet != 0, np.abs(level.sheet), np.where(level.adds[:, None], level.depth, -np.expm1(-level.depth)))


def radiance_of(level: Level) -> np.ndarray:
    """(r, 6, 3) float32: mean radiance that the faces of cells show where they show anything."""
    depth = np.repeat(level.depth, 2, axis=1)[..., None]
    glow = level.glow.reshape(len(level.depth), FACES, 3) / np.maximum(depth, np.finfo(np.float32).tiny)
    ways = np.tile(np.float32([1, -1]), 3)
    side = (np.repeat(level.sheet, 2, axis=1) * ways > 0).astype(np.int64)
    shown = level.shown.reshape(-1, 2, 3)[np.arange(len(level.depth))[:, None], side]
    return np.where(np.repeat(level.sheet, 2, axis=1)[..., None] != 0, shown, np.where(depth > 0, glow, np.float32(0)))


def cube_colours(hierarchy: Hierarchy, number: int, what: str) -> tuple[np.ndarray, np.ndarray]:
    """World positions (n, 3) of the corners of all cubes' triangles, and their colours (n, 4), scene-linear, for shaders that know
    nothing of voxels."""
    rows = voxel_rows(hierarchy, number, what)
    positions = rows[:, None, :3] + rows[:, None, 3:4] * cube_triangles()
    colours = np.repeat(rows[:, 4:].reshape(-1, FACES, 4), 6, axis=1)
    drawn = (colours[..., 3] > 0).ravel()
    return positions.reshape(-1, 3)[drawn].astype(np.float32), colours.reshape(-1, 4)[drawn]
