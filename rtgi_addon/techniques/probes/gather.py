"""Rays from probes: traced in one pass, shaded from the surface cache in the next, projected onto SH.

A few neighbouring probes share their directions: SH projection is then a matrix product, and rays of one direction from nearby
points find the same part of the BVH. Groups are scrambled independently of one another, so their errors are too.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from ...numerics import octahedral, sh
from ...numerics.sampling import hash_u32, sobol_owen, sobol_owen_at, sphere_from_square
from ...transport.context import LightContext
from ...transport.surface_cache import SurfaceCache
from ...transport.texel_light import ALL_SOURCES, CHOICES
from ...transport.texel_table import SurfaceHits
from ...transport.vectors import dot

# Probes that share a set of directions.
GROUP = 8
# One emitter (and one bright world) sample for so many rays.
RAYS_PER_LIGHT_SAMPLE = 8
# Samples of each lamp that has an extent, where its direct light is wanted.
LAMP_SAMPLES = 64
# Distances are averaged over this many rays of each probe: with 64 cells to a tile, as many as tell.
VISIBILITY_RAYS = 1024
_UNIFORM_PDF = np.float32(1.0 / (4.0 * np.pi))


@dataclass(frozen=True, eq=False)
class Item:
    """Blocks of ``count`` rays of some ``groups`` (g,), from ray ``first`` (g,) of each group's sequence, for as many of its
    probes: ``probes`` (g, m). ``first`` and ``count`` are multiples of RAYS_PER_LIGHT_SAMPLE; a group may occur with several
    blocks. Rays are ordered block by block, direction by direction: (g, n, m) with n = ``count``."""

    groups: np.ndarray
    probes: np.ndarray
    first: np.ndarray
    count: int

    @property
    def shape(self) -> tuple[int, int, int]:
        """(g, n, m)."""
        return len(self.groups), self.count, self.probes.shape[1]

    @property
    def ray_count(self) -> int:
        """Rays in the item."""
        return self.probes.size * self.count

    @cached_property
    def _runs(self) -> np.ndarray:
        # Blocks of the same probes follow one another.
        return np.flatnonzero(np.append(True, (np.diff(self.groups) != 0) | (np.diff(self.probes[:, 0]) != 0)))

    @property
    def merged_probes(self) -> np.ndarray:
        """The probes (b, m) that ``merged`` sums belong to, each once."""
        return self.probes[self._runs]

    def merged(self, part: np.ndarray) -> np.ndarray:
        """Sums (b, …) of ``part`` (g, …) over the blocks of the same probes."""
        return np.add.reduceat(part, self._runs, axis=0)

    def probe_of(self, rows: np.ndarray) -> np.ndarray:
        """The probe (h,) that each of the rays ``rows`` (h,) leaves from."""
        _, n, m = self.shape
        return self.probes.reshape(-1)[rows // (n * m) * m + rows % m]


@dataclass(eq=False)
class Traced:
    """What an item's rays met: ``rows`` (h,) of those that hit ``surface`` (h,) at ``t`` (h,), and the ``directions`` (g·n, 3)."""

    surface: SurfaceHits
    rows: np.ndarray
    t: np.ndarray
    directions: np.ndarray


@dataclass(eq=False)
class Gathered:
    """An item's sums over the blocks of the same ``probes`` (b, m): ``sh`` (b, m, k, 3) the sum over rays of 4π·L·Y (divide by the
    number of rays), ``emitted`` what of it is light from emissive surfaces (None where nothing emits), ``albedo`` (h, 3) at the
    hits (None where it is each triangle's own), and for visibility the sums (b, m, T², 2) of distance and squared distance over
    the rays in each cell of the tile, with their numbers (b, 1, T²)."""

    probes: np.ndarray
    sh: np.ndarray
    emitted: np.ndarray | None
    albedo: np.ndarray | None
    distance: np.ndarray
    distance_weight: np.ndarray


