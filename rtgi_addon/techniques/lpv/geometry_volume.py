"""The geometry volume: how much of each face between cells surfaces close, where and how they cross it, and what they reflect.

Kaplanyan and Dachsbacher 2010 gather surface elements (surfels) in a lattice half a cell off that of the light and interpolate
what they block from the four corners of a face. A wall that ends at a floor then covers half of the last corner, and lets
a quarter of the light through beside it. Here every face knows for itself: a surface that crosses the way from one cell's centre
to the next closes the face between them, from both sides and whatever its slope (`crossings`, for all surfaces), or surfels close
the face nearest to them by their cross-section (``inject_surfels``, for what views have seen of the surfaces).
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from .grid import LpvGrid, direction_kept
from .injection import cells_before

# The rows of a geometry volume's faces, of ROWS: of the face, and of what is met from BELOW and from ABOVE, of SIDE_ROWS each.
CLOSED, CROSSING, BELOW, ABOVE, ROWS = 0, 1, slice(2, 9), slice(9, 16), 16
SPREAD, NORMAL, ALBEDO, SIDE_ROWS = 0, slice(1, 4), slice(4, 7), 7
# Surfaces about a face face both ways where the mean of their normals is shorter than this.
_CANCELLED = np.float32(0.25)
# The most that the area of the stairs may differ from that of the surface: beyond that, hardly any of one or the other is known.
MOST_RATIO = 3.0
# How far before a surface the way to a cell's centre begins, in cells.
CLEARANCE = 1e-3


@dataclass(frozen=True, eq=False)
class Surfels:
    """Surface elements: ``positions`` (n, 3) [m], unit ``normals`` (n, 3), ``area`` (n,) [m^2], ``albedo`` (n, 3)."""

    positions: np.ndarray
    normals: np.ndarray
    area: np.ndarray
    albedo: np.ndarray


@dataclass(frozen=True, eq=False)
class GeometryVolume:
    """What surfaces do at the faces of ``grid``'s cells.

    ``planes``: for the faces across x, y and z an array (ROWS, …) float32 each, of the cells' shape (nz, ny, nx) with one more
    along the axis, for the planes from the lowest on: CLOSED, the share of the way through that surfaces close; CROSSING, how far
    above the plane [cells] they cross it on average; and of the sides that face down the axis (BELOW) and up it (ABOVE), which are
    two surfaces' where a thin wall is modelled with both of its faces: SPREAD, the mean of |n|_1 of their unit normals; NORMAL, the
    mean of those, turned so that they do not point down the axis; ALBEDO by channel. ``area`` (nz, ny, nx) float32: what stands
    before each cell of either side of the surfaces, over the area of a cell's face.
    """

    grid: LpvGrid
    planes: tuple[np.ndarray, np.ndarray, np.ndarray]
    area: np.ndarray

    @property
    def is_empty(self) -> bool:
        """True if no surface lies in the volume."""
        return not any(plane[CLOSED].any() for plane in self.planes)


def plane_shape(grid: LpvGrid, axis: int) -> tuple[int, int, int]:
    """(nz, ny, nx) of the faces across ``axis``."""
    return tuple(count + (2 - axis == dimension) for dimension, count in enumerate(grid.shape))


def inject_surfels(grid: LpvGrid, surfels: Surfels) -> GeometryVolume:
    """The geometry volume of ``surfels``: each closes the face nearest to it across every axis by its cross-section. Those that
    lie outside ``grid`` are left out."""
    cells = grid.cells_of(surfels.positions)
    share = surfels.area.astype(np.float64) / grid.cell**2
    spread = np.abs(surfels.normals).sum(axis=1)
    planes = []
    for axis in range(3):
        shape = plane_shape(grid, axis)
        index = np.floor(cells).astype(np.int64)
        index[:, axis] = np.floor(cells[:, axis] + 0.5)
        kept = np.flatnonzero(np.all((index >= 0) & (index < shape[::-1]), axis=1))
        x, y, z = index[kept].T
        flat = (z * shape[1] + y) * shape[2] + x
        normals = surfels.normals[kept] * np.where(surfels.normals[kept, axis] < 0, -1.0, 1.0)[:, None]
        weight = share[kept] * normals[:, axis]
        side = [spread[kept], *normals.T, *surfels.albedo[kept].T]
        columns = [cells[kept, axis] - index[kept, axis], *side, *side]
        sums = [np.bincount(flat, weight * column, np.prod(shape)) for column in (np.ones(len(kept)), *columns)]
        planes.append(means(np.stack(sums).reshape(ROWS, *shape), np.minimum(sums[0], 1.0).reshape(shape)))
    return with_area(grid, tuple(planes), surfels)


def means(sums: np.ndarray, closed: np.ndarray) -> np.ndarray:
    """Rows of a plane from weighted ``sums`` (ROWS, …) of the surfaces there, whose first is that of the weights, and the share
    ``closed`` of each face."""
    rows = sums / np.maximum(sums[0], 1e-30)
    rows[CLOSED] = closed
    return rows.astype(np.float32)


def with_area(grid: LpvGrid, planes: tuple[np.ndarray, np.ndarray, np.ndarray], surfels: Surfels,
              seen: Callable[[np.ndarray, np.ndarray], np.ndarray] | None = None) -> GeometryVolume:
    """The volume of ``planes`` with the area of ``surfels``, which are all that it knows, before each cell. ``seen`` tells of
    points (n, 3) and others (n, 3) which see each other: the inside of a thin wall lies before no cell."""
    faces = _faces(grid, planes)
    area = np.zeros(grid.count)
    for side in (1.0, -1.0):
        normals = side * surfels.normals
        rows, index = cells_before(grid, surfels.positions, normals, faces)
        if seen is not None:
            nx, ny, _ = grid.resolution
            centers = grid.corner + (np.stack([index % nx, index // nx % ny, index // (nx * ny)], axis=1) + 0.5) * grid.cell
            open_way = seen(surfels.positions[rows] + CLEARANCE * grid.cell * normals[rows], centers)
            rows, index = rows[open_way], index[open_way]
        area += np.bincount(index, surfels.area[rows] / grid.cell**2, grid.count)
    return GeometryVolume(grid, planes, area.reshape(grid.shape).astype(np.float32))


def combine(volumes: list[GeometryVolume]) -> GeometryVolume:
    """One volume of several that each see a part of the surfaces: at every face the one that closes most of it counts, since
    what two views see of a surface is the same surface. Raises ValueError for none."""
    best, *others = volumes
    planes, area = list(best.planes), best.area
    for other in others:
        planes = [np.where(more[CLOSED] > plane[CLOSED], more, plane) for plane, more in zip(planes, other.planes, strict=True)]
        area = np.maximum(area, other.area)
    return GeometryVolume(best.grid, tuple(planes), area)


@dataclass(frozen=True, eq=False)
class Blocking:
    """What the faces of ``grid``'s cells do to light, as flat arrays over cells.

    ``strides`` are the index steps to the next cell along x, y, z; ``direction`` is what ``direction_kept`` says. ``through``
    (3, N): for the face above each cell along an axis, what it lets through (0 at the volume's border). ``area`` (N,): what the
    accumulated light is multiplied by (None: 1). ``faces`` (6, nz, ny, nx), as of `standing` (None: all open). ``blocked``
    (3, 2, 2, N): for the faces above and below, the share that they stop, and by how much of the flux that is met by the surface
    and not its stairs alone; ``normal`` (3, 2, 3, N): the surface's unit normal along the axis and the two that follow it, turned
    so that the first is not negative; ``reflectance`` (3, 2, 3, N): its albedo by channel. None where nothing is reflected.
    ``kept`` (2, 3, N): which share of each cell's flux and vector flux media leave of a step, by channel (`media_cells`); None
    where there are none.
    """

    strides: tuple[int, int, int]
    direction: float
    through: np.ndarray
    area: np.ndarray | None = None
    faces: np.ndarray | None = None
    blocked: np.ndarray | None = None
    normal: np.ndarray | None = None
    reflectance: np.ndarray | None = None
    kept: np.ndarray | None = None


def vacuum(grid: LpvGrid) -> Blocking:
    """Faces that let everything through."""
    through = np.ones((3, *grid.shape), np.float32)
    for axis in range(3):
        through[(axis, *_along(axis, slice(-1, None)))] = 0.0
    nx, ny, _ = grid.resolution
    return Blocking((1, nx, nx * ny), direction_kept(grid.resolution), through.reshape(3, -1))


def face_blocking(volume: GeometryVolume, bounces: bool = True) -> Blocking:
    """What the faces do; with ``bounces`` also what the surfaces reflect."""
    grid = volume.grid
    empty = vacuum(grid)
    faces = _faces(grid, volume.planes)
    through = empty.through * faces[:3].reshape(3, -1)
    area = _area_ratio(volume).reshape(-1)
    if not bounces:
        return Blocking(empty.strides, empty.direction, through, area, faces)
    blocked, normal, reflectance = (np.empty((3, 2, rows, *grid.shape), np.float32) for rows in (2, 3, 3))
    for axis, plane in enumerate(volume.planes):
        # A cell is below the face above it.
        for end, (rows, part) in enumerate(((BELOW, slice(1, None)), (ABOVE, slice(None, -1)))):
            at = (slice(None), *_along(axis, part))
            side, closed = plane[rows][at], plane[CLOSED][at[1:]]
            facing = side[NORMAL][[(axis + turn) % 3 for turn in range(3)]]
            length = np.sqrt(np.square(facing).sum(axis=0))
            # Surfaces that face both ways cancel: they send light back along the axis.
            plain = length < _CANCELLED
            facing /= np.maximum(length, np.finfo(np.float32).tiny)
            facing[:, plain] = 0.0
            facing[0, plain] = 1.0
            blocked[axis, end] = closed, _surface_share(side)
            normal[axis, end], reflectance[axis, end] = facing, side[ALBEDO]
    flat = [array.reshape(*array.shape[:-3], -1) for array in (blocked, normal, reflectance)]
    return Blocking(empty.strides, empty.direction, through, area, faces, *flat)


def _surface_share(side: np.ndarray) -> np.ndarray:
    """The area of a surface over that of its stairs: 1/|n|_1; ``side`` (SIDE_ROWS, …)."""
    return 1.0 / np.maximum(side[SPREAD], np.float32(1.0))


def _faces(grid: LpvGrid, planes) -> np.ndarray:
    """(6, nz, ny, nx) float32, as of `standing`."""
    faces = np.empty((6, *grid.shape), np.float32)
    for axis, plane in enumerate(planes):
        above = _along(axis, slice(1, None))
        faces[axis], faces[3 + axis] = 1.0 - plane[CLOSED][above], plane[CROSSING][above]
    return faces


def _area_ratio(volume: GeometryVolume) -> np.ndarray:
    """(nz, ny, nx) float32: area of the closed faces about each cell over that of the surface, both of the cell and of the
    neighbours that no wall parts from it; 1 where there is neither."""
    stairs = np.zeros(volume.grid.shape, np.float32)
    for axis, plane in enumerate(volume.planes):
        for rows, part in ((BELOW, slice(1, None)), (ABOVE, slice(None, -1))):
            stairs += (plane[CLOSED] * _surface_share(plane[rows]))[_along(axis, part)]
    faces = _faces(volume.grid, volume.planes)
    stairs, area = _blurred(stairs, faces), _blurred(volume.area, faces)
    known = (stairs > 0) & (area > 0)
    ratio = np.where(known, stairs, 1.0) / np.where(known, area, 1.0)
    return np.clip(ratio, 1.0 / MOST_RATIO, MOST_RATIO).astype(np.float32)


def _blurred(values: np.ndarray, faces: np.ndarray) -> np.ndarray:
    """``values`` with a half of their neighbours' along each axis, as far as the faces between let light through."""
    for axis in range(3):
        low, high = _along(axis, slice(None, -1)), _along(axis, slice(1, None))
        share = np.float32(0.5) * faces[axis][low]
        blurred = values.copy()
        blurred[low] += share * values[high]
        blurred[high] += share * values[low]
        values = blurred
    return values


def _along(axis: int, part: slice) -> tuple[slice, slice, slice]:
    """Index into (z, y, x) that takes ``part`` along x, y or z."""
    return tuple(part if 2 - axis == dimension else slice(None) for dimension in range(3))
