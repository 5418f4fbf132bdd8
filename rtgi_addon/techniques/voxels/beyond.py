"""How much of the sky surfaces outside the grid of voxels hide, where rays leave it: a table for readers that have no rays."""

import numpy as np

from ...numerics.octahedral import texel_directions
from ...transport.context import LightContext
from ...transport.voxels import VoxelGrid

# Patches along each edge of the grid's sides, and directions from each: texels along the side of an octahedral tile.
PATCHES, DIRECTIONS = 8, 32
# Of directions that do not leave by their side, the nearest that do are asked: cosine to the side.
_LEAST = 0.02


def goes_on(context: LightContext, grid: VoxelGrid) -> bool:
    """Whether anything stands outside the grid that can hide the sky from what has left it."""
    corners = context.geometry.triangles_world.reshape(-1, 3)
    return bool(np.any(corners.min(axis=0) < grid.corner) or np.any(corners.max(axis=0) > grid.high))


def hidden_sky(context: LightContext, grid: VoxelGrid) -> np.ndarray:
    """(6, PATCHES, PATCHES, DIRECTIONS²) float32: what of the sky gets through to middles of patches of the grid's sides (2·axis
    and, the high one, + 1), [second, first] of the axes after it, from octahedral directions."""
    middle = (np.arange(PATCHES) + 0.5) / PATCHES
    first, second = np.meshgrid(middle, middle)
    size, towards = np.asarray(grid.cell) * grid.resolution, texel_directions(DIRECTIONS).astype(np.float64)
    result = np.empty((6, PATCHES**2, DIRECTIONS**2), np.float32)
    for side in range(6):
        axis, sign = side // 2, 2 * (side % 2) - 1
        place = np.zeros((PATCHES**2, 3))
        place[:, axis], place[:, (axis + 1) % 3], place[:, (axis + 2) % 3] = side % 2, first.ravel(), second.ravel()
        points = np.repeat(place * size + grid.corner, len(towards), axis=0).astype(np.float32)
        outward = towards.copy()
        outward[:, axis] = sign * np.maximum(sign * outward[:, axis], _LEAST)
        outward /= np.linalg.norm(outward, axis=1, keepdims=True)
        directions = np.tile(outward.astype(np.float32), (PATCHES**2, 1))
        passed = context.tracers.diffuse.transmittance(points, directions, looks=True)
        result[side] = np.asarray(passed, np.float32).reshape(len(points), -1).mean(axis=1).reshape(PATCHES**2, -1)
    return result.reshape(6, PATCHES, PATCHES, -1)
