"""What arrives at every cell at once, in fixed directions: slice after slice of the grid hands its light on to the next.

Along a direction's steepest axis each slice's cells take what reaches them, block and add by their own surfaces, and pass the rest
on; between slices the picture is shifted, with shares of four neighbours (as the march's rays, but all of a slice together: the
lecture's march from the volume's own cells). A direction costs one pass over the grid, however many cells ask. It blurs: what is
thinner than a cell spreads by about the root of the slices that it has passed.
"""

from collections.abc import Callable

import numpy as np

from ...numerics import sh
from ...numerics.sampling import fibonacci_sphere
from ...progress import Progress
from ..parallel import parallel_for
from .hierarchy import Hierarchy

# Directions whose passes are held at once, for one product with the basis.
_TOGETHER = 8


def sweep(hierarchy: Hierarchy, directions: int, order: int, beyond: Callable[[np.ndarray], np.ndarray], threads: int | None = None,
          progress: Progress | None = None, around: np.ndarray | None = None) -> np.ndarray:
    """SH coefficients (nz, ny, nx, (order + 1)², 3) float32 of the radiance that arrives in each cell from other cells, by so many
    ``directions``; ``beyond``(directions (k, 3)) is that (k, 3) of what lies outside the grid, or, where it lies in another one,
    ``around`` what arrives in its cells there, in the same coefficients: those at the border are read."""
    towards, shape = fibonacci_sphere(directions), hierarchy.grid.shape
    exact = sh.evaluate(towards, order)
    basis = exact * np.float32(4.0 * np.pi / directions)

    def outside(k: int) -> np.ndarray:
        if around is None:
            return sky[k]
        return np.maximum(np.tensordot(around, exact[k].astype(np.float32), axes=(3, 0)), np.float32(0))

    sky = beyond(towards) if around is None else None
    result = np.zeros((basis.shape[1], int(np.prod(shape)) * 3), np.float32)
    row = hierarchy.levels[0].row.reshape(hierarchy.levels[0].shape)[1:-1, 1:-1, 1:-1]
    groups = [range(first, min(first + _TOGETHER, directions)) for first in range(0, directions, _TOGETHER)]
    for index, group in enumerate(groups):
        if progress is not None:
            progress.step(index / len(groups), "sweeping the voxels")
        arriving = parallel_for(lambda k, first=group[0]: _pass(hierarchy, row, towards[first + k], outside(first + k)), len(group),
                                threads)
        result += basis[list(group)].T @ np.stack(arriving).reshape(len(group), -1)
    return np.moveaxis(result.reshape(-1, *shape, 3), 0, -2)


def _pass(hierarchy: Hierarchy, row: np.ndarray, towards: np.ndarray, outside: np.ndarray) -> np.ndarray:
    """What arrives (nz, ny, nx, 3) of the light that is seen ``towards`` (3,); ``outside`` (3,), or (nz, ny, nx, 3) of which the
    border's cells are read, comes in."""
    towards = np.asarray(towards, np.float64)
    level, axis = hierarchy.levels[0], int(np.argmax(np.abs(towards)))
    slope = towards / np.abs(towards[axis])
    depth = (level.depth * np.abs(slope).astype(np.float32)).sum(axis=1)
    glow = sum(level.glow[2 * a + (towards[a] < 0)::6] * np.float32(abs(slope[a])) for a in range(3))
    passes = np.exp(-depth)
    shows = glow * ((1.0 - passes) / np.maximum(depth, np.float32(1e-30)))[:, None]
    # Between slices it is not known whose sheet it was that light has met, so shares multiply; squared, they leave little between
    # them.
    through = (level.sheet * slope.astype(np.float32)).sum(axis=1)
    cut = np.minimum(np.abs(through), np.float32(1))
    cut = 1.0 - (1.0 - cut) ** 2
    passes *= 1.0 - cut
    shows += cut[:, None] * level.shown[2 * np.arange(len(cut)) + (through > 0)]
    arriving = np.empty((*row.shape, 3), np.float32)
    # Slices along the axis first; the other two as rows and columns of a picture.
    slices, cells = np.moveaxis(arriving, 2 - axis, 0), np.moveaxis(row, 2 - axis, 0)
    others = [other for other in (2, 1, 0) if other != axis]
    around = np.moveaxis(np.broadcast_to(outside, arriving.shape), 2 - axis, 0)
    order = range(len(slices)) if towards[axis] < 0 else range(len(slices) - 1, -1, -1)
    light = around[order[0]].astype(np.float32)
    for index in order:
        slices[index] = light
        light = passes[cells[index]][..., None] * light + shows[cells[index]]
        for dimension, other in enumerate(others):
            light = _shifted(light, dimension, -slope[other], np.moveaxis(around[index], dimension, 0))
    return arriving


def _shifted(picture: np.ndarray, dimension: int, by: float, outside: np.ndarray) -> np.ndarray:
    """``picture`` moved along ``dimension`` by up to one cell; the first or the last row of ``outside`` comes in at its edge."""
    share = np.float32(abs(by))
    if share == 0:
        return picture
    moved = np.empty_like(picture)
    source, target = np.moveaxis(picture, dimension, 0), np.moveaxis(moved, dimension, 0)
    if by > 0:
        target[1:], target[0] = source[:-1], outside[0]
    else:
        target[:-1], target[-1] = source[1:], outside[-1]
    moved *= share
    moved += (1 - share) * picture
    return moved
