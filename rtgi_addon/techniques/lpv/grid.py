"""A light propagation volume's lattice and the numbers that its shape alone gives: lobes, what crosses a face, step matrices.

A cell holds an intensity I(w) [W/sr] as SH of order 1, as if all its light left from its centre. Coefficients are arrays
(4, 3, nz, ny, nx) float32: SH index 1, y, z, x (numerics.sh), colour channel, cell. With a cell's flux P and vector flux F, the
integral of w·I(w), I(w) = (P + 3·F·w)/4 pi: P is sqrt(4 pi)·c0 and F is sqrt(4 pi/3)·(c3, c1, c2).
"""

from dataclasses import dataclass
from math import pi, sqrt

import numpy as np

from ...transport.voxels.grid import VoxelGrid

# SH index of the linear term along x, y and z (the order of numerics.sh is 1, y, z, x).
LINEAR = (3, 1, 2)
# What goes through each face of a cell in a step towards w: these shares of P and of F·w. They are half-range moments of its
# radiance, the integrals of w·u over the u with w·u > 0, times 2/3: then all of a cell's light leaves it.
FLUX_OUT, VECTOR_OUT = 1.0 / 6.0, 1.0 / 3.0
# The vector flux that goes with it, integrals of w·u times u: along w of P and of F·w, and of the rest of F. The last two are those
# of light that planes send out, which is even over half the sphere, 2/3·1/3 and, of 2/3·2/(3 pi) = .1415, what makes 2·2/9 + 4·5/36
# one: no vector flux comes of nothing, and before an endless plane that sends out 1 W per face P = 3 W and F = 3/2 W, so that
# P/6 = F/3: none of its light comes back to it. (Of SH of order 1 they are 1/4 and 1/8, and 6 % of it do.)
VECTOR_OF_FLUX, VECTOR_AHEAD, VECTOR_ACROSS = 1.0 / 9.0, 2.0 / 9.0, 5.0 / 36.0
# SH of the clamped cosine: I(w) = flux/pi · max(0, n·w) has coefficients flux/pi · (COSINE_0, COSINE_1·n), a vector flux of 2/3.
COSINE_0, COSINE_1, LOBE_VECTOR = sqrt(pi) / 2.0, sqrt(pi / 3.0), 2.0 / 3.0
# Coefficients of one watt (c0) and of one watt of vector flux (c1).
PER_FLUX, PER_VECTOR = COSINE_0 / pi, COSINE_1 / (LOBE_VECTOR * pi)


@dataclass(frozen=True)
class LpvGrid(VoxelGrid):
    """A lattice of cubes whose cells hold light; see VoxelGrid."""

    def empty(self) -> np.ndarray:
        """Coefficients (4, 3, nz, ny, nx) float32 of darkness."""
        return np.zeros((4, 3, *self.shape), np.float32)


def lattice_across(axis: int, corner: np.ndarray, spacing: float, count) -> np.ndarray:
    """Middles (n, 3) float64 of squares of side ``spacing`` across ``axis`` from ``corner`` (3,) on, ``count`` (3,) of them along
    each of the other axes, the last of which runs fastest; 0 along ``axis``."""
    others = [(axis + 1) % 3, (axis + 2) % 3]
    first, second = np.meshgrid(*(corner[other] + (np.arange(count[other]) + 0.5) * spacing for other in others), indexing="ij")
    middles = np.zeros((first.size, 3))
    middles[:, others[0]], middles[:, others[1]] = first.ravel(), second.ravel()
    return middles


def total_flux(coefficients: np.ndarray) -> np.ndarray:
    """Flux (3,) float64 [W] of all cells of ``coefficients`` (4, 3, nz, ny, nx)."""
    return coefficients[0].sum(axis=(1, 2, 3), dtype=np.float64) / PER_FLUX


def direction_kept(resolution: tuple[int, int, int]) -> float:
    """Share of its vector flux that light keeps in a step: what gives it the mean free path of the mean chord of a cube as large
    as the volume, 4V/S = 2/3 of its side.

    A step that keeps k of the vector flux spreads light as a mean free path of 3/4 + 2/3·k/(1 - k) cells does: F settles at
    -(2/9)·k/(1 - k)·grad P, so the flux through a face is -(1/4 + (2/9)·k/(1 - k))·grad P of the physical one, a third of the path.
    A path of so many metres, not cells, is what lets finer cells converge.
    """
    return max(0.0, 1.0 - 1.0 / (max(resolution) - 0.125))


def step_matrices(kept: float = 1.0) -> tuple[np.ndarray, np.ndarray]:
    """Unblocked propagation: neighbour offsets (6, 3) int and matrices (6, 4, 4) float64 that take a cell's coefficients to
    what its neighbour at that offset gets of them in one step; ``kept`` as of ``direction_kept``."""
    offsets = np.concatenate([np.eye(3, dtype=int), -np.eye(3, dtype=int)])
    scale = np.array([PER_FLUX, PER_VECTOR, PER_VECTOR, PER_VECTOR])
    matrices = np.zeros((6, 4, 4))
    for matrix, offset in zip(matrices, offsets, strict=True):
        axis = int(np.flatnonzero(offset)[0])
        row, *others = (LINEAR[(axis + turn) % 3] for turn in range(3))
        sign = offset[axis]
        matrix[0, 0], matrix[0, row] = FLUX_OUT, sign * VECTOR_OUT
        matrix[row, 0], matrix[row, row] = sign * kept * VECTOR_OF_FLUX, kept * VECTOR_AHEAD
        for other in others:
            matrix[other, other] = kept * VECTOR_ACROSS
    return offsets, matrices * scale[:, None] / scale
