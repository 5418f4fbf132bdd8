"""Light at what the rays of live probes hit: lamps by shadow rays from there, all other light by the probes of the frame before.

There is no surface cache: it would be out of date whenever something moves. So bounces come one a frame, over the lattice, and
leak where it does (docs/physics.md §3, "leak fed back through bounces").
"""

from copy import copy
from dataclasses import dataclass, replace
from types import SimpleNamespace

import numpy as np

from ....transport.cache.hit_light import HitRays, shifted_for
from ....transport.cache.surface_cache import EMITTER_SAMPLES, samples_emitters
from ....transport.cache.texel_light import ALL_SOURCES
from ....transport.cache.texel_table import SurfaceHits
from ....transport.context import LightContext
from ....transport.parallel import chunks
from ....transport.paths.direct import choose_among
from ....transport.paths.sources import Sources
from ...lattice.field import ProbeField
from ..gather import Gathered, Gatherer
from ..items import Item
from ..settings import ProbeSettings

# Hits and sources that are weighed against each other at a time.
_PAIRS = 1 << 19


class LiveGatherer(Gatherer):
    """Traces and shades the rays of probes at ``placement`` in ``context``, with the light of ``field`` (None: none yet) at what
    they hit."""

    def __init__(self, context: LightContext, placement, settings: ProbeSettings, seed: int):
        super().__init__(context, _sides(context), placement, settings, seed)
        self._hit_light = LiveHitLight(context, None)

    def of_frame(self, seed: int, field: ProbeField | None) -> "LiveGatherer":
        """The same probes with other random numbers, under the light of ``field``."""
        other = copy(self)
        other._seed, other._hit_light = seed, replace(self._hit_light, field=field)
        return other

    def gathered(self, item: Item) -> Gathered:
        """What the rays of ``item`` bring. Threads may ask at once."""
        traced = self.trace(item)
        nothing = self.settings.bounces == 0
        return self.shade(item, traced, None if nothing else np.zeros(len(traced.rows), np.intp))


def _sides(context: LightContext):
    """What a gatherer asks of a surface cache, where there is none: hits have a side and no texel."""
    return SimpleNamespace(
        walks_media=False, bright=SimpleNamespace(count=0), layout=_Sides(), context=context,
        emitter_samples=EMITTER_SAMPLES if samples_emitters(context) else 0)


class _Sides:
    @staticmethod
    def slots(_primitive, _u, _v, front: np.ndarray) -> np.ndarray:
        return front.astype(np.int32)


@dataclass(frozen=True, eq=False)
class LiveHitLight:
    """Light at hits in ``context``: that of its lamps, and the rest by ``field`` (None: none). As HitLight."""

    context: LightContext
    field: ProbeField | None

    def reflected(self, hits: SurfaceHits, _texel: np.ndarray, albedo: np.ndarray, rays: HitRays) -> np.ndarray:
        """See HitLight."""
        surfaces, every = self.context.surfaces, np.arange(len(hits.primitive))
        if len(albedo) != len(every):
            albedo = np.take(albedo, hits.primitive, axis=0)
        radiance = self._arriving(hits, rays, every)
        radiance *= albedo
        if surfaces.has_translucency:
            rows = np.flatnonzero(surfaces.translucent[self.context.geometry.material[hits.primitive]])
            chosen = hits.take(rows)
            passed = surfaces.translucency(chosen.primitive, chosen.u, chosen.v, rays.cosine(rows))
            radiance[rows] += self._arriving(replace(chosen, slots=chosen.slots ^ 1), rays, rows) * passed
        radiance *= np.float32(1.0 / np.pi)
        return radiance

    def _arriving(self, hits: SurfaceHits, rays: HitRays, rows: np.ndarray) -> np.ndarray:
        """Irradiance (m, 3) on the sides of ``hits`` (m,), ``rows`` (m,) of the rays."""
        surfaces, points, reach = self.context.surfaces, rays.points(rows), rays.reach(rows)
        face = self.context.geometry.normals_world[hits.primitive] * hits.side[:, None]
        shading = face
        if surfaces.has_smooth_normals:
            shading = surfaces.shading_normal(hits.primitive, hits.u, hits.v) * hits.side[:, None]
        total = self._direct(hits, rays, rows, points, shading, face, reach)
        if self.field is not None and len(points):
            total += self.field.irradiance(points, shading)
        return total

    def _direct(self, hits, rays, rows, points, shading, face, reach) -> np.ndarray:
        sources = Sources(self.context)
        total = np.zeros((len(rows), 3), np.float32)
        if sources.count <= ALL_SOURCES:
            numbers = None if sources.is_delta.all() else rays.numbers(rows, 2)
            for source in range(sources.count):
                uv = np.zeros((len(rows), 2), np.float32) if sources.is_delta[source] else shifted_for(numbers, source)
                total += sources.irradiance(source, points, shading, face, reach, uv, hits.primitive)
            return total
        numbers = rays.numbers(rows, 3)
        for span in chunks(len(rows), max(1, _PAIRS // sources.count)):
            source, chance = choose_among(sources.importances(points[span], shading[span]), numbers[span, 2])
            light = sources.irradiance(source, points[span], shading[span], face[span], reach[span], numbers[span, :2],
                                       hits.primitive[span])
            total[span] = np.where(chance[:, None] > 0, light / np.maximum(chance, np.float32(1e-30))[:, None], 0.0)
        return total
