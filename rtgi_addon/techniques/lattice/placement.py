"""Where probes really stand: validity at the lattice points, and a small move for those that lie just inside geometry or on it.

A probe in the very plane of a wall sees that wall in every direction and nothing else, and one a hair behind it is dark: lattices
drawn to fit a room have whole layers of them. Like RTXGI-DDGI's relocation this keeps probes a clearance away from surfaces; they
go to the side that the nearest one faces. One that is clear of a surface, but behind it, is sent through it only where far less is
seen from behind there: beside a box of which some faces are turned it would end in the box.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from ...numerics.grid import cell_size, lattice_points
from ...numerics.sampling import fibonacci_sphere
from ...progress import Progress
from ...scene import ProbeVolume
from ...transport.context import LightContext
from ...transport.parallel import CHUNK, chunks, parallel_for
from ...transport.vectors import dot
from ..base import BACKFACE_THRESHOLD
from .unseen import worth_rays

# Rays that look around a probe before it is placed.
PILOT_RAYS = 48
# RTXGI-DDGI moves a probe by at most this share of a cell.
MAX_OFFSET = 0.45
# A moved probe stops this share of a cell beyond the surface it left, and none stays nearer to a surface than that.
CLEARANCE = 0.05
# Surfaces meet in corners: a probe is moved away from this many, one after the other.
MOST_WALLS = 3
# Surfaces count as near up to this many clearances along a ray: from just outside a corner no ray meets its walls sooner.
NEAR_ALONG_RAY = 4.0
# A probe that is clear of what it is behind goes through that where its rays meet less than this share of the backs from there.
_LESS_BEHIND = 0.5
# A probe nearer than this share of the clearance is moved: rounding must not leave one that was moved already a hair short of it.
_WITHIN = 0.99
# Distances that probes keep are clamped to this many diagonals of a cell.
_REACH = 1.5


@dataclass(eq=False)
class Placement:
    """Probes of all volumes in one list, volume after volume, x fastest.

    ``positions`` (p, 3) float32 where rays start; ``offset`` (p, 3) float32 from the lattice point; ``validity`` (p,) float32
    share of rays that do not meet the inside of a solid, at the lattice point; ``measured`` (p,) bool: probes that are
    outside geometry, moved or not; ``reach`` (p,) float32: distances are clamped here, 1.5 diagonals of a cell.
    """

    positions: np.ndarray
    offset: np.ndarray
    validity: np.ndarray
    measured: np.ndarray
    reach: np.ndarray

    def take(self, rows: np.ndarray) -> "Placement":
        """Those of ``rows`` alone."""
        return Placement(self.positions[rows], self.offset[rows], self.validity[rows], self.measured[rows], self.reach[rows])


def place(context: LightContext, volumes: tuple[ProbeVolume, ...], virtual_offset: bool, progress: Progress,
          known: Sequence[tuple[np.ndarray, Placement]] = ()) -> Placement:
    """Find out which probes are inside solids, and move those that can be moved. Probes that nobody wants count as inside, and
    those of scattered volumes stand where they should. How some stand may be ``known``: the probes (m,), by their numbers, and
    their Placement (m)."""
    points = [lattice_points(volume.world_from_local, volume.resolution).reshape(-1, 3) for volume in volumes]
    wanted = [np.zeros(len(lattice), bool) if volume.scattered is not None else
              np.ones(len(lattice), bool) if mask is None else np.asarray(mask, bool).reshape(-1)
              for volume, mask, lattice in zip(volumes, worth_rays(context.geometry, volumes), points, strict=True)]
    owner = np.repeat(np.arange(len(volumes)), [len(lattice) for lattice in points])
    lattice, left = np.concatenate(points), np.concatenate(wanted)
    known = [(probes, placed, left[probes]) for probes, placed in known]
    for probes, _, _ in known:
        left[probes] = False
    rows = np.flatnonzero(left)
    placed = place_points(context, volumes, lattice[rows], owner[rows], virtual_offset, progress)
    if len(rows) == len(lattice):
        return placed
    whole = _whole(placed, lattice, rows)
    for probes, placed, own in known:
        for name in ("positions", "offset", "validity", "measured", "reach"):
            getattr(whole, name)[probes[own]] = getattr(placed, name)[own]
    return _with_scattered(volumes, whole)


def _whole(placed: Placement, lattice: np.ndarray, rows: np.ndarray) -> Placement:
    """All of the ``lattice`` (p, 3), of which ``rows`` were ``placed``: the others count as inside."""

    def whole(values, rest):
        array = np.full((len(lattice), *values.shape[1:]), rest, values.dtype)
        array[rows] = values
        return array

    offset = whole(placed.offset, 0.0)
    return Placement(lattice.astype(np.float32) + offset, offset, whole(placed.validity, 0.0), whole(placed.measured, False),
                     whole(placed.reach, 0.0))


def _with_scattered(volumes: tuple[ProbeVolume, ...], placement: Placement) -> Placement:
    """``placement`` with the probes of scattered volumes, which are in the open, as they were placed."""
    start = 0
    for volume in volumes:
        first, start = start, start + int(np.prod(volume.resolution))
        scattered = volume.scattered
        if scattered is not None:
            own = slice(first, first + len(scattered.points_world))
            placement.offset[own] = scattered.points_world - placement.positions[own]
            placement.positions[own] = scattered.points_world
            placement.validity[own], placement.measured[own], placement.reach[own] = 1.0, True, scattered.reach
    return placement


def place_points(context: LightContext, volumes: tuple[ProbeVolume, ...], points: np.ndarray, owner: np.ndarray,
                 virtual_offset: bool, progress: Progress) -> Placement:
    """The same for some lattice ``points`` (p, 3) alone, each of the volume ``owner`` (p,)."""
    sides = np.stack([cell_size(volume.world_from_local, volume.nodes) for volume in volumes])
    lattice = points.astype(np.float32)
    step, reach = sides.min(axis=1)[owner].astype(np.float32), (_REACH * np.linalg.norm(sides, axis=1))[owner].astype(np.float32)
    pilot = _pilot(context, lattice, progress)
    offset = np.zeros_like(lattice)
    inside = pilot.validity < 1.0 - BACKFACE_THRESHOLD
    measured = ~inside
    if virtual_offset:
        _leave_solids(context, lattice, step, pilot, offset, measured, progress)
        _leave_surfaces(context, lattice, step, offset, measured, progress)
    return Placement(lattice + offset, offset, pilot.validity, measured, reach)


class _Pilot(NamedTuple):
    """Validity (n,), and direction (n, 3) and distance (n,) to the nearest back face of a solid (infinite where there is none)."""

    validity: np.ndarray
    exit_direction: np.ndarray
    exit_distance: np.ndarray


def _leave_solids(context, lattice, step, pilot, offset, measured, progress) -> None:
    """Move probes that are less than MAX_OFFSET of a cell inside a solid out of it; sets their ``offset`` and ``measured``."""
    rows = np.flatnonzero(~measured & (pilot.exit_distance + CLEARANCE * step <= MAX_OFFSET * step))
    move = pilot.exit_direction[rows] * (pilot.exit_distance[rows] + CLEARANCE * step[rows])[:, None]
    good = _pilot(context, lattice[rows] + move, progress).validity >= 1.0 - BACKFACE_THRESHOLD
    offset[rows[good]], measured[rows[good]] = move[good], True


def _leave_surfaces(context, lattice, step, offset, measured, progress) -> None:
    """Move measured probes nearer than CLEARANCE to a surface, or a little behind it, to the side that it faces; changes their
    ``offset``."""
    rows, before, through = np.flatnonzero(measured), offset.copy(), np.zeros(len(offset), bool)
    for _ in range(MOST_WALLS):
        normal, height = _nearest_surface(context, lattice[rows] + offset[rows], CLEARANCE * step[rows], progress)
        near = np.flatnonzero(height < _WITHIN * CLEARANCE * step[rows])
        rows, normal, height = rows[near], normal[near], height[near]
        through[rows] |= height < -CLEARANCE * step[rows]
        offset[rows] += normal * (CLEARANCE * step[rows] - height)[:, None]
    through = np.flatnonzero(through)
    here, there = (_back_share(context, lattice[through] + moved[through], progress) for moved in (before, offset))
    back = through[there >= _LESS_BEHIND * here]
    offset[back] = before[back]


def _back_share(context, points, progress) -> np.ndarray:
    """(n,) share of rays from ``points`` (n, 3) that meet the back of a surface, solid or not."""
    directions = fibonacci_sphere(PILOT_RAYS)
    spans = chunks(len(points), CHUNK // PILOT_RAYS)

    def trace(i):
        count = len(points[spans[i]])
        rays = np.repeat(directions, count, axis=0)
        hits = context.tracer.intersect(np.tile(points[spans[i]], (PILOT_RAYS, 1)), rays)
        rows = np.flatnonzero(hits.primitive >= 0)
        rows = rows[dot(context.geometry.normals_world[hits.primitive[rows]], rays[rows]) > 0]
        return np.bincount(rows % count, minlength=count) / PILOT_RAYS

    return np.concatenate([np.zeros(0), *parallel_for(trace, len(spans), context.threads, progress, "placing probes")])


def _nearest_surface(context, points, clearance, progress):
    """Normal (n, 3) and signed height (n,) above its plane of the nearest surface around each of ``points`` (n, 3), of those met
    within NEAR_ALONG_RAY times ``clearance`` (n,); infinite where there is none."""
    directions = fibonacci_sphere(PILOT_RAYS)
    spans = chunks(len(points), CHUNK // PILOT_RAYS)

    def trace(i):
        count = len(points[spans[i]])
        rays, limit = np.repeat(directions, count, axis=0), np.tile(NEAR_ALONG_RAY * clearance[spans[i]], PILOT_RAYS)
        hits = context.tracer.intersect(np.tile(points[spans[i]], (PILOT_RAYS, 1)), rays, limit)
        rows = np.flatnonzero(hits.primitive >= 0)
        normals = context.geometry.normals_world[hits.primitive[rows]]
        height = np.full(PILOT_RAYS * count, np.inf, np.float32)
        height[rows] = -dot(normals, rays[rows]) * hits.t[rows]
        height = height.reshape(PILOT_RAYS, count)
        nearest = np.abs(height).argmin(axis=0)
        of_ray = np.zeros((PILOT_RAYS * count, 3), np.float32)
        of_ray[rows] = normals
        return of_ray.reshape(PILOT_RAYS, count, 3)[nearest, np.arange(count)], height[nearest, np.arange(count)]

    parts = parallel_for(trace, len(spans), context.threads, progress, "placing probes")
    normal, height = np.zeros((len(points), 3), np.float32), np.full(len(points), np.inf, np.float32)
    for span, (normals, heights) in zip(spans, parts, strict=True):
        normal[span], height[span] = normals, heights
    return normal, height


def _pilot(context, points, progress) -> _Pilot:
    directions = fibonacci_sphere(PILOT_RAYS)
    spans = chunks(len(points), CHUNK // PILOT_RAYS)

    def trace(i):
        origins = points[spans[i]]
        rays = np.repeat(directions, len(origins), axis=0)
        hits = context.tracer.intersect(np.tile(origins, (PILOT_RAYS, 1)), rays)
        rows = np.flatnonzero(hits.primitive >= 0)
        rows = rows[dot(context.geometry.normals_world[hits.primitive[rows]], rays[rows]) > 0]
        return rows, hits.primitive[rows], hits.t[rows]

    parts = parallel_for(trace, len(spans), context.threads, progress, "placing probes")
    validity = np.ones(len(points), np.float32)
    direction = np.zeros((len(points), 3), np.float32)
    distance = np.full(len(points), np.inf, np.float32)
    for span, (rows, primitive, t) in zip(spans, parts, strict=True):
        count, solid = len(points[span]), context.solids.is_solid(primitive)
        t_solid = np.full(PILOT_RAYS * count, np.inf, np.float32)
        t_solid[rows[solid]] = t[solid]
        t_solid = t_solid.reshape(PILOT_RAYS, count)
        validity[span] = 1.0 - np.isfinite(t_solid).mean(axis=0)
        nearest = t_solid.argmin(axis=0)
        distance[span] = t_solid[nearest, np.arange(count)]
        direction[span] = directions[nearest]
    return _Pilot(validity, direction, distance)
