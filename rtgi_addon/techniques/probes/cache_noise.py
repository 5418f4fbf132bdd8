"""The noise that the surface cache's own rays leave in probes, which rays of probes do not show: all of them read the same texels.

By how much halves of each texel's rays differ is read by probes as light is, which gives the noise of the cache but for a factor
(transport/cache/half_differences.py). Rays are few, and each reads one texel where the sphere about a probe shows hundreds: two
sets of them read the differences by themselves, and the mean of the products of what they find has no such part.

What it does not tell is the noise of lamps that texels sample: where a room's light starts from one small patch of sun, that at the
patch's edge is most of it (of 0.8 % in a cube of 2 m with a patch of 0.5 m and texels of 0.1 m, 0.1 % is told).
"""

import numpy as np

from ...numerics.sampling import hash_u32
from ...progress import Progress
from ...transport.cache.half_differences import half_differences
from .gather import Gatherer, gather
from .gathering import items_of

# Probes that are asked, and rays of each.
PROBES, RAYS = 256, 128
# Variance of a mean over both halves of a texel's rays, relative to the squared difference of the halves' means: 0.14 to 0.27 on
# four samples, 32 and 64 rays a texel, from how probes of eight caches differ. Independent halves would give 0.25.
HALVES = 0.2
# Tells these rays apart from all others of a seed.
_STREAM = 0x0C4C


def cache_noise(gatherer: Gatherer, probes: np.ndarray, scale: np.ndarray, seed: int) -> float:
    """Mean square, over some of the ``probes`` (m,), of the cache's noise in their coefficients relative to ``scale`` (m,): the
    norm that errors of each are relative to. 0 where nothing is reflected."""
    if gatherer.settings.bounces == 0 or not probes.size:
        return 0.0
    chosen = np.arange(0, len(probes), -(-len(probes) // PROBES))
    asking, items = gatherer.seeded(int(hash_u32(seed, _STREAM))), items_of(probes[chosen], 1, RAYS)
    traced, texels, gathered = gather(asking, items, Progress(), "")
    differences = half_differences(gatherer.cache)
    found: dict[int, np.ndarray] = {}
    for item, hits, texel, sums in zip(items, traced, texels, gathered, strict=True):
        read = asking.read(item, hits, differences[texel], sums.albedo)
        for probe, part, first in zip(item.probes[:, 0].tolist(), read[:, 0], item.first, strict=True):
            found.setdefault(probe, np.zeros((2, *part.shape)))[int(first >= RAYS // 2)] += part
    first, second = np.stack([found[probe] for probe in probes[chosen].tolist()], axis=1) / (RAYS // 2)
    squares = HALVES * (first * second).sum(axis=(1, 2))
    lit = scale[chosen] > 0
    relative = squares[lit] / scale[chosen][lit] ** 2
    return max(0.0, float(relative.mean())) if relative.size else 0.0
