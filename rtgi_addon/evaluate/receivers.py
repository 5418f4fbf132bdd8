"""Where errors are measured: points on surfaces and just above them, under many normals, and probes.

Errors at probes are those of the bake alone; errors at surface points have in them what interpolation between probes, leaks and
self-lighting add (docs/physics.md §4).
"""

from typing import NamedTuple

import numpy as np

from ..numerics.sampling import about, cosine_hemisphere, sphere_from_square
from ..progress import Progress
from ..scene import ProbeVolume
from ..techniques.base import BACKFACE_THRESHOLD
from ..techniques.lattice.placement import place
from ..transport.context import LightContext
from ..transport.rays.tracer import offset_origins
from ..transport.vectors import faced, normalized

# How often how many rays are sent out for each wanted point before those that are still missing are given up.
ROUNDS, RAYS_A_POINT = 8, 4
# Receivers under tilted normals are lifted no more than this share of the way to the next surface.
_ROOM_SHARE = 0.5
# Tells the numbers of receivers apart from all others of a seed: the letters re.
_STREAM = 0x7265


class Receivers(NamedTuple):
    """Where irradiance is asked for: ``points`` (n, 3) and unit ``normals`` (n, 3) float32, world space, and ``own`` (n,) bool:
    True where the normal is the surface's own, False where it was tilted."""

    points: np.ndarray
    normals: np.ndarray
    own: np.ndarray

    def take(self, rows) -> "Receivers":
        """Only the receivers ``rows`` (indices or booleans)."""
        return Receivers(*(array[rows] for array in self))


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
    rng = np.random.default_rng([seed, _STREAM])
    rounds, wanted = [], points
    for _ in range(ROUNDS):
        origins = eyes[rng.integers(0, len(eyes), RAYS_A_POINT * points)].astype(np.float32)
        directions = sphere_from_square(rng.random((len(origins), 2))).astype(np.float32)
        hits = context.tracer.intersect(origins, directions)
        rows = np.flatnonzero(hits.primitive >= 0)[:wanted]
        primitive = hits.primitive[rows]
        normals = faced(context.geometry.normals_world[primitive], directions[rows])
        position = context.geometry.points(primitive, hits.u[rows], hits.v[rows])
        rounds.append((offset_origins(position, normals, normals, hits.t[rows]), normals))
        wanted -= len(rows)
        if wanted == 0:
            break
    position, upright = (np.concatenate(arrays).astype(np.float32) for arrays in zip(*rounds, strict=True))
    others = normals_per_point - 1
    room = context.tracer.intersect(position, upright).t
    lifted = position + upright * np.minimum(np.float32(lift), _ROOM_SHARE * room)[:, None]
    tilted = _tilted(np.repeat(upright, others, axis=0), rng)
    normals = np.concatenate([upright[:, None], tilted.reshape(len(upright), others, 3)], axis=1)
    places = np.concatenate([position[:, None], np.repeat(lifted[:, None], others, axis=1)], axis=1)
    return Receivers(places.reshape(-1, 3).astype(np.float32), normals.reshape(-1, 3).astype(np.float32),
                     np.tile(np.arange(normals_per_point) == 0, len(upright)))


def _tilted(normals: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    """One cosine-distributed direction (n, 3) about each of ``normals`` (n, 3)."""
    return normalized(about(normals, cosine_hemisphere(rng.random((len(normals), 2)))))
