"""Direct light at surface points: lamps and the bright patches of the world, with shadow rays."""

import numpy as np

from .context import LightContext
from .rays import INFINITE, offset_origins
from .vectors import dot, luminance

# A shadow ray ends this share short of a lamp, so that a lamp lying on a surface is not shadowed by it.
_SHORT_OF_LAMP = np.float32(1.0 - 1e-4)


class Sources:
    """All light that is sampled rather than hit: the scene's lamps, then the world's bright patches as one more source.

    ``count`` sources; ``casts_shadow`` and ``is_delta`` (count,) bool as in LampTable.
    """

    def __init__(self, context: LightContext):
        self._context = context
        self._lamps = context.lamps
        self._bright = context.environment.bright
        self._bright_index = self._lamps.count
        self.count = self._lamps.count + (1 if self._bright.count else 0)
        self.casts_shadow = np.append(self._lamps.casts_shadow, True)[: self.count]
        self.is_delta = np.append(self._lamps.is_delta, False)[: self.count]

    def irradiance(self, source, points, normals, geometric, reach, uv) -> np.ndarray:
        """One unbiased sample (n, 3) [W·m⁻²] of the shadowed irradiance that ``source`` (an index, or (n,) indices) gives.

        ``points`` (n, 3); ``normals`` and ``geometric`` (n, 3): unit shading and face normals turned to the receiving side;
        ``reach`` (n,): how far the rays travelled that found the points, for the offset; ``uv`` (n, 2) in [0, 1).
        """
        direction, distance, irradiance = self._sample(source, points, uv)
        cosine = dot(normals, direction)
        lit = (cosine > 0) & (dot(geometric, direction) > 0) & (irradiance[:, 0] + irradiance[:, 1] + irradiance[:, 2] > 0)
        shadowed = lit & self.casts_shadow[source]
        rows = np.flatnonzero(shadowed)
        if rows.size:
            origins = offset_origins(points[rows], geometric[rows], direction[rows], reach[rows])
            limit = np.minimum(distance[rows] * _SHORT_OF_LAMP, INFINITE)
            lit[rows] = ~self._context.tracer.occluded(origins, direction[rows], limit)
        return irradiance * np.where(lit, cosine, 0)[:, None]

    def facing_irradiance(self, source: int, points, uv) -> tuple[np.ndarray, np.ndarray]:
        """Direction (n, 3) of one source seen from points in free space, and its shadowed irradiance (n, 3) on a plane that
        faces that direction."""
        direction, distance, irradiance = self._sample(source, points, uv)
        if self.casts_shadow[source]:
            hidden = self._context.tracer.occluded(points, direction, np.minimum(distance * _SHORT_OF_LAMP, INFINITE))
            irradiance = np.where(hidden[:, None], np.float32(0), irradiance)
        return direction, irradiance

    def importance(self, source: int, points, normals) -> np.ndarray:
        """Luminance (n,) of the unshadowed irradiance of a source: what to choose sources by, and nothing else."""
        if source == self._bright_index:
            return np.full(len(points), luminance(self._bright.irradiance_estimate), np.float32)
        return luminance(self._lamps.irradiance_unshadowed(source, points, normals))

    def _sample(self, source, points, uv):
        if np.ndim(source) == 0:
            return self._sample_bright(uv) if source == self._bright_index else self._sample_lamps(int(source), points, uv)
        bright = source == self._bright_index
        if not bright.any():
            return self._sample_lamps(source, points, uv)
        parts = np.empty((len(points), 3), np.float32), np.empty(len(points), np.float32), np.empty((len(points), 3), np.float32)
        for rows, sampled in ((np.flatnonzero(~bright), False), (np.flatnonzero(bright), True)):
            if rows.size:
                values = self._sample_bright(uv[rows]) if sampled else self._sample_lamps(source[rows], points[rows], uv[rows])
                for part, value in zip(parts, values, strict=True):
                    part[rows] = value
        return parts

    def _sample_lamps(self, source, points, uv):
        sample = self._lamps.sample(source, points, uv)
        return sample.direction, sample.distance, sample.irradiance

    def _sample_bright(self, uv):
        direction, weight = self._bright.sample(uv)
        return direction, np.full(len(uv), np.inf, np.float32), weight