class Gatherer:
    """Traces and shades items against one context and one surface cache. ``pdf`` is the density [1/sr] of its directions."""

    pdf = _UNIFORM_PDF

    def __init__(self, context: LightContext, cache: SurfaceCache, placement, settings, seed: int):
        self._context, self._cache, self._placement, self._seed = context, cache, placement, seed
        self._order, self._resolution = settings.order, settings.visibility_resolution
        self._bounces = settings.bounces
        self._albedo = context.surfaces.albedo_by_triangle()
        emitters = context.emitters
        self._sample_emitters = emitters.count > 0 and cache.emitter_samples > 0

    def trace(self, item: Item) -> Traced:
        """Nearest hits of an item's rays."""
        directions = self.directions(item)
        rays = np.repeat(directions, item.shape[2], axis=0)
        hits = self._context.tracer.intersect(self._origins(item, item.shape[1]), rays)
        rows = np.flatnonzero(hits.primitive >= 0)
        primitive, u, v = hits.primitive[rows], hits.u[rows], hits.v[rows]
        front = dot(self._context.geometry.normals_world[primitive], rays[rows]) < 0
        slots = self._cache.layout.slots(primitive, u, v, front)
        return Traced(SurfaceHits(primitive, u, v, slots), rows, hits.t[rows], directions)

    def directions(self, item: Item) -> np.ndarray:
        """Directions (g·n, 3) that the probes of each group share."""
        return sphere_from_square(self._numbers(item, 2).reshape(-1, 2))

    def _origins(self, item: Item, n: int) -> np.ndarray:
        """Where ``n`` rays from each probe start: (g·n·m, 3)."""
        positions = self._placement.positions[item.probes][:, None]
        return np.broadcast_to(positions, (len(item.groups), n, *positions.shape[2:])).reshape(-1, 3)

    def under(self, context: LightContext, cache: SurfaceCache) -> "Gatherer":
        """The same probes and directions under other light."""
        other = object.__new__(Gatherer)
        other.__dict__.update(self.__dict__)
        other._context, other._cache = context, cache
        return other

    def _numbers(self, item: Item, last: int, first: int = 0) -> np.ndarray:
        """Dimensions ``first`` … ``last`` − 1 of the groups' sequences: (g, n, last − first)."""
        index = item.first[:, None] + np.arange(item.count)
        return sobol_owen_at(index, last, hash_u32(self._seed, item.groups)[:, None], first=first)

    def _light_numbers(self, item: Item, dimensions: int, purpose: int) -> np.ndarray:
        """(g, n / RAYS_PER_LIGHT_SAMPLE, dimensions) for samples of one kind of light, in step with the rays."""
        index = item.first[:, None] // RAYS_PER_LIGHT_SAMPLE + np.arange(item.count // RAYS_PER_LIGHT_SAMPLE)
        return sobol_owen_at(index, dimensions, hash_u32(self._seed, item.groups, purpose)[:, None])

    def shade(self, item: Item, traced: Traced, texel: np.ndarray | None) -> Gathered:
        """Radiance along the traced rays, projected. ``texel`` (h,) is the cache's for each hit, None if nothing is reflected."""
        radiance = np.zeros((*item.shape, 3), np.float32)
        albedo = None
        if texel is not None:
            hits = traced.surface
            albedo = self._context.surfaces.albedo(hits.primitive, hits.u, hits.v) if self._albedo is None else None
            radiance.reshape(-1, 3)[traced.rows] = self._reflected(item, traced, texel, albedo)
        if not self._context.environment.is_black:
            radiance += self.sky(item, traced)
        basis = self.basis(item, traced.directions)
        total = project(basis, radiance) * np.float32(4.0 * np.pi) + self._light_samples(item, texel is not None)
        emitted = None
        if self._context.surfaces.has_emission:
            radiance[:] = 0
            radiance.reshape(-1, 3)[traced.rows] = self._emitted(item, traced)
            emitted = project(basis, radiance) * np.float32(4.0 * np.pi) + self._emitter_samples(item)
            total = total + emitted
        return Gathered(item.merged_probes, item.merged(total), None if emitted is None else item.merged(emitted), albedo,
                        *(item.merged(part) for part in self._visibility(item, traced)))

    def basis(self, item: Item, directions: np.ndarray) -> np.ndarray:
        """SH basis (g, n, k) of directions (g·n, 3)."""
        return sh.evaluate(directions, self._order).reshape(len(item.groups), -1, sh.coefficient_count(self._order))

    def sky(self, item: Item, traced: Traced) -> np.ndarray:
        """Radiance (g, n, m, 3) of the world, without its bright patches, along the rays that hit nothing; 0 along the others."""
        missed = np.ones(item.ray_count, bool)
        missed[traced.rows] = False
        sky = self._context.environment.base_radiance(traced.directions).reshape(*item.shape[:2], 1, 3)
        return np.where(missed.reshape(*item.shape, 1), sky, np.float32(0))

    def _reflected(self, item: Item, traced: Traced, texel: np.ndarray, albedo: np.ndarray | None) -> np.ndarray:
        cache = self._cache
        irradiance = np.take(cache.irradiance_rest, texel, axis=0, mode="wrap")
        if cache.sources.count:
            irradiance += self._direct(item, traced, texel)
        irradiance *= np.take(self._albedo, traced.surface.primitive, axis=0) if albedo is None else albedo
        irradiance *= np.float32(1.0 / np.pi)
        return irradiance

    def _emitted(self, item: Item, traced: Traced) -> np.ndarray:
        surfaces, result = self._context.surfaces, np.zeros((len(traced.rows), 3), np.float32)
        rows = np.flatnonzero(surfaces.emissive[self._context.geometry.material[traced.surface.primitive]])
        found = traced.surface.take(rows)
        emission = surfaces.emission(found.primitive, found.u, found.v)
        if self._sample_emitters:
            density = self._density(item, traced, rows)
            by_light = self._context.emitters.pdf_area(found.primitive) / RAYS_PER_LIGHT_SAMPLE
            emission = emission * (density / np.maximum(density + by_light, 1e-30))[:, None]
        result[rows] = emission
        return result

    def _density(self, item: Item, traced: Traced, rows: np.ndarray) -> np.ndarray:
        """Density (n,) [m⁻²] of probe rays on the surfaces that the given hits met."""
        directions = traced.directions[traced.rows[rows] // item.shape[2]]
        cosine = np.abs(dot(self._context.geometry.normals_world[traced.surface.primitive[rows]], directions))
        return self.pdf * cosine / np.maximum(traced.t[rows] ** 2, np.float32(1e-20))

    def _direct(self, item: Item, traced: Traced, texel: np.ndarray) -> np.ndarray:
        """Irradiance (h, 3) of lamps and bright sky at hits, less what is sampled as a bright surface: the texel's mean where that
        is smooth, shadow rays from the hit elsewhere."""
        cache = self._cache
        total = np.take(cache.irradiance_direct, texel, axis=0, mode="wrap")
        uneven = np.flatnonzero(~np.take(cache.smooth[:, 0], texel, mode="wrap"))
        if uneven.size:
            total[uneven] = self._direct_at(item, traced, texel, uneven)
        if cache.bright.count:
            pdf = np.take(cache.bright.pdf_area, texel, mode="wrap")
            found = np.flatnonzero(pdf)
            density = self._density(item, traced, found)
            total[found] *= (density / np.maximum(density + pdf[found] / RAYS_PER_LIGHT_SAMPLE, 1e-30))[:, None]
        return total

    def _direct_at(self, item: Item, traced: Traced, texel: np.ndarray, chosen: np.ndarray) -> np.ndarray:
        """One shadow ray from each of the ``chosen`` (c,) hits to each of a few sources, or to one picked from the texel's."""
        cache, hits, rows, t = self._cache, traced.surface.take(chosen), traced.rows[chosen], traced.t[chosen]
        points = np.take(traced.directions, rows // item.shape[2], axis=0) * t[:, None]
        points += self._placement.positions[item.probe_of(rows)]
        _, _, _, _, shading, face = cache.surface_at(hits.slots, hits.primitive, hits.u, hits.v, points)
        if cache.sources.count <= ALL_SOURCES:
            numbers = None if cache.sources.is_delta.all() else self._shifted(item, rows, 2, 4)
            total = np.zeros((len(rows), 3), np.float32)
            for source in range(cache.sources.count):
                uv = np.zeros((len(rows), 2), np.float32) if cache.sources.is_delta[source] else _turn(numbers, source)
                total += cache.sources.irradiance(source, points, shading, face, t, uv)
            return total
        numbers = self._shifted(item, rows, 2, 5)
        column = np.minimum((numbers[:, 2] * CHOICES).astype(np.int64), CHOICES - 1)
        source, weight = cache.choices[texel[chosen], column], cache.choice_weights[texel[chosen], column]
        return cache.sources.irradiance(source.astype(np.int64), points, shading, face, t, numbers[:, :2]) * weight[:, None]

    def _shifted(self, item: Item, rows: np.ndarray, first: int, last: int) -> np.ndarray:
        """(h, last − first): the sequences' further dimensions for the rays ``rows`` (h,), shifted on the torus for each probe."""
        probes = item.probe_of(rows)
        numbers = np.take(self._numbers(item, last, first).reshape(-1, last - first), rows // item.shape[2], axis=0)
        every = np.arange(len(self._placement.positions))
        for d in range(first, last):
            numbers[:, d - first] += np.take(_fraction(hash_u32(every, d, self._seed, 17)), probes)
        return numbers - np.floor(numbers)

    def _light_samples(self, item: Item, reflected: bool) -> np.ndarray:
        """Sums (g, m, k, 3), in the units of Gathered.sh, of bright sky and bright surfaces sampled from the probes."""
        surfaces, count = self._cache.bright, sh.coefficient_count(self._order)
        total = np.zeros((*item.probes.shape, count, 3), np.float32)
        if item.shape[1] < RAYS_PER_LIGHT_SAMPLE:
            return total
        if self._context.environment.bright.count:
            total += self.bright_sky(item)
        if reflected and surfaces.count:
            # Each probe meets its own points of the pool, in the sequence's order.
            numbers = self._light_numbers(item, 1, 5) + _fraction(hash_u32(item.probes, self._seed, 5))[:, None]
            numbers = (numbers - np.floor(numbers)).reshape(-1)
            origins = self._origins(item, item.shape[1] // RAYS_PER_LIGHT_SAMPLE)
            total += self._connected(item, *surfaces.connect(numbers, origins, 1 / RAYS_PER_LIGHT_SAMPLE, self.pdf))
        return total

    def bright_sky(self, item: Item) -> np.ndarray:
        """The part of ``_light_samples`` that comes from bright patches of the world (g, m, k, 3)."""
        g, n, m = item.shape
        n //= RAYS_PER_LIGHT_SAMPLE
        directions, weight = self._context.environment.bright.sample(self._light_numbers(item, 2, 3).reshape(-1, 2))
        free = ~self._context.tracer.occluded(self._origins(item, n), np.repeat(directions, m, axis=0))
        seen = np.where(free.reshape(g, n, m, 1), weight.reshape(g, n, 1, 3), np.float32(0))
        return project(self.basis(item, directions), seen) * np.float32(RAYS_PER_LIGHT_SAMPLE)

    def _emitter_samples(self, item: Item) -> np.ndarray | np.float32:
        """As ``_light_samples``, for emissive triangles."""
        n = item.shape[1] // RAYS_PER_LIGHT_SAMPLE
        if n == 0 or not self._sample_emitters:
            return np.float32(0)
        xi = self._light_numbers(item, 3, 4).reshape(-1, 3)
        return self._connected(item, *self._connect_emitters(xi, self._origins(item, n), item.shape[2]))

    def _connected(self, item: Item, directions: np.ndarray, contributions: np.ndarray) -> np.ndarray:
        """Sums (g, m, k, 3) of connections from the item's probes, ordered like its light samples."""
        g, n, m = len(item.groups), item.shape[1] // RAYS_PER_LIGHT_SAMPLE, item.shape[2]
        basis = np.ascontiguousarray(sh.evaluate(directions, self._order)).reshape(g, n, m, -1)
        return np.matmul(basis.transpose(0, 2, 3, 1), contributions.reshape(g, n, m, 3).transpose(0, 2, 1, 3))

    def lamps(self, probes: np.ndarray) -> np.ndarray:
        """The direct light of lamps as SH coefficients (m, k, 3) of ``probes`` (m,)."""
        sources, points = self._cache.sources, self._placement.positions[probes]
        result = np.zeros((len(probes), sh.coefficient_count(self._order), 3))
        for lamp in range(self._context.lamps.count):
            samples = 1 if sources.is_delta[lamp] else LAMP_SAMPLES
            for xi in sobol_owen(samples, 2, hash_u32(self._seed, lamp, 6)):
                directions, irradiance = sources.facing_irradiance(lamp, points, np.tile(xi, (len(points), 1)))
                result += sh.evaluate(directions, self._order)[:, :, None] * (irradiance / np.float32(samples))[:, None, :]
        return result

    def _connect_emitters(self, xi: np.ndarray, origins: np.ndarray, m: int):
        """As BrightSurfaces.connect, for emissive triangles: directions and contributions, each sample shared by m probes."""
        target, normal, emission, pdf_area, _ = (np.repeat(part, m, axis=0) for part in self._context.emitters.sample(xi))
        towards = target - origins
        squared = np.maximum(dot(towards, towards), np.float32(1e-20))
        distance = np.sqrt(squared)
        directions = towards / distance[:, None]
        free = ~self._context.tracer.occluded(origins, directions, distance * np.float32(1 - 1e-4))
        transfer = np.abs(dot(normal, directions)) / squared
        share = transfer / np.maximum(pdf_area / RAYS_PER_LIGHT_SAMPLE + self.pdf * transfer, np.float32(1e-30))
        return directions, np.where(free[:, None], emission * share[:, None], np.float32(0))

    def _visibility(self, item: Item, traced: Traced) -> tuple[np.ndarray, np.ndarray]:
        g, n, m = item.shape
        tiles = self._resolution**2
        sums, weights = np.zeros((g * tiles, m, 2), np.float32), np.zeros(g * tiles, np.float32)
        early = np.flatnonzero(np.repeat(item.first < VISIBILITY_RAYS, n))
        if early.size:
            t = np.full(item.ray_count, np.inf, np.float32)
            t[traced.rows] = traced.t
            t = np.minimum(t.reshape(g, n, m), self._placement.reach[item.probes][:, None]).reshape(g * n, m)
            cell = octahedral.texel_index(traced.directions[early], self._resolution) + early // n * tiles
            order = np.argsort(cell, kind="stable")
            cells, first, count = np.unique(cell[order], return_index=True, return_counts=True)
            t = t[early[order]]
            sums[cells, :, 0], sums[cells, :, 1] = np.add.reduceat(t, first, axis=0), np.add.reduceat(t * t, first, axis=0)
            weights[cells] = count
        return sums.reshape(g, tiles, m, 2).transpose(0, 2, 1, 3), weights.reshape(g, 1, tiles)


def _turn(numbers: np.ndarray, source: int) -> np.ndarray:
    """Another shift on the torus for each further source, so that lamps are not sampled in step."""
    turned = numbers + np.float32(0.381966 * source)
    return turned - np.floor(turned)


def _fraction(hashed: np.ndarray) -> np.ndarray:
    return (hashed >> np.uint32(8)).astype(np.float32) * np.float32(2.0**-24)


def project(basis: np.ndarray, radiance: np.ndarray) -> np.ndarray:
    """Sum over directions of ``basis`` (g, n, k) times ``radiance`` (g, n, m, c): (g, m, k, c)."""
    g, n, m, channels = radiance.shape
    # OpenBLAS starts threads of its own for products of 2^18 multiplications or more, which under our threads only wait for each
    # other; a block of rays stays below.
    products = np.matmul(basis.transpose(0, 2, 1), radiance.reshape(g, n, m * channels))
    return products.reshape(g, -1, m, channels).transpose(0, 2, 1, 3)
