"""Rays against the scene's triangles through Embree, in chunks over every core.

Without an embreex wheel ``make_tracer`` falls back to Blender's BVH, and outside Blender to the numpy twin.
"""

import platform
import sys
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from .geometry import Geometry
from .parallel import CHUNK, chunks, parallel_for
from .ray_counter import record
from .surfaces import Surfaces
from .vectors import dot

try:
    from embreex import rtcore_scene
    from embreex.mesh_construction import TriangleMesh
except ImportError:  # no wheel for this platform (Windows and Linux on Arm), or one that this system cannot load
    rtcore_scene = None

# Relative to coordinates and hit distance: some 30 float32 ulps, which covers the error of o + t·d and of the BVH's quantization.
SELF_INTERSECTION = np.float32(4e-6)
# Layers of cut-out foliage a ray may pass before it counts as lost.
MAX_ALPHA_LAYERS = 64
# Rays without a limit end here, far beyond any scene, as embreex itself does.
INFINITE = np.float32(1e37)


@dataclass(frozen=True, eq=False)
class Hits:
    """Nearest hits: ``primitive`` (n,) int32, −1 where a ray left the scene (never index with it); ``u``, ``v`` (n,) Embree
    barycentrics; ``t`` (n,) distance in units of the direction's length, infinite for a miss."""

    primitive: np.ndarray
    u: np.ndarray
    v: np.ndarray
    t: np.ndarray


class Tracer(Protocol):
    """What light transport asks of a ray tracer. Arrays are float32; directions need not be unit."""

    def intersect(self, origins: np.ndarray, directions: np.ndarray, t_max: np.ndarray | None = None) -> Hits:
        """Nearest hit of each ray (n, 3); surfaces that let the ray through by their alpha are skipped."""

    def occluded(self, origins: np.ndarray, directions: np.ndarray, t_max: np.ndarray | None = None) -> np.ndarray:
        """(n,) bool: True where something lies between the origin and ``t_max`` (n,) (None: anywhere)."""


def make_tracer(geometry: Geometry, surfaces: Surfaces | None = None, threads: int | None = None) -> Tracer:
    """The fastest tracer there is for ``geometry``; with ``surfaces``, one that honours alpha."""
    tracer = EmbreeTracer(geometry, threads) if rtcore_scene is not None else _without_embree(geometry)
    if surfaces is not None and surfaces.has_transparency:
        return AlphaTracer(tracer, geometry, surfaces)
    return tracer


def _without_embree(geometry: Geometry) -> Tracer:
    from .brute_force import BruteForceTracer
    from .bvh_tree import BVHTreeTracer
    try:
        return BVHTreeTracer(geometry)
    except ImportError:  # mathutils comes with Blender alone
        return BruteForceTracer(geometry)


def slow_rays_warning() -> str | None:
    """What to tell the user where rays do not go through Embree, and what to do; None where they do."""
    if rtcore_scene is not None:
        return None
    from .bvh_tree import SLOWER
    on_arm = platform.machine().lower() in ("arm64", "aarch64") and sys.platform != "darwin"
    remedy = ("the package does not exist for this system" if on_arm else
              "install the extension's zip made for this system, or that package, and restart Blender")
    return (f"there is no Embree here (the Python package embreex): rays go through Blender's BVH, which makes bakes some {SLOWER} "
            f"times slower, and more on many cores; {remedy}")


class EmbreeTracer:
    """Embree 4 in robust mode (watertight at shared edges), one ray at a time per thread.

    Calls of at most one chunk run on the calling thread, so that a worker's own chunks never nest pools.
    """

    def __init__(self, geometry: Geometry, threads: int | None = None):
        self._scene = rtcore_scene.EmbreeScene()
        # embreex copies vertex by vertex through Python objects; indexed or not costs the same, the flat form keeps one array.
        self._mesh = TriangleMesh(self._scene, geometry.triangles_world)
        self._threads = threads
        # The first query builds the BVH; doing it here keeps two threads from building it at once.
        self._scene.run(np.zeros((1, 3), np.float32), np.ones((1, 3), np.float32))

    def intersect(self, origins, directions, t_max=None) -> Hits:
        """See Tracer."""
        parts = self._run(origins, directions, t_max, self._intersect_chunk)
        if len(parts) == 1:
            return parts[0]
        return Hits(*(np.concatenate([getattr(part, name) for part in parts]) for name in ("primitive", "u", "v", "t")))

    def occluded(self, origins, directions, t_max=None) -> np.ndarray:
        """See Tracer."""
        parts = self._run(origins, directions, t_max, self._occluded_chunk)
        return parts[0] if len(parts) == 1 else np.concatenate(parts)

    def _run(self, origins, directions, t_max, function):
        record(len(origins))
        spans = chunks(len(origins)) or [slice(0, 0)]
        limits = None if t_max is None else np.broadcast_to(np.asarray(t_max, np.float32), (len(origins),))
        return parallel_for(lambda i: function(origins[spans[i]], directions[spans[i]],
                                               None if limits is None else limits[spans[i]]), len(spans), self._threads)

    def _intersect_chunk(self, origins, directions, limits) -> Hits:
        # embreex overwrites the limits with the hit distances.
        dists = None if limits is None else np.array(limits, np.float32)
        out = self._scene.run(origins, directions, dists, query="INTERSECT", output=True)
        t = out["tfar"]
        t[out["primID"] < 0] = np.inf
        return Hits(out["primID"], out["u"], out["v"], t)

    def _occluded_chunk(self, origins, directions, limits) -> np.ndarray:
        dists = None if limits is None else np.array(np.minimum(limits, INFINITE), np.float32)
        return self._scene.run(origins, directions, dists, query="OCCLUDED") >= 0


