"""What media do to light that goes from cell to cell of a volume: they take of it, and scatter it within the cell.

A step stands for two thirds of a cell's side: all of a cell's flux P = phi·s^2 leaves in it, while on a way s each of its six faces
would pass a quarter of phi·s^2.

Of what a medium takes from a step, the share that it scatters stays in the cell as flux and loses its direction but for the phase
function's mean cosine: light diffuses, as in M. Billeter, E. Sintorn, U. Assarsson, "Real-Time Multiple Scattering Using Light
Propagation Volumes", I3D 2012. What it is not: lamps' light that scatters before any surface, and emission, are not in it.
"""

import numpy as np

from ...transport.media.phase import phase_moments
from ...transport.media.table import MediaTable
from .grid import LpvGrid

# How much of a cell's side a step stands for.
STEP = 2.0 / 3.0
# Points along each side of a cell whose coefficients are averaged, and cells at once.
_WITHIN, _AT_ONCE = 2, 1 << 13


def kept_in_media(grid: LpvGrid, media: MediaTable) -> np.ndarray | None:
    """Which share of the flux and of the vector flux (2, 3, N) float32, by colour channel, a step leaves in each cell of ``grid``;
    None where no medium is."""
    if media.is_empty:
        return None
    result = np.ones((2, 3, grid.count), np.float32)
    moments = [phase_moments(filling.medium.phase, 1)[1] for filling in media.fillings]
    inner = (np.stack(np.meshgrid(*[np.arange(_WITHIN)] * 3, indexing="ij"), axis=-1).reshape(-1, 3) + 0.5) / _WITHIN
    for first in range(0, grid.count, _AT_ONCE):
        index = np.arange(first, min(first + _AT_ONCE, grid.count))
        cells = np.stack(np.unravel_index(index, grid.shape), axis=1)[:, ::-1]
        points = np.asarray(grid.corner) + grid.cell * (cells[:, None] + inner).reshape(-1, 3)
        found = media.at(points)
        left = np.exp(-STEP * grid.cell * _mean(sum(one.extinction for one in found)))
        scattering = [_mean(one.scattering) for one in found]
        taken = (1.0 - left) / np.maximum(_mean(sum(one.extinction for one in found)), 1e-300)
        result[0, :, index] = left + taken * sum(scattering)
        result[1, :, index] = left + taken * sum(moment * part for moment, part in zip(moments, scattering, strict=True))
    return result if np.any(result < 1.0) else None


def _mean(values: np.ndarray) -> np.ndarray:
    """The mean (n, 3) over each cell's points."""
    return values.reshape(-1, _WITHIN**3, 3).mean(axis=1)
