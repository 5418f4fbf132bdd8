"""Irradiance from accumulated light propagation volumes.

Convention: a cell of total flux P and vector flux J (`grid`) sends E = (a·P/4 pi + b·J·w/2 pi)/s^2 through its face towards w, with
a = 2 pi/3 and b = W_front + 4·W_side·c: the face's solid angles summed with 1 and with the cosine to w. Through a closed surface
of such faces goes just the flux of the sources inside, so about a point source in vacuum E(n) - E(-n) tends to flux/(4 pi r^2)
on average over directions. As radiance L this is L_0 = (a/pi)·c_0/s^2 and L_1 = -(3b/2 pi)·c_1/s^2: it comes from where
intensity goes against.

A surface is given the light of the second cell in front of it. The first one holds what the surface itself sends out, a lobe
whose order-1 SH sends -13.8 % backwards, into its own surface. Light that spread back from there is damped by the directional
derivative of Kaplanyan and Dachsbacher 2010: where irradiance falls off with height, the surface lights itself.
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
# How far in front of a surface its light is taken, in cells; half a cell leads to the centre of the first.
SURFACE_CELLS = 1.5
# A cell's centre counts as behind a plane beyond this many cells.
BEHIND_CELLS = 1e-3
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
    irradiance = _irradiance(grid, flat, points, normals, SURFACE_CELLS)
    if dampening:
        farther = _irradiance(grid, flat, points, normals, SURFACE_CELLS + 1.0)
        irradiance *= np.square(np.minimum(farther / np.maximum(irradiance, np.float32(1e-30)), np.float32(1.0)))
    return irradiance


def _irradiance(grid, flat, points, normals, cells):
    coefficients = sample(grid, flat, points + (cells * grid.cell) * normals, points, normals)
    along = np.stack([coefficients[:, row] for row in LINEAR], axis=1)
    total = np.float32(_Y0 * FACE_TOTAL / grid.cell**2) * coefficients[:, 0]
    away = np.float32(_Y1 * FACE_AHEAD / grid.cell**2) * np.einsum("nac,na->nc", along, normals.astype(np.float32))
    return np.maximum(total - away, np.float32(0.0))


def interleaved(volume: np.ndarray) -> np.ndarray:
    """``volume`` (4, 3, nz, ny, nx) as (cells, 12): a cell's values side by side, which look-ups want."""
    return np.ascontiguousarray(volume.reshape(12, -1).T)


def sample(grid: LpvGrid, flat: np.ndarray, points: np.ndarray, planes: np.ndarray | None = None,
           normals: np.ndarray | None = None) -> np.ndarray:
    """Coefficients (n, 4, 3) float32 at ``points`` (n, 3), trilinear between the cells' centres; beyond the outermost ones theirs.

    With ``planes`` and ``normals`` (n, 3), cells whose centres lie behind the plane through a row's point do not count: behind
    a wall's face is another room, or nothing.
    """
    cells = grid.cells_of(points) - 0.5
    indices, weights = trilinear(cells, grid.resolution)
    if planes is not None:
        base = grid.cells_of(planes) - 0.5
        nx, ny, _ = grid.resolution
        height = sum((position - base[:, axis, None]) * normals[:, axis, None]
                     for axis, position in enumerate((indices % nx, indices // nx % ny, indices // (nx * ny))))
        weights = np.where(height > -BEHIND_CELLS, weights, np.float32(0.0))
        weights /= np.maximum(weights.sum(axis=1, keepdims=True), np.float32(1e-6))
    return np.einsum("nk,nkc->nc", weights, flat[indices]).reshape(-1, 4, 3)


def intensity_of_radiance(grid: LpvGrid) -> np.ndarray:
    """Factors (4,) float32 that take SH coefficients of incident radiance to those of a cell's intensity."""
    factors = np.full(4, -2.0 * pi / (3.0 * FACE_AHEAD) * grid.cell**2, np.float32)
    factors[0] = pi / FACE_TOTAL * grid.cell**2
    return factors


def radiance_sh(grids: tuple[LpvGrid, ...], volumes: tuple[np.ndarray, ...], points: np.ndarray, order: int) -> np.ndarray:
    """SH coefficients (n, (order + 1)^2, 3) float32 of incident radiance at free ``points`` (n, 3); bands above 1 are 0."""
    points = np.asarray(points, np.float64)
    share = shares(grids, points)
    result = np.zeros((len(points), max(sh.coefficient_count(order), 4), 3), np.float32)
    for grid, volume, weight in zip(grids, volumes, share.T, strict=True):
        rows = np.flatnonzero(weight)
        if rows.size:
            coefficients = sample(grid, interleaved(volume), points[rows]) / intensity_of_radiance(grid)[:, None]
            result[rows, :4] += weight[rows, None, None] * coefficients
    return result[:, : sh.coefficient_count(order)]