class AlphaTracer:
    """Lets rays through surfaces by their alpha: a hard cut at the material's threshold, or a coin per ray and layer.

    The coin is a hash of the ray itself, so the same ray always meets the same answer, on any thread.
    """

    def __init__(self, tracer: Tracer, geometry: Geometry, surfaces: Surfaces):
        self._tracer, self._surfaces = tracer, surfaces
        self._transparent_triangle = surfaces.transparent[geometry.material]
        self._threshold = surfaces.alpha_threshold[geometry.material]

    def intersect(self, origins, directions, t_max=None) -> Hits:
        """See Tracer."""
        limits = np.full(len(origins), INFINITE, np.float32) if t_max is None else np.array(
            np.broadcast_to(np.asarray(t_max, np.float32), (len(origins),)))
        hits = self._tracer.intersect(origins, directions, limits)
        passed = np.zeros(len(origins), np.float32)
        rows = self._passing(hits, origins, directions, np.arange(len(origins)))
        for _ in range(MAX_ALPHA_LAYERS):
            if rows.size == 0:
                break
            # Step past the layer by what a hit distance can be wrong by, measured along the ray.
            reach = np.abs(origins[rows]).max(axis=1) + hits.t[rows] * np.sqrt(np.sum(directions[rows] ** 2, axis=1))
            passed[rows] = hits.t[rows] + SELF_INTERSECTION * reach / np.sqrt(np.sum(directions[rows] ** 2, axis=1))
            start = origins[rows] + directions[rows] * passed[rows, None]
            onward = self._tracer.intersect(start, directions[rows], np.maximum(limits[rows] - passed[rows], 0))
            hits.primitive[rows], hits.u[rows], hits.v[rows] = onward.primitive, onward.u, onward.v
            hits.t[rows] = onward.t + passed[rows]
            rows = self._passing(hits, origins, directions, rows)
        hits.primitive[rows] = -1
        hits.t[rows] = np.inf
        return hits

    def occluded(self, origins, directions, t_max=None) -> np.ndarray:
        """See Tracer."""
        return self.intersect(origins, directions, t_max).primitive >= 0

    def _passing(self, hits, origins, directions, rows):
        primitive = hits.primitive[rows]
        rows = rows[(primitive >= 0) & self._transparent_triangle[np.maximum(primitive, 0)]]
        if rows.size == 0:
            return rows
        primitive = hits.primitive[rows]
        alpha = self._surfaces.alpha(primitive, hits.u[rows], hits.v[rows])
        threshold = self._threshold[primitive]
        cut = np.where(np.isnan(threshold), _coin(origins[rows], directions[rows], primitive), threshold)
        return rows[alpha < cut] if np.isnan(threshold).any() else rows[alpha < threshold]


def _coin(origins: np.ndarray, directions: np.ndarray, primitive: np.ndarray) -> np.ndarray:
    bits = np.ascontiguousarray(np.concatenate([origins, directions], axis=1), np.float32).view(np.uint32)
    state = primitive.astype(np.uint32) * np.uint32(0x9E3779B9)
    for column in range(6):
        state = (state ^ bits[:, column]) * np.uint32(0x85EBCA6B)
        state ^= state >> np.uint32(13)
        state *= np.uint32(0xC2B2AE35)
        state ^= state >> np.uint32(16)
    return (state >> np.uint32(8)).astype(np.float32) * np.float32(2.0**-24)


def offset_origins(points: np.ndarray, normals: np.ndarray, directions: np.ndarray, reach: np.ndarray | None = None) -> np.ndarray:
    """Move surface points (n, 3) off their plane to the side ``directions`` (n, 3) leave on, along geometric ``normals`` (n, 3).

    The step is relative to the coordinates, and to ``reach`` (n,) where the points were computed as o + t·d: the distance t.
    """
    # By component: reducing over an axis of three costs numpy several times as much.
    scale = np.maximum(np.maximum(np.abs(points[:, 0]), np.abs(points[:, 1])), np.abs(points[:, 2]))
    if reach is not None:
        scale = np.maximum(scale, reach)
    step = scale * SELF_INTERSECTION
    side = dot(normals, directions)
    return points + normals * np.where(side >= 0, step, -step)[:, None].astype(np.float32)


__all__ = ["CHUNK", "AlphaTracer", "EmbreeTracer", "Hits", "Tracer", "make_tracer", "offset_origins", "slow_rays_warning"]
