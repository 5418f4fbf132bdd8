"""Rays through the finest cells: each cell on the way once (Amanatides and Woo, Eurographics 1987), front to back.

Source: the lecture's march through the volume. Its pseudo-code divides what it finds by r² and multiplies with the cosine at the
far end although it draws directions, and adds light where nothing was hit: over an endless bright plane that gives L/(5h²) instead
of π·L. Along a direction radiance does not change: what is seen is the sum of T·(1 - e^-τ)·L over the cells.
"""

from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from ..vectors import dot
from .grid import VoxelGrid
from .hierarchy import Hierarchy, Level
from .voxelize import NO_PLATE

# Where so little is left of a ray, the rest is taken for nothing.
SPENT = np.float32(1e-3)
# A receiver's own plane does not block it: along axes that its normal has this share of, in cells that its plane touches, or comes
# as close to as this share of a cell. A sheet there is its own where their normals have this cosine.
OWN_AXIS, TOUCHING, OWN_PLANE = np.float32(0.25), np.float32(0.02), np.float32(0.7)
# Cells' planes do not quite meet where a surface is curved: a sheet reaches this far to either side, in cells.
GAP = np.float32(0.03)
# A plate is met this close to it, in cells.
PLATE = np.float32(0.005)
# Rays go on in step; those that have ended are dropped this often.
_DROP = 8


@dataclass(frozen=True, eq=False)
class March:
    """What rays (n,) met: ``radiance`` (n, 3), ``passed`` (n,), the share that is left of what lies behind, and how far they came,
    ``at`` (n,) float64 in cells."""

    radiance: np.ndarray
    passed: np.ndarray
    at: np.ndarray


def march_on(hierarchies: tuple[Hierarchy, ...], origins: np.ndarray, directions: np.ndarray, normals: np.ndarray | None = None,
             first_hit: float | None = None) -> March:
    """As ``march``, through the finest cells of one grid after the other that the rays come into, until they leave the last."""
    found = march(hierarchies[0], origins, directions, normals, first_hit=first_hit)
    radiance, passed, at = found.radiance, found.passed, found.at
    for before, hierarchy in pairwise(hierarchies):
        at = at * (before.grid.cell / hierarchy.grid.cell)
        rows = np.flatnonzero(passed)
        if not rows.size:
            break
        on = march(hierarchy, origins[rows], directions[rows], None if normals is None else normals[rows], first_hit=first_hit,
                   begin=at[rows])
        radiance[rows] += passed[rows, None] * on.radiance
        passed[rows], at[rows] = passed[rows] * on.passed, on.at
    return March(radiance, passed, at)


def march(hierarchy: Hierarchy, origins: np.ndarray, directions: np.ndarray, normals: np.ndarray | None = None,
          reach: np.ndarray | None = None, first_hit: float | None = None, begin: np.ndarray | None = None) -> March:
    """Follow rays from ``origins`` (n, 3) [m] along unit ``directions`` (n, 3) until they leave the grid, or until they come to an
    empty cell after ``reach`` (n,) cells.

    ``normals`` (n, 3) are those of the surfaces that they leave, which do not block them. ``first_hit``: a cell that takes more
    than this share of a ray ends it, and shows itself whole, as the lecture's does; None lets all cells count for what they cover.
    What lies before ``begin`` (n,) cells is left out.
    """
    level, grid = hierarchy.levels[0], hierarchy.grid
    start, direction = grid.cells_of(origins), np.asarray(directions, np.float64)
    radiance, passed = np.zeros((len(start), 3), np.float32), np.ones(len(start), np.float32)
    enter, leave = box_span(grid, start, direction)
    if begin is not None:
        enter = np.maximum(enter, begin)
    reach, at = leave if reach is None else np.asarray(reach, np.float64), np.maximum(enter, 0.0)
    rows = np.flatnonzero(leave > enter)
    walk = _Walk(level, grid, start[rows], direction[rows], enter[rows], leave[rows], reach[rows],
                 None if normals is None else normals[rows])
    step = 0
    while rows.size:
        blocked, shown = walk.cross()
        if first_hit is not None:
            whole = blocked > first_hit
            shown = np.where(whole[:, None], shown / np.maximum(blocked, np.float32(1e-30))[:, None], np.float32(0))
            blocked = whole.astype(np.float32)
        radiance[rows] += passed[rows, None] * shown
        passed[rows] *= 1.0 - blocked
        at[rows] = walk.at
        step += 1
        going = walk.goes_on & (passed[rows] > SPENT)
        if step % _DROP == 0 or not going.any():
            rows = rows[going]
            walk.keep(going)
        else:
            walk.rest(going)
    passed[passed <= SPENT] = 0.0
    return March(radiance, passed, at)


