"""Surfaces that let rays through by their alpha, over any tracer of opaque ones."""

from dataclasses import replace

import numpy as np

from ...numerics.sampling import unit_interval
from ..surfaces.geometry import Geometry
from ..surfaces.materials import LOOK, POINT, SHADOW, Surfaces
from ..vectors import dot
from .tracer import INFINITE, SELF_INTERSECTION, Hits, Tracer

# Layers of cut-out foliage a ray may pass before it counts as lost.
MAX_ALPHA_LAYERS = 64


class AlphaTracer(Tracer):
    """Lets rays through surfaces by their alpha: a hard cut at the material's threshold, or a coin per ray and layer; what passes
    takes on the surface's tint. Light between two points is not left to coins: what they would give on average passes.

    The coin is a hash of the ray itself, so the same ray always meets the same answer, on any thread. ``points``: rays from and to
    lamps without a size. ``passing`` (m,) bool names the materials that let rays through (None: all that can).
    """

    def __init__(self, tracer: Tracer, geometry: Geometry, surfaces: Surfaces, points: bool = False,
                 passing: np.ndarray | None = None):
        self._tracer, self._geometry, self._surfaces = tracer, geometry, surfaces
        self._look, self._shadow = (POINT, POINT) if points else (LOOK, SHADOW)
        self._passing = surfaces.transparent if passing is None else passing
        self._transparent_triangle = self._passing[geometry.material]
        self._glass_triangle = surfaces.glass[geometry.material] if surfaces.has_glass else None
        self._normals = geometry.normals_world

    def intersect(self, origins, directions, t_max=None) -> Hits:
        """See Tracer."""
        return self._intersect(origins, directions, t_max, self._look)

    def of_points(self) -> Tracer:
        """See Tracer."""
        if not self._surfaces.has_glass:
            return self
        return AlphaTracer(self._tracer, self._geometry, self._surfaces, True, self._passing)

    def _intersect(self, origins, directions, t_max, shadow: int) -> Hits:
        walk = _Layers(self, origins, directions, t_max, shadow)
        rows = walk.met(np.arange(len(origins)))
        for _ in range(MAX_ALPHA_LAYERS):
            if rows.size == 0:
                break
            primitive = walk.hits.primitive[rows]
            alpha, threshold, tint = walk.surface(rows)
            cut = np.where(np.isnan(threshold), coin(origins[rows], directions[rows], primitive), threshold)
            passing = alpha < cut
            rows = rows[passing]
            if tint is not None:
                walk.hits.tint[rows] *= tint[passing]
            rows = walk.onward(rows)
        walk.lose(rows)
        return walk.hits

    def occluded(self, origins, directions, t_max=None) -> np.ndarray:
        """See Tracer."""
        return self._intersect(origins, directions, t_max, self._shadow).primitive >= 0

    def transmittance(self, origins, directions, t_max=None, looks=False) -> np.ndarray:
        """See Tracer."""
        walk = _Layers(self, origins, directions, t_max, self._look if looks else self._shadow)
        left = np.ones((len(origins), 3 if self._surfaces.has_tint else 1), np.float32)
        rows = walk.met(np.arange(len(origins)))
        for _ in range(MAX_ALPHA_LAYERS):
            if rows.size == 0:
                break
            alpha, threshold, tint = walk.surface(rows)
            left[rows] *= np.where(np.isnan(threshold), 1.0 - alpha, alpha < threshold)[:, None].astype(np.float32)
            if tint is not None:
                left[rows] *= tint
            rows = walk.onward(rows[left[rows].max(axis=1) > 0])
        walk.lose(rows)
        return np.where((walk.hits.primitive >= 0)[:, None], np.float32(0.0), left)


class _Layers:
    """Rays on their way through layers that they may pass."""

    def __init__(self, owner: AlphaTracer, origins, directions, t_max, shadow: int):
        self._owner, self._origins, self._directions, self._shadow = owner, origins, directions, shadow
        self._limits = np.full(len(origins), INFINITE, np.float32) if t_max is None else np.array(
            np.broadcast_to(np.asarray(t_max, np.float32), (len(origins),)))
        self.hits = owner._tracer.intersect(origins, directions, self._limits)
        if owner._surfaces.has_tint:
            self.hits = replace(self.hits, tint=np.ones((len(origins), 3), np.float32))
        # Layers of glass that a ray has entered and not left yet.
        self._inside = None if owner._glass_triangle is None else np.zeros(len(origins), np.int8)

    def met(self, rows: np.ndarray) -> np.ndarray:
        """Those of the rays ``rows`` whose hit is on a surface that may let them pass."""
        primitive = self.hits.primitive[rows]
        return rows[(primitive >= 0) & self._owner._transparent_triangle[np.maximum(primitive, 0)]]

    def surface(self, rows: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray | None]:
        """Coverage (n,), threshold (n,) and tint (n, 3), or None, of what the rays ``rows`` have met."""
        surfaces, hits = self._owner._surfaces, self.hits
        primitive, u, v = hits.primitive[rows], hits.u[rows], hits.v[rows]
        cosine = -dot(self._owner._normals[primitive], self._directions[rows])
        if self._inside is not None:
            leaving = np.flatnonzero(self._owner._glass_triangle[primitive] & (cosine < 0) & (self._inside[rows] > 0))
            self._inside[rows] += self._owner._glass_triangle[primitive] & (cosine > 0)
            self._inside[rows[leaving]] -= 1
            # A ray that came in leaves under the angle at which it came.
            cosine[leaving] *= -1
        alpha, threshold = surfaces.alpha(primitive, u, v, cosine, self._shadow)
        return alpha, threshold, surfaces.tint(primitive, u, v, cosine, self._shadow) if surfaces.has_tint else None

    def onward(self, rows: np.ndarray) -> np.ndarray:
        """Let the rays ``rows`` go on past what they met; returns those that may pass what they meet then."""
        if rows.size == 0:
            return rows
        hits, directions = self.hits, self._directions[rows]
        length = np.sqrt(np.sum(directions ** 2, axis=1))
        # Step past the layer by what a hit distance can be wrong by, measured along the ray.
        reach = np.abs(self._origins[rows]).max(axis=1) + hits.t[rows] * length
        passed = hits.t[rows] + SELF_INTERSECTION * reach / length
        start = self._origins[rows] + directions * passed[:, None]
        onward = self._owner._tracer.intersect(start, directions, np.maximum(self._limits[rows] - passed, 0))
        hits.primitive[rows], hits.u[rows], hits.v[rows] = onward.primitive, onward.u, onward.v
        hits.t[rows] = onward.t + passed
        return self.met(rows)

    def lose(self, rows: np.ndarray) -> None:
        """Rays that have passed too many layers are taken to miss everything."""
        self.hits.primitive[rows] = -1
        self.hits.t[rows] = np.inf


def coin(origins: np.ndarray, directions: np.ndarray, primitive: np.ndarray) -> np.ndarray:
    """A number (n,) in [0, 1) for each ray at each triangle (n,) that it meets: what is covered less than that lets it through."""
    bits = np.ascontiguousarray(np.concatenate([origins, directions], axis=1), np.float32).view(np.uint32)
    state = primitive.astype(np.uint32) * np.uint32(0x9E3779B9)
    for column in range(6):
        state = (state ^ bits[:, column]) * np.uint32(0x85EBCA6B)
        state ^= state >> np.uint32(13)
        state *= np.uint32(0xC2B2AE35)
        state ^= state >> np.uint32(16)
    return unit_interval(state)
