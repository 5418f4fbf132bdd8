"""How much memory voxels take beside what any bake does, asked for before they are made."""

import numpy as np

from ...scene.memory import require_memory
from ...transport.context import LightContext
from ...transport.parallel import thread_count
from ...transport.surfaces.geometry import Geometry
from ...transport.voxels import VoxelGrid
from ...transport.voxels.voxelize import LINES
from .settings import VoxelSettings

# Of a place where a line meets a surface, of a cell of the grid, of one whose light is swept, and of a thread that gathers:
# measured as in scene/memory.py.
BYTES_PER_LINE, BYTES_PER_CELL, BYTES_PER_SWEPT, BYTES_PER_GATHERING = 90, 45, 420, 4 << 20


def require_voxels(context: LightContext, grids: tuple[VoxelGrid, ...], settings: VoxelSettings) -> None:
    """Raise BakeError if the voxels of ``grids`` want more memory than there is."""
    lines = sum(lines_met(context.geometry, grid) for grid in grids)
    cells = sum(grid.count for grid in grids)
    each = BYTES_PER_CELL + (BYTES_PER_SWEPT if settings.hands_on else 0)
    require_memory({"voxels": int(lines * BYTES_PER_LINE + cells * each),
                    "threads": thread_count(context.threads) * BYTES_PER_GATHERING})


def lines_met(geometry: Geometry, grid: VoxelGrid) -> float:
    """How often the lines of ``grid`` meet triangles of ``geometry``, about: LINES²·A·|n|₁/s² of what of their boxes is in it."""
    corners = geometry.triangles_world
    low, high = corners.min(axis=1).astype(np.float64), corners.max(axis=1).astype(np.float64)
    size = np.maximum(high - low, 1e-9 * grid.cell)
    inside = np.clip(np.minimum(high, grid.high) - np.maximum(low, grid.corner), 0.0, None)
    share = np.where(high - low > 0, inside / size, (low >= grid.corner) & (low <= grid.high)).prod(axis=1)
    across = np.abs(geometry.normals_world.astype(np.float64)).sum(axis=1)
    return float((LINES / grid.cell) ** 2 * (geometry.areas * across * share).sum())