def box_span(grid: VoxelGrid, start: np.ndarray, direction: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Where (n,) rays from ``start`` (n, 3) in cells enter and leave the grid, in cells along them; they begin at 0."""
    with np.errstate(divide="ignore", invalid="ignore"):
        first, second = -start / direction, (np.asarray(grid.resolution) - start) / direction
    # Along an axis that a ray does not move on it is between the planes all the way, or nowhere.
    still, within = direction == 0, (start >= 0) & (start < grid.resolution)
    low = np.where(still, np.where(within, -np.inf, np.inf), np.minimum(first, second))
    high = np.where(still, np.where(within, np.inf, -np.inf), np.maximum(first, second))
    return np.maximum(low.max(axis=1), 0.0), high.min(axis=1)


def span_of(hierarchy: Hierarchy, start: np.ndarray, direction: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """As ``box_span``, of all that is in ``hierarchy``, in its finest cells."""
    grid, outer = hierarchy.grid, hierarchy.outermost
    if outer is grid:
        return box_span(grid, start, direction)
    scale = outer.cell / grid.cell
    enter, leave = box_span(outer, outer.cells_of(grid.corner + start * grid.cell), direction)
    return enter * scale, leave * scale


class _Walk:
    """Rays on their way from cell to cell."""

    def __init__(self, level: Level, grid: VoxelGrid, start, direction, enter, leave, reach, normals):
        self._level, self.at, self._leave, self._enough = level, enter, leave, reach
        self._sign = np.where(direction < 0, -1, 1)
        entry = start + direction * enter[:, None]
        cell = np.clip(np.floor(entry), 0, np.asarray(grid.resolution) - 1)
        # A ray that starts between two cells is in the one that it goes to.
        cell -= (entry == cell) & (direction < 0) & (cell > 0)
        with np.errstate(divide="ignore", invalid="ignore"):
            self._each = 1.0 / np.abs(direction)
            self._next = np.where(direction != 0, (cell + (direction > 0) - start) / direction, np.inf)
        strides = np.array(level.strides)
        self._index = ((cell + 1) @ strides).astype(np.int64)
        self._step = self._sign * strides
        self._slope, self._from = direction, start - (cell + 0.5)
        self._face = 2 * np.arange(3) + (direction < 0)
        self._normals = None
        if normals is not None:
            self._normals = np.asarray(normals, np.float64)
            self._reach = 0.5 * np.abs(normals).sum(axis=1) + TOUCHING
        self._resting = np.zeros(len(start), bool)
        self.goes_on = ~self._resting

    def cross(self) -> tuple[np.ndarray, np.ndarray]:
        """What the cells that the rays are in block (r,) of them, and the radiance (r, 3) that they show of that; moves them on."""
        axis = np.argmin(self._next, axis=1)
        rays = np.arange(len(axis))
        end = np.minimum(self._next[rays, axis], self._leave)
        row = self._level.row.take(self._index, mode="clip")
        blocked, shown = np.zeros(len(row), np.float32), np.zeros((len(row), 3), np.float32)
        within = (row > 0) & ~self._resting
        met = np.flatnonzero(within)
        if met.size:
            way = (self._slope[met] * np.maximum(end - self.at, 0.0)[met, None]).astype(np.float32)
            blocked[met], shown[met] = self._met(met, row[met], way)
        # Those that rest stay where they ended, while others of their batch go on.
        self.at = np.where(self._resting, self.at, end)
        self._next[rays, axis] += self._each[rays, axis]
        self._index += self._step[rays, axis]
        self._from[rays, axis] -= self._sign[rays, axis]
        ahead = self._level.row.take(self._index, mode="clip") > 0
        self.goes_on = (end < self._leave) & ~self._resting & ((end < self._enough) | ahead)
        return blocked, shown

    def _met(self, met, row, way) -> tuple[np.ndarray, np.ndarray]:
        """See ``cross``: of the rays ``met`` (q,) that go ``way`` (q, 3) through cells that are not empty."""
        level, crossed, plane = self._level, np.abs(way), self._level.plane[row]
        # A sheet is met where the ray crosses its plane.
        normal = plane[:, :3]
        place = (self._from[met] + self._slope[met] * self.at[met, None]).astype(np.float32)
        before = dot(normal, place) - plane[:, 3]
        through = dot(normal, way)
        after = before + through
        near = (np.minimum(before, after) < GAP) & (np.maximum(before, after) > -GAP)
        cut = np.where(near, np.maximum(plane[:, 4], np.float32(0)), np.float32(0))
        held = np.flatnonzero(plane[:, 4] < 0)
        if held.size:
            # What lies across an axis is met where it lies, and not on the way there.
            begin = place[held] - normal[held]
            end = begin + way[held]
            hit = (np.minimum(begin, end) < PLATE) & (np.maximum(begin, end) > -PLATE)
            crossed[held] = np.where(normal[held] != NO_PLATE, hit, crossed[held])
        if self._normals is not None:
            own = self._normals[met]
            touching = np.abs(dot(self._from[met], own)) <= self._reach[met]
            crossed = np.where((np.abs(own) > OWN_AXIS) & touching[:, None], np.float32(0), crossed)
            cut = np.where(touching & (np.abs(dot(normal, own)) > OWN_PLANE), np.float32(0), cut)
        depth = dot(level.depth[row], crossed)
        glow = sum(level.glow[6 * row + self._face[met, axis]] * crossed[:, axis, None] for axis in range(3))
        blocked = -np.expm1(-depth)
        shown = glow * (blocked / np.maximum(depth, np.float32(1e-30)))[:, None]
        # A cell holds one or the other.
        return blocked + cut, shown + cut[:, None] * level.shown[2 * row + (through > 0)]

    def rest(self, going: np.ndarray) -> None:
        """Rays that are not ``going`` (r,) stay where they are, and meet nothing more."""
        self._resting |= ~going
        self._index[self._resting] = 0
        self._step[self._resting] = 0

    def keep(self, going: np.ndarray) -> None:
        """Drop all rays that are not ``going`` (r,)."""
        for name, value in vars(self).items():
            if isinstance(value, np.ndarray):
                setattr(self, name, value[going])
