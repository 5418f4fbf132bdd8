"""The geometry volume: how much surface stands in the way of light between cells, which way it faces and what it reflects.

Kaplanyan and Dachsbacher 2010: surface elements (surfels) are gathered in a lattice half a cell off that of the
light, so that its samples are the corners of the light's cells. On the way w through a face with normal f light is blocked with
chance B(w) = sum of A·|n·w| / (s^2·|f·w|), at most 1, interpolated from the face's four corners: the share of the face's own
cross-section that surfaces cover. The paper takes the sum from a clamped lobe in SH of order 1 per corner, which lets a quarter
of the light through a wall that it meets head-on. Here A·|n| is kept for the three axes, so a wall along the cells is tight from
both sides. For the oblique directions to side faces the axes' shares add up, which is exact for such walls and too much for
slanted ones.
"""

from dataclasses import dataclass
from math import pi

import numpy as np

from .grid import FRONT_SOLID_ANGLE, SIDE_ACROSS, SIDE_AHEAD, SIDE_SOLID_ANGLE, LpvGrid


@dataclass(frozen=True, eq=False)
class Surfels:
    """Surface elements: ``positions`` (n, 3) [m], unit ``normals`` (n, 3), ``area`` (n,) [m^2], ``albedo`` (n, 3)."""

    positions: np.ndarray
    normals: np.ndarray
    area: np.ndarray
    albedo: np.ndarray


@dataclass(frozen=True, eq=False)
class GeometryVolume:
    """Sums over the surfels about each corner of ``grid``'s cells, over the area of a cell's face.

    ``values`` (10, nz + 1, ny + 1, nx + 1) float32: coverage A/s^2; A·|n|/s^2 along x, y, z; A·n/s^2 along x, y, z; A·albedo/s^2 by
    channel.
    """

    grid: LpvGrid
    values: np.ndarray

    @property
    def coverage(self) -> np.ndarray:
        """(nz + 1, ny + 1, nx + 1) float32: surface area about each corner over the area of a face."""
        return self.values[0]

    @property
    def is_empty(self) -> bool:
        """True if no surface lies in the volume."""
        return not self.coverage.any()


def inject_surfels(grid: LpvGrid, surfels: Surfels) -> GeometryVolume:
    """The geometry volume of ``surfels``; those more than half a cell outside ``grid`` are left out."""
    corners = np.floor(grid.cells_of(surfels.positions) + 0.5).astype(np.int64)
    kept = np.flatnonzero(np.all((corners >= 0) & (corners <= grid.resolution), axis=1))
    corners = corners[kept]
    nx, ny, nz = (count + 1 for count in grid.resolution)
    index = (corners[:, 2] * ny + corners[:, 1]) * nx + corners[:, 0]
    share = surfels.area[kept].astype(np.float64) / grid.cell**2
    normals, albedo = surfels.normals[kept], surfels.albedo[kept]
    columns = [np.ones(len(kept)), *np.abs(normals).T, *normals.T, *albedo.T]
    values = np.stack([np.bincount(index, share * column, nx * ny * nz) for column in columns]).astype(np.float32)
    return GeometryVolume(grid, values.reshape(len(columns), nz, ny, nx))


def combine(volumes: list[GeometryVolume]) -> GeometryVolume:
    """One volume of several that each see a part of the surfaces: at every corner the one with the most coverage counts, since
    what two views see of a surface is the same surface. Raises ValueError for none."""
    best, *others = volumes
    values = best.values
    for other in others:
        values = np.where(other.coverage > values[0], other.values, values)
    return GeometryVolume(best.grid, values)


@dataclass(frozen=True, eq=False)
class Blocking:
    """What the faces of ``grid``'s cells do to light, as flat arrays over cells.

    ``strides`` are the index steps to the next cell along x, y, z. ``through`` (3, 4, N): for the face above each cell along an
    axis, the factors T_0, T_w, T_a, T_b of `propagation` (0 at the volume's border). ``blocked`` (3, 2, 2, N): for the faces above
    and below, the factors of (P + 2s·J_k) and (P + 2s·c·J_k) that meet a blocker; ``normal`` (3, 2, 3, N): its unit normal along
    the axis and the two that follow it, turned so that the first is not negative; ``reflectance`` (3, 2, 3, N): its albedo by
    channel. None where nothing is reflected.
    """

    strides: tuple[int, int, int]
    through: np.ndarray
    blocked: np.ndarray | None = None
    normal: np.ndarray | None = None
    reflectance: np.ndarray | None = None


