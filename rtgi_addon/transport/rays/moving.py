"""Tracers of geometry that moves: what stays keeps its BVH, what moves has one of its own that is built anew.

A refit would keep the tree of what moves as well and only widen its boxes; embreex has none, and building is linear in the
triangles that move, which are few where anything moves at all.
"""

import numpy as np

from ..surfaces.geometry import Geometry
from .choose import make_opaque_tracer
from .parts import JoinedTracer, PartTracer
from .tracer import Tracer

# Where more than this share of the triangles moves, two trees cost rays more than one costs to build.
MOST_MOVING = 0.5


class MovingTracers:
    """Makes one tracer after another of the same instances as they move.

    Called with the ``geometry`` and a ``key`` that tells apart the parts of a scene that have tracers of their own. ``built``
    counts the triangles of all trees so far: what following has cost.
    """

    def __init__(self):
        self._parts: dict[object, _Part] = {}
        self.built = 0

    def __call__(self, geometry: Geometry, key=None, threads: int | None = None) -> Tracer:
        before = self._parts.get(key)
        fits = before is not None and before.is_of(geometry)
        part = before.moved(geometry, threads) if fits else _Part(geometry, np.zeros(geometry.count, bool), None, threads)
        self._parts[key] = part
        self.built += part.built
        return part.tracer


class _Part:
    """Triangles as they stand, those ``moving`` (t,) bool in a tree of their own beside ``resting``, the tracer of all others
    (None: to be built). ``built`` is how many triangles went into trees."""

    def __init__(self, geometry: Geometry, moving: np.ndarray, resting: Tracer | None, threads: int | None):
        self._geometry, self._moving, self._resting, self.built = geometry, moving, resting, 0
        count = int(moving.sum())
        if count > MOST_MOVING * geometry.count or not count:
            self._resting, self.tracer, self.built = None, make_opaque_tracer(geometry, threads), geometry.count
            return
        if resting is None:
            rest = np.flatnonzero(~moving)
            self._resting = PartTracer(make_opaque_tracer(geometry.part(rest), threads), rest)
            self.built += len(rest)
        chosen = np.flatnonzero(moving)
        self.tracer = JoinedTracer([self._resting, PartTracer(make_opaque_tracer(geometry.part(chosen), threads), chosen)])
        self.built += count

    def is_of(self, geometry: Geometry) -> bool:
        """Whether ``geometry`` has the same triangles of the same instances, wherever they are."""
        return np.array_equal(geometry.instance, self._geometry.instance)

    def moved(self, geometry: Geometry, threads: int | None) -> "_Part":
        """The same triangles as they stand in ``geometry``; itself where they have stayed."""
        changed = np.any(geometry.triangles_world != self._geometry.triangles_world, axis=(1, 2))
        if not changed.any():
            self.built = 0
            return self
        instances = np.zeros(int(geometry.instance.max()) + 1, bool)
        instances[geometry.instance[changed | self._moving]] = True
        moving = instances[geometry.instance]
        resting = self._resting if np.array_equal(moving, self._moving) else None
        return _Part(geometry, moving, resting, threads)
