"""Rays for a plan's pilot: light at a few probes, and irradiance at receivers, both from one surface cache.

Both sides of the comparison share the cache, so what is left between them is interpolation and the noise of probe rays. The noise
comes from two halves of each ray sequence, as in techniques/probes/adaptive.py.
"""

from typing import NamedTuple

import numpy as np

from ...progress import Progress
from ...techniques.probes.bake import BLOCK_RAYS, ITEM_RAYS, mean_distances
from ...techniques.probes.gather import GROUP, Gathered, Gatherer, Item
from ...techniques.probes.placement import Placement
from ...techniques.probes.settings import ProbeSettings
from ...transport.context import LightContext
from ...transport.parallel import parallel_for
from ...transport.rays import offset_origins
from ...transport.surface_cache import SurfaceCache
from ...transport.vectors import dot
from ..receivers import Receivers
from ..references import Truth

# Rays of a probe: fewer than any bake traces, since their noise is taken out.
PROBE_RAYS = 128
# Variance of a mean over both halves of a sequence, relative to the squared difference of the halves' means. Independent halves
# would give 0.25; those of a scrambled Sobol sequence complement each other: 0.12 to 0.17 over four seeds on four samples.
HALVES = 0.14


class ProbeLight(NamedTuple):
    """Sums (m, k, 3) of 4π·L·Y over the first and the second ``rays`` of m probes, and ``visibility`` (m, T², 2)."""

    first: np.ndarray
    second: np.ndarray
    rays: int
    visibility: np.ndarray

    @property
    def sh(self) -> np.ndarray:
        """Coefficients (m, k, 3) float32 from all rays."""
        return ((self.first + self.second) / (2 * self.rays)).astype(np.float32)


def light_at_probes(context: LightContext, cache: SurfaceCache, settings: ProbeSettings, placement: Placement, seed: int,
                    progress: Progress) -> ProbeLight:
    """PROBE_RAYS rays from every measured probe of ``placement``. Raises Cancelled."""
    gatherer = Gatherer(context, cache, placement, settings, seed)
    count, rays = len(placement.positions), PROBE_RAYS // 2
    side = settings.visibility_resolution
    sums = np.zeros((2, count, (settings.order + 1) ** 2, 3))
    distance, weight = np.zeros((count, side * side, 2), np.float32), np.zeros((count, side * side), np.float32)
    items = _items(np.flatnonzero(placement.measured), GROUP, PROBE_RAYS)
    for item, one in zip(items, _gather(context, cache, gatherer, items, settings, progress), strict=True):
        sums[int(item.first[0] >= rays), one.probes] += one.sh
        distance[one.probes] += one.distance
        weight[one.probes] += one.distance_weight
    return ProbeLight(sums[0], sums[1], rays, mean_distances(distance, weight, side))


def light_at_receivers(context: LightContext, cache: SurfaceCache, settings: ProbeSettings, receivers: Receivers, rays: int,
                       seed: int, progress: Progress) -> Truth:
    """Irradiance (n, 3) [W·m⁻²] at ``receivers``, with its variance, from ``rays`` rays each (an even number of blocks).
    Raises Cancelled."""
    points = offset_origins(receivers.points, receivers.normals, receivers.normals)
    n = len(points)
    placement = Placement(points, np.zeros_like(points), np.ones(n, np.float32), np.ones(n, bool), np.ones(n, np.float32))
    gatherer = _IrradianceGatherer(context, cache, placement, settings, seed, receivers.normals)
    sums = np.zeros((2, n, 3))
    items = _items(np.arange(n), 1, rays)
    for item, one in zip(items, _gather(context, cache, gatherer, items, settings, progress), strict=True):
        sums[int(item.first[0] >= rays // 2), one.probes[:, 0]] += one.sh[:, 0, 0]
    halves = sums / (rays // 2)
    return Truth(halves.mean(axis=0), HALVES * (halves[0] - halves[1]) ** 2)


class _IrradianceGatherer(Gatherer):
    """Projects radiance onto the cosine about each receiver's normal instead of onto SH; all directions lie above the horizon.
    Groups have one member each."""

    pdf = np.float32(2.0 * Gatherer.pdf)

    def __init__(self, context, cache, placement, settings, seed, normals):
        super().__init__(context, cache, placement, settings, seed)
        self._normals = normals

    def directions(self, item: Item) -> np.ndarray:
        """Directions (g·n, 3): what would lie below the horizon is mirrored in it."""
        directions = super().directions(item)
        normals = np.repeat(self._normals[item.probes[:, 0]], item.shape[1], axis=0)
        return directions - 2.0 * np.minimum(dot(normals, directions), 0.0)[:, None] * normals

    def basis(self, item: Item, directions: np.ndarray) -> np.ndarray:
        """(g, n, 1): cosine at the receiver, for rays of half the sphere."""
        return 0.5 * self._cosine(item, directions)

    def _cosine(self, item: Item, directions: np.ndarray) -> np.ndarray:
        normals = np.repeat(self._normals[item.probes[:, 0]], len(directions) // len(item.groups), axis=0)
        return np.maximum(dot(normals, directions), 0.0).reshape(len(item.groups), -1, 1)

    def bright_sky(self, item: Item) -> np.ndarray:
        """See Gatherer: the sky is sampled as a whole, not by half."""
        return 2.0 * super().bright_sky(item)

    def _connected(self, item: Item, directions: np.ndarray, contributions: np.ndarray) -> np.ndarray:
        basis = self._cosine(item, directions)
        return np.matmul(basis.transpose(0, 2, 1), contributions.reshape(*basis.shape[:2], 3))[:, None]

    def _visibility(self, item: Item, traced) -> tuple[np.ndarray, np.ndarray]:
        return np.zeros((len(item.groups), 1, 1, 2), np.float32), np.zeros((len(item.groups), 1, 1), np.float32)


def _items(probes: np.ndarray, size: int, rays: int) -> list[Item]:
    """The first ``rays`` rays of ``probes`` (m,), ``size`` of which share directions, each item within one half of the sequence."""
    items, per_item = [], max(1, ITEM_RAYS // (BLOCK_RAYS * size)) * size
    whole = len(probes) // size * size
    for part in [*(probes[i:min(i + per_item, whole)] for i in range(0, whole, per_item)), probes[whole:]]:
        if not len(part):
            continue
        members = part.reshape(-1, min(size, len(part)))
        for first in range(0, rays, BLOCK_RAYS):
            items.append(Item(members[:, 0] // size, members, np.full(len(members), first), BLOCK_RAYS))
    return items


def _gather(context, cache, gatherer, items, settings, progress) -> list[Gathered]:
    traced = parallel_for(lambda i: gatherer.trace(items[i]), len(items), context.threads, progress.span(0.0, 0.4), "pilot rays")
    texels = [None] * len(items)
    if settings.bounces != 0:
        texels = cache.reach([one.surface for one in traced], progress.span(0.4, 0.5))
        cache.solve(settings.bounces, 0.01 * settings.target, progress.span(0.5, 0.6))
    return parallel_for(lambda i: gatherer.shade(items[i], traced[i], texels[i]), len(items), context.threads,
                        progress.span(0.6, 1.0), "pilot rays")