def vacuum(grid: LpvGrid) -> Blocking:
    """Faces that let everything through."""
    return face_blocking(GeometryVolume(grid, np.zeros((10, *(count + 1 for count in grid.shape)), np.float32)), bounces=False)


def face_blocking(volume: GeometryVolume, bounces: bool = True) -> Blocking:
    """The faces' transmittance from the corners' coverage; with ``bounces`` also what the blockers reflect."""
    grid = volume.grid
    nx, ny, _ = grid.resolution
    strides = (1, nx, nx * ny)
    through = np.zeros((3, 4, *grid.shape), np.float32)
    blocked = normal = reflectance = None
    if bounces:
        blocked, normal, reflectance = (np.empty((3, 2, rows, *grid.shape), np.float32) for rows in (2, 3, 3))
    for axis in range(3):
        face = _face_means(volume.values, axis)
        order = [(axis + turn) % 3 for turn in range(3)]
        ahead, *across = (face[1 + other] for other in order)
        front = np.minimum(ahead, np.float32(1.0))
        sides = [np.minimum(ahead + np.float32(SIDE_ACROSS / SIDE_AHEAD) * other, np.float32(1.0)) for other in across]
        inner = _along(axis, slice(1, -1))
        below = _along(axis, slice(None, -1))
        factors = through[axis][(slice(None), *below)]
        factors[0] = (1.0 - front[inner]) * np.float32(FRONT_SOLID_ANGLE / (4.0 * pi))
        clear = [1.0 - side[inner] for side in sides]
        factors[1] = (clear[0] + clear[1]) * np.float32(2.0 * SIDE_SOLID_ANGLE / (4.0 * pi))
        for index in range(2):
            factors[2 + index] = clear[index] * np.float32(2.0 * SIDE_SOLID_ANGLE * SIDE_ACROSS / (2.0 * pi))
        if bounces:
            facing = np.stack([face[4 + other] for other in order])
            facing *= np.where(facing[0] < 0, np.float32(-1.0), np.float32(1.0))
            length = np.sqrt(np.square(facing).sum(axis=0))
            # Surfaces that face both ways cancel: they send light back along the axis.
            plain = length < np.float32(0.25) * face[0]
            facing /= np.maximum(length, np.finfo(np.float32).tiny)
            facing[:, plain] = 0.0
            facing[0, plain] = 1.0
            albedo = face[7:10] / np.maximum(face[0], np.finfo(np.float32).tiny)
            stopped = np.stack([front * np.float32(FRONT_SOLID_ANGLE / (4.0 * pi)),
                                (sides[0] + sides[1]) * np.float32(2.0 * SIDE_SOLID_ANGLE / (4.0 * pi))])
            for end, part in enumerate((slice(1, None), slice(None, -1))):
                at = (slice(None), *_along(axis, part))
                blocked[axis, end], normal[axis, end], reflectance[axis, end] = stopped[at], facing[at], albedo[at]
    flat = [None if array is None else array.reshape(*array.shape[:-3], -1) for array in (through, blocked, normal, reflectance)]
    return Blocking(strides, *flat)


def _along(axis: int, part: slice) -> tuple[slice, slice, slice]:
    """Index into (z, y, x) that takes ``part`` along x, y or z."""
    return tuple(part if 2 - axis == dimension else slice(None) for dimension in range(3))


def _face_means(values: np.ndarray, axis: int) -> np.ndarray:
    """Means of the four corners of every face across ``axis``: (rows, …) with one more sample along the axis than cells."""
    for other in range(3):
        if other != axis:
            low, high = ((slice(None), *_along(other, part)) for part in (slice(None, -1), slice(1, None)))
            values = (values[low] + values[high]) * np.float32(0.5)
    return values
