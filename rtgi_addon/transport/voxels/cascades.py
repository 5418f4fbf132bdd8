"""Nested grids about one place, each twice as coarse and as wide as the one within it, read as the levels of one hierarchy.

A cone is soon wider than the finest cells, and reads the next grid's from then on, which reach twice as far: the finest are asked
about what is near alone. So level j is grid j's own voxels, and behind the outermost's come levels that are filtered from it. Where
a sample lies near the border of a grid, or beyond it, the next one answers, and over BLEND cells before that both do, so that
nothing steps at a border; receivers there have the light of both as well.

Grids lie on the lattices of their own cells that go through the world's origin: moved about by whole cells, or by less than half of
one, the cells that stay hold what they held.

Source: A. Panteleev, "Practical Real-Time Voxel-Based Global Illumination for Current GPUs", GTC 2014 (clipmaps of voxels); C.
Tanner, C. Migdal and M. Jones, "The Clipmap: A Virtual Mipmap", SIGGRAPH 1998.
"""

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np

from .grid import VoxelGrid, grid_around
from .hierarchy import Hierarchy, Level, build_hierarchy
from .voxelize import Voxels

# From the border of a grid, in its cells, the next one answers alone, since samples read neighbours; before that both do over so
# many.
EDGE, BLEND = 1.5, 2.0
# Fewer cells along any side leave nothing between the blends of one grid and of the next.
FEWEST = 18
# Nested grids are at least this share of their longest side wide along the others.
FLATTEST = 0.45


def nested(box: np.ndarray, resolution: int, count: int, center: np.ndarray, cell: float | None = None) -> tuple[VoxelGrid, ...]:
    """``count`` grids, finest first: the outermost around ``box`` (2, 3) [m] with ``resolution`` cells along its longest side, or
    with the cells that make the finest have the side ``cell`` [m], and higher where it would be flat; those within it have half of
    its extent, half of that and so on about ``center`` (3,), as far as they stay within it. Raises BakeError for more cells than
    there can be."""
    if count > 1:
        # Of a flat scene the finer ones would be flat as well, and reach no floor under who stands on it.
        middle, extent = box.mean(axis=0), box[1] - box[0]
        extent = np.maximum(extent, FLATTEST * extent.max())
        box = np.stack([middle - 0.5 * extent, middle + 0.5 * extent])
    outermost = grid_around(box, resolution, None if cell is None else cell * 2.0 ** (count - 1))
    if count == 1:
        return (outermost,)
    # On its lattice it may lie half a cell aside, which its margin leaves room for.
    grids = [_snapped(outermost.center, outermost.cell, outermost.resolution)]
    for _ in range(count - 1):
        outer = grids[0]
        inner = _snapped(center, 0.5 * outer.cell, outer.resolution)
        # Within the outer one, whose corners are on this one's lattice, too.
        low, high = np.round(np.asarray(outer.corner) / inner.cell), np.round(outer.high / inner.cell) - inner.resolution
        corner = np.clip(np.round(np.asarray(inner.corner) / inner.cell), low, high)
        grids.insert(0, replace(inner, corner=tuple(float(value) for value in corner * inner.cell)))
    return tuple(grids)


def _snapped(center: np.ndarray, cell: float, resolution: tuple[int, int, int]) -> VoxelGrid:
    corner = np.round(np.asarray(center) / cell - 0.5 * np.asarray(resolution)) * cell
    return VoxelGrid(tuple(float(value) for value in corner), cell, resolution)


def clipmap(finest: tuple[Hierarchy, ...], coarse: tuple[Hierarchy, ...]) -> tuple[Hierarchy, ...]:
    """What receivers in each of nested grids read, finest first. ``finest`` hold each grid's own cells, as what is near is read,
    and the outermost's all its levels; ``coarse`` those of all grids but the first as parts of one surface, as seen from afar."""
    grids = tuple(hierarchy.grid for hierarchy in finest)
    views = []
    for first, hierarchy in enumerate(finest):
        levels: list[Level] = [hierarchy.levels[0]]
        levels += [_seen_from(grids[first], other.grid, other.levels[0]) for other in coarse[first:]]
        levels += [_seen_from(grids[first], grids[-1], level) for level in finest[-1].levels[1:]]
        views.append(Hierarchy(grids[first], tuple(levels), grids[first:] if first < len(grids) - 1 else ()))
    return tuple(views)


def nested_hierarchies(grids: Sequence[tuple[Voxels, np.ndarray]]) -> tuple[Hierarchy, ...]:
    """What receivers in each of nested grids read, finest first: their voxels, and what faces of those show (m, 6, 3),
    premultiplied."""
    finest = [build_hierarchy(voxels, radiance, None if index == len(grids) - 1 else 1)
              for index, (voxels, radiance) in enumerate(grids)]
    return clipmap(tuple(finest), tuple(build_hierarchy(voxels, radiance, 1, afar=True) for voxels, radiance in grids[1:]))


def _seen_from(grid: VoxelGrid, own: VoxelGrid, level: Level) -> Level:
    """``level`` of the grid ``own`` as one of a hierarchy over ``grid``."""
    size = round(own.cell / grid.cell) * level.size
    offset = (np.asarray(own.corner) - grid.corner) / (grid.cell * size)
    return replace(level, size=size, offset=tuple(float(value) for value in offset))


def coarsest_needed(hierarchy: Hierarchy, position: np.ndarray) -> np.ndarray:
    """The least level (n,) float64 that may answer at ``position`` (n, 3) in the finest cells: between two where both do."""
    least = np.zeros(len(position))
    for number, grid in enumerate(hierarchy.cascades[:-1]):
        place = hierarchy.grid.corner + np.asarray(position) * hierarchy.grid.cell
        least = np.where(least == number, number + outside(grid, place), least)
    return least


def outside(grid: VoxelGrid, points: np.ndarray) -> np.ndarray:
    """How far (n,) in [0, 1] world ``points`` (n, 3) are on the way out of ``grid``: 0 within, 1 where it does not answer."""
    cells = grid.cells_of(points)
    inward = np.minimum(cells, np.asarray(grid.resolution) - cells).min(axis=1)
    return np.clip((EDGE + BLEND - inward) / BLEND, 0.0, 1.0)


def by_cascade(hierarchies: tuple[Hierarchy, ...], points: np.ndarray, found: Callable[[Hierarchy, np.ndarray], np.ndarray],
               ) -> np.ndarray:
    """(n, …) float32 of what ``found``(hierarchy, rows (m,)) → (m, …) says for ``points`` (n, 3), by the hierarchies of the grids
    that they are in, and between two where they are near a border."""
    if len(hierarchies) == 1:
        return found(hierarchies[0], np.arange(len(points)))
    share, left = np.zeros((len(hierarchies), len(points))), np.ones(len(points))
    for number, hierarchy in enumerate(hierarchies):
        out = outside(hierarchy.grid, points) if number < len(hierarchies) - 1 else np.zeros(len(points))
        share[number], left = left * (1.0 - out), left * out
    total = None
    for number, hierarchy in enumerate(hierarchies):
        rows = np.flatnonzero(share[number] > 0)
        if rows.size:
            part = found(hierarchy, rows)
            total = np.zeros((len(points), *part.shape[1:]), np.float32) if total is None else total
            total[rows] += share[number, rows].astype(np.float32).reshape(-1, *[1] * (part.ndim - 1)) * part
    return found(hierarchies[0], np.arange(0)) if total is None else total
