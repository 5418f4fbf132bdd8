"""Rays from probes: traced in one pass, shaded from the surface cache in the next, projected onto SH.

A few neighbouring probes share their directions: SH projection is then a matrix product, and rays of one direction from nearby
points find the same part of the BVH. Groups are scrambled independently of one another, so their errors are too.
"""

from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from ... import kernels
from ...numerics import octahedral, sh
from ...numerics.sampling import hash_u32, sobol_owen_at, sphere_from_square, unit_interval, wrapped
from ...progress import Progress
from ...transport.cache.hit_light import EndRays, HitLight
from ...transport.cache.media_walks import ends_on, light_of_ends
from ...transport.cache.surface_cache import SurfaceCache
from ...transport.cache.texel_table import SurfaceHits
from ...transport.context import LightContext
from ...transport.parallel import parallel_for
from ...transport.paths.direct import connect_emitters
from ...transport.paths.scattering import Walks, walk
from ...transport.vectors import dot
from .gather_kernels import can_project, follows, project, projected, shifted, traced, visibility
from .item_rays import DIRECTION, RAYS_PER_LIGHT_SAMPLE, ItemRays
from .items import Item
from .shares import USUAL, Shares
from .strata import CELLS, Strata

# Probes that share a set of directions.
GROUP = 8
# Distances are averaged over this many rays of each probe: with 64 cells to a tile, as many as tell.
VISIBILITY_RAYS = 1024
# The cache's solution may be off by this share of the target error.
SOLVER_SHARE = 0.01
# How far a batch is when its rays are traced, and when the cache has grown by what they met, and is solved.
# What numbers are drawn for beside the directions of rays: each purpose has sequences of its own.
_BRIGHT_SKY, _EMITTERS, _BRIGHT_SURFACES, _SHIFTS, _WALKS = 3, 4, 5, 17, 23
_UNIFORM_PDF = np.float32(1.0 / (4.0 * np.pi))
FULL_SPHERE = np.float32(4.0 * np.pi)


@dataclass(eq=False)
class Traced:
    """What an item's rays met: ``rows`` (h,) int32 of those that hit ``surface`` (h,) at ``t`` (h,) under ``cosine`` (h,), that
    between the front's normal and the way back; the ``directions`` (g·n, 3), and the ``tint`` (g·n·m, 3) of what comes along each
    ray (None: unchanged); ``media``: what there is on their way (None: nothing)."""

    surface: SurfaceHits
    rows: np.ndarray
    t: np.ndarray
    cosine: np.ndarray
    directions: np.ndarray
    tint: np.ndarray | None
    media: "InMedia | None" = None

    def take(self, rows: np.ndarray) -> "Traced":
        """The given hits only."""
        return replace(self, surface=self.surface.take(rows), rows=self.rows[rows], t=self.t[rows], cosine=self.cosine[rows])


@dataclass(frozen=True, eq=False)
class InMedia:
    """The ``walks`` in media that began along an item's rays, and those of their ``ends`` (e,) that are on surfaces: where, and
    under which ``cosines`` (e,)."""

    walks: Walks
    ends: np.ndarray
    surface: SurfaceHits
    cosines: np.ndarray


@dataclass(eq=False)
class Gathered:
    """An item's sums over the blocks of the same ``probes`` (b, m): ``sh`` (b, m, k, 3) the sum over rays of 4π·L·Y (divide by the
    number of rays), ``emitted`` what of it is light from emissive surfaces (None where nothing emits), ``albedo`` (h, 3) at the
    hits (None where it is each triangle's own), and for visibility the sums (b, m, T², 2) of distance and squared distance over
    the rays in each cell of the tile, with their numbers (b, 1, T²). ``along``: what each ray found, where that was asked for."""

    probes: np.ndarray
    sh: np.ndarray
    emitted: np.ndarray | None
    albedo: np.ndarray | None
    distance: np.ndarray
    distance_weight: np.ndarray
    along: "Along | None" = None


class Along(NamedTuple):
    """Radiance (g, n, m, 3) along an item's rays, and what of it is ``emitted`` by surfaces (None where nothing is)."""

    light: np.ndarray
    emitted: np.ndarray | None


