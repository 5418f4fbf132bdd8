"""Direct light on the surface cache: mean irradiance per texel, and which of many sources matter there."""

from typing import NamedTuple

import numpy as np

from ...numerics.sampling import hash_u32, unit_interval
from ..parallel import chunks
from ..paths.sources import Sources
from ..surfaces.materials import Surfaces
from .surface_points import SurfacePoints
from .texel_numbers import LIGHT, TexelNumbers
from .texels import side_of

# Sources up to this number are all sampled at every point; beyond, points sample a few chosen by importance.
ALL_SOURCES = 4
# How many choices a texel keeps, for itself and for the hits that fall into it.
CHOICES = 64
# A pool point of the bright surfaces samples one in so many of its choices: there are many such points.
POOL_STRIDE = 8
# Share of a texel's choices made blindly: a lamp that the texel's centre misjudges still gets its light across.
DEFENSIVE = 0.2
# Texels and sources that are weighed against each other at a time, each pair of them in some 60 bytes.
PAIRS = 1 << 19
# More sources than this have no number of 16 bits.
_MOST_SHORT = np.iinfo(np.int16).max
# Where choices come from the same hash as other numbers of a slot: what tells them apart.
_JITTER, _TURN = 97, 98


class DirectLight(NamedTuple):
    """Mean direct ``irradiance`` (n, 3) of texels, whether it is ``smooth`` (n, 1) bool over each, and their ``choices`` of sources
    (n, CHOICES) with one over the probability of each; (n, 0) where all sources are sampled anyway."""

    irradiance: np.ndarray
    smooth: np.ndarray
    choices: np.ndarray
    choice_weights: np.ndarray


