"""What a bake of probes takes to work with: the surface cache, and the rays that are held between tracing and shading.

Measured as in scene/memory.py. How many texels rays will reach is told by a few of them (reach.py); how many rays the probes will
want is not known before they have a few: until then a mean of the samples stands for it. Every batch is checked, too, before its
memory is asked for.

Two moments may take most, and what is there at the one is not at the other: the first rays, whose hits bring nearly all texels into
use at once, and the largest round, when the cache holds no more than what it keeps. Texels that are found as late as that ask for
themselves.
"""

from typing import NamedTuple

import numpy as np

from ...transport.cache.memory import kept_bytes, traced_bytes
from ...transport.cache.surface_cache import SurfaceCache
from ...transport.context import LightContext
from ...transport.parallel import thread_count
from .adaptive import FIRST_ROUND, SLOPE
from .reach import Reach
from .settings import ProbeSettings

# A hit between tracing and shading, and more for its albedo where that varies within triangles; a ray's tint where anything tints.
BYTES_PER_HIT, BYTES_PER_ALBEDO, BYTES_PER_TINT = 32, 12, 12
# A ray that is kept for relighting, with its share of a direction; more for one that escaped, and for an albedo or a tint.
BYTES_PER_KEPT_RAY, BYTES_PER_KEPT_ESCAPE, BYTES_PER_KEPT_COLOUR = 7, 4, 6
# What a probe's first rays found (spreading.py), with what is being put together of it.
BYTES_OF_FIRST_RAYS = 4600
# Stack and temporaries of a thread: 2.3 to 2.7 MiB from one to eight of them in three samples, more where they all work at once.
BYTES_PER_THREAD = 4 << 20
# Where texels lie on a triangle.
BYTES_PER_TRIANGLE = 190
# More temporaries of a thread where lamps are chosen among many.
BYTES_OF_A_CHOICE = 20 << 20
# Rays that a probe of the samples takes to an error of 1 %: the median, of 500 to 11,500.
USUAL_RAYS, USUAL_ERROR = 1750, 0.01
# The largest round's share of all rays, where rays are doubled until they are enough: ⅓ to ½ if all probes want as many, and
# the mean of that whatever power of two they end near.
LARGEST_ROUND = 0.42


class RayBytes(NamedTuple):
    """Bytes of a ray between tracing and shading (``held``), and of one that is ``kept`` for relighting."""

    held: float
    kept: float

    @staticmethod
    def of(context: LightContext, hits: float = 1.0) -> "RayBytes":
        """Those of rays in ``context`` of which the share ``hits`` meets something."""
        varies, tinted = not context.surfaces.has_uniform_albedo, context.surfaces.has_tint
        return RayBytes(
            hits * (BYTES_PER_HIT + BYTES_PER_ALBEDO * varies) + BYTES_PER_TINT * tinted,
            BYTES_PER_KEPT_RAY + BYTES_PER_KEPT_ESCAPE * (1.0 - hits) + BYTES_PER_KEPT_COLOUR * (int(varies) + int(tinted)))


def working_bytes(cache: SurfaceCache, settings: ProbeSettings, reach: Reach, probes: int, batch_rays: int,
                  most_kept: int) -> dict[str, int]:
    """Bytes by what takes them, when that is most, for a bake of ``probes`` probes whose rays meet what ``reach`` says of the
    cache, that holds up to ``batch_rays`` rays at a time and keeps up to ``most_kept`` for relighting."""
    context, each = cache.context, RayBytes.of(cache.context, reach.hits)
    first, rays = probes * (settings.rays or FIRST_ROUND) / 4, probes * expected_rays(settings)
    moments = [(traced_bytes(cache, reach.texels), int(each.held * min(first, batch_rays))),
               (kept_bytes(cache, reach.texels), ray_bytes(rays, each, batch_rays, most_kept))]
    of_cache, of_rays = max(moments, key=sum)
    thread = BYTES_PER_THREAD + (BYTES_OF_A_CHOICE if cache.chooses_sources else 0)
    return {"the surface cache": BYTES_PER_TRIANGLE * context.geometry.count + of_cache,
            "threads": thread * thread_count(context.threads),
            "rays": of_rays + (0 if settings.rays else BYTES_OF_FIRST_RAYS * probes)}


def later_bytes(context: LightContext, hits: float, rays: np.ndarray, needed: np.ndarray, batch_rays: int,
                most_kept: int) -> dict[str, int]:
    """Bytes that further rays take on top of what is there, until probes that have had ``rays`` (p,) have had as many as are
    ``needed`` (p,); ``hits`` and the others as above, ``most_kept`` with those that are kept already."""
    more = float(np.maximum(needed - rays, 0).sum())
    left = max(0, most_kept - int(rays.sum()))
    return {"rays": ray_bytes(more, RayBytes.of(context, hits), batch_rays, left, largest_round(rays, needed))}


def ray_bytes(rays: float, each: RayBytes, batch_rays: int, most_kept: int, largest: float | None = None) -> int:
    """Bytes that ``rays`` take, ``each`` of them so many, of which up to ``batch_rays`` of the ``largest`` round (None: its usual
    share) are held at a time and up to ``most_kept`` kept."""
    largest = LARGEST_ROUND * rays if largest is None else largest
    return int(each.held * min(largest, batch_rays) + each.kept * min(rays, most_kept))


def largest_round(rays: np.ndarray, needed: np.ndarray) -> float:
    """Rays of the largest of the rounds that double the ``rays`` (p,) of probes until they are as many as ``needed`` (p,)."""
    largest = 0
    while np.any(needed > rays):
        after = np.clip(2 * rays, None, np.maximum(needed, rays))
        largest, rays = max(largest, int((after - rays).sum())), after
    return largest


def expected_rays(settings: ProbeSettings) -> float:
    """Rays of a probe: as set, or what one of the samples takes to the target error."""
    if settings.rays is not None:
        return float(settings.rays)
    return float(np.clip(USUAL_RAYS * (USUAL_ERROR / settings.error) ** (1.0 / SLOPE), 2 * FIRST_ROUND, settings.max_rays))
