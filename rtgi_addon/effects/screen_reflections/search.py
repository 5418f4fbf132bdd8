"""Where rays meet what the picture shows: pixel by pixel, over a pyramid of least depths, or by even steps and bisection.

The first two agree on every ray: a pixel is met where the ray's depths within it reach from before its surface's depth to no more
than ``thickness`` behind it, on a front, MOVED pixels or more from where the ray began. Blocks that the ray stays in front of are
stepped over whole (Uludag 2014, "Hi-Z Screen-Space Cone-Traced Reflections"); pixels are kept as integers, so that no offset is
needed at their edges. The third is the usual march of engines (McGuire and Mara 2014).
"""

from dataclasses import dataclass

import numpy as np

from ..frame import NOWHERE
from .rays import ScreenRays, facing

# A ray meets nothing in the pixel it leaves; of those about it what faces it is another surface.
MOVED = 1
# Halvings of a step of the march that met something.
BISECTIONS = 5


@dataclass(frozen=True, eq=False)
class Screen:
    """What is looked at: ``levels`` of least depth (pyramid.min_pyramid) and triangles' ``normals`` (h, w, 3), world."""

    levels: list[np.ndarray]
    normals: np.ndarray

    @property
    def size(self) -> np.ndarray:
        """Width and height [pixels]."""
        return np.array(self.levels[0].shape[::-1])


@dataclass(frozen=True, eq=False)
class Found:
    """What rays met: ``pixel`` (n, 2) (x, y), −1 where nothing; ``s`` (n,) along the rays; how far ``behind`` (n,) [m] the surface
    they are there; and how many pixels or blocks were looked at, ``looked`` (n,)."""

    pixel: np.ndarray
    s: np.ndarray
    behind: np.ndarray
    looked: np.ndarray

    @property
    def hit(self) -> np.ndarray:
        """(n,) bool."""
        return self.pixel[:, 0] >= 0


def search(screen: Screen, rays: ScreenRays, directions: np.ndarray, thickness: float, steps: int, levels: int) -> Found:
    """Follow ``rays`` with world ``directions`` (n, 3) over the first ``levels`` levels (1: pixel by pixel), looking at up to
    ``steps`` pixels or blocks."""
    n, size = len(rays.end), screen.size
    top = min(levels, len(screen.levels)) - 1
    found = Found(np.full((n, 2), -1), np.zeros(n), np.zeros(n), np.zeros(n, np.int32))
    start = np.clip(np.floor(rays.origins).astype(np.int64), 0, size - 1)
    rows, pixel, s, level = np.flatnonzero(rays.end > 0), start.copy(), np.zeros(n), np.zeros(n, np.int64)
    sign = rays.along > 0
    with np.errstate(divide="ignore", invalid="ignore"):
        inverse = np.where(rays.along != 0, 1.0 / rays.along, np.inf)
    for _ in range(steps):
        if not rows.size:
            break
        found.looked[rows] += 1
        ray, here, lift = rays.take(rows), pixel[rows], level[rows]
        cell = here >> lift[:, None]
        edge = (cell + sign[rows]) << lift[:, None]
        with np.errstate(invalid="ignore"):
            crossing = (edge - ray.origins) * inverse[rows]
        crossing = np.where(np.isfinite(inverse[rows]), crossing, np.inf)
        axis = np.argmin(crossing, axis=1)
        leave = np.maximum(np.minimum(crossing[np.arange(len(rows)), axis], ray.end), s[rows])
        depths = ray.depth(s[rows]), ray.depth(leave)
        deepest = np.maximum(*depths)
        least = _of_levels(screen.levels, lift, cell)
        passes = deepest < least
        # Where something may be met the search goes down, and at a pixel it is looked at.
        met = np.flatnonzero(~passes & (lift == 0))
        hit = met[_meets(screen, directions[rows[met]], here[met], start[rows[met]], np.minimum(*depths)[met],
                         least[met], thickness)]
        chosen = rows[hit]
        place = np.clip(ray.take(hit).at_depth(least[hit]), s[chosen], leave[hit])
        found.pixel[chosen], found.s[chosen] = here[hit], place
        found.behind[chosen] = np.maximum(ray.take(hit).depth(place) - least[hit], 0.0)
        onward = passes | (lift == 0)
        moved = _across(ray, here, cell, edge, axis, leave, sign[rows], lift)
        pixel[rows[onward]], s[rows[onward]] = moved[onward], leave[onward]
        level[rows] = np.where(passes, np.minimum(lift + 1, top), np.maximum(lift - 1, 0))
        done = onward & (leave >= ray.end)
        done[hit] = True
        outside = np.any((pixel[rows] < 0) | (pixel[rows] >= size), axis=1)
        rows = rows[~(done | outside)]
    return found