class TexelLight:
    """Samples ``sources`` at points of texels, ``samples`` of each; light is smooth where it varies by less than ``smoothness``
    (relative) between them. ``numbers`` are those of the texels.

    ``limits`` are the numbers of bounces to which some lamps are limited, ascending (see ``Lamp.max_bounces``).
    """

    def __init__(self, sources: Sources, surfaces: Surfaces, numbers: TexelNumbers, samples: int, smoothness: float):
        self._sources, self._surfaces, self._numbers = sources, surfaces, numbers
        self._samples, self._smoothness, self._seed = samples, smoothness, numbers.seed
        self._limited = sources.limited()
        self.limits = list(self._limited)
        # How many each texel keeps: none where there is nothing to choose.
        self.choices = CHOICES if sources.count > ALL_SOURCES else 0

    def direct(self, slots: np.ndarray, surface: SurfacePoints) -> DirectLight:
        """Direct light of all sources over the first points of ``surface`` on each of the texels with ``slots`` (n,)."""
        n, samples, sources = len(slots), self._samples, self._sources.count
        choices, weights = np.zeros((n, self.choices), np.int16), np.zeros((n, self.choices), np.float32)
        if sources == 0:
            return DirectLight(np.zeros((n, 3), np.float32), np.ones((n, 1), bool), choices, weights)
        surface, uv = self._points(slots, surface)
        if sources <= ALL_SOURCES:
            light = self._of(0, surface, uv)
            for source in range(1, sources):
                light += self._of(source, surface, uv)
            light = light.reshape(samples, n, 3)
            mean = light.mean(axis=0)
            # Dark throughout counts as smooth: the chance of missing a sliver of light equals that of missing one of shadow.
            spread = np.square(light - mean).mean(axis=0).sum(axis=1)
            smooth = spread <= self._smoothness**2 * np.square(mean).sum(axis=1)
            return DirectLight(mean, smooth[:, None], choices, weights)
        choices, weights = self._choose(slots, surface.points[:n], surface.shading[:n])
        result, squares, passes = np.zeros((n, 3), np.float32), np.zeros(n), -(-CHOICES // samples)
        for number in range(passes):
            column = (np.arange(samples) + number * samples) % CHOICES
            light = self._of(choices[:, column].T.reshape(-1).astype(np.int64), surface, uv)
            light = (light * weights[:, column].T.reshape(-1, 1)).reshape(samples, n, 3)
            result += light.mean(axis=0) / np.float32(passes)
            squares += np.square(light, dtype=np.float64).sum(axis=(0, 2))
        # Here the samples differ by their source as well: what must be small is the error of their mean.
        count = samples * passes
        mean_square = np.square(result, dtype=np.float64).sum(axis=1)
        smooth = squares / count - mean_square <= (2.0 * self._smoothness) ** 2 * count * mean_square
        return DirectLight(result, smooth[:, None], choices, weights)

    def limited(self, slots: np.ndarray, surface: SurfacePoints) -> np.ndarray:
        """Direct irradiance (n, g, 3) of the lamps with each of the ``limits``."""
        parts = [self.mean(lamps, slots, surface) for lamps in self._limited.values()]
        return np.stack(parts, axis=1) if parts else np.zeros((len(slots), 0, 3), np.float32)

    def mean(self, chosen: list[int], slots: np.ndarray, surface: SurfacePoints) -> np.ndarray:
        """Mean irradiance (n, 3) of the ``chosen`` sources alone over the first points of ``surface``."""
        surface, uv = self._points(slots, surface)
        light = np.zeros((len(surface.points), 3), np.float32)
        for source in chosen:
            light += self._of(source, surface, uv)
        return light.reshape(self._samples, len(slots), 3).mean(axis=0)

    def reflected(self, slots: np.ndarray, surface: SurfacePoints, uv: np.ndarray) -> np.ndarray:
        """Radiance (m, 3) that the sources' light leaves at points on ``slots`` (m,) by reflection, or having passed from the other
        side; ``uv`` (m, 2) in [0, 1)."""
        side, where = side_of(slots)[:, 0], (surface.primitive, surface.u, surface.v)
        radiance = self._arriving(slots, surface, uv) * self._surfaces.albedo_of_side(*where, side)
        if self._surfaces.has_translucency:
            passed = self._surfaces.translucency(*where, side)
            rows = np.flatnonzero(passed.any(axis=1))
            other = surface.take(rows).turned()
            if rows.size:
                radiance[rows] += self._arriving(slots[rows] ^ 1, other, uv[rows]) * passed[rows]
        return radiance * np.float32(1 / np.pi)

    def _arriving(self, slots: np.ndarray, surface: SurfacePoints, uv: np.ndarray) -> np.ndarray:
        """Irradiance (m, 3) at points on ``slots`` (m,)."""
        irradiance = np.zeros((len(surface.points), 3), np.float32)
        if self._sources.count <= ALL_SOURCES:
            for source in range(self._sources.count):
                irradiance += self._of(source, surface, uv)
        else:
            choices, weights = self._choose(slots, surface.points, surface.shading)
            for column in range(0, CHOICES, POOL_STRIDE):
                light = self._of(choices[:, column].astype(np.int64), surface, uv)
                irradiance += light * (weights[:, column, None] / np.float32(CHOICES // POOL_STRIDE))
        return irradiance

    def _points(self, slots: np.ndarray, surface: SurfacePoints) -> tuple[SurfacePoints, np.ndarray]:
        """The points of ``surface`` at which light is sampled, and the numbers for it."""
        return surface.first(self._samples * len(slots)), self._numbers.of(slots, LIGHT, self._samples).reshape(-1, 2)

    def _of(self, source, surface: SurfacePoints, uv: np.ndarray) -> np.ndarray:
        reach = np.zeros(len(surface.points), np.float32)
        return self._sources.irradiance(source, surface.points, surface.shading, surface.face, reach, uv, surface.primitive)

    def _choose(self, slots, points, normals):
        """Pick CHOICES sources per texel, stratified, in proportion to their unshadowed light at one of its points."""
        blocks = [self._choose_among_all(slots[rows], points[rows], normals[rows])
                  for rows in chunks(len(slots), max(1, PAIRS // self._sources.count))]
        return tuple(np.concatenate(parts) for parts in zip(*blocks, strict=True))

    def _choose_among_all(self, slots, points, normals):
        importance = self._sources.importances(points, normals).T.astype(np.float64, order="C")
        total = importance.sum(axis=1, keepdims=True)
        uniform = 1.0 / self._sources.count
        probability = np.where(total > 0, (1 - DEFENSIVE) * importance / np.maximum(total, 1e-30) + DEFENSIVE * uniform, uniform)
        cdf = np.cumsum(probability, axis=1)
        cdf /= cdf[:, -1:]
        jitter = unit_interval(hash_u32(slots, _JITTER, self._seed))
        targets = (np.arange(CHOICES) + jitter[:, None]) / CHOICES
        # One flat search over all rows: row i's distribution is moved to [i, i + 1).
        offset = np.arange(len(slots))[:, None]
        flat = np.searchsorted((cdf + offset).reshape(-1), (targets + offset).reshape(-1), side="right")
        choice = np.clip(flat.reshape(targets.shape) - offset * self._sources.count, 0, self._sources.count - 1)
        # Shuffle the strata by a rotation, or each sample point would always meet the same kind of source.
        turn = (hash_u32(slots, _TURN, self._seed) % np.uint32(CHOICES)).astype(np.int64)[:, None]
        choice = np.take_along_axis(choice, (np.arange(CHOICES) * 7 + turn) % CHOICES, axis=1)
        weight = 1.0 / np.take_along_axis(probability, choice, axis=1)
        return choice.astype(np.int32 if self._sources.count > _MOST_SHORT else np.int16), weight.astype(np.float32)
