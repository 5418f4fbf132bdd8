"""Irradiance from accumulated light propagation volumes.

Convention: a cell of total flux P and vector flux F (`grid`) sends E = (P/6 + F·w/3)/s^2 through its face towards w, and that is
what a surface on the face is given: all that surfaces receive is what was stopped on its way. As radiance that is
L = (P + 3·F·w)/(6 pi·s^2), so L_0 = 2/(3 s^2)·c_0 and L_1 = -2/(3 s^2)·c_1: it comes from where intensity goes against.

A surface takes its light half a cell before it, from cells on its side of its plane and of the walls beside it (`standing`): from
where light that meets it is stopped, so that irradiance summed over surfaces is the flux that they stop.
``dampening`` multiplies by the directional derivative of Kaplanyan and Dachsbacher 2010: where irradiance falls off with height,
the surface lights itself. It takes light away, and keeps no sums.
"""

from math import pi

import numpy as np

from ...numerics import sh
from .cascades import shares
from .grid import LINEAR, LpvGrid
from .injection import AT_ONCE
from .standing import open_weights

# E = (FACE_TOTAL·Y0·c0 - FACE_AHEAD·Y1·c1·n)/s^2: the flux out of a cell in terms of its coefficients.
FACE_TOTAL, FACE_AHEAD = 2.0 * pi / 3.0, 4.0 * pi / 9.0
# How far in front of a surface its light is taken, in cells; half a cell leads to the centre of the first.
SURFACE_CELLS = 0.5
# SH of order 1 at a direction: constant, and factor of the component.
_Y0, _Y1 = 1.0 / np.sqrt(4.0 * pi), np.sqrt(3.0 / (4.0 * pi))


def gather(grids: tuple[LpvGrid, ...], volumes: tuple[np.ndarray, ...], points: np.ndarray, normals: np.ndarray,
           dampening: bool = False, faces: tuple[np.ndarray | None, ...] | None = None) -> np.ndarray:
    """Irradiance (n, 3) float32 [W/m^2], never negative, at ``points`` (n, 3) with unit ``normals`` (n, 3).

    ``volumes`` hold each cascade's accumulated coefficients (4, 3, nz, ny, nx), ``faces`` what its faces are, as of `standing`
    (None: all open).
    """
    points, normals = np.asarray(points, np.float64), np.asarray(normals, np.float64)
    share = shares(grids, points)
    result = np.zeros((len(points), 3), np.float32)
    for grid, volume, weight, of_grid in zip(grids, volumes, share.T, faces or (None,) * len(grids), strict=True):
        flat, lit = interleaved(volume), np.flatnonzero(weight)
        for rows in np.split(lit, range(AT_ONCE, len(lit), AT_ONCE)):
            result[rows] += weight[rows, None] * _of_cascade(grid, flat, of_grid, points[rows], normals[rows], dampening)
    return result


def _of_cascade(grid, flat, faces, points: np.ndarray, normals: np.ndarray, dampening: bool) -> np.ndarray:
    irradiance = _irradiance(grid, flat, faces, points, normals, SURFACE_CELLS)
    if dampening:
        farther = _irradiance(grid, flat, faces, points, normals, SURFACE_CELLS + 1.0)
        irradiance *= np.square(np.minimum(farther / np.maximum(irradiance, np.float32(1e-30)), np.float32(1.0)))
    return irradiance


def _irradiance(grid, flat, faces, points, normals, cells):
    coefficients = sample(grid, flat, faces, points, normals, cells)
    along = np.stack([coefficients[:, row] for row in LINEAR], axis=1)
    of_flux, of_vector = irradiance_factors(grid)
    total = np.float32(of_flux) * coefficients[:, 0]
    away = np.float32(of_vector) * np.einsum("nac,na->nc", along, normals.astype(np.float32))
    return np.maximum(total - away, np.float32(0.0))


def irradiance_factors(grid: LpvGrid) -> tuple[float, float]:
    """What coefficient 0, and what 1 to 3 along the normal, are multiplied by to give irradiance: SH constants and the faces' solid
    angles, over the area of a face."""
    return _Y0 * FACE_TOTAL / grid.cell**2, _Y1 * FACE_AHEAD / grid.cell**2


def interleaved(volume: np.ndarray) -> np.ndarray:
    """``volume`` (4, 3, nz, ny, nx) as (cells, 12): a cell's values side by side, which look-ups want."""
    return np.ascontiguousarray(volume.reshape(12, -1).T)


def sample(grid: LpvGrid, flat: np.ndarray, faces: np.ndarray | None, points: np.ndarray, normals: np.ndarray | None = None,
           cells: float = 0.0) -> np.ndarray:
    """Coefficients (n, 4, 3) float32 at ``points`` (n, 3), trilinear between the cells' centres; beyond the outermost ones theirs.

    With ``normals`` (n, 3) ``cells`` before the surfaces at the points, and only from before their planes. Cells do not count as
    far as walls stand before them (`standing`).
    """
    base, last = grid.cells_of(points), np.asarray(grid.resolution) - 1
    place = base - 0.5 if normals is None else base + cells * normals - 0.5
    place = np.clip(place, 0, last)
    low = np.minimum(np.floor(place).astype(np.int64), np.maximum(last - 1, 0))
    indices, weights = open_weights(faces, low, place - low, base, normals, grid.resolution)
    return np.einsum("nk,nkc->nc", weights, flat[indices]).reshape(-1, 4, 3)


def intensity_of_radiance(grid: LpvGrid) -> np.ndarray:
    """Factors (4,) float32 that take SH coefficients of incident radiance to those of a cell's intensity."""
    return np.array([1.5, -1.5, -1.5, -1.5], np.float32) * np.float32(grid.cell**2)


def radiance_sh(grids: tuple[LpvGrid, ...], volumes: tuple[np.ndarray, ...], points: np.ndarray, order: int,
                faces: tuple[np.ndarray | None, ...] | None = None) -> np.ndarray:
    """SH coefficients (n, (order + 1)^2, 3) float32 of incident radiance at free ``points`` (n, 3); bands above 1 are 0.
    ``faces`` as of ``gather``."""
    points = np.asarray(points, np.float64)
    share = shares(grids, points)
    result = np.zeros((len(points), max(sh.coefficient_count(order), 4), 3), np.float32)
    for grid, volume, weight, of_grid in zip(grids, volumes, share.T, faces or (None,) * len(grids), strict=True):
        rows = np.flatnonzero(weight)
        if rows.size:
            coefficients = sample(grid, interleaved(volume), of_grid, points[rows]) / intensity_of_radiance(grid)[:, None]
            result[rows, :4] += weight[rows, None, None] * coefficients
    return result[:, : sh.coefficient_count(order)]
