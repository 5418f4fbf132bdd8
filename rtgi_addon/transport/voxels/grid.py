"""A lattice of cubes along the world's axes."""

from dataclasses import dataclass

import numpy as np

from ...errors import BakeError

# Cells between the grid's border and what it is put around: half of one is left so that walls at the border do not lie between two.
MARGIN = 1.5
# Cells that are refused: their radiance alone would be beyond 8 GiB.
MAX_CELLS = 1 << 26
# The six ways along the axes: index 2·axis looks along +axis (and sees the low face of a cell), 2·axis + 1 along -axis.
FACES = 6


@dataclass(frozen=True)
class VoxelGrid:
    """Cubic cells along the world's axes: ``corner`` (3,) lowest corner [m], ``cell`` side of a cell [m], ``resolution``
    (x, y, z) cells. Arrays over cells are indexed [z, y, x]; a cell's flat index is (z·ny + y)·nx + x."""

    corner: tuple[float, float, float]
    cell: float
    resolution: tuple[int, int, int]

    @property
    def shape(self) -> tuple[int, int, int]:
        """(nz, ny, nx), the order of arrays."""
        return self.resolution[::-1]

    @property
    def count(self) -> int:
        """Number of cells."""
        return int(np.prod(self.resolution))

    @property
    def center(self) -> np.ndarray:
        """Centre (3,) float64 [m]."""
        return np.asarray(self.corner) + 0.5 * self.cell * np.asarray(self.resolution)

    @property
    def high(self) -> np.ndarray:
        """Highest corner (3,) float64 [m]."""
        return np.asarray(self.corner) + self.cell * np.asarray(self.resolution)

    @property
    def world_from_local(self) -> np.ndarray:
        """(4, 4) float64 of the box local [-1, 1]^3, as a ProbeVolume has it: its samples are the cells' centres."""
        matrix = np.diag([*(0.5 * self.cell * np.asarray(self.resolution, np.float64)), 1.0])
        matrix[:3, 3] = self.center
        return matrix

    def cells_of(self, points_world: np.ndarray) -> np.ndarray:
        """Points (n, 3) in units of cells from the corner: cell i reaches from i to i + 1."""
        return (np.asarray(points_world, np.float64) - self.corner) / self.cell

    def centers_of(self, cells: np.ndarray) -> np.ndarray:
        """World centres (n, 3) float64 [m] of cells with the flat indices ``cells`` (n,)."""
        nx, ny, _ = self.resolution
        column = np.stack([cells % nx, cells // nx % ny, cells // (nx * ny)], axis=1)
        return np.asarray(self.corner) + self.cell * (column + 0.5)

    def inside(self, points_world: np.ndarray) -> np.ndarray:
        """(n,) bool: which of ``points_world`` (n, 3) lie in the volume."""
        cells = self.cells_of(points_world)
        return np.all((cells >= 0) & (cells < self.resolution), axis=1)


def grid_around(box: np.ndarray, resolution: int, cell: float | None = None) -> VoxelGrid:
    """The grid around ``box`` (2, 3) [m] of ``resolution`` cells along its longest side, or of cells of side ``cell`` [m].

    Always of cubes, whatever the box: cells that were longer one way would block and light by the way that light goes. Raises
    BakeError for more cells than MAX_CELLS.
    """
    low, high = np.asarray(box, np.float64)
    extent = high - low
    if cell is None:
        cell = float(extent.max()) / (resolution - 2 * MARGIN)
    if not np.isfinite(cell) or cell <= 0:
        raise BakeError("the voxel grid has no extent", "place a probe volume around what is to be lit")
    across = extent / cell + 2 * MARGIN
    if not np.all(np.isfinite(across)) or np.prod(np.ceil(across - 1e-9)) > MAX_CELLS:
        shown = " x ".join(f"{count:.0f}" for count in np.ceil(across))
        raise BakeError(f"a voxel grid of {shown} cells of {cell:.3g} m is beyond {MAX_CELLS:,} cells",
                        "raise the cell size or lower the resolution")
    count = np.ceil(across - 1e-9).astype(int)
    corner = 0.5 * (low + high) - 0.5 * cell * count
    return VoxelGrid(tuple(float(value) for value in corner), cell, tuple(int(value) for value in count))
