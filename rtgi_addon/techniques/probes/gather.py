"""Rays from probes: traced in one pass, shaded from the surface cache in the next, projected onto SH.

A work item is a group of neighbouring probes that share their directions: SH projection is then one matrix product, and rays
of one direction from nearby points find the same part of the BVH. Groups are scrambled independently of one another.
"""

from dataclasses import dataclass

import numpy as np

from ...numerics import octahedral, sh
from ...numerics.sampling import hash_u32, sobol_owen, sphere_from_square
from ...transport.context import LightContext
from ...transport.surface_cache import SurfaceCache
from ...transport.texel_light import ALL_SOURCES, CHOICES
from ...transport.texel_table import SurfaceHits
from ...transport.vectors import dot

# Probes that share a set of directions.
GROUP = 64
# One emitter (and one bright world) sample for so many rays.
RAYS_PER_LIGHT_SAMPLE = 8
# Samples of each lamp that has an extent, where its direct light is wanted.
LAMP_SAMPLES = 64
# Sharpness of the cosine-power filter that spreads ray distances over a visibility tile: Majercik et al. 2019 use 50 for
# few rays a frame; three times that leaks half as much light past thin walls.
_VISIBILITY_SHARPNESS = 150.0
_UNIFORM_PDF = np.float32(1.0 / (4.0 * np.pi))


@dataclass(frozen=True, eq=False)
class Item:
    """Rays ``first`` … ``last`` − 1 of the sequence of ``group`` from ``probes`` (m,), all of that group; both ends are
    multiples of RAYS_PER_LIGHT_SAMPLE."""

    group: int
    probes: np.ndarray
    first: int
    last: int

    @property
    def ray_count(self) -> int:
        """Rays in the item."""
        return len(self.probes) * (self.last - self.first)


@dataclass(eq=False)
class Traced:
    """What an item's rays met: ``rows`` (h,) of those (n·m, direction by direction) that hit ``surface`` (h,) at ``t`` (h,), and the
    ``directions`` (n, 3)."""

    surface: SurfaceHits
    rows: np.ndarray
    t: np.ndarray
    directions: np.ndarray


@dataclass(eq=False)
class Gathered:
    """An item's sums: ``sh`` (m, k, 3) the sum over its rays of 4π·L·Y (divide by the number of rays), ``emitted`` what of it is
    light from emissive surfaces (None where nothing emits), ``albedo`` (h, 3) at the hits (None where it is each triangle's own),
    and for visibility the weighted sums (T², m, 2) of distance and squared distance with their weights (T²,)."""

    sh: np.ndarray
    emitted: np.ndarray | None
    albedo: np.ndarray | None
    distance: np.ndarray
    distance_weight: np.ndarray


