"""Rays through media: what they leave of light becomes the tint of what comes along a ray, and part of what passes between
points."""

from dataclasses import replace

import numpy as np

from ...scene import Medium
from ..rays.kinds import Tracers
from ..rays.tracer import Hits, Tracer
from ..vectors import dot
from .table import MediaTable


class MediaTracer(Tracer):
    """``tracer``, whose rays are absorbed and scattered away by ``media`` on their way; see Tracer."""

    def __init__(self, tracer: Tracer, media: MediaTable):
        self._tracer, self._media = tracer, media

    def intersect(self, origins, directions, t_max=None) -> Hits:
        """See Tracer; a ray that meets nothing comes from infinitely far."""
        hits = self._tracer.intersect(origins, directions, t_max)
        left = self._left(origins, directions, hits.t)
        return replace(hits, tint=left if hits.tint is None else hits.tint * left)

    def occluded(self, origins, directions, t_max=None) -> np.ndarray:
        """See Tracer: by surfaces."""
        return self._tracer.occluded(origins, directions, t_max)

    def transmittance(self, origins, directions, t_max=None, looks=False) -> np.ndarray:
        """See Tracer."""
        return self._tracer.transmittance(origins, directions, t_max, looks) * self._left(origins, directions, t_max)

    def of_points(self) -> Tracer:
        """See Tracer."""
        return MediaTracer(self._tracer.of_points(), self._media)

    def _left(self, origins, directions, t_max) -> np.ndarray:
        length = np.sqrt(dot(directions, directions))
        limits = None if t_max is None else np.asarray(t_max) * length
        return self._media.transmittance(origins, directions / length[:, None], limits)


class MediaAlone(MediaTracer):
    """As were there ``media`` and no surfaces; see Tracer."""

    def __init__(self, media: MediaTable):
        super().__init__(_Nothing(), media)


class _Nothing(Tracer):
    def intersect(self, origins, directions, t_max=None) -> Hits:
        """See Tracer."""
        n = len(origins)
        return Hits(np.full(n, -1, np.int32), *(np.zeros(n, np.float32) for _ in range(2)), np.full(n, np.inf, np.float32))

    def occluded(self, origins, directions, t_max=None) -> np.ndarray:
        """See Tracer."""
        return np.zeros(len(origins), bool)


def looked_at(medium: Medium) -> bool:
    """Whether probes and surfaces find ``medium``, and what it gives and scatters: as diffuse rays do."""
    return medium.visible_diffuse


def in_shadow(medium: Medium) -> bool:
    """Whether ``medium`` stands in the way of lamps."""
    return medium.visible_shadow


def through_media(tracers: Tracers, media: MediaTable) -> Tracers:
    """The ``tracers`` with ``media`` in the way of all but the camera's rays, each medium in that of the kinds of rays which the
    ray visibility of its object names; two kinds that share one still do."""
    kept = {"view": looked_at, "diffuse": looked_at, "shadow": in_shadow,
            "light": lambda medium: looked_at(medium) or in_shadow(medium)}
    tables: dict[tuple, MediaTable] = {}
    made: dict[tuple, Tracer] = {}

    def within(kind: str) -> Tracer:
        tracer, found = getattr(tracers, kind), media.part(kept[kind])
        if found.is_empty:
            return tracer
        found = tables.setdefault(found.fillings, found)
        return made.setdefault((id(tracer), id(found)), MediaTracer(tracer, found))

    return replace(tracers, **{kind: within(kind) for kind in kept})
