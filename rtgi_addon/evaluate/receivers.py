"""Where errors are measured: points on surfaces and just above them, under many normals, and probes.

Errors at probes are those of the bake alone; errors at surface points have in them what interpolation between probes, leaks and
self-lighting add (PHYSICS.md §4).
"""

from typing import NamedTuple

import numpy as np

from ..numerics.sampling import cosine_hemisphere, frame, sphere_from_square
from ..progress import Progress
from ..scene import ProbeVolume
from ..techniques.base import BACKFACE_THRESHOLD
from ..techniques.probes.placement import place
from ..transport.context import LightContext
from ..transport.rays import offset_origins
from ..transport.vectors import dot, normalized

# How often four rays are sent out for each wanted point before those that are still missing are given up.
ROUNDS = 8


class Receivers(NamedTuple):
    """Where irradiance is asked for: ``points`` (n, 3) and unit ``normals`` (n, 3) float32, world space, and ``own`` (n,) bool:
    True where the normal is the surface's own, False where it was tilted."""

    points: np.ndarray
    normals: np.ndarray
    own: np.ndarray

    def take(self, rows) -> "Receivers":
        """Only the receivers ``rows`` (indices or booleans)."""
        return Receivers(*(part[rows] for part in self))


def open_probes(context: LightContext, volumes: tuple[ProbeVolume, ...]) -> np.ndarray:
    """Indices (n,) of the usable probes of ``volumes``, one volume after another, x fastest: those that lie in the open at their
    lattice point (numerics.grid), whatever technique bakes them."""
    placement = place(context, volumes, False, Progress())
    return np.flatnonzero(placement.validity >= 1.0 - BACKFACE_THRESHOLD)


def surface_receivers(context: LightContext, eyes: np.ndarray, points: int, normals_per_point: int = 4, seed: int = 0,
                      lift: float = 0.0) -> Receivers:
    """``points`` points on surfaces that rays from ``eyes`` (p, 3) in the open meet, each under ``normals_per_point`` normals.

    The first normal of a point is its surface's own, towards the eye; the others are cosine-distributed about it, as those of
    small things that stand there, ``lift`` [m] above the surface (but no more than half way to the next one): without it they
    would look at their own surface from no distance at all. Fewer points where hardly any ray meets a surface. Another ``seed``
    gives independent points: what was chosen on some can be checked on others.
    """
    rng = np.random.default_rng([seed, 0x7265])
    found, wanted = [], points
    for _ in range(ROUNDS):
        origins = eyes[rng.integers(0, len(eyes), 4 * points)].astype(np.float32)
        directions = sphere_from_square(rng.random((len(origins), 2))).astype(np.float32)
        hits = context.tracer.intersect(origins, directions)
        rows = np.flatnonzero(hits.primitive >= 0)[:wanted]
        primitive = hits.primitive[rows]
        normals = context.geometry.normals_world[primitive]
        normals = normals * -np.copysign(np.float32(1.0), dot(normals, directions[rows]))[:, None]
        position = context.geometry.points(primitive, hits.u[rows], hits.v[rows])
        found.append((offset_origins(position, normals, normals, hits.t[rows]), normals))
        wanted -= len(rows)
        if wanted == 0:
            break
    position, own = (np.concatenate(part).astype(np.float32) for part in zip(*found, strict=True))
    others = normals_per_point - 1
    room = context.tracer.intersect(position, own).t
    lifted = position + own * np.minimum(np.float32(lift), 0.5 * room)[:, None]
    tilted = _tilted(np.repeat(own, others, axis=0), rng)
    normals = np.concatenate([own[:, None], tilted.reshape(len(own), others, 3)], axis=1)
    places = np.concatenate([position[:, None], np.repeat(lifted[:, None], others, axis=1)], axis=1)
    return Receivers(places.reshape(-1, 3).astype(np.float32), normals.reshape(-1, 3).astype(np.float32),
                     np.tile(np.arange(normals_per_point) == 0, len(own)))


def _tilted(normals: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    """One cosine-distributed direction (n, 3) about each of ``normals`` (n, 3)."""
    local = cosine_hemisphere(rng.random((len(normals), 2)))
    tangent, bitangent = frame(normals)
    return normalized(tangent * local[:, :1] + bitangent * local[:, 1:2] + normals * local[:, 2:])
