"""Direct light on the surface cache: mean irradiance per texel, and which of many sources matter there."""

import numpy as np

from ..numerics.sampling import hash_u32

# Sources up to this number are all sampled at every point; beyond, points sample a few chosen by importance.
ALL_SOURCES = 4
# How many choices a texel keeps, for itself and for the hits that fall into it.
CHOICES = 64
# A pool point of the bright surfaces samples one in so many of its choices: there are many such points.
POOL_STRIDE = 8
# Share of a texel's choices made blindly: a lamp that the texel's centre misjudges still gets its light across.
DEFENSIVE = 0.2


class TexelLight:
    """Samples ``cache.sources`` at points of ``cache``'s texels."""

    def __init__(self, cache):
        self._cache, self._sources = cache, cache.sources
        self._seed = cache._seed

    @staticmethod
    def no_choices() -> tuple[np.ndarray, np.ndarray]:
        """The one row of zeros that stands for no texel, for both tables of choices."""
        return np.zeros((1, CHOICES), np.int16), np.zeros((1, CHOICES), np.float32)

    def direct(self, texels: np.ndarray, surface):
        """Mean direct irradiance (n, 3) over the first points of ``surface``; whether it is ``smooth`` (n, 1) bool, that is, varies
        by less than the cache's ``smoothness`` between them; and the texels' choices (n, CHOICES): source index and one over its
        probability; zeros where all sources are sampled anyway."""
        slots = self._cache.table.slots[texels]
        n, samples, sources = len(slots), self._cache.lamp_samples, self._sources.count
        result = np.zeros((n, 3), np.float32)
        choices, weights = (np.zeros((n, CHOICES), table.dtype) for table in self.no_choices())
        if sources == 0:
            return result, np.ones((n, 1), bool), choices, weights
        points, shading, face = (part[: samples * n] for part in surface[3:])
        uv = self._cache.numbers(slots, 4, 6, samples).reshape(-1, 2)
        reach = np.zeros(len(points), np.float32)
        if sources <= ALL_SOURCES:
            light = self._sources.irradiance(0, points, shading, face, reach, uv)
            for source in range(1, sources):
                light += self._sources.irradiance(source, points, shading, face, reach, uv)
            light = light.reshape(samples, n, 3)
            mean = light.mean(axis=0)
            # Dark throughout counts as smooth: the chance of missing a sliver of light equals that of missing one of shadow.
            spread = np.square(light - mean).mean(axis=0).sum(axis=1)
            smooth = spread <= self._cache.smoothness**2 * np.square(mean).sum(axis=1)
            return mean, smooth[:, None], choices, weights
        choices, weights = self._choose(slots, points[:n], shading[:n])
        passes = -(-CHOICES // samples)
        squares = np.zeros(n)
        for number in range(passes):
            column = (np.arange(samples) + number * samples) % CHOICES
            light = self._sources.irradiance(choices[:, column].T.reshape(-1).astype(np.int64), points, shading, face, reach, uv)
            light = (light * weights[:, column].T.reshape(-1, 1)).reshape(samples, n, 3)
            result += light.mean(axis=0) / np.float32(passes)
            squares += np.square(light, dtype=np.float64).sum(axis=(0, 2))
        # Here the samples differ by their source as well: what must be small is the error of their mean.
        count = samples * passes
        mean_square = np.square(result, dtype=np.float64).sum(axis=1)
        smooth = squares / count - mean_square <= (2.0 * self._cache.smoothness) ** 2 * count * mean_square
        return result, smooth[:, None], choices, weights

    def radiance_at(self, slots, primitive, u, v, uv):
        """Radiance (m, 3) that the sources' light leaves at points of slots by reflection, and their points and face normals."""
        primitive, u, v, points, shading, face = self._cache.surface_at(slots, primitive, u, v)
        reach = np.zeros(len(points), np.float32)
        irradiance = np.zeros((len(points), 3), np.float32)
        if self._sources.count <= ALL_SOURCES:
            for source in range(self._sources.count):
                irradiance += self._sources.irradiance(source, points, shading, face, reach, uv)
        else:
            choices, weights = self._choose(slots, points, shading)
            for column in range(0, CHOICES, POOL_STRIDE):
                light = self._sources.irradiance(choices[:, column].astype(np.int64), points, shading, face, reach, uv)
                irradiance += light * (weights[:, column, None] / np.float32(CHOICES // POOL_STRIDE))
        albedo = self._cache.context.surfaces.albedo(primitive, u, v)
        return irradiance * albedo * np.float32(1 / np.pi), points, face

    def _choose(self, slots, points, normals):
        """Pick CHOICES sources per texel, stratified, in proportion to their unshadowed light at one of its points."""
        importance = np.stack([self._sources.importance(i, points, normals) for i in range(self._sources.count)], axis=1)
        importance = importance.astype(np.float64)
        total = importance.sum(axis=1, keepdims=True)
        uniform = 1.0 / self._sources.count
        probability = np.where(total > 0, (1 - DEFENSIVE) * importance / np.maximum(total, 1e-30) + DEFENSIVE * uniform, uniform)
        cdf = np.cumsum(probability, axis=1)
        cdf /= cdf[:, -1:]
        jitter = (hash_u32(slots, 97, self._seed) >> np.uint32(8)) * 2.0**-24
        targets = (np.arange(CHOICES) + jitter[:, None]) / CHOICES
        # One flat search over all rows: row i's distribution is moved to [i, i + 1).
        offset = np.arange(len(slots))[:, None]
        flat = np.searchsorted((cdf + offset).reshape(-1), (targets + offset).reshape(-1), side="right")
        choice = np.clip(flat.reshape(targets.shape) - offset * self._sources.count, 0, self._sources.count - 1)
        # Shuffle the strata by a rotation, or each sample point would always meet the same kind of source.
        turn = (hash_u32(slots, 98, self._seed) % np.uint32(CHOICES)).astype(np.int64)[:, None]
        choice = np.take_along_axis(choice, (np.arange(CHOICES) * 7 + turn) % CHOICES, axis=1)
        weight = 1.0 / np.take_along_axis(probability, choice, axis=1)
        return choice.astype(np.int16), weight.astype(np.float32)
