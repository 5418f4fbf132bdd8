"""What a surface cache's own rays leave of noise in the light that others read from it.

Each texel is known by R rays, a scrambled net that its slot shifts. Halves of them say different things, and what they differ by,
of texels that are shifted independently, goes through the weights of whoever reads them as the noise itself does: what the sum of
the differences comes to, squared, is that noise but for a factor.
"""

import numpy as np

from ...numerics.sampling import hash_u32
from ..parallel import parallel_for
from .surface_cache import SurfaceCache

# Tells which half is taken from the other apart from all other numbers of a slot.
_SIDES = 131


def half_differences(cache: SurfaceCache) -> np.ndarray:
    """By how much the irradiance (n + 1, 3) of the texels of ``cache``, which is solved, is more by the first half of the rays of
    each than by the second: of what comes to them at last, for the noise of what was reflected before has been averaged by then."""
    factors, rows = cache.form_factors, cache.rows
    radiance = np.zeros((cache.count + 1, 4), np.float32)
    radiance[:, :3] = rows.leaving(cache.irradiance_rest) * np.float32(1 / np.pi)
    result, spans = rows.halves + cache.bounce_halves, factors.spans()

    def gather(i):
        result[spans[i]] += factors.difference(i, radiance, cache.context.surfaces.albedo_by_angle.table)

    parallel_for(gather, len(spans), cache.context.threads)
    # What halves of all texels differ by alike, for they sample other parts of the brightly lit surfaces, is no noise: as often it
    # counts for one half as for the other.
    result[:-1][hash_u32(cache.table.slots, cache.numbers.seed, _SIDES) & 1 > 0] *= -1
    return result
