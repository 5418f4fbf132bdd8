"""Virtual lights into a light propagation volume: each becomes a cosine lobe of intensity in one cell."""

import numpy as np

from .grid import LINEAR, LOBE_VECTOR, PER_FLUX, PER_VECTOR, LpvGrid
from .standing import standing_cells

# How far before its surface a light is put, in cells: at the centre of the first.
INJECTION_CELLS = 0.5
# Surfaces whose cells are looked for at once: their temporaries are many.
AT_ONCE = 1 << 14


def cells_before(grid: LpvGrid, positions: np.ndarray, normals: np.ndarray,
                 faces: np.ndarray | None = None) -> tuple[np.ndarray, np.ndarray]:
    """Rows (m,) of the surfaces at ``positions`` (n, 3) under ``normals`` (n, 3) that stand before cells of ``grid``, and the flat
    indices (m,) of these; ``faces`` as of `standing`."""
    parts = [_cells_before(grid, positions, normals, faces, slice(start, start + AT_ONCE))
             for start in range(0, max(len(positions), 1), AT_ONCE)]
    return tuple(np.concatenate(arrays) for arrays in zip(*parts, strict=True))


def _cells_before(grid, positions, normals, faces, part: slice) -> tuple[np.ndarray, np.ndarray]:
    points, normals = grid.cells_of(positions[part]), np.asarray(normals[part], np.float64)
    place = points + INJECTION_CELLS * normals - 0.5
    low = np.floor(place).astype(np.int64)
    cells = standing_cells(faces, low, place - low, points, normals)
    kept = np.flatnonzero(np.all((cells >= 0) & (cells < grid.resolution), axis=1))
    nx, ny = grid.resolution[:2]
    return part.start + kept, (cells[kept, 2] * ny + cells[kept, 1]) * nx + cells[kept, 0]


def inject(grid: LpvGrid, positions: np.ndarray, normals: np.ndarray, flux: np.ndarray,
           faces: np.ndarray | None = None) -> np.ndarray:
    """Coefficients (4, 3, nz, ny, nx) float32 of lights at ``positions`` (n, 3) that send ``flux`` (n, 3) [W] about ``normals``
    (n, 3) with I = flux/pi · cosine (Kaplanyan and Dachsbacher 2010).

    A light is moved by half a cell along its normal first, into the cell that its surface stands before (`standing`). What then
    lies outside the volume is left out. Sums are in float64.
    """
    kept, index = cells_before(grid, positions, normals, faces)
    normals, flux = np.asarray(normals)[kept], np.asarray(flux)[kept]
    result = grid.empty().reshape(4, 3, -1)
    for channel in range(3):
        result[0, channel] = PER_FLUX * np.bincount(index, flux[:, channel], grid.count)
        for axis, row in enumerate(LINEAR):
            result[row, channel] = LOBE_VECTOR * PER_VECTOR * np.bincount(index, flux[:, channel] * normals[:, axis], grid.count)
    return result.reshape(4, 3, *grid.shape)
