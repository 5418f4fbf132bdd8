"""The slow, readable twin of the Embree tracer: every ray against every triangle, in float64.

It is the oracle of the tests, and the last resort where neither Embree nor Blender's BVH can be had. Source: T. Möller and
B. Trumbore, "Fast, Minimum Storage Ray/Triangle Intersection" (1997). Transparency is laid over it by ``alpha.AlphaTracer``.
"""

import numpy as np

from ..surfaces.geometry import Geometry
from .ray_counter import record
from .tracer import Hits, Tracer

# Ray-triangle pairs per block: about 200 MB of float64 temporaries.
PAIRS = 1 << 20
# Barycentric slack that closes the cracks which rounding opens along shared edges.
EDGE_SLACK = 1e-10


class BruteForceTracer(Tracer):
    """Nearest hits by exhaustive search. Keeps the contract of ``tracer.Tracer`` for opaque surfaces."""

    def __init__(self, geometry: Geometry):
        corners = geometry.triangles_world.astype(np.float64)
        self._v0 = corners[:, 0]
        self._edge1, self._edge2 = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]

    def intersect(self, origins, directions, t_max=None) -> Hits:
        """See Tracer."""
        n = len(origins)
        record(n)
        limits = np.broadcast_to(np.asarray(np.inf if t_max is None else t_max, np.float64), (n,))
        hits = Hits(np.full(n, -1, np.int32), np.zeros(n, np.float32), np.zeros(n, np.float32), np.full(n, np.inf, np.float32))
        step = max(1, PAIRS // max(1, len(self._v0)))
        for start in range(0, n, step):
            span = slice(start, start + step)
            t, u, v = self._all_pairs(origins[span], directions[span], limits[span])
            nearest = np.argmin(t, axis=1)
            rows = np.arange(len(nearest))
            found = np.isfinite(t[rows, nearest])
            hits.primitive[span] = np.where(found, nearest, -1)
            hits.u[span] = np.where(found, u[rows, nearest], 0.0)
            hits.v[span] = np.where(found, v[rows, nearest], 0.0)
            hits.t[span] = t[rows, nearest]
        return hits

    def occluded(self, origins, directions, t_max=None) -> np.ndarray:
        """See Tracer."""
        return self.intersect(origins, directions, t_max).primitive >= 0

    def _all_pairs(self, origins, directions, limits):
        """Distances (n, t), infinite where ray and triangle do not meet within the limit, and the barycentrics there."""
        o, d = origins.astype(np.float64)[:, None], directions.astype(np.float64)[:, None]
        p = np.cross(d, self._edge2)
        determinant = np.sum(self._edge1 * p, axis=-1)
        with np.errstate(divide="ignore", invalid="ignore"):
            inverse = 1.0 / determinant
            s = o - self._v0
            u = np.sum(s * p, axis=-1) * inverse
            q = np.cross(s, self._edge1)
            v = np.sum(d * q, axis=-1) * inverse
            t = np.sum(self._edge2 * q, axis=-1) * inverse
            meet = (u >= -EDGE_SLACK) & (v >= -EDGE_SLACK) & (u + v <= 1.0 + EDGE_SLACK) & (t >= 0.0) & (t <= limits[:, None])
        return np.where(meet & (determinant != 0.0), t, np.inf), u, v
