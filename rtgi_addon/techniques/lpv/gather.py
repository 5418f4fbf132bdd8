"""Irradiance from accumulated light propagation volumes.

Convention: light that passes a cell's face as P + J (its total and vector flux) makes the irradiance that a plane in the face
would receive, E = (a·P/4 pi + b·J·w/2 pi) / s^2 for light travelling along w, with a = 2 pi/3 and b = W_front + 4·W_side·c: the
face's solid angles summed with 1 and with the cosine to w. So E is exact for a plane along the cells, and through any closed
surface of faces goes the flux of the source inside it: about a point source E(n) - E(-n) averages to flux/(4 pi r^2). A surface is
met by the light of the cell in front of it, half a cell along its normal.

As radiance L this is L_0 = (a/pi)·c_0/s^2 and L_1 = -(3b/2 pi)·c_1/s^2: incident from where intensity goes against.
"""

from math import pi

import numpy as np

from ...numerics import sh
from ...numerics.grid import trilinear
from .cascades import shares
from .grid import FRONT_SOLID_ANGLE, LINEAR, SIDE_AHEAD, SIDE_SOLID_ANGLE, LpvGrid

FACE_TOTAL = 2.0 * pi / 3.0
FACE_AHEAD = FRONT_SOLID_ANGLE + 4.0 * SIDE_SOLID_ANGLE * SIDE_AHEAD
# SH of order 1 at a direction: constant, and factor of the component.
_Y0, _Y1 = 1.0 / np.sqrt(4.0 * pi), np.sqrt(3.0 / (4.0 * pi))


def gather(grids: tuple[LpvGrid, ...], volumes: tuple[np.ndarray, ...], points: np.ndarray, normals: np.ndarray,
           dampening: bool = True) -> np.ndarray:
    """Irradiance (n, 3) float32 [W/m^2], never negative, at ``points`` (n, 3) with unit ``normals`` (n, 3).

    ``volumes`` hold each cascade's accumulated coefficients (4, 3, nz, ny, nx).
    """
    points, normals = np.asarray(points, np.float64), np.asarray(normals, np.float64)
    share = shares(grids, points)
    result = np.zeros((len(points), 3), np.float32)
    for grid, volume, weight in zip(grids, volumes, share.T, strict=True):
        rows = np.flatnonzero(weight)
        if rows.size:
            result[rows] += weight[rows, None] * _one(grid, volume, points[rows], normals[rows], dampening)
    return result


def _one(grid: LpvGrid, volume: np.ndarray, points: np.ndarray, normals: np.ndarray, dampening: bool) -> np.ndarray:
    flat = interleaved(volume)
    first = points + (0.5 * grid.cell) * normals
    total, away = _towards(sample(grid, flat, first), normals)
    area = np.float32(1.0 / grid.cell**2)
    irradiance = np.float32(FACE_TOTAL) * total - np.float32(FACE_AHEAD) * away
    if dampening:
        _, farther = _towards(sample(grid, flat, first + grid.cell * normals), normals)
        irradiance += np.float32(FACE_AHEAD - 0.5 * FACE_TOTAL) * np.maximum(away - np.maximum(farther, 0.0), 0.0)
    return np.maximum(irradiance * area, np.float32(0.0))


def interleaved(volume: np.ndarray) -> np.ndarray:
    """``volume`` (4, 3, nz, ny, nx) as (cells, 12): a cell's values side by side, which look-ups want."""
    return np.ascontiguousarray(volume.reshape(12, -1).T)


def sample(grid: LpvGrid, flat: np.ndarray, points: np.ndarray) -> np.ndarray:
    """Coefficients (n, 4, 3) float32 at ``points`` (n, 3), trilinear between the cells' centres; beyond the outermost ones theirs."""
    indices, weights = trilinear(grid.cells_of(points) - 0.5, grid.resolution)
    return np.einsum("nk,nkc->nc", weights, flat[indices]).reshape(-1, 4, 3)


def _towards(coefficients: np.ndarray, normals: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The constant part (n, 3) of intensity and the linear part (n, 3) along ``normals``."""
    along = np.stack([coefficients[:, row] for row in LINEAR], axis=1)
    return np.float32(_Y0) * coefficients[:, 0], np.float32(_Y1) * np.einsum("nac,na->nc", along, normals.astype(np.float32))


def radiance_sh(grids: tuple[LpvGrid, ...], volumes: tuple[np.ndarray, ...], points: np.ndarray, order: int) -> np.ndarray:
    """SH coefficients (n, (order + 1)^2, 3) float32 of incident radiance at free ``points`` (n, 3); bands above 1 are 0."""
    points = np.asarray(points, np.float64)
    share = shares(grids, points)
    result = np.zeros((len(points), max(sh.coefficient_count(order), 4), 3), np.float32)
    for grid, volume, weight in zip(grids, volumes, share.T, strict=True):
        rows = np.flatnonzero(weight)
        if rows.size:
            coefficients = sample(grid, interleaved(volume), points[rows]) * (weight[rows, None, None] / np.float32(grid.cell**2))
            result[rows, 0] += np.float32(FACE_TOTAL / pi) * coefficients[:, 0]
            result[rows, 1:4] -= np.float32(1.5 * FACE_AHEAD / pi) * coefficients[:, 1:]
    return result[:, : sh.coefficient_count(order)]
