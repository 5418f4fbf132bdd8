"""The path-traced reference: unbiased incident radiance, irradiance and SH of it, with next-event estimation.

It is the yardstick for every technique, so it takes no short cuts: no cache, no clamp, no limit but Russian roulette
(and, in fog without end, which would let no path go, MOST_TURNS vertices).
What arrives is what a probe holds (docs/physics.md §1): light bounced at least once, emission and the world, and of lamps the
direct light of those alone that are set to it (``Lamp.bake``).

Lamps and bright world patches are reached by shadow rays alone, the rest of the world by scattered rays alone, emissive triangles
by both under the balance heuristic (Veach and Guibas 1995). Every number depends on the seed and the ray alone, so results are
the same for any number of threads.
"""

from typing import NamedTuple

import numpy as np

from ...numerics import sh
from ...numerics.sampling import about, cosine_hemisphere, hash_u32, sphere_from_square
from ...progress import Progress
from ...scene.lights import held_directly
from ..context import LightContext
from ..parallel import chunks, parallel_for
from ..rays.tracer import Hits, offset_origins
from ..vectors import dot, normalized
from .direct import NO_DENSITY, Receiver, direct_irradiance, emitter_weight, sample_environment
from .numbers import LAMP, ROULETTE, SCATTER, PathNumbers
from .scattering import MOST_TURNS
from .sources import Sources
from .tracking import scatter_in_media
from .wavefront import Vertices, Wavefront

# Rays per unit of work: a path keeps some thirty arrays alive.
PATH_CHUNK = 1 << 14
# Russian roulette begins at this vertex and lets no path go on with less than this probability.
ROULETTE_DEPTH, ROULETTE_FLOOR = 4, 0.05
# Independent scrambles from which standard errors are estimated.
REPLICATES = 8


class Estimate(NamedTuple):
    """A ``mean`` and its ``standard_error``, arrays of the same shape, from independent randomizations."""

    mean: np.ndarray
    standard_error: np.ndarray


def trace_radiance(context: LightContext, origins: np.ndarray, directions: np.ndarray, *, bounces: int | None = None,
                   seed: int = 0) -> np.ndarray:
    """One unbiased estimate of the radiance (n, 3) [W·sr⁻¹·m⁻²] arriving at ``origins`` (n, 3) from ``directions`` (n, 3).

    ``bounces`` is the number of reflections off surfaces; 0 leaves emission and the world, None has no limit.
    """
    origins = np.ascontiguousarray(origins, np.float32)
    directions = normalized(np.ascontiguousarray(directions, np.float32))
    spans = chunks(len(origins), PATH_CHUNK)

    def work(i):
        span = spans[i]
        rows = np.arange(span.start, span.stop, dtype=np.uint32)
        numbers = PathNumbers(hash_u32(seed, rows), np.zeros(len(rows), np.uint32))
        density = np.full(len(rows), NO_DENSITY, np.float32)
        return _walk(context, origins[span], directions[span], density, numbers, bounces, whole_world=True)

    parts = parallel_for(work, len(spans), context.threads)
    return np.concatenate(parts) if parts else np.zeros((0, 3), np.float32)


def irradiance_at(context: LightContext, points: np.ndarray, normals: np.ndarray, samples: int, *, bounces: int | None = None,
                  seed: int = 0, direct: bool = False, progress: Progress | None = None) -> Estimate:
    """Irradiance (n, 3) [W·m⁻²] at ``points`` (n, 3) on surfaces with unit ``normals`` (n, 3).

    ``samples`` paths a point, rounded up to a multiple of ``REPLICATES``; ``direct`` adds the lamps' own light, also of those of
    which probes hold the bounces only.
    """
    normals = np.ascontiguousarray(normals, np.float32)
    points = offset_origins(np.ascontiguousarray(points, np.float32), normals, normals)
    lamps = held_directly(context.scene.lights, direct)

    def estimate(rows, numbers):
        p, n = points[rows], normals[rows]
        light = direct_irradiance(context, p, Receiver(n, n), numbers, 0, lamps)
        directions, cosine = _scatter(n, numbers.draw(0, SCATTER, 2))
        density = np.maximum(cosine, 1e-7) * np.float32(1.0 / np.pi)
        radiance = _walk(context, p, directions, density, numbers, bounces)
        return (light + np.float32(np.pi) * radiance)[:, None]

    result = _replicated(context, len(points), samples, seed, 1, estimate, progress, "irradiance")
    return Estimate(result.mean[:, 0], result.standard_error[:, 0])


