"""Tracers of parts of the geometry, joined: so that kinds of rays that see different parts share what all of them see."""

from collections.abc import Sequence

import numpy as np

from .tracer import INFINITE, Hits, Tracer


class PartTracer(Tracer):
    """A ``tracer`` of some triangles, which are the ones at ``index`` (k,) int32 of the whole geometry; see Tracer."""

    def __init__(self, tracer: Tracer, index: np.ndarray):
        self._tracer, self._index = tracer, index.astype(np.int32)

    def intersect(self, origins, directions, t_max=None) -> Hits:
        """See Tracer."""
        hits = self._tracer.intersect(origins, directions, t_max)
        primitive = np.where(hits.primitive >= 0, self._index[np.maximum(hits.primitive, 0)], np.int32(-1))
        return Hits(primitive, hits.u, hits.v, hits.t)

    def occluded(self, origins, directions, t_max=None) -> np.ndarray:
        """See Tracer."""
        return self._tracer.occluded(origins, directions, t_max)


class JoinedTracer(Tracer):
    """The nearest hit of several tracers; none at all sees nothing. See Tracer."""

    def __init__(self, tracers: Sequence[Tracer]):
        self._tracers = tuple(tracers)

    def intersect(self, origins, directions, t_max=None) -> Hits:
        """See Tracer."""
        n = len(origins)
        limits = np.array(np.broadcast_to(np.asarray(INFINITE if t_max is None else t_max, np.float32), (n,)))
        nearest = Hits(np.full(n, -1, np.int32), np.zeros(n, np.float32), np.zeros(n, np.float32), np.full(n, np.inf, np.float32))
        for tracer in self._tracers:
            hits = tracer.intersect(origins, directions, limits)
            rows = np.flatnonzero(hits.primitive >= 0)
            for mine, found in ((nearest.primitive, hits.primitive), (nearest.u, hits.u), (nearest.v, hits.v), (nearest.t, hits.t)):
                mine[rows] = found[rows]
            limits[rows] = hits.t[rows]
        return nearest

    def occluded(self, origins, directions, t_max=None) -> np.ndarray:
        """See Tracer."""
        limits = None if t_max is None else np.broadcast_to(np.asarray(t_max, np.float32), (len(origins),))
        hidden = np.zeros(len(origins), bool)
        for tracer in self._tracers:
            rows = np.flatnonzero(~hidden)
            if rows.size:
                hidden[rows] = tracer.occluded(origins[rows], directions[rows], None if limits is None else limits[rows])
        return hidden
