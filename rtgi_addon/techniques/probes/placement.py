"""Where probes really stand: validity at the lattice points, and a small move out of geometry for those just inside."""

from dataclasses import dataclass

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
# A moved probe stops this share of a cell beyond the surface it left.
CLEARANCE = 0.05


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
    """Find out which probes are inside solids, and move those that can be moved."""
    points, reach, step = [], [], []
    for volume in volumes:
        axes = np.linalg.norm(cell_axes(volume.world_from_local, volume.resolution), axis=0)
        lattice = lattice_points(volume.world_from_local, volume.resolution).reshape(-1, 3)
        points.append(lattice)
        reach.append(np.full(len(lattice), 1.5 * np.linalg.norm(axes)))
        step.append(np.full(len(lattice), axes.min()))
    lattice = np.concatenate(points).astype(np.float32)
    step = np.concatenate(step).astype(np.float32)
    solids = Solids(context.scene, context.geometry, context.surfaces)
    validity, exit_direction, exit_distance = _pilot(context, solids, lattice, progress)
    offset = np.zeros_like(lattice)
    inside = validity < 1.0 - BACKFACE_THRESHOLD
    measured = ~inside
    if virtual_offset and inside.any():
        rows = np.flatnonzero(inside & (exit_distance + CLEARANCE * step <= MAX_OFFSET * step))
        move = exit_direction[rows] * (exit_distance[rows] + CLEARANCE * step[rows])[:, None]
        moved_validity, _, _ = _pilot(context, solids, lattice[rows] + move, progress)
        rows, move = rows[moved_validity >= 1.0 - BACKFACE_THRESHOLD], move[moved_validity >= 1.0 - BACKFACE_THRESHOLD]
        offset[rows], measured[rows] = move, True
    return Placement(lattice + offset, offset, validity, measured, np.concatenate(reach).astype(np.float32))


def _pilot(context, solids, points, progress):
    """Validity (n,), and direction and distance to the nearest back face of a solid (infinite where there is none)."""
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
    return validity, direction, distance