def _across(ray: ScreenRays, here, cell, edge, axis, leave, sign, lift) -> np.ndarray:
    """The pixels (m, 2) that rays come to where they leave their cells at ``leave`` (m,) over an edge of ``axis`` (m,)."""
    every = np.arange(len(here))
    moved = np.floor(ray.pixels(leave)).astype(np.int64)
    low = cell << lift[:, None]
    moved = np.clip(moved, low, low + (1 << lift[:, None]) - 1)
    # Pixel by pixel nothing but the axis that is crossed can change; rounding is not asked.
    moved = np.where((lift == 0)[:, None], here, moved)
    moved[every, axis] = edge[every, axis] - np.where(sign[every, axis], 0, 1)
    return moved


def _of_levels(levels: list[np.ndarray], level: np.ndarray, cell: np.ndarray) -> np.ndarray:
    result = np.empty(len(level), np.float64)
    for number in np.unique(level):
        rows = np.flatnonzero(level == number)
        result[rows] = levels[number][cell[rows, 1], cell[rows, 0]]
    return result


def _meets(screen: Screen, directions, pixel, start, nearest, depth, thickness) -> np.ndarray:
    """Which rays (m,) bool meet the surface of their pixel, whose ``depth`` (m,) they reach."""
    apart = np.abs(pixel - start).max(axis=1) >= MOVED
    front = facing(screen.normals[pixel[:, 1], pixel[:, 0]], directions)
    return apart & front & (depth < NOWHERE) & (nearest <= depth + thickness)


def march(screen: Screen, rays: ScreenRays, directions: np.ndarray, thickness: float, steps: int,
          jitter: float) -> Found:
    """Follow ``rays`` by ``steps`` even steps on the screen, the first of them ``jitter`` of the others, and halve the one that met
    something BISECTIONS times."""
    n = len(rays.end)
    found = Found(np.full((n, 2), -1), np.zeros(n), np.zeros(n), np.zeros(n, np.int32))
    start, rows = np.clip(np.floor(rays.origins).astype(np.int64), 0, screen.size - 1), np.flatnonzero(rays.end > 0)
    before = np.zeros(n)
    for step in range(1, steps + 1):
        if not rows.size:
            break
        found.looked[rows] += 1
        ray = rays.take(rows)
        s = np.minimum((step - 1.0 + jitter) / steps, 1.0) * ray.end
        pixel, depth = _shown(screen, ray, s)
        depths = ray.depth(before[rows]), ray.depth(s)
        reached = np.flatnonzero((np.maximum(*depths) >= depth) & (np.minimum(*depths) <= depth + thickness) & (depth < NOWHERE))
        low, high = before[rows[reached]], s[reached]
        part = ray.take(reached)
        for _ in range(BISECTIONS):
            middle = 0.5 * (low + high)
            behind = part.depth(middle) >= _shown(screen, part, middle)[1]
            low, high = np.where(behind, low, middle), np.where(behind, middle, high)
        pixel, depth = _shown(screen, part, high)
        apart = np.abs(pixel - start[rows[reached]]).max(axis=1) >= MOVED
        front = facing(screen.normals[pixel[:, 1], pixel[:, 0]], directions[rows[reached]])
        off = part.depth(high) - depth
        hit = np.flatnonzero(apart & front & (depth < NOWHERE) & (off <= thickness))
        chosen = rows[reached[hit]]
        found.pixel[chosen], found.s[chosen], found.behind[chosen] = pixel[hit], high[hit], np.maximum(off[hit], 0.0)
        before[rows] = s
        rows = np.delete(rows, reached[hit])
    return found


def _shown(screen: Screen, rays: ScreenRays, s: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    pixel = np.clip(np.floor(rays.pixels(s)).astype(np.int64), 0, screen.size - 1)
    return pixel, screen.levels[0][pixel[:, 1], pixel[:, 0]].astype(np.float64)
