"""The surface cache under other lamps and another world, without a new form-factor ray."""

from dataclasses import replace

import numpy as np

from ...progress import Progress
from ..context import LightContext
from ..parallel import chunks, parallel_for
from .light_changes import FEW_CHANGES, changed_sources
from .surface_cache import SurfaceCache, Traced
from .texel_light import ALL_SOURCES
from .texel_rows import TexelRows

# Points on texels at which lamps are sampled at a time.
POINTS = 1 << 14
# What was received before counts up to so many times: of next to nothing that was lit, nothing is to be learnt.
_MOST_BRIGHTER = 1e3


def relit_cache(cache: SurfaceCache, context: LightContext, progress: Progress) -> SurfaceCache:
    """The same texels and hits as in ``cache`` under the lamps and world of ``context``, for ``solve`` with ``bright`` False.

    Direct light is known as its mean over each texel alone: ``smooth`` is True throughout.
    """
    rows = replace(cache.rows, smooth=np.ones_like(cache.rows.smooth))
    other = cache.under(context, Traced(cache.table, cache.form_factors, rows))
    world_changed = context.environment is not cache.context.environment
    gone, came = changed_sources(cache.context, context)
    few = other.sources.count > ALL_SOURCES and len(gone) + len(came) <= FEW_CHANGES
    # The world is asked along the rays of a block; lamps, at fewer points of a texel than it has rays, of more texels at a time.
    spans = cache.form_factors.spans() if world_changed else chunks(cache.count, POINTS // cache.lamp_samples)

    def work(i):
        texels = np.arange(spans[i].start, spans[i].stop)
        slots = cache.table.slots[texels]
        surface = cache.sampler.on_texels(texels, cache.points if world_changed else cache.lamp_samples)
        sky = rows.irradiance_sky[texels]
        if world_changed:
            sky = other.sky_again(slots, surface, i)[0]
        limited = other.light.limited(slots, surface)
        if other.sources.count <= ALL_SOURCES:
            return sky, other.light.mean(range(other.sources.count), slots, surface), limited
        if not few:
            return sky, other.light.direct(slots, surface).irradiance, limited
        direct = rows.irradiance_direct[texels] + other.light.mean(came, slots, surface)
        return sky, direct - cache.light.mean(gone, slots, surface), limited

    parts = parallel_for(work, len(spans), context.threads, progress, "direct light on the surface cache")
    none = TexelRows.none(len(other.light.limits))
    lasts = none.irradiance_sky, none.irradiance_direct, none.irradiance_limited
    sky, direct, limited = (np.concatenate([*(part[column] for part in parts), last]) for column, last in enumerate(lasts))
    other.rows = replace(rows, irradiance_sky=sky, irradiance_direct=direct, irradiance_limited=limited)
    return other


def light_again(cache: SurfaceCache, progress: Progress) -> None:
    """Find all light that comes to the texels of ``cache`` from elsewhere anew, after ``SurfaceCache.under`` made it for another
    context: what a bake in that context would find, for ``solve``. Rays are traced again only where surfaces or media shine, or a
    world through what colours it. Raises Cancelled."""
    context, rows, spans = cache.context, cache.rows, cache.form_factors.spans()
    # Form factors keep colours in 16 bits.
    coloured = bool(cache.form_factors.tints) and not context.environment.is_black
    traced = context.surfaces.has_emission or cache.walks_media or coloured

    def work(i):
        texels = np.arange(spans[i].start, spans[i].stop)
        if traced:
            return cache.met_again(texels)
        slots, surface = cache.table.slots[texels], cache.sampler.on_texels(texels, cache.points)
        none = np.zeros((len(texels), 3), np.float32)
        sky, halves = (none, none) if context.environment.is_black else cache.sky_again(slots, surface, i)
        return TexelRows(sky, none, *cache.light.direct(slots, surface), rows.albedo[texels], rows.translucency[texels],
                         rows.opposite[texels], cache.light.limited(slots, surface), halves)

    parts = parallel_for(work, len(spans), context.threads, progress, "light on the surface cache")
    found = TexelRows.none(len(cache.light.limits), cache.light.choices).followed_by(parts)
    cache.rows = replace(found, opposite=rows.opposite)


def thought_to_receive(cache: SurfaceCache, before: SurfaceCache) -> np.ndarray:
    """What the texels of ``cache`` may receive (n + 1, 3) from one another, by what they received in ``before``, which is solved:
    as much more as leaves all of them together."""
    fixed, known = (own.rows.irradiance_sky + own.rows.irradiance_emission for own in (cache, before))
    now, then = (np.abs(own.rows.leaving(light + own.rows.irradiance_direct)).sum(axis=0, dtype=np.float64)
                 for own, light in ((cache, fixed), (before, known)))
    share = np.minimum(now / np.maximum(then, 1e-30), _MOST_BRIGHTER)
    return np.maximum(before.irradiance_rest - known, 0) * share.astype(np.float32)
