"""Where probes might stand: above every floor that vertical rays meet, storey by storey."""

import numpy as np

from ...errors import BakeError
from ...numerics.grid import box_corners, cell_size, local_from_world
from ...progress import Progress
from ...scene import ProbeVolume
from ...transport.context import LightContext
from ..lattice.placement import place_points

# Rooms lower than this share of a cell are no place for a probe.
LOWEST = 0.3
# A ray goes on this far [shares of its length] behind what it met, and meets so many things at most.
_BEHIND, MOST_STOREYS = 1e-5, 64
# More candidates than this are refused: pilot rays would take longer than the bake.
MOST_CANDIDATES = 1 << 16
# How upright a volume stands whose own sides tell how far apart places are, up and sideways: the cosine of a degree.
_UPRIGHT = 0.9998


def candidates(context: LightContext, volume: ProbeVolume, progress: Progress) -> np.ndarray:
    """Places (n, 3) float64 in the box of ``volume``, about as dense as its lattice, in every storey between a floor and what is
    above it, kept clear of geometry. Raises BakeError where there are too many, Cancelled."""
    aside, up = spacing(volume)
    corners = box_corners(volume.world_from_local)
    low, high = corners.min(axis=0), corners.max(axis=0)
    count = np.maximum(1, np.round((high - low)[:2] / aside)).astype(np.int64)
    steps = [low[axis] + (np.arange(count[axis]) + 0.5) * (high[axis] - low[axis]) / count[axis] for axis in (0, 1)]
    columns = np.stack([part.ravel() for part in np.meshgrid(*steps)], axis=1)
    if len(columns) * np.ceil((high[2] - low[2]) / up) > 16 * MOST_CANDIDATES:
        raise _too_many(volume)
    points = [above_floors(column, heights, high[2], up) for column, heights in zip(
        columns, _heights(context, columns, low[2], high[2]), strict=True)]
    points = np.concatenate([np.zeros((0, 3)), *points])
    points = points[inside(volume, points)]
    if len(points) > MOST_CANDIDATES:
        raise _too_many(volume)
    return clear(context, volume, points, progress)


def clear(context: LightContext, volume: ProbeVolume, points: np.ndarray, progress: Progress) -> np.ndarray:
    """``points`` (n, 3) moved a little away from surfaces, without those inside solids. Raises Cancelled."""
    if not len(points):
        return points
    placed = place_points(context, (volume,), points, np.zeros(len(points), np.int64), True, progress)
    return placed.positions[placed.measured].astype(np.float64)


def spacing(volume: ProbeVolume) -> tuple[float, float]:
    """How far apart [m] places stand sideways and upwards: as nodes of ``volume``, whose mean serves for both where it lies
    askew."""
    sides = cell_size(volume.world_from_local, volume.nodes)
    third = np.asarray(volume.world_from_local, np.float64)[:3, 2]
    if abs(third[2]) >= _UPRIGHT * np.linalg.norm(third):
        return float(np.sqrt(sides[0] * sides[1])), float(sides[2])
    return float(np.cbrt(sides.prod())), float(np.cbrt(sides.prod()))


def inside(volume: ProbeVolume, points: np.ndarray) -> np.ndarray:
    """(n,) bool: those of ``points`` (n, 3) in the box of ``volume``."""
    return np.all(np.abs(local_from_world(volume.world_from_local, points)) <= 1.0, axis=-1)


def above_floors(column: np.ndarray, heights: np.ndarray, top: float, up: float) -> np.ndarray:
    """Places (n, 3) over ``column`` (2,) in the storeys between ``heights`` (m,), falling, of what a ray from ``top`` met: evenly
    some ``up`` [m] apart, half as far from floor and ceiling."""
    ceilings = np.concatenate([[top], heights])[:-1]
    found = [np.zeros((0, 3))]
    for ceiling, floor in zip(ceilings, heights, strict=True):
        height = ceiling - floor
        if height < LOWEST * up:
            continue
        number = max(1, round(height / up))
        z = floor + (np.arange(number) + 0.5) * height / number
        found.append(np.stack([np.full(number, column[0]), np.full(number, column[1]), z], axis=1))
    return np.concatenate(found)


def _heights(context: LightContext, columns: np.ndarray, bottom: float, top: float) -> list[np.ndarray]:
    """What rays straight down over ``columns`` (n, 2) meet: heights, falling, from ``top`` to the first one below ``bottom``."""
    heights = [[] for _ in columns]
    rows = np.arange(len(columns))
    origins = np.column_stack([columns, np.full(len(columns), top)]).astype(np.float32)
    for _ in range(MOST_STOREYS):
        if not len(rows):
            break
        hits = context.tracer.intersect(origins, np.tile(np.float32([0, 0, -1]), (len(rows), 1)))
        met = np.flatnonzero(hits.primitive >= 0)
        rows, origins, way = rows[met], origins[met], hits.t[met]
        z = origins[:, 2] - way
        for row, height in zip(rows.tolist(), z.tolist(), strict=True):
            heights[row].append(height)
        origins[:, 2] = z - _BEHIND * np.maximum(way, np.abs(z) + 1.0)
        going = np.flatnonzero(z > bottom)
        rows, origins = rows[going], origins[going]
    return [np.array(column, np.float64) for column in heights]


def _too_many(volume: ProbeVolume) -> BakeError:
    return BakeError(f"volume {volume.name} has more than {MOST_CANDIDATES:,} places for scattered probes",
                     "lower its resolution, which says how dense they may stand, or split it into several volumes")
