"""A choice among what a tracer of opaque surfaces meets."""

import numpy as np

from .tracer import INFINITE, SELF_INTERSECTION, Hits, Tracer

# Layers a ray may pass before it counts as lost.
MAX_LAYERS = 64


class SelectingTracer(Tracer):
    """Only the triangles ``kept`` (t,) bool of ``tracer`` stop rays; see Tracer."""

    def __init__(self, tracer: Tracer, kept: np.ndarray):
        self._tracer, self._kept = tracer, kept

    def intersect(self, origins, directions, t_max=None) -> Hits:
        """See Tracer."""
        limits = np.full(len(origins), INFINITE, np.float32) if t_max is None else np.array(
            np.broadcast_to(np.asarray(t_max, np.float32), (len(origins),)))
        hits = self._tracer.intersect(origins, directions, limits)
        passed = np.zeros(len(origins), np.float32)
        rows = self._passing(hits, np.arange(len(origins)))
        for _ in range(MAX_LAYERS):
            if rows.size == 0:
                break
            # Step past the layer by what a hit distance can be wrong by, measured along the ray.
            length = np.sqrt(np.sum(directions[rows] ** 2, axis=1))
            reach = np.abs(origins[rows]).max(axis=1) + hits.t[rows] * length
            passed[rows] = hits.t[rows] + SELF_INTERSECTION * reach / length
            start = origins[rows] + directions[rows] * passed[rows, None]
            onward = self._tracer.intersect(start, directions[rows], np.maximum(limits[rows] - passed[rows], 0))
            hits.primitive[rows], hits.u[rows], hits.v[rows] = onward.primitive, onward.u, onward.v
            hits.t[rows] = onward.t + passed[rows]
            rows = self._passing(hits, rows)
        hits.primitive[rows] = -1
        hits.t[rows] = np.inf
        return hits

    def occluded(self, origins, directions, t_max=None) -> np.ndarray:
        """See Tracer."""
        return self.intersect(origins, directions, t_max).primitive >= 0

    def _passing(self, hits: Hits, rows: np.ndarray) -> np.ndarray:
        primitive = hits.primitive[rows]
        return rows[(primitive >= 0) & ~self._kept[np.maximum(primitive, 0)]]
