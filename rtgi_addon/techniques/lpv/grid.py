"""A light propagation volume's lattice and the numbers that its shape alone gives: face solid angles, lobes, step matrices.

A cell holds an intensity I(w) [W/sr] as SH of order 1, as if all its light left from its centre. Coefficients are arrays
(4, 3, nz, ny, nx) float32: SH index 1, y, z, x (numerics.sh), colour channel, cell. A cell's total flux is sqrt(4 pi)·c0 and
its vector flux, a sum of (flux)·(lobe direction), is sqrt(3 pi)·(c3, c1, c2).
"""

from dataclasses import dataclass
from math import atan, pi, sqrt

import numpy as np

from ...numerics import sh

# SH index of the linear term along x, y and z (the order of numerics.sh is 1, y, z, x).
LINEAR = (3, 1, 2)


def _square_solid_angle(distance: float, half: float = 0.5) -> float:
    """Solid angle [sr] of a square of half side ``half`` seen from ``distance`` above its centre."""
    return 4.0 * atan(half * half / (distance * sqrt(2.0 * half * half + distance * distance)))


# From a cell's centre: a neighbour's far face, and each of its four side faces. The five fill the face in between, a sixth of
# the sphere. Kaplanyan and Dachsbacher 2010.
FRONT_SOLID_ANGLE = _square_solid_angle(1.5)
SIDE_SOLID_ANGLE = (_square_solid_angle(0.5) - FRONT_SOLID_ANGLE) / 4.0
# Cosines of the direction to a side face's centre with the way to the neighbour and with that face's normal.
SIDE_AHEAD, SIDE_ACROSS = 2.0 / sqrt(5.0), 1.0 / sqrt(5.0)
# SH of the clamped cosine: I(w) = flux/pi · max(0, n·w) has coefficients flux/pi · (COSINE_0, COSINE_1·n).
COSINE_0, COSINE_1 = sqrt(pi) / 2.0, sqrt(pi / 3.0)
# Coefficients of one watt (c0) and of one watt's direction (c1).
PER_FLUX, PER_VECTOR = COSINE_0 / pi, COSINE_1 / pi


@dataclass(frozen=True)
class LpvGrid:
    """Cubic cells along the world's axes: ``corner`` (3,) lowest corner [m], ``cell`` side of a cell [m], ``resolution``
    (x, y, z) cells."""

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

    def inside(self, points_world: np.ndarray) -> np.ndarray:
        """(n,) bool: which of ``points_world`` (n, 3) lie in the volume."""
        cells = self.cells_of(points_world)
        return np.all((cells >= 0) & (cells < self.resolution), axis=1)

    def empty(self) -> np.ndarray:
        """Coefficients (4, 3, nz, ny, nx) float32 of darkness."""
        return np.zeros((4, 3, *self.shape), np.float32)


def total_flux(coefficients: np.ndarray) -> np.ndarray:
    """Flux (3,) float64 [W] of all cells of ``coefficients`` (4, 3, nz, ny, nx)."""
    return coefficients[0].sum(axis=(1, 2, 3), dtype=np.float64) / PER_FLUX


def face_directions() -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """The 30 ways out of a cell: neighbour offsets (30, 3) int, directions (30, 3) to the neighbours' faces, the faces' own
    outward normals (30, 3) and their solid angles (30,), which sum to 4 pi."""
    offsets, directions, normals, solid_angles = [], [], [], []
    for offset in np.concatenate([np.eye(3, dtype=int), -np.eye(3, dtype=int)]):
        for normal in np.concatenate([np.eye(3, dtype=int), -np.eye(3, dtype=int)]):
            ahead = int(offset @ normal)
            if ahead < 0:
                continue
            offsets.append(offset)
            normals.append(normal)
            directions.append(offset if ahead else offset * SIDE_AHEAD + normal * SIDE_ACROSS)
            solid_angles.append(FRONT_SOLID_ANGLE if ahead else SIDE_SOLID_ANGLE)
    return np.array(offsets), np.array(directions, np.float64), np.array(normals, np.float64), np.array(solid_angles)


def step_matrices() -> tuple[np.ndarray, np.ndarray]:
    """Unblocked propagation: neighbour offsets (6, 3) int and matrices (6, 4, 4) float64 that take a cell's coefficients to
    what its neighbour at that offset gets of them in one step."""
    offsets, directions, normals, solid_angles = face_directions()
    lobes = np.concatenate([np.full((30, 1), PER_FLUX), PER_VECTOR * normals[:, [1, 2, 0]]], axis=1)
    single = lobes[:, :, None] * (solid_angles[:, None] * sh.evaluate(directions, 1))[:, None, :]
    return offsets[::5], single.reshape(6, 5, 4, 4).sum(axis=1)
