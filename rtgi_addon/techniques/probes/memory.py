"""What a bake of probes takes to work with: the surface cache, and the rays that are held between tracing and shading.

Measured as in scene/memory.py. How many texels rays will reach is told by a few of them (reach.py); how many rays the probes will
want is not known before they have a few: until then a mean of the samples stands for it. Every batch is checked, too, before its
memory is asked for.
"""

import numpy as np

from ...transport.cache.surface_cache import SurfaceCache
from ...transport.parallel import thread_count
from .adaptive import FIRST_ROUND, SLOPE
from .reach import Reach
from .settings import ProbeSettings

# A hit between tracing and shading; a ray that is kept for relighting.
BYTES_PER_HIT, BYTES_PER_KEPT_RAY = 32, 7
# Stack and temporaries of a thread: 2.3 to 2.7 MiB from one to eight of them in three samples, more where they all work at once.
BYTES_PER_THREAD = 4 << 20
# Where texels lie on a triangle.
BYTES_PER_TRIANGLE = 190
# More temporaries of a thread where lamps are chosen among many.
BYTES_OF_A_CHOICE = 20 << 20
# Rays that a probe of the samples takes to an error of 1 %: 500 to 3,500 in rooms and courts, up to 16,000 in the atrium.
USUAL_RAYS, USUAL_ERROR = 2000, 0.01


def working_bytes(cache: SurfaceCache, settings: ProbeSettings, reach: Reach, probes: int, batch_rays: int,
                  most_kept: int) -> dict[str, int]:
    """Bytes by what takes them for a bake of ``probes`` probes whose rays meet what ``reach`` says of the cache, that holds up to
    ``batch_rays`` rays at a time and keeps up to ``most_kept`` for relighting."""
    thread = BYTES_PER_THREAD + (BYTES_OF_A_CHOICE if cache.chooses_sources else 0)
    layout = BYTES_PER_TRIANGLE * cache.context.geometry.count
    return {"the surface cache": layout + cache.bytes_of(reach.texels), "threads": thread * thread_count(cache.context.threads),
            "rays": ray_bytes(probes * expected_rays(settings), reach.hits, batch_rays, most_kept)}


def ray_bytes(rays: float, hits: float, batch_rays: int, most_kept: int) -> int:
    """Bytes that ``rays`` in all take, of which the share ``hits`` meets something, up to ``batch_rays`` are held at a time and up
    to ``most_kept`` kept."""
    # A bake goes in rounds, of which the largest has about half of all rays.
    return int(BYTES_PER_HIT * hits * min(rays / 2, batch_rays) + BYTES_PER_KEPT_RAY * min(rays, most_kept))


def expected_rays(settings: ProbeSettings) -> float:
    """Rays of a probe: as set, or what one of the samples takes to the target error."""
    if settings.rays is not None:
        return float(settings.rays)
    return float(np.clip(USUAL_RAYS * (USUAL_ERROR / settings.error) ** (1.0 / SLOPE), 2 * FIRST_ROUND, settings.max_rays))

