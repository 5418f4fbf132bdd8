"""Rays from the surface under texels of a light atlas, and what they bring: cosine-distributed, ending in the surface cache."""

import numpy as np

from ...numerics.sampling import about, cosine_hemisphere, hash_u32
from ...progress import Progress
from ...scene.lights import held_directly
from ...techniques.base import Field
from ...transport.cache.look import CachedScene, Looks
from ...transport.context import LightContext
from ...transport.lights.links import LightLinks
from ...transport.parallel import chunks, parallel_for
from ...transport.paths.direct import Receiver
from ...transport.paths.numbers import LAMP, SCATTER, PathNumbers
from ...transport.paths.sources import Sources
from ...transport.rays.tracer import offset_origins
from ...transport.vectors import dot, normalized
from ..media.along import MediaAlong
from ..media.lighting import Surroundings
from ..ray_traced.diffuse import sent_along
from .coefficients import COUNT, exact_for, projected
from .settings import AtlasSettings
from .unwrapped import FINENESS, Places

_STREAM = 0xA71A5
# Rays that are held at a time, in some hundred bytes each.
_RAYS_AT_ONCE = 1 << 21
# A place counts as inside a solid from this share of its rays that meet the inside of one.
_INSIDE = 0.5


class TexelGather:
    """The rays of a light atlas from the ``places`` of its texels in the scene of ``context``; ``field`` and ``seed`` as
    ``bake_atlas`` has them. Surfaces are ``cached`` (None: anew), with ``links`` as ``CachedScene.about`` has them. ``texels`` (n,)
    are those that have places, ``rays`` counts the rays of all."""

    def __init__(self, context: LightContext, field: Field | None, settings: AtlasSettings, places: Places, seed: int,
                 links: LightLinks | None = None, cached: CachedScene | None = None):
        self.context, self._settings, self._places, self._seed = context, settings, places, seed
        self.texels, self._first, self._count = np.unique(places.texel, return_index=True, return_counts=True)
        if cached is None:
            points = context.geometry.points(places.triangle, places.u, places.v)
            middle = 0.5 * (points.min(axis=0) + points.max(axis=0))
            cached = CachedScene.about(context, middle, float(np.linalg.norm(points - middle, axis=1).max()), seed, links)
        self.cached = cached
        self._media = None if context.media.is_empty else MediaAlong(Surroundings.of(context.scene, context, field))
        lights = context.scene.lights
        held = {lights[number].name for number in held_directly(lights)} if field is None else field.direct_lamps
        self._held = [number for number, light in enumerate(lights) if held is None or light.name in held]
        self._sources = Sources(context)
        self.rays = len(self.texels) * settings.rays
        self._open = np.ones(len(places.texel), bool)

    def under(self, context: LightContext, field: Field | None, progress: Progress) -> "TexelGather":
        """The same rays under the light of another ``context`` of the same surfaces, those that are in use. Raises Cancelled."""
        return TexelGather(context, field, self._settings, self._places, self._seed, cached=self.cached.under(context, progress))

    def reach(self, progress: Progress) -> list[np.ndarray]:
        """Bring into use what all rays meet, and tell the texel (h,) of every hit, for the ``chunks`` of all ``batches``. Raises
        BakeError where there is not the memory for it, and Cancelled."""
        texels, count = [], len(self.texels)
        for batch in self.batches():
            parts, span = self.chunks(batch), progress.span(batch.start / count, batch.stop / count)
            looks = parallel_for(lambda i, parts=parts: self.trace(parts[i], self.rows(parts[i])), len(parts), self.context.threads,
                                 span.span(0.0, 0.4), "Looking from the light atlas")
            texels += self.cached.cache.reach([look.hits for look in looks], span.span(0.4, 1.0))
        return texels

    def run(self, progress: Progress) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """The texels (n,), which of them are known (n,) bool, and of each (n, 3·COUNT + 3) float32: coefficients, irradiance."""
        count = len(self.texels)
        parts = [self._batch(span, progress.span(span.start / count, span.stop / count)) for span in self.batches()]
        return self.texels, *(np.concatenate(found) for found in zip(*parts, strict=True))

    @property
    def covered(self) -> np.ndarray:
        """(n, FINENESS²) bool: the places of each texel that its light was gathered from. Known when all have been weighed."""
        result = np.zeros((len(self.texels), FINENESS**2), bool)
        result[np.repeat(np.arange(len(self.texels)), self._count), self._places.step] = self._open
        return result

    def chunks(self, span: slice) -> list[slice]:
        """The texels ``span`` in pieces for one thread each."""
        per_chunk = max((1 << 16) // self._settings.rays, 1)
        return [slice(span.start + part.start, span.start + part.stop) for part in chunks(span.stop - span.start, per_chunk)]

    def batches(self) -> list[slice]:
        """All texels in pieces whose rays are held together."""
        return chunks(len(self.texels), max(_RAYS_AT_ONCE // self._settings.rays, 1))

    def _batch(self, span: slice, progress: Progress) -> tuple[np.ndarray, np.ndarray]:
        spans, threads = self.chunks(span), self.context.threads
        rows = [self.rows(part) for part in spans]
        traced = parallel_for(lambda i: self.trace(spans[i], rows[i]), len(spans), threads, progress.span(0.0, 0.4),
                              "Looking from the light atlas")
        texels = self.cached.settle(traced, progress.span(0.4, 0.6))
        parts = parallel_for(lambda i: self._shade(rows[i], traced[i], texels[i]), len(spans), threads, progress.span(0.6, 1.0),
                             "Lighting the light atlas")
        return tuple(np.concatenate(found) for found in zip(*parts, strict=True))

    def rows(self, span: slice) -> np.ndarray:
        """The place (m,) that each ray of the texels ``span`` leaves from, texel by texel: all of a texel's in turn."""
        ray = np.arange(self._settings.rays)
        return (self._first[span, None] + ray % self._count[span, None]).reshape(-1)

    def surface(self, rows: np.ndarray) -> tuple[np.ndarray, Receiver]:
        """Points (m, 3) of the places ``rows`` (m,), and their surfaces."""
        triangle, u, v = (part[rows] for part in (self._places.triangle, self._places.u, self._places.v))
        geometry, surfaces = self.context.geometry, self.context.surfaces
        face = geometry.normals_world[triangle]
        shading = surfaces.shading_normal(triangle, u, v) if surfaces.has_smooth_normals else face
        return geometry.points(triangle, u, v), Receiver(shading, face, triangle)

    def trace(self, span: slice, rows: np.ndarray) -> Looks:
        """The rays of the texels ``span``, which leave the places ``rows``."""
        points, receiver = self.surface(rows)
        texel = np.repeat(self.texels[span], self._settings.rays)
        index = np.tile(np.arange(self._settings.rays, dtype=np.uint32), len(texel) // self._settings.rays)
        numbers = PathNumbers(hash_u32(_STREAM, self._seed, texel), index)
        local = cosine_hemisphere(numbers.draw(0, SCATTER, 2))
        directions = about(receiver.shading, local)
        density = local[:, 2] * np.float32(1.0 / np.pi)
        return self.cached.look(offset_origins(points, receiver.face, directions), directions, numbers, density)

    def _shade(self, rows: np.ndarray, look: Looks, texel: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Of the texels whose rays ``look`` holds: which are known (m,), and their light (m, 3·COUNT + 3)."""
        rays = self._settings.rays
        points, receiver = self.surface(rows)
        light = self.cached.radiance(look, texel)
        if self._media is not None:
            light = light + sent_along(self._media, look)
        # Interpolated normals send some rays into the surface itself.
        light = np.where(dot(receiver.face, look.directions)[:, None] > 0, light, 0.0) * np.float32(np.pi)
        irradiance, coefficients = light.copy(), projected(look.directions, light, dot(receiver.shading, look.directions))
        for directions, arriving in self._samples(points, receiver, look):
            irradiance += arriving
            coefficients += projected(directions, arriving, np.maximum(dot(receiver.shading, directions), 0.0))
        known, weight, mean = self.weights(rows, look, receiver)
        irradiance = np.einsum("mr,mrc->mc", weight, irradiance.reshape(-1, rays, 3))
        coefficients = np.einsum("mr,mrkc->mkc", weight, coefficients.reshape(-1, rays, COUNT, 3))
        exact = exact_for(coefficients, mean, irradiance)
        return known, np.concatenate([exact.reshape(len(exact), -1), irradiance], axis=1).astype(np.float32)

    def weights(self, rows: np.ndarray, look: Looks, receiver: Receiver) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Of the texels whose rays ``look`` holds: which are known (m,) bool, what each ray counts (m, rays), and the mean normals
        (m, 3)."""
        rays = self._settings.rays
        inside = self.inside(rows, look)
        self._open[rows[inside]] = False
        counts = ~inside.reshape(-1, rays)
        share = counts.sum(axis=1)
        known, weight = share > 0, counts / np.maximum(share, 1)[:, None].astype(np.float64)
        mean = normalized(np.einsum("mr,mrc->mc", weight, receiver.shading.reshape(-1, rays, 3)))
        mean[~known] = 0.0
        return known, weight, mean

    def _samples(self, points: np.ndarray, receiver: Receiver, look: Looks):
        """Directions (n, 3) and irradiance (n, 3) of what is sampled rather than met by rays: light sources, bright surfaces, and
        the lamps that the bake holds."""
        yield from self.cached.light_samples(points, receiver, look.numbers, 1.0)
        yield from self.cached.bright_samples(points, receiver, look.numbers)
        u = look.numbers.draw(0, LAMP, 3)[:, 1:]
        off = offset_origins(points, receiver.face, receiver.face)
        links = self.context.links
        for lamp in self._held:
            directions, arriving = self._sources.facing_irradiance(lamp, off, u)
            cosine = np.maximum(dot(receiver.shading, directions), 0.0) * (dot(receiver.face, directions) > 0)
            if links.has_receivers:
                cosine = cosine * links.lamp_lights(lamp, receiver.instance(self.context))
            yield directions, arriving * cosine[:, None]

    def inside(self, rows: np.ndarray, look: Looks) -> np.ndarray:
        """(n,) bool: rays that leave places inside solids."""
        behind = look.cosine < 0
        met = np.zeros(len(rows))
        met[look.rows[behind]] = self.context.solids.is_solid(look.hits.primitive[behind])
        place, index, count = np.unique(rows, return_inverse=True, return_counts=True)
        share = np.bincount(index.reshape(-1), met, minlength=len(place)) / count
        return share[index.reshape(-1)] > _INSIDE
