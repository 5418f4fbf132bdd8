"""Where probes really stand: validity at the lattice points, and a small move for those that lie just inside geometry or on it.

A probe in the very plane of a wall sees that wall in every direction and nothing else, and one a hair behind it is dark: lattices
drawn to fit a room have whole layers of them. Like RTXGI-DDGI's relocation this keeps probes a clearance away from surfaces; they
go to the side that the nearest one faces.
"""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from ...numerics.grid import cell_axes, lattice_points
from ...numerics.sampling import fibonacci_sphere
from ...progress import Progress
from ...scene import ProbeVolume
from ...transport.context import LightContext
from ...transport.parallel import CHUNK, chunks, parallel_for
from ...transport.solids import Solids
from ...transport.vectors import dot
from ..base import BACKFACE_THRESHOLD

PILOT_RAYS = 48
# RTXGI-DDGI moves a probe by at most this share of a cell.
MAX_OFFSET = 0.45
# A moved probe stops this share of a cell beyond the surface it left, and none stays nearer to a surface than that.
CLEARANCE = 0.05
# Surfaces meet in corners: a probe is moved away from this many, one after the other.
MOST_WALLS = 3
# Surfaces count as near up to this many clearances along a ray: from just outside a corner no ray meets its walls sooner.
NEAR_ALONG_RAY = 4.0


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


def place(context: LightContext, volumes: tuple[ProbeVolume, ...], virtual_offset: bool, progress: Progress) -> Placement:
    """Find out which probes are inside solids, and move those that can be moved. Probes that nobody wants count as inside."""
    points = [lattice_points(volume.world_from_local, volume.resolution).reshape(-1, 3) for volume in volumes]
    wanted = [np.ones(len(lattice), bool) if volume.wanted is None else np.asarray(volume.wanted, bool).reshape(-1)
              for volume, lattice in zip(volumes, points, strict=True)]
    owner = np.repeat(np.arange(len(volumes)), [len(lattice) for lattice in points])
    lattice, rows = np.concatenate(points), np.flatnonzero(np.concatenate(wanted))
    placed = place_points(context, volumes, lattice[rows], owner[rows], virtual_offset, progress)
    if len(rows) == len(lattice):
        return placed

    def whole(part, rest):
        array = np.full((len(lattice), *part.shape[1:]), rest, part.dtype)
        array[rows] = part
        return array

    offset = whole(placed.offset, 0.0)
    return Placement(lattice.astype(np.float32) + offset, offset, whole(placed.validity, 0.0), whole(placed.measured, False),
                     whole(placed.reach, 0.0))


def place_points(context: LightContext, volumes: tuple[ProbeVolume, ...], points: np.ndarray, owner: np.ndarray,
                 virtual_offset: bool, progress: Progress) -> Placement:
    """The same for some lattice ``points`` (p, 3) alone, each of the volume ``owner`` (p,)."""
    axes = np.stack([np.linalg.norm(cell_axes(volume.world_from_local, volume.resolution), axis=0) for volume in volumes])
    lattice = points.astype(np.float32)
    step, reach = axes.min(axis=1)[owner].astype(np.float32), (1.5 * np.linalg.norm(axes, axis=1))[owner].astype(np.float32)
    solids = Solids(context.scene, context.geometry, context.surfaces)
    pilot = _pilot(context, solids, lattice, progress)
    offset = np.zeros_like(lattice)
    inside = pilot.validity < 1.0 - BACKFACE_THRESHOLD
    measured = ~inside
    if virtual_offset:
        _leave_solids(context, solids, lattice, step, pilot, offset, measured, progress)
        _leave_surfaces(context, lattice, step, offset, measured, progress)
    return Placement(lattice + offset, offset, pilot.validity, measured, reach)


class _Pilot(NamedTuple):
    """Validity (n,), and direction (n, 3) and distance (n,) to the nearest back face of a solid (infinite where there is none)."""

    validity: np.ndarray
    exit_direction: np.ndarray
    exit_distance: np.ndarray


