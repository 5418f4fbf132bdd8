"""What gets past the surfaces between a point and a light, for lights that not all instances keep from shining."""

import numpy as np

from ..surfaces.geometry import Geometry
from ..surfaces.materials import Surfaces
from .alpha import AlphaTracer
from .passing import SelectingTracer
from .tracer import Tracer


class ShadowRays:
    """``opaque``, a tracer of what casts shadows, with sets of instances that do: ``blockers`` (s, i) bool, of which the first has
    all."""

    def __init__(self, opaque: Tracer, geometry: Geometry, surfaces: Surfaces, blockers: np.ndarray):
        chosen = [opaque, *(SelectingTracer(opaque, instances[geometry.instance]) for instances in blockers[1:])]
        self._tracers = [AlphaTracer(tracer, geometry, surfaces) if surfaces.has_transparency else tracer for tracer in chosen]
        self._points = [tracer.of_points() for tracer in self._tracers]

    def tracer(self, blockers: int = 0, is_delta: bool = False) -> Tracer:
        """The tracer towards lamps with that set of blockers, and without a size if ``is_delta``."""
        return (self._points if is_delta else self._tracers)[blockers]

    def transmittance(self, is_delta, origins: np.ndarray, directions: np.ndarray, t_max: np.ndarray | None = None,
                      blockers=0) -> np.ndarray:
        """As Tracer's, towards lamps of which ``is_delta`` (one for all rays, or (n,)) tells those without a size, with sets of
        ``blockers`` (one, or (n,))."""
        if self._points[0] is self._tracers[0]:
            is_delta = False
        if len(self._tracers) == 1:
            blockers = 0
        if np.ndim(is_delta) == 0 and np.ndim(blockers) == 0:
            return self.tracer(int(blockers), bool(is_delta)).transmittance(origins, directions, t_max)
        n = len(origins)
        limits = None if t_max is None else np.broadcast_to(np.asarray(t_max, np.float32), (n,))
        kinds = np.broadcast_to(np.asarray(blockers) * 2 + np.asarray(is_delta, bool), (n,))
        passed = None
        for kind in np.unique(kinds).tolist():
            rows = np.flatnonzero(kinds == kind)
            part = self.tracer(kind >> 1, bool(kind & 1)).transmittance(
                origins[rows], directions[rows], None if limits is None else limits[rows])
            passed = np.zeros((n, part.shape[1]), part.dtype) if passed is None else passed
            passed[rows] = part
        return np.ones((0, 1), np.float32) if passed is None else passed
