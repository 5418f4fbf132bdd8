"""What arrives at every cell at once, in fixed directions: slice after slice of the grid hands its light on to the next.

Along a direction's steepest axis what is in the middles of a slice's cells goes on to the next slice's, and then a part of it to
the cells beside them, as the direction slopes (as the march's rays, but all of a slice together: the lecture's march from the
volume's own cells). What stands between two middles (between.py) blocks and adds its own light on the way. So no light goes through
a closed wall, none is lost and none is made. A direction costs one pass over the grid, however many cells ask. It blurs: what is
thinner than a cell spreads by about the root of the slices that it has passed.
"""

from collections.abc import Callable
from itertools import pairwise

import numpy as np

from ...numerics import sh
from ...numerics.grid import trilinear
from ...numerics.sampling import fibonacci_sphere
from ...progress import Progress
from ..parallel import parallel_for
from .between import Between, cells_before, shown_between

# Passes that are held at once, for one product with the basis; a pass takes all directions that go the same way along each axis and
# are steepest along the same.
_TOGETHER = 4
# Numbers of a pass that are multiplied at once.
_AT_ONCE = 1 << 17


def sweep(standing: Between, opacity: np.ndarray, radiance: np.ndarray, directions: int, order: int,
          beyond: Callable[[np.ndarray], np.ndarray], threads: int | None = None, progress: Progress | None = None,
          around: np.ndarray | None = None) -> np.ndarray:
    """SH coefficients (nz, ny, nx, (order + 1)², 3) float32 of the radiance that arrives in each cell from other cells, by so many
    ``directions``, where cells with ``opacity`` (m, 3) that are ``standing`` show ``radiance`` (m, 6, 3), premultiplied;
    ``beyond``(directions (k, 3)) is that (k, 3) of what lies outside the grid, or, where it lies in another one, ``around`` what
    arrives in its cells there, in the same coefficients: those at the border are read."""
    towards, shape = fibonacci_sphere(directions), standing.grid.shape
    exact = sh.evaluate(towards, order)
    basis = exact * np.float32(4.0 * np.pi / directions)
    sky = beyond(towards) if around is None else None

    def outside(rows: np.ndarray) -> np.ndarray:
        if around is None:
            return np.broadcast_to(sky[rows].astype(np.float32)[:, None, None, None], (len(rows), *shape, 3))
        return np.maximum(np.stack([np.tensordot(around, part, axes=(3, 0)) for part in exact[rows].astype(np.float32)]), 0)

    stairs = _Stairs(standing, opacity, radiance)
    ways = (towards < 0) @ np.array([1, 2, 4]) + 8 * np.abs(towards).argmax(axis=1)
    alike = [np.flatnonzero(ways == way) for way in np.unique(ways)]
    result = np.zeros((basis.shape[1], int(np.prod(shape)) * 3), np.float32)
    groups = [alike[first:first + _TOGETHER] for first in range(0, len(alike), _TOGETHER)]
    for index, group in enumerate(groups):
        if progress is not None:
            progress.step(index / len(groups), "sweeping the voxels")
        arriving = parallel_for(lambda k, group=group: _pass(stairs, towards[group[k]], outside(group[k])), len(group), threads)
        for rows, light in zip(group, arriving, strict=True):
            flat = light.reshape(len(rows), -1)
            for first in range(0, flat.shape[1], _AT_ONCE):
                part = slice(first, first + _AT_ONCE)
                result[:, part] += basis[rows].T @ flat[:, part]
    return np.moveaxis(result.reshape(-1, *shape, 3), 0, -2)


class _Stairs:
    """What ``standing`` lets pass and shows, slice by slice along each axis."""

    def __init__(self, standing: Between, opacity: np.ndarray, radiance: np.ndarray):
        self.shape, self._faces, self._found = standing.grid.shape, standing.faces, {}
        self._shown = [[shown_between(standing, opacity, radiance, axis, up) for up in (False, True)] for axis in range(3)]
        self._passed = [faces.passed for faces in standing.faces]

    def along(self, main: int, axis: int, up: bool) -> list:
        """Of what stands along ``axis``, for light that goes ``up`` it or down, slice by slice along ``main``: the cells (p,) that
        the light comes into in the slice's picture, and what it lets pass (p, 1) and shows (p, 3)."""
        key = (main, axis, up)
        if key not in self._found:
            place = self._faces[axis].place.copy()
            place[:, axis] -= not up
            rows, columns = (other for other in (2, 1, 0) if other != main)
            size = np.array(self.shape[::-1])
            held = np.flatnonzero(((place >= 0) & (place < size)).all(axis=1))
            held = held[np.argsort(place[held, main], kind="stable")]
            ends = np.searchsorted(place[held, main], np.arange(size[main] + 1))
            pixel = place[held, rows] * size[columns] + place[held, columns]
            passed, shown = self._passed[axis][held, None], self._shown[axis][int(up)][held]
            self._found[key] = [(pixel[a:b], passed[a:b], shown[a:b]) for a, b in pairwise(ends)]
        return self._found[key]


