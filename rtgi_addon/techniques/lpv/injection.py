"""Virtual lights into a light propagation volume: each becomes a cosine lobe of intensity in one cell."""

import numpy as np

from .grid import LINEAR, PER_FLUX, PER_VECTOR, LpvGrid


def inject(grid: LpvGrid, positions: np.ndarray, normals: np.ndarray, flux: np.ndarray) -> np.ndarray:
    """Coefficients (4, 3, nz, ny, nx) float32 of lights at ``positions`` (n, 3) that send ``flux`` (n, 3) [W] about ``normals``
    (n, 3) with I = flux/pi · cosine (Kaplanyan and Dachsbacher 2010).

    A light is moved by half a cell along its normal first, into the cell in front of its surface. What then lies outside
    the volume is left out. Sums are in float64.
    """
    cells = np.floor(grid.cells_of(positions) + 0.5 * np.asarray(normals, np.float64)).astype(np.int64)
    nx, ny = grid.resolution[:2]
    kept = np.flatnonzero(np.all((cells >= 0) & (cells < grid.resolution), axis=1))
    cells, normals, flux = cells[kept], np.asarray(normals)[kept], np.asarray(flux)[kept]
    index = (cells[:, 2] * ny + cells[:, 1]) * nx + cells[:, 0]
    result = grid.empty().reshape(4, 3, -1)
    for channel in range(3):
        result[0, channel] = PER_FLUX * np.bincount(index, flux[:, channel], grid.count)
        for axis, row in enumerate(LINEAR):
            result[row, channel] = PER_VECTOR * np.bincount(index, flux[:, channel] * normals[:, axis], grid.count)
    return result.reshape(4, 3, *grid.shape)