def probe_sh(context: LightContext, points: np.ndarray, order: int, samples: int, *, bounces: int | None = None, seed: int = 0,
             progress: Progress | None = None) -> Estimate:
    """SH coefficients (n, (order + 1)², 3) of the radiance arriving at free ``points`` (n, 3), in the convention of numerics.sh.

    ``samples`` paths a point, rounded up to a multiple of ``REPLICATES``.
    """
    points = np.ascontiguousarray(points, np.float32)
    uniform = np.float32(0.25 / np.pi)
    lamps, sources = held_directly(context.scene.lights), Sources(context)

    def estimate(rows, numbers):
        p = points[rows]
        directions = sphere_from_square(numbers.draw(0, SCATTER, 2))
        radiance = _walk(context, p, directions, np.full(len(p), uniform, np.float32), numbers, bounces) / uniform
        result = sh.evaluate(directions, order)[:, :, None] * radiance[:, None]
        for light, radiance in sample_environment(context, p, numbers, 0, uniform):
            result += sh.evaluate(light, order)[:, :, None] * radiance[:, None]
        uv = numbers.draw(0, LAMP, 3)[:, 1:] if lamps else None
        for lamp in lamps:
            light, irradiance = sources.facing_irradiance(lamp, p, uv)
            result += sh.evaluate(light, order)[:, :, None] * irradiance[:, None]
        return result

    return _replicated(context, len(points), samples, seed, sh.coefficient_count(order), estimate, progress, "reference probes")