def _pass(stairs: _Stairs, towards: np.ndarray, outside: np.ndarray) -> np.ndarray:
    """What arrives (d, nz, ny, nx, 3) of the light that is seen ``towards`` (d, 3), all in one octant and steepest along one axis;
    ``outside`` (d, nz, ny, nx, 3), of which the border's cells are read, comes in."""
    axis = int(np.argmax(np.abs(towards[0])))
    slope, up = np.abs(towards / towards[:, axis, None]).astype(np.float32), towards[0] < 0
    arriving = np.empty(outside.shape, np.float32)
    # Slices along the axis first; the other two as rows and columns of a picture.
    slices, around = (np.moveaxis(values, 3 - axis, 0) for values in (arriving, outside))
    main = stairs.along(axis, axis, up[axis])
    beside = [(dimension, up[other], slope[:, other, None, None, None], stairs.along(axis, other, up[other]))
              for dimension, other in enumerate(other for other in (2, 1, 0) if other != axis)]
    order = range(len(slices)) if up[axis] else range(len(slices) - 1, -1, -1)
    light = np.array(around[order[0]], np.float32)
    moved = np.empty_like(light)
    for number, index in enumerate(order):
        _cross(light, *main[index])
        if number:
            for dimension, ascends, share, standing in beside:
                _move(moved, light, 1 + dimension, ascends, around[index])
                _cross(moved, *standing[index])
                moved -= light
                moved *= share
                light += moved
        slices[index] = light
    return arriving


def _cross(light: np.ndarray, pixel: np.ndarray, passed: np.ndarray, shown: np.ndarray) -> None:
    """Let ``light`` (d, rows, columns, 3) come into cells ``pixel`` (p,) through what stands before them."""
    if pixel.size:
        picture = light.reshape(len(light), -1, 3)
        picture[:, pixel] = picture[:, pixel] * passed + shown


def _move(moved: np.ndarray, light: np.ndarray, dimension: int, up: bool, outside: np.ndarray) -> None:
    """Put ``light`` into ``moved``, one cell further ``up`` its ``dimension`` or down; the border of ``outside`` comes in."""
    target, source, edge = (np.moveaxis(values, dimension, 0) for values in (moved, light, outside))
    if up:
        target[1:], target[0] = source[:-1], edge[0]
    else:
        target[:-1], target[-1] = source[1:], edge[-1]


def sample_cells(grid, values: np.ndarray, points: np.ndarray) -> np.ndarray:
    """``values`` (nz, ny, nx, …) of the cells of ``grid`` at ``points`` (n, 3), interpolated: (n, …)."""
    indices, weights = trilinear(grid.cells_of(points) - 0.5, grid.resolution)
    flat = values.reshape(grid.count, -1)
    total = np.zeros((len(points), flat.shape[1]), np.float32)
    for corner in range(8):
        total += weights[:, corner, None] * flat[indices[:, corner]]
    return total.reshape(len(points), *values.shape[3:])


def irradiance_of_cells(standing: Between, light: np.ndarray, points: np.ndarray,
                        normals: np.ndarray) -> np.ndarray:
    """Irradiance (n, 3) at ``points`` (n, 3) under ``normals`` (n, 3) by the cells in front of them: ``light`` (nz, ny,
    nx, 9, 3) is what arrives there, in SH."""
    cells, weights = cells_before(standing, points, normals)
    flat = light.reshape(standing.grid.count, -1)
    coefficients = np.zeros((len(points), flat.shape[1]), np.float32)
    for corner in range(8):
        coefficients += weights[:, corner, None] * flat[cells[:, corner]]
    coefficients = coefficients.reshape(len(points), -1, 3)
    return np.maximum(sh.irradiance(coefficients, np.asarray(normals, np.float32)[:, None])[:, 0], 0.0).astype(np.float32)
