"""Rays through Blender's own BVH, for platforms where embreex has no wheel: Windows and Linux on Arm.

``mathutils.bvhtree`` answers one ray a call and holds the interpreter lock meanwhile, so this is the one place with a Python loop
over rays, and more threads do not help: 0.1 million nearest hits a second in the atrium's 293,000 triangles and 0.25 million in
cornell_box, shadow rays twice that, where Embree traces 24 to 35 times as many on two cores. Whole bakes of both took 4.3 and 4.9
times as long on two cores; on more the gap widens. Its triangle test is watertight and takes both sides (Woop, Benthin and Wald,
"Watertight Ray/Triangle Intersection", JCGT 2(1), 2013). Transparency is laid over it by ``alpha.AlphaTracer``.
"""

import math

import numpy as np

from ..surfaces.geometry import Geometry
from ..vectors import dot
from .ray_counter import record
from .tracer import INFINITE, Hits, Tracer

# Seconds of a whole bake over the same with Embree on two cores.
SLOWER = 5


class BVHTreeTracer(Tracer):
    """Nearest hits by ``mathutils.bvhtree.BVHTree``. Keeps the contract of ``tracer.Tracer`` for opaque surfaces.

    Raises ImportError outside Blender.
    """

    def __init__(self, geometry: Geometry):
        from mathutils.bvhtree import BVHTree

        self._triangles = geometry.triangles_world
        corners = self._triangles.reshape(-1, 3)
        # Without a margin (epsilon) rays do not turn into capsules, which would hit beside silhouettes.
        self._tree = BVHTree.FromPolygons(corners.tolist(), np.arange(len(corners)).reshape(-1, 3).tolist(), all_triangles=True,
                                          epsilon=0.0)

    def intersect(self, origins, directions, t_max=None) -> Hits:
        """See Tracer."""
        record(len(origins))
        length, limits = self._distances(directions, t_max)
        cast = self._tree.ray_cast
        found = [cast(origin, direction, limit)[2:] for origin, direction, limit in
                 zip(origins.tolist(), directions.tolist(), limits.tolist(), strict=True)]
        primitive = np.array([-1 if index is None else index for index, _ in found], np.int32).reshape(-1)
        distance = np.array([math.inf if distance is None else distance for _, distance in found], np.float64).reshape(-1)
        rows = np.flatnonzero(primitive >= 0)
        u, v = np.zeros((2, len(primitive)), np.float32)
        u[rows], v[rows] = _barycentrics(self._triangles[primitive[rows]], origins[rows], directions[rows])
        return Hits(primitive, u, v, (distance / length).astype(np.float32))

    def occluded(self, origins, directions, t_max=None) -> np.ndarray:
        """See Tracer."""
        record(len(origins))
        cast, (_, limits) = self._tree.ray_cast, self._distances(directions, t_max)
        return np.fromiter((cast(origin, direction, limit)[2] is not None for origin, direction, limit in
                            zip(origins.tolist(), directions.tolist(), limits.tolist(), strict=True)), bool, len(origins))

    @staticmethod
    def _distances(directions, t_max) -> tuple[np.ndarray, np.ndarray]:
        """Lengths of the directions (n,), which ``ray_cast`` makes unit, and the limits (n,) as distances."""
        length = np.sqrt(dot(directions, directions).astype(np.float64))
        limits = np.broadcast_to(np.asarray(INFINITE if t_max is None else t_max, np.float64), length.shape)
        return length, np.minimum(limits * length, INFINITE)


def _barycentrics(corners: np.ndarray, origins: np.ndarray, directions: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Embree's u, v (n,) where rays meet the planes of their triangles ``corners`` (n, 3, 3), kept within these."""
    corners, origins, directions = (part.astype(np.float64) for part in (corners, origins, directions))
    edge1, edge2, s = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0], origins - corners[:, 0]
    p, q = np.cross(directions, edge2), np.cross(s, edge1)
    determinant = dot(edge1, p)
    inverse = np.divide(1.0, determinant, out=np.zeros_like(determinant), where=determinant != 0)
    u = np.clip(dot(s, p) * inverse, 0.0, 1.0)
    return u, np.clip(dot(directions, q) * inverse, 0.0, 1.0 - u)