def _replicated(context, count, samples, seed, width, estimate, progress, label) -> Estimate:
    """Mean and standard error over ``REPLICATES`` independent scrambles of what ``estimate(rows, numbers)`` gives each path."""
    per_replicate = -(-max(1, samples) // REPLICATES)
    block = min(per_replicate, PATH_CHUNK)
    points_per_item = max(1, PATH_CHUNK // block)
    items = [(replicate, span, first) for replicate in range(REPLICATES) for span in chunks(count, points_per_item)
             for first in range(0, per_replicate, block)]

    def work(i):
        replicate, span, first = items[i]
        rows = np.arange(span.start, span.stop)
        index = np.arange(first, min(first + block, per_replicate), dtype=np.uint32)
        flat = np.repeat(rows, len(index))
        numbers = PathNumbers(hash_u32(seed, replicate, flat), np.tile(index, len(rows)))
        return estimate(flat, numbers).reshape(len(rows), len(index), width, 3).sum(axis=1, dtype=np.float64)

    sums = np.zeros((REPLICATES, count, width, 3))
    for (replicate, span, _), part in zip(items, parallel_for(work, len(items), context.threads, progress, label), strict=True):
        sums[replicate, span] += part
    means = sums / per_replicate
    error = means.std(axis=0, ddof=1) / np.sqrt(REPLICATES)
    return Estimate(means.mean(axis=0).astype(np.float32), error.astype(np.float32))


def _walk(context, origins, directions, density, numbers, bounces, whole_world=False) -> np.ndarray:
    """Radiance (n, 3) along rays drawn with solid-angle ``density`` (n,).

    ``NO_DENSITY`` marks rays that no light sampling competes with. ``whole_world`` lets the first segment see the bright patches.
    """
    radiance = np.zeros((len(origins), 3), np.float32)
    surfaces, depth = context.surfaces, 0
    # Fog without end that absorbs nothing would never let a path go.
    endless = any(medium.fills_space for medium in context.scene.media)
    paths = Wavefront(np.arange(len(origins)), origins, directions, np.ones((len(origins), 3), np.float32), numbers, density)
    while paths.rows.size:
        hits = _met(context, paths, depth)
        scattered = None
        if not context.media.is_empty:
            through, scattered, throughput = scatter_in_media(context, paths, hits.t, radiance, depth + 1,
                                                              bounces is not None and depth >= bounces)
            hits, paths = hits.take(through), paths.take(through).carrying(throughput)
        if hits.tint is not None:
            paths = paths.carrying(paths.throughput * hits.tint)
        missed = np.flatnonzero(hits.primitive < 0)
        if missed.size and not context.environment.is_black:
            look_up = context.environment.radiance if whole_world and depth == 0 else context.environment.base_radiance
            radiance[paths.rows[missed]] += paths.throughput[missed] * look_up(paths.directions[missed])
        found, met = Vertices.of(hits, paths.directions)
        paths = paths.take(found)
        if surfaces.has_emission:
            weight = emitter_weight(context, met, paths.density)
            if depth > 0 and context.links.restricts_emitters:
                found = context.links.found_by_rays(context.geometry.instance[met.primitive], paths.instance)
                weight = weight * (found if context.media.is_empty else found | (paths.instance < 0))
            emitted = surfaces.emission(met.primitive, met.u, met.v, met.cosine(context))
            radiance[paths.rows] += paths.throughput * emitted * weight[:, None]
        if (bounces is not None and depth >= bounces) or (endless and depth >= MOST_TURNS):
            break
        depth += 1
        albedo = surfaces.albedo(met.primitive, met.u, met.v, met.cosine(context))
        carried, through = met.choose_side(context, albedo, met.cosine(context), paths.numbers, depth)
        kept, gain = _survivors(carried, paths.numbers, depth)
        throughput = (paths.throughput * carried)[kept] * gain[:, None]
        paths, met = paths.take(kept), met.take(kept)
        points, geometric, shading = met.facing(context, None if through is None else through[kept])
        light = direct_irradiance(context, points, Receiver(shading, geometric, met.primitive), paths.numbers, depth)
        radiance[paths.rows] += throughput * light * np.float32(1.0 / np.pi)
        directions, cosine = _scatter(shading, paths.numbers.draw(depth, SCATTER, 2))
        density = np.maximum(cosine, 1e-7) * np.float32(1.0 / np.pi)
        # Interpolated normals may scatter into the surface itself; nothing comes from there.
        left = context.geometry.instance[met.primitive]
        paths = Wavefront(paths.rows, points, directions, throughput, paths.numbers, density, left)
        paths = paths.take(np.flatnonzero(dot(geometric, directions) > 0))
        if scattered is not None:
            paths = Wavefront.join([paths, scattered], paths)
    return radiance


def _met(context, paths: Wavefront, depth: int) -> Hits:
    """What ``paths`` meet: those that media have scattered may meet other surfaces than those that surfaces have."""
    tracers = context.bare
    if depth == 0 or tracers.scatter is tracers.diffuse:
        return (tracers.view if depth == 0 else tracers.diffuse).intersect(paths.origins, paths.directions)
    scattered = paths.instance < 0
    parts = [(np.flatnonzero(chosen), tracer) for chosen, tracer in ((~scattered, tracers.diffuse), (scattered, tracers.scatter))]
    hits = [tracer.intersect(paths.origins[rows], paths.directions[rows]) for rows, tracer in parts]
    order = np.argsort(np.concatenate([rows for rows, _ in parts]))
    tinted = any(part.tint is not None for part in hits)
    tints = [np.ones((len(part.t), 3), np.float32) if part.tint is None else part.tint for part in hits]
    return Hits(*(np.concatenate([getattr(part, name) for part in hits])[order] for name in ("primitive", "u", "v", "t")),
                np.concatenate(tints)[order] if tinted else None)


def _survivors(albedo, numbers, depth) -> tuple[np.ndarray, np.ndarray]:
    """Paths that go on (their rows) and the gain that makes up for those that do not.

    Roulette by albedo, not by throughput: the survivors' throughput stays small, and the tail of the series adds little noise.
    """
    strength = albedo.max(axis=1)
    if depth < ROULETTE_DEPTH:
        kept = np.flatnonzero(strength > 0)
        return kept, np.ones(len(kept), np.float32)
    chance = np.where(strength > 0, np.clip(strength, ROULETTE_FLOOR, 1.0), 0.0).astype(np.float32)
    kept = np.flatnonzero(numbers.draw(depth, ROULETTE, 1)[:, 0] < chance)
    return kept, 1.0 / chance[kept]


def _scatter(normals, u) -> tuple[np.ndarray, np.ndarray]:
    """Cosine-distributed directions (n, 3) about ``normals`` (n, 3), and their cosines."""
    local = cosine_hemisphere(u)
    return normalized(about(normals, local)), local[:, 2]