class Gatherer:
    """Traces and shades items against one context and one surface cache."""

    def __init__(self, context: LightContext, cache: SurfaceCache, placement, settings, seed: int):
        self._context, self._cache, self._placement, self._seed = context, cache, placement, seed
        self._order, self._resolution = settings.order, settings.visibility_resolution
        self._bounces = settings.bounces
        self._tile_directions = octahedral.texel_directions(self._resolution).reshape(-1, 3).astype(np.float32)
        self._albedo = context.surfaces.albedo_by_triangle()
        emitters = context.emitters
        self._sample_emitters = emitters.count > 0 and cache.emitter_samples > 0

    def trace(self, item: Item) -> Traced:
        """Nearest hits of an item's rays."""
        directions = self.directions(item)
        m = len(item.probes)
        rays = np.repeat(directions, m, axis=0)
        origins = np.tile(self._placement.positions[item.probes], (len(directions), 1))
        hits = self._context.tracer.intersect(origins, rays)
        rows = np.flatnonzero(hits.primitive >= 0)
        primitive, u, v = hits.primitive[rows], hits.u[rows], hits.v[rows]
        front = dot(self._context.geometry.normals_world[primitive], rays[rows]) < 0
        return Traced(SurfaceHits(primitive, u, v, self._cache.layout.slots(primitive, u, v, front)), rows, hits.t[rows], directions)

    def directions(self, item: Item) -> np.ndarray:
        """Directions (n, 3) that the item's probes share."""
        return sphere_from_square(self._numbers(item, 2))

    def under(self, context: LightContext, cache: SurfaceCache) -> "Gatherer":
        """The same probes and directions under other light."""
        other = object.__new__(Gatherer)
        other.__dict__.update(self.__dict__)
        other._context, other._cache = context, cache
        return other

    def _numbers(self, item: Item, last: int, first: int = 0) -> np.ndarray:
        points = sobol_owen(item.last - item.first, last, hash_u32(self._seed, item.group), start=item.first)
        return points[:, first:]

    def shade(self, item: Item, traced: Traced, texel: np.ndarray | None) -> Gathered:
        """Radiance along the traced rays, projected. ``texel`` (h,) is the cache's for each hit, None where nothing is reflected."""
        m, n = len(item.probes), item.last - item.first
        radiance = np.zeros((n, m, 3), np.float32)
        albedo = None
        if texel is not None:
            hits = traced.surface
            albedo = self._context.surfaces.albedo(hits.primitive, hits.u, hits.v) if self._albedo is None else None
            radiance.reshape(-1, 3)[traced.rows] = self._reflected(item, traced, texel, albedo)
        if not self._context.environment.is_black:
            radiance += self.sky(traced, n, m)
        basis = sh.evaluate(traced.directions, self._order)
        total = project(basis, radiance) * np.float32(4.0 * np.pi) + self._light_samples(item, texel is not None)
        emitted = None
        if self._context.surfaces.has_emission:
            radiance[:] = 0
            radiance.reshape(-1, 3)[traced.rows] = self._emitted(item, traced)
            emitted = project(basis, radiance) * np.float32(4.0 * np.pi) + self._emitter_samples(item)
            total = total + emitted
        return Gathered(total, emitted, albedo, *self._visibility(item, traced))

    def sky(self, traced: Traced, n: int, m: int) -> np.ndarray:
        """Radiance (n, m, 3) of the world, without its bright patches, along the rays that hit nothing; 0 along the others."""
        missed = np.ones(n * m, bool)
        missed[traced.rows] = False
        sky = self._context.environment.base_radiance(traced.directions)
        return np.where(missed.reshape(n, m, 1), sky[:, None, :], np.float32(0))

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
        directions = traced.directions[traced.rows[rows] // len(item.probes)]
        cosine = np.abs(dot(self._context.geometry.normals_world[traced.surface.primitive[rows]], directions))
        return _UNIFORM_PDF * cosine / np.maximum(traced.t[rows] ** 2, np.float32(1e-20))

    def _direct(self, item: Item, traced: Traced, texel: np.ndarray) -> np.ndarray:
        """Irradiance (h, 3) of lamps and bright sky at hits: one shadow ray for each of a few sources, or for one chosen; less what
        is sampled as a bright surface."""
        cache, hits, rows = self._cache, traced.surface, traced.rows
        step, probe = np.divmod(rows, len(item.probes))
        points = self._placement.positions[item.probes][probe] + traced.directions[step] * traced.t[:, None]
        side = np.where(hits.slots & 1, np.float32(1), np.float32(-1))[:, None]
        face = self._context.geometry.normals_world[hits.primitive] * side
        surfaces = self._context.surfaces
        shading = surfaces.shading_normal(hits.primitive, hits.u, hits.v) * side if surfaces.has_smooth_normals else face
        if cache.sources.count <= ALL_SOURCES:
            numbers = None if cache.sources.is_delta.all() else self._shifted(item, 2, 4)[rows]
            total = np.zeros((len(rows), 3), np.float32)
            for source in range(cache.sources.count):
                uv = np.zeros((len(rows), 2), np.float32) if cache.sources.is_delta[source] else _turn(numbers, source)
                total += cache.sources.irradiance(source, points, shading, face, traced.t, uv)
        else:
            numbers = self._shifted(item, 2, 5)[rows]
            column = np.minimum((numbers[:, 2] * CHOICES).astype(np.int64), CHOICES - 1)
            source, weight = cache.choices[texel, column], cache.choice_weights[texel, column]
            total = cache.sources.irradiance(source.astype(np.int64), points, shading, face, traced.t, numbers[:, :2]) * weight[:, None]
        if cache.bright.count:
            pdf = np.take(cache.bright.pdf_area, texel, mode="wrap")
            found = np.flatnonzero(pdf)
            density = self._density(item, traced, found)
            total[found] *= (density / np.maximum(density + pdf[found] / RAYS_PER_LIGHT_SAMPLE, 1e-30))[:, None]
        return total

    def _shifted(self, item: Item, first: int, last: int) -> np.ndarray:
        """(n·m, last − first): the sequence's further dimensions, shifted on the torus for each probe by a hash."""
        shift = np.stack([hash_u32(item.probes, d, self._seed, 17) for d in range(first, last)], axis=-1)
        numbers = self._numbers(item, last, first)[:, None] + (shift >> np.uint32(8)).astype(np.float32) * np.float32(2.0**-24)
        return (numbers - np.floor(numbers)).reshape(-1, last - first)

    def _light_samples(self, item: Item, reflected: bool) -> np.ndarray:
        """Sums (m, k, 3), in the units of Gathered.sh, of bright sky and bright surfaces sampled from the probes."""
        total, surfaces = np.zeros((len(item.probes), sh.coefficient_count(self._order), 3), np.float32), self._cache.bright
        if self._context.environment.bright.count:
            total += self.bright_sky(item)
        n, m, origins, start = self._light_sample_frame(item)
        if n and reflected and surfaces.count:
            # Each probe meets its own points of the pool, in the sequence's order.
            shift = (hash_u32(item.probes, self._seed, 5) >> np.uint32(8)).astype(np.float32) * np.float32(2.0**-24)
            numbers = sobol_owen(n, 1, hash_u32(self._seed, item.group, 5), start=start) + shift
            total += self._balanced(surfaces.connect((numbers - np.floor(numbers)).reshape(-1), origins, None), n, m)
        return total

    def bright_sky(self, item: Item) -> np.ndarray:
        """The part of ``_light_samples`` that comes from bright patches of the world (m, k, 3)."""
        n, m, origins, start = self._light_sample_frame(item)
        xi = sobol_owen(n, 2, hash_u32(self._seed, item.group, 3), start=start)
        directions, weight = self._context.environment.bright.sample(xi)
        free = ~self._context.tracer.occluded(origins, np.repeat(directions, m, axis=0))
        seen = np.where(free.reshape(n, m, 1), weight[:, None, :], np.float32(0))
        return project(sh.evaluate(directions, self._order), seen) * np.float32(RAYS_PER_LIGHT_SAMPLE)

    def _emitter_samples(self, item: Item) -> np.ndarray | np.float32:
        """As ``_light_samples``, for emissive triangles."""
        n, m, origins, start = self._light_sample_frame(item)
        if n == 0 or not self._sample_emitters:
            return np.float32(0)
        xi = sobol_owen(n, 3, hash_u32(self._seed, item.group, 4), start=start)
        return self._balanced(self._connect_emitters(xi, origins, m), n, m)

    def _light_sample_frame(self, item: Item):
        n, m = (item.last - item.first) // RAYS_PER_LIGHT_SAMPLE, len(item.probes)
        return n, m, np.tile(self._placement.positions[item.probes], (n, 1)), item.first // RAYS_PER_LIGHT_SAMPLE

    def _balanced(self, connection, n: int, m: int) -> np.ndarray:
        """Sum (m, k, 3) of n·m connections by the balance heuristic over rays and samples together, both counted per ray."""
        directions, at_light, density, emission = connection
        at_light = np.maximum(at_light, 0)
        weight = at_light / np.maximum(_UNIFORM_PDF * at_light + density / RAYS_PER_LIGHT_SAMPLE, 1e-30)
        basis = np.ascontiguousarray(sh.evaluate(directions, self._order)).reshape(n, m, -1)
        return np.matmul(basis.transpose(1, 2, 0), (emission * weight[:, None]).reshape(n, m, 3).transpose(1, 0, 2))

    def lamps(self, probes: np.ndarray) -> np.ndarray:
        """The direct light of lamps as SH coefficients (m, k, 3)."""
        sources, points = self._cache.sources, self._placement.positions[probes]
        result = np.zeros((len(probes), sh.coefficient_count(self._order), 3))
        for lamp in range(self._context.lamps.count):
            samples = 1 if sources.is_delta[lamp] else LAMP_SAMPLES
            for xi in sobol_owen(samples, 2, hash_u32(self._seed, lamp, 6)):
                directions, irradiance = sources.facing_irradiance(lamp, points, np.tile(xi, (len(points), 1)))
                result += sh.evaluate(directions, self._order)[:, :, None] * (irradiance / np.float32(samples))[:, None, :]
        return result

    def _connect_emitters(self, xi: np.ndarray, origins: np.ndarray, m: int):
        """As BrightSurfaces.connect, for emissive triangles: n samples shared by m probes."""
        target, normal, emission, pdf_area, _ = (np.repeat(part, m, axis=0) for part in self._context.emitters.sample(xi))
        towards = target - origins
        squared = np.maximum(dot(towards, towards), np.float32(1e-20))
        distance = np.sqrt(squared)
        directions = towards / distance[:, None]
        free = ~self._context.tracer.occluded(origins, directions, distance * np.float32(1 - 1e-4))
        at_light = np.abs(dot(normal, directions)) / squared
        return directions, at_light, pdf_area, np.where(free[:, None], emission, np.float32(0))

    def _visibility(self, item: Item, traced: Traced) -> tuple[np.ndarray, np.ndarray]:
        m, n = len(item.probes), item.last - item.first
        reach = self._placement.reach[item.probes]
        t = np.full(n * m, np.inf, np.float32)
        t[traced.rows] = traced.t
        t = np.minimum(t.reshape(n, m), reach)
        cosine = np.maximum(traced.directions @ self._tile_directions.T, 0)
        weight = (cosine ** np.float32(_VISIBILITY_SHARPNESS)).astype(np.float32)
        both = np.concatenate([t, t * t], axis=1)
        return (weight.T @ both).reshape(-1, 2, m).transpose(0, 2, 1), weight.sum(axis=0)


def _turn(numbers: np.ndarray, source: int) -> np.ndarray:
    """Another shift on the torus for each further source, so that lamps are not sampled in step."""
    turned = numbers + np.float32(0.381966 * source)
    return turned - np.floor(turned)


def project(basis: np.ndarray, radiance: np.ndarray) -> np.ndarray:
    """Sum over directions of ``basis`` (n, k) times ``radiance`` (n, m, 3): (m, k, 3)."""
    n, m, _ = radiance.shape
    return (basis.T @ radiance.reshape(n, m * 3)).reshape(-1, m, 3).transpose(1, 0, 2)