def _leave_solids(context, solids, lattice, step, pilot, offset, measured, progress) -> None:
    """Move probes that are less than MAX_OFFSET of a cell inside a solid out of it; sets their ``offset`` and ``measured``."""
    rows = np.flatnonzero(~measured & (pilot.exit_distance + CLEARANCE * step <= MAX_OFFSET * step))
    move = pilot.exit_direction[rows] * (pilot.exit_distance[rows] + CLEARANCE * step[rows])[:, None]
    good = _pilot(context, solids, lattice[rows] + move, progress).validity >= 1.0 - BACKFACE_THRESHOLD
    offset[rows[good]], measured[rows[good]] = move[good], True


def _leave_surfaces(context, lattice, step, offset, measured, progress) -> None:
    """Move measured probes nearer than CLEARANCE to a surface away from it, to the side that it faces; changes their ``offset``."""
    rows = np.flatnonzero(measured)
    for _ in range(MOST_WALLS):
        normal, height = _nearest_surface(context, lattice[rows] + offset[rows], CLEARANCE * step[rows], progress)
        # Rounding must not leave a probe that was moved nearer than the clearance.
        near = np.flatnonzero(height < 0.99 * CLEARANCE * step[rows])
        rows, normal, height = rows[near], normal[near], height[near]
        offset[rows] += normal * (CLEARANCE * step[rows] - height)[:, None]


def _nearest_surface(context, points, clearance, progress):
    """Normal (n, 3) and signed height (n,) above its plane of the nearest surface around each of ``points`` (n, 3), of those met
    within NEAR_ALONG_RAY times ``clearance`` (n,); infinite where there is none."""
    directions = fibonacci_sphere(PILOT_RAYS)
    spans = chunks(len(points), CHUNK // PILOT_RAYS)

    def trace(i):
        n = len(points[spans[i]])
        rays, limit = np.repeat(directions, n, axis=0), np.tile(NEAR_ALONG_RAY * clearance[spans[i]], PILOT_RAYS)
        hits = context.tracer.intersect(np.tile(points[spans[i]], (PILOT_RAYS, 1)), rays, limit)
        rows = np.flatnonzero(hits.primitive >= 0)
        normals = context.geometry.normals_world[hits.primitive[rows]]
        height = np.full(PILOT_RAYS * n, np.inf, np.float32)
        height[rows] = -dot(normals, rays[rows]) * hits.t[rows]
        height = height.reshape(PILOT_RAYS, n)
        nearest = np.abs(height).argmin(axis=0)
        of_ray = np.zeros((PILOT_RAYS * n, 3), np.float32)
        of_ray[rows] = normals
        return of_ray.reshape(PILOT_RAYS, n, 3)[nearest, np.arange(n)], height[nearest, np.arange(n)]

    parts = parallel_for(trace, len(spans), context.threads, progress, "placing probes")
    normal, height = np.zeros((len(points), 3), np.float32), np.full(len(points), np.inf, np.float32)
    for span, (own_normal, own_height) in zip(spans, parts, strict=True):
        normal[span], height[span] = own_normal, own_height
    return normal, height


def _pilot(context, solids, points, progress) -> _Pilot:
    directions = fibonacci_sphere(PILOT_RAYS)
    spans = chunks(len(points), CHUNK // PILOT_RAYS)

    def trace(i):
        origins = points[spans[i]]
        n = len(origins)
        rays = np.repeat(directions, n, axis=0)
        hits = context.tracer.intersect(np.tile(origins, (PILOT_RAYS, 1)), rays)
        rows = np.flatnonzero(hits.primitive >= 0)
        rows = rows[dot(context.geometry.normals_world[hits.primitive[rows]], rays[rows]) > 0]
        return rows, hits.primitive[rows], hits.t[rows], n

    parts = parallel_for(trace, len(spans), context.threads, progress, "placing probes")
    validity = np.ones(len(points), np.float32)
    direction = np.zeros((len(points), 3), np.float32)
    distance = np.full(len(points), np.inf, np.float32)
    for span, (rows, primitive, t, n) in zip(spans, parts, strict=True):
        solid = solids.is_solid(primitive)
        t_solid = np.full(PILOT_RAYS * n, np.inf, np.float32)
        t_solid[rows[solid]] = t[solid]
        t_solid = t_solid.reshape(PILOT_RAYS, n)
        validity[span] = 1.0 - np.isfinite(t_solid).mean(axis=0)
        nearest = t_solid.argmin(axis=0)
        distance[span] = t_solid[nearest, np.arange(n)]
        direction[span] = directions[nearest]
    return _Pilot(validity, direction, distance)
