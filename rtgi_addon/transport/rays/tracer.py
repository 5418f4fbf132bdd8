"""What all tracers share: the hits they return, what is asked of them, and how rays leave a surface."""

from dataclasses import dataclass
from typing import Protocol

import numpy as np

from ..vectors import dot, largest

# Relative to coordinates and hit distance: some 30 float32 ulps, which covers the error of o + t·d and of the BVH's quantization.
SELF_INTERSECTION = np.float32(4e-6)
# Rays without a limit end here, far beyond any scene, as embreex itself does.
INFINITE = np.float32(1e37)
# Shadow rays stop short of what they aim at by this share of their length: a lamp may lie on a surface, an emitter always does.
SHORTENING = np.float32(1e-4)
# Segments between two points that both were moved off their surfaces end this share short: rounding must not take the far end's
# own surface for a wall. Much more, and a point close to a wall would see both its sides.
SEGMENT = np.float32(1.0 - 1e-6)


@dataclass(frozen=True, eq=False)
class Hits:
    """Nearest hits: ``primitive`` (n,) int32, −1 where a ray left the scene (never index with it); ``u``, ``v`` (n,) Embree
    barycentrics, some finite number for a miss; ``t`` (n,) distance in units of the direction's length, infinite for a miss;
    ``tint`` (n, 3) what surfaces that the ray has passed leave of the light that comes along it, None where all of it is left."""

    primitive: np.ndarray
    u: np.ndarray
    v: np.ndarray
    t: np.ndarray
    tint: np.ndarray | None = None

    def take(self, rows: np.ndarray) -> "Hits":
        """Those of the given rays alone."""
        return Hits(self.primitive[rows], self.u[rows], self.v[rows], self.t[rows], None if self.tint is None else self.tint[rows])


class Tracer(Protocol):
    """What light transport asks of a ray tracer. Arrays are float32; directions need not be unit."""

    def intersect(self, origins: np.ndarray, directions: np.ndarray, t_max: np.ndarray | None = None) -> Hits:
        """Nearest hit of each ray (n, 3); surfaces that let the ray through by their alpha are skipped."""

    def occluded(self, origins: np.ndarray, directions: np.ndarray, t_max: np.ndarray | None = None) -> np.ndarray:
        """(n,) bool: True where something lies between the origin and ``t_max`` (n,) (None: anywhere)."""

    def transmittance(self, origins: np.ndarray, directions: np.ndarray, t_max: np.ndarray | None = None,
                      looks: bool = False) -> np.ndarray:
        """(n, 1), or (n, 3) where colours differ: the share of light that gets from ``t_max`` (n,) (None: from anywhere) to the
        origin. ``looks``: of what a surface reflects, which some surfaces let pass otherwise than the light of sources."""
        return ~self.occluded(origins, directions, t_max)[:, None]

    def of_points(self) -> "Tracer":
        """The tracer of rays from and to lamps without a size, which nothing finds through glass."""
        return self


def short_of(distance: np.ndarray, origins: np.ndarray | None = None, targets: np.ndarray | None = None) -> np.ndarray:
    """Where (n,) shadow rays end that aim at what is ``distance`` (n,) away, of lamps that may be infinitely far.

    Rays from ``origins`` to ``targets`` (n, 3) on surfaces end sooner by what the coordinates of both may be rounded by, too.
    """
    limits = np.minimum(distance * (1 - SHORTENING), INFINITE)
    if targets is None:
        return limits
    reach = np.maximum(largest(np.abs(targets)), largest(np.abs(origins)))
    return np.maximum(limits - 4 * SELF_INTERSECTION * reach, 0.0)


def attenuate(weight: np.ndarray, index, passed: np.ndarray) -> np.ndarray | None:
    """Multiply ``weight`` (…) at ``index`` by ``passed`` (n, 1), what rays let through there; where that has colours (n, 3), leave
    it and return what to multiply with (…, 3)."""
    if passed.shape[1] == 1:
        weight[index] *= passed[:, 0]
        return None
    tint = np.ones((*weight.shape, 3), np.float32)
    tint[index] = passed
    return tint


def offset_origins(points: np.ndarray, normals: np.ndarray, directions: np.ndarray, reach: np.ndarray | None = None) -> np.ndarray:
    """Move surface points (n, 3) off their plane to the side ``directions`` (n, 3) leave on, along geometric ``normals`` (n, 3).

    The step is relative to the coordinates, and to ``reach`` (n,) where the points were computed as o + t·d: the distance t.
    """
    scale = largest(np.abs(points))
    if reach is not None:
        scale = np.maximum(scale, reach)
    step = scale * SELF_INTERSECTION
    side = dot(normals, directions)
    return points + normals * np.where(side >= 0, step, -step)[:, None].astype(np.float32)
