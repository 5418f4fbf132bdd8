"""Rays from probes: traced in one pass, shaded from the surface cache in the next, projected onto SH.

A work item is a group of neighbouring probes that share their directions: SH projection is then one matrix product, and rays
of one direction from nearby points find the same part of the BVH. Groups are scrambled independently of one another.
"""

from dataclasses import dataclass

import numpy as np

from ...numerics import octahedral, sh
from ...numerics.sampling import hash_u32, sobol_owen, sphere_from_square
from ...transport.context import LightContext
from ...transport.rays import Hits
from ...transport.surface_cache import ALL_SOURCES, CHOICES, SurfaceCache
from ...transport.vectors import dot

# Probes that share a set of directions.
GROUP = 64
# One emitter (and one bright world) sample for so many rays.
RAYS_PER_LIGHT_SAMPLE = 8
# Sharpness of the cosine-power filter that spreads ray distances over a visibility tile (Majercik et al. 2019).
_VISIBILITY_SHARPNESS = 50.0
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
    """What an item's rays met: hits (n·m,), direction by direction, the slot of each (−1: none), and the directions (n, 3)."""

    hits: Hits
    slots: np.ndarray
    directions: np.ndarray


@dataclass(eq=False)
class Gathered:
    """An item's sums: ``sh`` (m, k, 3) the sum over its rays of 4π·L·Y (divide by the number of rays), and for visibility the
    weighted sums (T², m, 2) of distance and squared distance with their weights (T²,)."""

    sh: np.ndarray
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
        directions = sphere_from_square(self._numbers(item, 2))
        m = len(item.probes)
        rays = np.repeat(directions, m, axis=0)
        origins = np.tile(self._placement.positions[item.probes], (len(directions), 1))
        hits = self._context.tracer.intersect(origins, rays)
        rows = np.flatnonzero(hits.primitive >= 0)
        primitive = hits.primitive[rows]
        front = dot(self._context.geometry.normals_world[primitive], rays[rows]) < 0
        slots = np.full(len(rays), -1, np.int32)
        slots[rows] = self._cache.layout.slots(primitive, hits.u[rows], hits.v[rows], front)
        return Traced(hits, slots, directions)

    def _numbers(self, item: Item, last: int, first: int = 0) -> np.ndarray:
        points = sobol_owen(item.last - item.first, last, hash_u32(self._seed, item.group), start=item.first)
        return points[:, first:]

    def shade(self, item: Item, traced: Traced) -> Gathered:
        """Radiance along the traced rays, projected."""
        m, n = len(item.probes), item.last - item.first
        radiance = np.zeros((n, m, 3), np.float32)
        flat = radiance.reshape(-1, 3)
        rows = np.flatnonzero(traced.slots >= 0)
        if rows.size:
            flat[rows] = self._radiance_of_hits(item, traced, rows)
        if not self._context.environment.is_black:
            sky = self._context.environment.base_radiance(traced.directions)
            missed = (traced.slots < 0).reshape(n, m)
            radiance += np.where(missed[:, :, None], sky[:, None, :], 0)
        basis = sh.evaluate(traced.directions, self._order)
        projected = (basis.T @ radiance.reshape(n, m * 3)).reshape(-1, m, 3).transpose(1, 0, 2) * np.float32(4.0 * np.pi)
        projected = projected + self._light_samples(item)
        return Gathered(projected, *self._visibility(item, traced))

    def _radiance_of_hits(self, item: Item, traced: Traced, rows: np.ndarray) -> np.ndarray:
        geometry, surfaces, cache = self._context.geometry, self._context.surfaces, self._cache
        hits, m = traced.hits, len(item.probes)
        primitive, u, v, t = hits.primitive[rows], hits.u[rows], hits.v[rows], hits.t[rows]
        texel = cache.texel(traced.slots[rows])
        result = np.zeros((len(rows), 3), np.float32)
        if self._bounces != 0:
            irradiance = np.take(cache.irradiance_rest, texel, axis=0, mode="wrap")
            if cache.sources.count:
                irradiance = irradiance + self._direct(item, traced, rows, primitive, u, v, t, texel)
            albedo = surfaces.albedo(primitive, u, v) if self._albedo is None else self._albedo[primitive]
            result = irradiance * albedo * np.float32(1.0 / np.pi)
        if surfaces.has_emission:
            emissive = np.flatnonzero(surfaces.emissive[geometry.material[primitive]])
            if emissive.size:
                found = primitive[emissive]
                emission = surfaces.emission(found, u[emissive], v[emissive])
                if self._sample_emitters:
                    directions = traced.directions[rows[emissive] // m]
                    cosine = np.maximum(np.abs(dot(geometry.normals_world[found], directions)), 1e-6)
                    pdf = self._context.emitters.pdf_area(found) * t[emissive] ** 2 / cosine
                    emission = emission * (_UNIFORM_PDF / (_UNIFORM_PDF + pdf / RAYS_PER_LIGHT_SAMPLE))[:, None]
                result[emissive] += emission
        return result

    def _direct(self, item, traced, rows, primitive, u, v, t, texel) -> np.ndarray:
        """Irradiance (n, 3) of lamps and bright sky at hits: one shadow ray for each of a few sources, or for one chosen."""
        geometry, surfaces, cache = self._context.geometry, self._context.surfaces, self._cache
        m = len(item.probes)
        step, probe = np.divmod(rows, m)
        directions = traced.directions[step]
        points = self._placement.positions[item.probes][probe] + directions * t[:, None]
        side = np.where(traced.slots[rows] & 1, np.float32(1), np.float32(-1))[:, None]
        face = geometry.normals_world[primitive] * side
        shading = surfaces.shading_normal(primitive, u, v) * side if surfaces.has_smooth_normals else face
        if cache.sources.count <= ALL_SOURCES:
            numbers = None if cache.sources.is_delta.all() else self._shifted(item, 2, 4)
            total = np.zeros((len(rows), 3), np.float32)
            for source in range(cache.sources.count):
                uv = np.zeros((len(rows), 2), np.float32) if cache.sources.is_delta[source] else _turn(numbers[rows], source)
                total += cache.sources.irradiance(source, points, shading, face, t, uv)
            return total
        numbers = self._shifted(item, 2, 5)[rows]
        column = np.minimum((numbers[:, 2] * CHOICES).astype(np.int64), CHOICES - 1)
        source, weight = cache.choices[texel, column], cache.choice_weights[texel, column]
        return cache.sources.irradiance(source, points, shading, face, t, numbers[:, :2]) * weight[:, None]

    def _shifted(self, item: Item, first: int, last: int) -> np.ndarray:
        """(n·m, last − first): the sequence's further dimensions, shifted on the torus for each probe by a hash."""
        shift = np.stack([hash_u32(item.probes, d, self._seed, 17) for d in range(first, last)], axis=-1)
        numbers = self._numbers(item, last, first)[:, None] + (shift >> np.uint32(8)).astype(np.float32) * np.float32(2.0**-24)
        return (numbers - np.floor(numbers)).reshape(-1, last - first)

    def _light_samples(self, item: Item) -> np.ndarray | np.float32:
        """Sums (m, k, 3), in the units of Gathered.sh, of emitters and bright sky seen straight from the probes."""
        context, rays = self._context, item.last - item.first
        n, m = rays // RAYS_PER_LIGHT_SAMPLE, len(item.probes)
        bright = context.environment.bright
        if n == 0 or not (self._sample_emitters or bright.count):
            return np.float32(0)
        total = np.zeros((m, sh.coefficient_count(self._order), 3), np.float32)
        start = item.first // RAYS_PER_LIGHT_SAMPLE
        origins = np.tile(self._placement.positions[item.probes], (n, 1))
        if bright.count:
            xi = sobol_owen(n, 2, hash_u32(self._seed, item.group, 3), start=start)
            directions, weight = bright.sample(xi)
            free = ~context.tracer.occluded(origins, np.repeat(directions, m, axis=0))
            seen = np.where(free.reshape(n, m, 1), weight[:, None, :], 0).astype(np.float32)
            basis = sh.evaluate(directions, self._order)
            total += (basis.T @ seen.reshape(n, m * 3)).reshape(-1, m, 3).transpose(1, 0, 2) * np.float32(rays / n)
        if self._sample_emitters:
            xi = sobol_owen(n, 3, hash_u32(self._seed, item.group, 4), start=start)
            target, normal, emission, pdf_area, _ = context.emitters.sample(xi)
            towards = np.repeat(target, m, axis=0) - origins
            distance = np.sqrt(np.maximum(dot(towards, towards), 1e-20))
            directions = towards / distance[:, None]
            cosine = np.maximum(np.abs(dot(np.repeat(normal, m, axis=0), directions)), 1e-6)
            pdf = np.repeat(pdf_area, m) * distance**2 / cosine
            free = ~context.tracer.occluded(origins, directions, distance * np.float32(1 - 1e-4))
            # The balance heuristic over rays and samples together, with both counted per ray.
            weight = np.where(free, 1.0 / (_UNIFORM_PDF + pdf / RAYS_PER_LIGHT_SAMPLE), 0)
            seen = np.repeat(emission, m, axis=0) * weight[:, None]
            basis = sh.evaluate(directions, self._order)
            total += np.einsum("nmk,nmc->mkc", basis.reshape(n, m, -1), seen.reshape(n, m, 3).astype(np.float32))
        return total

    def _visibility(self, item: Item, traced: Traced) -> tuple[np.ndarray, np.ndarray]:
        m, n = len(item.probes), item.last - item.first
        reach = self._placement.reach[item.probes]
        t = np.minimum(np.where(traced.slots < 0, np.inf, traced.hits.t).reshape(n, m), reach)
        cosine = np.maximum(traced.directions @ self._tile_directions.T, 0)
        weight = (cosine ** np.float32(_VISIBILITY_SHARPNESS)).astype(np.float32)
        both = np.concatenate([t, t * t], axis=1)
        return (weight.T @ both).reshape(-1, 2, m).transpose(0, 2, 1), weight.sum(axis=0)


def _turn(numbers: np.ndarray, source: int) -> np.ndarray:
    """Another shift on the torus for each further source, so that lamps are not sampled in step."""
    turned = numbers + np.float32(0.381966 * source)
    return turned - np.floor(turned)