class Gatherer:
    """Traces and shades items against one ``context`` and one surface ``cache``, under ``settings``. ``pdf`` is the density [1/sr]
    of its directions; with ``strata`` it is that before some of them take more than others, whose rays count for less. It
    ``keeps_light`` along the first rays, which tell where those go."""

    pdf = _UNIFORM_PDF

    def __init__(self, context: LightContext, cache: SurfaceCache, placement, settings, seed: int, strata: Strata | None = None,
                 keeps_light: bool = False):
        self.context, self.cache, self._placement, self.settings, self._seed = context, cache, placement, settings, seed
        self._strata, self._keeps_light = strata, keeps_light
        self._hit_light = HitLight(cache)
        self._order, self._resolution = settings.order, settings.visibility_resolution
        self._albedo = context.surfaces.albedo_by_triangle()
        self._shift_tables: dict[tuple[int, int], np.ndarray] = {}
        emitters = context.emitters
        self._sample_emitters = emitters.count > 0 and cache.emitter_samples > 0

    def trace(self, item: Item) -> Traced:
        """Nearest hits of an item's rays."""
        directions = self.directions(item)
        # Live probes have no cache: their hits have a side and no texel.
        texels = getattr(self.cache.layout, "cells", None) is not None
        if follows(self.context.tracer) and texels and not self.cache.walks_media:
            found = traced(self.context.tracer, self.cache.layout, self._placement.positions[item.probes], directions)
            return Traced(*found, directions, None)
        rays = np.repeat(directions, item.shape[2], axis=0)
        hits = self.context.tracer.intersect(self._origins(item, item.shape[1]), rays)
        rows = np.flatnonzero(hits.primitive >= 0).astype(np.int32)
        primitive, u, v = hits.primitive[rows], hits.u[rows], hits.v[rows]
        cosine = -dot(self.context.geometry.normals_world[primitive], rays[rows])
        slots = self.cache.layout.slots(primitive, u, v, cosine > 0)
        media = self._in_media(item, rays, hits.t) if self.cache.walks_media else None
        return Traced(SurfaceHits(primitive, u, v, slots), rows, hits.t[rows], cosine, directions, hits.tint, media)

    def _in_media(self, item: Item, rays: np.ndarray, limits: np.ndarray) -> InMedia:
        """Walks along an item's ``rays`` up to ``limits``."""
        g, n, _ = item.shape
        ray = (item.first[:, None] + np.arange(n)).reshape(g, n, 1)
        key = hash_u32(item.probes[:, None, :], ray, self._seed, _WALKS).reshape(-1)
        walks = walk(self.context, self.cache.sources, self._origins(item, n), rays, limits, key,
                     most_turns=self.settings.bounces)
        return InMedia(walks, *ends_on(self.context, self.cache.layout, walks))

    def directions(self, item: Item) -> np.ndarray:
        """Directions (g·n, 3) that the probes of each group share."""
        return sphere_from_square(self._numbers(item, DIRECTION).reshape(-1, DIRECTION))

    def _origins(self, item: Item, n: int) -> np.ndarray:
        """Where ``n`` rays from each probe start: (g·n·m, 3)."""
        positions = self._placement.positions[item.probes][:, None]
        return np.broadcast_to(positions, (len(item.groups), n, *positions.shape[2:])).reshape(-1, 3)

    def positions_of(self, item: Item) -> np.ndarray:
        """The probes of the item: (g, m, 3)."""
        return self._placement.positions[item.probes]

    def positions(self, item: Item, rows: np.ndarray) -> np.ndarray:
        """Where the rays ``rows`` (h,) start: (h, 3)."""
        return self._placement.positions[item.probe_of(rows)]

    def under(self, context: LightContext, cache: SurfaceCache) -> "Gatherer":
        """The same probes and directions under other light."""
        return Gatherer(context, cache, self._placement, self.settings, self._seed, self._strata)

    def seeded(self, seed: int) -> "Gatherer":
        """The same probes under the same light, with other directions."""
        return Gatherer(self.context, self.cache, self._placement, self.settings, seed)

    def read(self, item: Item, traced: Traced, irradiance: np.ndarray, albedo: np.ndarray | None) -> np.ndarray:
        """Sums (g, m, k, 3) of 4π·L·Y over an item's rays, if what they hit had received ``irradiance`` (h, 3) and nothing else
        were to be seen; ``albedo`` (h, 3) at the hits (None: each triangle's own)."""
        colour = np.take(self._albedo, traced.surface.primitive, axis=0) if albedo is None else albedo
        radiance = irradiance * colour * np.float32(1 / np.pi)
        return self._projected(item, traced, self.ray_basis(item, traced.directions), radiance, None, None)

    def _numbers(self, item: Item, last: int, first: int = 0) -> np.ndarray:
        """Dimensions ``first`` … ``last`` − 1 of the groups' sequences: (g, n, last − first)."""
        index = item.first[:, None] + np.arange(item.count) if item.spread is None else item.spread.order
        return sobol_owen_at(index, last, hash_u32(self._seed, item.groups)[:, None], first=first)

    def _light_numbers(self, item: Item, dimensions: int, purpose: int) -> np.ndarray:
        """(g, n / RAYS_PER_LIGHT_SAMPLE, dimensions) for samples of one kind of light, in step with the rays."""
        index = item.first[:, None] // RAYS_PER_LIGHT_SAMPLE + np.arange(item.count // RAYS_PER_LIGHT_SAMPLE)
        return sobol_owen_at(index, dimensions, hash_u32(self._seed, item.groups, purpose)[:, None])

    def shade(self, item: Item, traced: Traced, texel: np.ndarray | None, ends: np.ndarray | None = None) -> Gathered:
        """Radiance along the traced rays, projected. ``texel`` (h,) is the cache's for each hit, None if nothing is reflected;
        ``ends`` (e,) those of where walks in media ended."""
        albedo, reflected = None, np.zeros((len(traced.rows), 3), np.float32)
        if texel is not None:
            hits, rays = traced.surface, ItemRays(self, item, traced)
            albedo = None if self._albedo is not None else self.context.surfaces.albedo(hits.primitive, hits.u, hits.v,
                                                                                        traced.cosine)
            of_hits = albedo
            if self._albedo is not None:
                # As many hits as triangles would be taken for the albedo of hits.
                alike = len(self._albedo) == len(texel)
                of_hits = np.take(self._albedo, hits.primitive, axis=0) if alike else self._albedo
            reflected = self._hit_light.reflected(hits, texel, of_hits, rays)
        basis = self.ray_basis(item, traced.directions)
        sky = None if self.context.environment.is_black else self.context.environment.base_radiance(traced.directions)
        scattered = None if traced.media is None else self._scattered(traced.media, ends)
        total = self._projected(item, traced, basis, reflected, sky, scattered) + self._light_samples(item, texel is not None)
        along = None
        if self._keeps_light and item.first[0] < CELLS:
            along = Along(self._along(item, traced, reflected, sky, scattered), None)
        emitted = None
        if self.context.surfaces.has_emission or self.context.media.is_emissive:
            glow = self._emitted(item, traced) if self.context.surfaces.has_emission else np.zeros_like(reflected)
            of_media = None if traced.media is None else traced.media.walks.emitted
            emitted = self._projected(item, traced, basis, glow, None, of_media) + self._emitter_samples(item)
            total = total + emitted
            if along is not None:
                glow = self._along(item, traced, glow, None, of_media)
                along = Along(along.light + glow, glow)
        return Gathered(item.merged_probes, item.merged(total), None if emitted is None else item.merged(emitted), albedo,
                        *(item.merged(part) for part in self._visibility(item, traced)), along)

    def look(self, item: Item, traced: Traced) -> Gathered:
        """What rays tell without light: ``Gathered`` with no SH."""
        albedo = None
        if self._albedo is None:
            hits = traced.surface
            albedo = self.context.surfaces.albedo(hits.primitive, hits.u, hits.v, traced.cosine)
        none = np.zeros((*item.merged_probes.shape, 0, 3), np.float32)
        return Gathered(item.merged_probes, none, None, albedo, *(item.merged(part) for part in self._visibility(item, traced)))

    def basis(self, item: Item, directions: np.ndarray) -> np.ndarray:
        """SH basis (g, n, k) of directions (g·n, 3)."""
        return sh.evaluate_rows(directions, self._order).reshape(len(item.groups), -1, sh.coefficient_count(self._order))

    def ray_basis(self, item: Item, directions: np.ndarray) -> np.ndarray:
        """``basis`` (g, n, k) of the ``directions`` (g·n, 3) of an item's rays, times their weights."""
        basis, weights = self.basis(item, directions), self._weights(item)
        if weights is not None:
            basis *= weights[:, :, None]
        return basis

    def _weights(self, item: Item) -> np.ndarray | None:
        if item.spread is not None:
            return item.spread.weights
        # The first rays, once others have followed.
        if self._strata is None or not self._strata.refined(item.groups).any():
            return None
        return self._strata.weights(item.groups, self._numbers(item, DIRECTION))

    def _projected(self, item: Item, traced: Traced, basis: np.ndarray, radiance: np.ndarray, sky: np.ndarray | None,
                   along: np.ndarray | None) -> np.ndarray:
        """Sums (g, m, k, 3) of 4π·L·Y: ``radiance`` (h, 3) of what the rays hit, of the others ``sky`` (g·n, 3) in each direction
        (None: black), with what surfaces that rays passed make of it, and ``along`` (g·n·m, 3) the rays (None: nothing)."""
        if traced.tint is None and along is None and can_project(basis):
            return projected(item.shape, basis, traced.rows, radiance, sky) * FULL_SPHERE
        return project(basis, self._along(item, traced, radiance, sky, along)) * FULL_SPHERE

    @staticmethod
    def _along(item: Item, traced: Traced, radiance: np.ndarray, sky: np.ndarray | None, along: np.ndarray | None) -> np.ndarray:
        """Radiance (g, n, m, 3) along the rays, from what ``_projected`` takes."""
        light = np.zeros((*item.shape, 3), np.float32)
        if sky is not None:
            light[:] = sky.reshape(*item.shape[:2], 1, 3)
        light.reshape(-1, 3)[traced.rows] = radiance
        if traced.tint is not None:
            light *= traced.tint.reshape(light.shape)
        if along is not None:
            light += along.reshape(light.shape)
        return light

    def _scattered(self, media: InMedia, texel: np.ndarray | None) -> np.ndarray:
        """Radiance (rays, 3) that media scatter along the rays: of light sources, and of what their walks ended on."""
        walks, hits = media.walks, media.surface
        light = light_of_ends(self.context, walks, media.ends, hits, media.cosines)
        if texel is not None and len(media.ends):
            albedo = self.context.surfaces.albedo(hits.primitive, hits.u, hits.v, -media.cosines)
            rays = EndRays(walks, media.ends, media.cosines, self._seed)
            light[media.ends] += self._hit_light.reflected(hits, texel, albedo, rays) * walks.tint[media.ends]
        radiance = walks.gained.copy()
        radiance[walks.rows] += light
        return radiance

    def _emitted(self, item: Item, traced: Traced) -> np.ndarray:
        surfaces, result = self.context.surfaces, np.zeros((len(traced.rows), 3), np.float32)
        rows = np.flatnonzero(surfaces.emissive[self.context.geometry.material[traced.surface.primitive]])
        hits, rays = traced.surface.take(rows), ItemRays(self, item, traced)
        emission = surfaces.emission(hits.primitive, hits.u, hits.v, rays.cosine(rows))
        if self._sample_emitters:
            pdf = self.context.emitters.pdf_area(hits.primitive, hits.u, hits.v)
            emission = emission * rays.share(rows, pdf)
        result[rows] = emission
        return result

    def shifted(self, item: Item, rows: np.ndarray, first: int, last: int) -> np.ndarray:
        """(h, last − first): the sequences' further dimensions for the rays ``rows`` (h,), shifted on the torus for each probe."""
        numbers, shifts = self._numbers(item, last, first), self._shifts(first, last)
        if kernels.is_available():
            return shifted(item.shape, numbers, item.probes, rows, shifts)
        numbers = np.take(numbers.reshape(-1, last - first), rows // item.shape[2], axis=0)
        return wrapped(numbers + np.take(shifts, item.probe_of(rows), axis=0))

    def _shifts(self, first: int, last: int) -> np.ndarray:
        """(p, last − first) in [0, 1): by how much dimensions are shifted for each probe."""
        if (first, last) not in self._shift_tables:
            every = np.arange(len(self._placement.positions))
            columns = [unit_interval(hash_u32(every, d, self._seed, _SHIFTS)) for d in range(first, last)]
            self._shift_tables[first, last] = np.stack(columns, axis=1)
        return self._shift_tables[first, last]

    def _light_samples(self, item: Item, reflected: bool) -> np.ndarray:
        """Sums (g, m, k, 3), in the units of Gathered.sh, of bright sky and bright surfaces sampled from the probes."""
        surfaces, count = self.cache.bright, sh.coefficient_count(self._order)
        total = np.zeros((*item.probes.shape, count, 3), np.float32)
        if item.shape[1] < RAYS_PER_LIGHT_SAMPLE:
            return total
        if self.context.environment.bright.count:
            total += self.bright_sky(item)
        if reflected and surfaces.count:
            # Each probe meets its own points of the pool, in the sequence's order.
            shift = unit_interval(hash_u32(item.probes, self._seed, _BRIGHT_SURFACES))[:, None]
            numbers = wrapped(self._light_numbers(item, 1, _BRIGHT_SURFACES) + shift).reshape(-1)
            origins = self._origins(item, item.shape[1] // RAYS_PER_LIGHT_SAMPLE)
            total += self._connected(item, *surfaces.connect(numbers, origins, 1 / RAYS_PER_LIGHT_SAMPLE, self.pdf))
        return total

    def bright_sky(self, item: Item) -> np.ndarray:
        """The part of ``_light_samples`` that comes from bright patches of the world (g, m, k, 3)."""
        g, n, m = item.shape
        n //= RAYS_PER_LIGHT_SAMPLE
        directions, weight = self.context.environment.bright.sample(self._light_numbers(item, 2, _BRIGHT_SKY).reshape(-1, 2))
        passed = self.context.tracer.transmittance(self._origins(item, n), np.repeat(directions, m, axis=0))
        seen = weight.reshape(g, n, 1, 3) * passed.reshape(g, n, m, -1)
        return project(self.basis(item, directions), seen) * np.float32(RAYS_PER_LIGHT_SAMPLE)

    def _emitter_samples(self, item: Item) -> np.ndarray | np.float32:
        """As ``_light_samples``, for emissive triangles."""
        n = item.shape[1] // RAYS_PER_LIGHT_SAMPLE
        if n == 0 or not self._sample_emitters:
            return np.float32(0)
        # Each sample is shared by the probes of its group.
        emitted = self.context.emitters.sample(self._light_numbers(item, 3, _EMITTERS).reshape(-1, 3)).repeated(item.shape[2])
        connected = connect_emitters(self.context, emitted, self._origins(item, n), 1 / RAYS_PER_LIGHT_SAMPLE, self.pdf)
        return self._connected(item, *connected)

    def _connected(self, item: Item, directions: np.ndarray, contributions: np.ndarray) -> np.ndarray:
        """Sums (g, m, k, 3) of connections from the item's probes, ordered like its light samples."""
        g, n, m = len(item.groups), item.shape[1] // RAYS_PER_LIGHT_SAMPLE, item.shape[2]
        basis = sh.evaluate_rows(directions, self._order).reshape(g, n, m, -1)
        return np.matmul(basis.transpose(0, 2, 3, 1), contributions.reshape(g, n, m, 3).transpose(0, 2, 1, 3))

    def _visibility(self, item: Item, traced: Traced) -> tuple[np.ndarray, np.ndarray]:
        g, n, m = item.shape
        tiles = self._resolution**2
        sums, weights = np.zeros((g * tiles, m, 2), np.float32), np.zeros(g * tiles, np.float32)
        early = np.flatnonzero(np.repeat(item.first < VISIBILITY_RAYS, n))
        weight = self._weights(item) if early.size else None
        if early.size and weight is None and kernels.is_available():
            return visibility(item.shape, item.first < VISIBILITY_RAYS, octahedral.texel_index(traced.directions, self._resolution),
                              tiles, self._placement.reach[item.probes], traced.rows, traced.t)
        if early.size:
            t = np.full(item.ray_count, np.inf, np.float32)
            t[traced.rows] = traced.t
            t = np.minimum(t.reshape(g, n, m), self._placement.reach[item.probes][:, None]).reshape(g * n, m)
            cell = octahedral.texel_index(traced.directions[early], self._resolution) + early // n * tiles
            order = np.argsort(cell, kind="stable")
            cells, first, count = np.unique(cell[order], return_index=True, return_counts=True)
            t, each = t[early[order]], None if weight is None else weight.reshape(-1, 1)[early[order]]
            weighted = t if each is None else t * each
            sums[cells, :, 0], sums[cells, :, 1] = (np.add.reduceat(part, first, axis=0) for part in (weighted, weighted * t))
            weights[cells] = count if each is None else np.add.reduceat(each[:, 0], first)
        return sums.reshape(g, tiles, m, 2).transpose(0, 2, 1, 3), weights.reshape(g, 1, tiles)


def gather(gatherer: Gatherer, items: list[Item], progress: Progress, label: str,
           shares: Shares = USUAL) -> tuple[list[Traced], list[np.ndarray | None], list[Gathered]]:
    """What the rays of ``items`` meet, the surface cache's texels there (None where nothing is reflected), and the items' sums once
    the cache is solved. Raises Cancelled."""
    cache, settings, threads = gatherer.cache, gatherer.settings, gatherer.context.threads
    traced = parallel_for(lambda i: gatherer.trace(items[i]), len(items), threads, progress.span(0.0, shares.traced), label)
    texels, ends = [None] * len(items), [None] * len(items)
    if settings.bounces != 0:
        walked = [hits.media.surface for hits in traced if hits.media is not None]
        texels = cache.reach([hits.surface for hits in traced] + walked, progress.span(shares.traced, shares.grown), shares.texels)
        texels, ends = texels[:len(items)], texels[len(items):] or ends
        cache.solve(settings.bounces, SOLVER_SHARE * settings.target, progress.span(shares.grown, shares.solved))
    gathered = parallel_for(lambda i: gatherer.shade(items[i], traced[i], texels[i], ends[i]), len(items), threads,
                            progress.span(shares.solved, 1.0), label)
    return traced, texels, gathered
