"""Many lights at once on the surface cache: what texels receive of each, and what they make of it between them.

Neither form factors nor texels know the light, so every light is one more column of the right-hand side of one system
(Sloan, Kautz and Snyder, "Precomputed Radiance Transfer", SIGGRAPH 2002, §5: the transfer of interreflected light):
E = E₀ + F·ρE, column by column. Columns are colours (n + 1, C, 3), and may be negative, as spherical harmonics are.
"""

from typing import Protocol

import numpy as np

from ...numerics import sh
from ...progress import Progress
from ..context import LightContext
from ..parallel import parallel_for
from ..paths.sources import Sources
from .solver import MAX_ITERATIONS, Anderson
from .surface_cache import SurfaceCache
from .texel_light import TexelLight

# Columns that are iterated together: rows of 384 bytes are read as fast as memory allows, and a block's sums stay in the cache.
COLUMNS_AT_ONCE = 32


def sky_columns(cache: SurfaceCache, order: int, progress: Progress) -> np.ndarray:
    """Irradiance (n + 1, (order + 1)², 3) float32 on the texels of skies whose radiance is each of the spherical harmonics in turn,
    with a last row of zeros."""
    spans, count = cache.form_factors.spans(), sh.coefficient_count(order)

    def work(i):
        texels = np.arange(spans[i].start, spans[i].stop)
        slots, n = cache.table.slots[texels], len(texels)
        directions, escaped, tints = cache.escaped_again(slots, cache.sampler.on_texels(texels, cache.points), i)
        basis = np.zeros((cache.rays * n, count, 1 if tints is None else 3), np.float32)
        basis[escaped] = sh.evaluate(directions[escaped], order)[:, :, None]
        if tints is not None:
            basis[escaped] *= tints[escaped, None].astype(np.float32)
        mean = basis.reshape(cache.rays, n, count, -1).sum(axis=0) * np.float32(np.pi / cache.rays)
        return np.broadcast_to(mean, (n, count, 3))

    parts = parallel_for(work, len(spans), cache.context.threads, progress, "the sky on surfaces")
    return np.concatenate([*parts, np.zeros((1, count, 3), np.float32)])


def source_columns(cache: SurfaceCache, context: LightContext, samples: int, progress: Progress) -> np.ndarray:
    """Direct irradiance (n + 1, C, 3) float32 on the texels of each of the C lamps of ``context``, which has the surfaces of the
    ``cache``, from up to ``samples`` points of every texel; a last row of zeros."""
    light = TexelLight(Sources(context), context.surfaces, cache.numbers, min(samples, cache.points), 0.0)
    spans, count = cache.form_factors.spans(), context.lamps.count

    def work(i):
        texels = np.arange(spans[i].start, spans[i].stop)
        slots, surface = cache.table.slots[texels], cache.sampler.on_texels(texels, min(samples, cache.points))
        result = np.empty((len(texels), count, 3), np.float32)
        for lamp in range(count):
            result[:, lamp] = light.mean([lamp], slots, surface)
        return result

    parts = parallel_for(work, len(spans), context.threads, progress, "suns and lamps on surfaces")
    return np.concatenate([*parts, np.zeros((1, count, 3), np.float32)])


class Kept(Protocol):
    """Where finished parts are left (techniques.base.Checkpoint)."""

    @property
    def due(self) -> bool:
        """Whether to ``save`` now."""

    def save(self, name: str, arrays: dict[str, np.ndarray]) -> None:
        """Store ``arrays`` under ``name``."""

    def load(self, name: str) -> dict[str, np.ndarray] | None:
        """What was stored under ``name``, or None."""


def solve_columns(cache: SurfaceCache, source: np.ndarray, bounces: int | None, tolerance: float, progress: Progress,
                  kept: Kept | None = None) -> np.ndarray:
    """Irradiance (n + 1, C, 3) float32 of texels that receive ``source`` (n + 1, C, 3) from elsewhere, with what they then
    receive of each other.

    ``bounces`` and ``tolerance`` as in ``SurfaceCache.solve``; the tolerance holds for each column by itself. Columns that were
    solved before an interruption are taken from ``kept``. Raises Cancelled.
    """
    result, columns = np.empty_like(source), source.shape[1]
    for first in range(0, columns, COLUMNS_AT_ONCE):
        part = slice(first, min(first + COLUMNS_AT_ONCE, columns))
        found = None if kept is None else kept.load(f"columns{first}")
        if found is not None:
            result[:, part] = found["irradiance"]
            continue
        flat = np.ascontiguousarray(source[:, part]).reshape(len(source), -1)
        span = progress.span(part.start / columns, part.stop / columns)
        result[:, part] = _solve(cache, flat, bounces, tolerance, span).reshape(len(source), -1, 3)
        if kept is not None and kept.due:
            kept.save(f"columns{first}", {"irradiance": np.ascontiguousarray(result[:, part])})
    return result


def leaving_columns(cache: SurfaceCache, irradiance: np.ndarray) -> np.ndarray:
    """Radiance (n + 1, C, 3) that texels send out which receive ``irradiance`` (n + 1, C, 3)."""
    rows = cache.rows
    radiance = irradiance * (rows.albedo / np.float32(np.pi))[:, None]
    if rows.passing.size:
        passed = (rows.translucency[rows.passing] / np.float32(np.pi))[:, None]
        radiance[rows.passing] += passed * irradiance[rows.opposite[rows.passing, 0]]
    return radiance


def _solve(cache: SurfaceCache, source: np.ndarray, bounces: int | None, tolerance: float, progress: Progress) -> np.ndarray:
    factors, by_angle = cache.form_factors, cache.context.surfaces.albedo_by_angle.table
    spans, count = factors.spans(), source.shape[1] // 3
    passes = MAX_ITERATIONS if bounces is None else max(0, bounces - 1)
    received = np.zeros_like(source)

    def gather(i):
        total = np.zeros((factors.hits[i].shape[1], count, 3), np.float32)
        for ray, hits in enumerate(factors.hits[i]):
            seen = np.take(radiance, hits, axis=0, mode="wrap").reshape(total.shape)
            if factors.angles:
                seen *= by_angle[factors.angles[i][ray]][:, None]
            if factors.tints:
                seen *= factors.tints[i][ray][:, None]
            total += seen
        received[spans[i]] = total.reshape(len(total), -1) * np.float32(np.pi / factors.rays)

    def leaving(irradiance):
        return leaving_columns(cache, irradiance.reshape(len(source), -1, 3)).reshape(source.shape)

    current, history = leaving(source), Anderson(signed=True)
    for iteration in range(passes):
        # Extrapolated columns come column by column in memory; rows are what is read.
        radiance = np.ascontiguousarray(current)
        parallel_for(gather, len(spans), cache.context.threads)
        following = leaving(source + received)
        change = np.abs(following - current).mean(axis=0, dtype=np.float64)
        scale = np.abs(following).mean(axis=0, dtype=np.float64)
        progress.step(min(iteration / passes if bounces is not None else 1.0 - 0.8**iteration, 0.99), "light between surfaces")
        if bounces is None and np.all(change <= tolerance * scale):
            break
        current = following if bounces is not None else history.step(current, following)
    return source + received
