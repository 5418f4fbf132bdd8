"""A few rays from anywhere: irradiance at receivers, and what light at points in the air is asked by, from one surface cache.

Light at probes (started.py) shares the cache, so what is left between them is interpolation and the noise of these rays. The noise
comes from two halves of each ray sequence, as in adaptive.py.
"""

import numpy as np

from ...progress import Progress
from ...transport.cache.surface_cache import SurfaceCache
from ...transport.context import LightContext
from ...transport.rays.tracer import offset_origins
from ...transport.vectors import dot
from ..lamp_light import LampLight
from ..lattice.placement import Placement
from .gather import Gatherer, gather
from .item_rays import BLOCK_RAYS, ITEM_RAYS
from .items import Item
from .settings import ProbeSettings

# Variance of a mean over both halves of a sequence, relative to the squared difference of the halves' means. Independent halves
# would give 0.25; those of a scrambled Sobol sequence complement each other: 0.12 to 0.17 over four seeds on four samples.
HALVES = 0.14
# What a progress bar says meanwhile.
RAYS_LABEL = "rays from points"


def light_at_receivers(context: LightContext, cache: SurfaceCache, settings: ProbeSettings, points: np.ndarray,
                       normals: np.ndarray, lamp_light: LampLight, rays: int, seed: int,
                       progress: Progress) -> tuple[np.ndarray, np.ndarray]:
    """Irradiance (n, 3) [W·m⁻²] at ``points`` with ``normals`` (n, 3), and its variance, from ``rays`` rays each (an even number of
    blocks), with ``lamp_light`` from lamps directly. Raises Cancelled."""
    points = offset_origins(points, normals, normals)
    placement = in_the_air(points)
    gatherer = _IrradianceGatherer(context, cache, placement, settings, seed, normals)
    sums = np.zeros((2, len(points), 3))
    items = items_of(np.arange(len(points)), 1, rays)
    for item, gathered in zip(items, gather(gatherer, items, progress, RAYS_LABEL)[2], strict=True):
        sums[int(item.first[0] >= rays // 2), gathered.probes[:, 0]] += gathered.sh[:, 0, 0]
    halves = sums / (rays // 2) + (lamp_light.irradiance(points, normals) if lamp_light else 0.0)
    return halves.mean(axis=0), HALVES * (halves[0] - halves[1]) ** 2


def in_the_air(points: np.ndarray) -> Placement:
    """``points`` (n, 3) as if they were probes that nothing had to move."""
    points = np.ascontiguousarray(points, np.float32)
    ones = np.ones(len(points), np.float32)
    return Placement(points, np.zeros_like(points), ones, np.ones(len(points), bool), ones)


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
        return 0.5 * self._receiver_cosine(item, directions)

    def _receiver_cosine(self, item: Item, directions: np.ndarray) -> np.ndarray:
        normals = np.repeat(self._normals[item.probes[:, 0]], len(directions) // len(item.groups), axis=0)
        return np.maximum(dot(normals, directions), 0.0).reshape(len(item.groups), -1, 1)

    def bright_sky(self, item: Item) -> np.ndarray:
        """See Gatherer: the sky is sampled as a whole, not by half."""
        return 2.0 * super().bright_sky(item)

    def _connected(self, item: Item, directions: np.ndarray, contributions: np.ndarray) -> np.ndarray:
        basis = self._receiver_cosine(item, directions)
        return np.matmul(basis.transpose(0, 2, 1), contributions.reshape(*basis.shape[:2], 3))[:, None]

    def _visibility(self, item: Item, traced) -> tuple[np.ndarray, np.ndarray]:
        return np.zeros((len(item.groups), 1, 1, 2), np.float32), np.zeros((len(item.groups), 1, 1), np.float32)


def items_of(probes: np.ndarray, size: int, rays: int) -> list[Item]:
    """The first ``rays`` rays of ``probes`` (m,), ``size`` of which share directions, each item within one half of the sequence."""
    items, per_item = [], max(1, ITEM_RAYS // (BLOCK_RAYS * size)) * size
    whole = len(probes) // size * size
    for alike in [*(probes[i:min(i + per_item, whole)] for i in range(0, whole, per_item)), probes[whole:]]:
        if not len(alike):
            continue
        members = alike.reshape(-1, min(size, len(alike)))
        for first in range(0, rays, BLOCK_RAYS):
            items.append(Item(members[:, 0] // size, members, np.full(len(members), first), BLOCK_RAYS))
    return items
