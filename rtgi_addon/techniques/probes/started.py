"""The first rays of some of a bake's probes, traced before anybody knows whether that bake will be made.

They are those that the bake itself would begin with: a probe's group, its directions and what shifts them for it follow from its
place in the lattice and the bake's seed. So a bake that takes them over traces the rest, and ends where it would have alone.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from ...progress import Progress
from ...scene import ProbeVolume
from ...transport.cache.surface_cache import SurfaceCache
from ...transport.context import LightContext
from ..base import Field
from ..lattice.placement import Placement
from .adaptive import FIRST_ROUND
from .gather import GROUP, Gatherer, gather
from .item_rays import BLOCK_RAYS, ITEM_RAYS
from .items import Item
from .relight import HitMemory
from .settings import ProbeSettings

# Rays of a probe in each of two halves, which are the first rounds of a bake's: fewer than any bake traces.
HALF_RAYS = BLOCK_RAYS
PROBE_RAYS = 2 * HALF_RAYS


@dataclass(frozen=True, eq=False)
class StartedProbes:
    """Probes ``rows`` (m,), sorted flat indices of the lattice ``volume``, whose first probe is number ``start`` of a bake with
    ``settings`` and ``seed``, and how they are placed.

    ``first`` and ``second`` (m, k, 3) are sums of 4π·L·Y over HALF_RAYS rays each, ``emitted`` (m, k, 3) what both have of
    emissive surfaces (None where nothing emits), ``light`` and ``glow`` (m, PROBE_RAYS, 3) the same ray by ray, ``distance``
    (m, T², 2) and ``weight`` (m, T²) as a bake sums them, and ``memory`` what the rays hit.
    """

    volume: ProbeVolume
    start: int
    settings: ProbeSettings
    seed: int
    rows: np.ndarray
    placement: Placement
    first: np.ndarray
    second: np.ndarray
    emitted: np.ndarray | None
    light: np.ndarray
    glow: np.ndarray | None
    distance: np.ndarray
    weight: np.ndarray
    memory: tuple[HitMemory, ...]

    @property
    def numbers(self) -> np.ndarray:
        """(m,) of the probes in the bake."""
        return self.start + self.rows

    @property
    def sh(self) -> np.ndarray:
        """Coefficients (m, k, 3) float32 from all rays."""
        return ((self.first + self.second) / PROBE_RAYS).astype(np.float32)

    def joined(self, other: "StartedProbes") -> "StartedProbes":
        """These and ``other`` probes of the same lattice."""
        order = np.argsort(np.append(self.rows, other.rows), kind="stable")

        def both(name, of=lambda part: part):
            return np.concatenate([getattr(of(self), name), getattr(of(other), name)])[order]

        placement = Placement(*(both(name, lambda part: part.placement)
                                for name in ("positions", "offset", "validity", "measured", "reach")))
        return StartedProbes(self.volume, self.start, self.settings, self.seed, both("rows"), placement, both("first"),
                             both("second"), None if self.emitted is None else both("emitted"), both("light"),
                             None if self.glow is None else both("glow"), both("distance"), both("weight"),
                             self.memory + other.memory)


@dataclass(frozen=True, eq=False)
class Finished:
    """A bake of ``volumes`` with ``settings`` and ``seed`` that was made to see how good it is: its ``field``, what it took
    without its fit (``seconds``) and with it (``rays``), and the fit alone (``fit_seconds``)."""

    volumes: tuple[ProbeVolume, ...]
    settings: ProbeSettings
    seed: int
    field: Field
    seconds: float
    rays: int
    fit_seconds: float

    def is_of(self, volumes: tuple[ProbeVolume, ...], settings: ProbeSettings, seed: int) -> bool:
        """Whether it is the bake of ``volumes`` with ``settings`` and ``seed``."""
        return (self.settings, self.seed, len(self.volumes)) == (settings, seed, len(volumes)) and all(
            (mine.name, mine.settings, mine.planned, *lattice_key(mine)) == (its.name, its.settings, its.planned, *lattice_key(its))
            and its.scattered is None and its.near == mine.near and np.array_equal(mine.wanted, its.wanted)
            for mine, its in zip(self.volumes, volumes, strict=True))


def that_fit(all_started: Sequence[StartedProbes], volumes: tuple[ProbeVolume, ...], settings: ProbeSettings,
             seed: int) -> list[StartedProbes]:
    """Those of ``all_started`` that a bake of ``volumes`` with ``settings`` and ``seed`` begins with, one for a volume."""
    found, start = [], 0
    if settings.rays is not None or settings.max_rays < FIRST_ROUND:
        return found
    for volume in volumes:
        lattice = start, *lattice_key(volume)
        found += [one for one in all_started if (one.start, *lattice_key(one.volume)) == lattice and one.seed == seed
                  and _alike(one.settings, settings) and volume.scattered is None][:1]
        start += int(np.prod(volume.resolution))
    return found


def lattice_key(volume: ProbeVolume) -> tuple:
    """What makes the lattice of ``volume``: its box and its resolution."""
    return tuple(volume.resolution), np.asarray(volume.world_from_local, np.float64).tobytes()


def _alike(started: ProbeSettings, settings: ProbeSettings) -> bool:
    """Whether probes that were ``started`` are those of a bake with ``settings``, whose cache theirs is."""
    same = replace(started, order=settings.order, error=settings.error, max_rays=settings.max_rays, direct=settings.direct,
                   fit=settings.fit)
    return started.order >= settings.order and same == settings


def rounded_out(volume: ProbeVolume, start: int, rows: np.ndarray) -> np.ndarray:
    """``rows`` (m,), sorted flat indices of ``volume`` whose first probe is number ``start``, with what is missing of groups of
    which they are half or more: whole groups take less to trace, and a bake wants the rest anyway."""
    groups, count = np.unique((start + rows) // GROUP, return_counts=True)
    filled = (groups[2 * count >= GROUP, None] * GROUP + np.arange(GROUP)).reshape(-1) - start
    return np.union1d(rows, filled[(filled >= 0) & (filled < np.prod(volume.resolution))])


def start_probes(context: LightContext, cache: SurfaceCache, settings: ProbeSettings, volume: ProbeVolume, start: int, seed: int,
                 rows: np.ndarray, placed: Placement, progress: Progress) -> StartedProbes:
    """The first rays of the measured probes among ``rows`` (m,) of ``volume``, which are ``placed`` (m); see StartedProbes. Raises
    Cancelled."""
    count, k, tiles = len(rows), (settings.order + 1) ** 2, settings.visibility_resolution**2
    # By their numbers in the bake, and no more than reaches the last of them.
    numbers = start + rows
    where = np.zeros(int(numbers[-1]) + 1 if count else 0, np.int64)
    where[numbers] = np.arange(count)
    everywhere = Placement(*(np.zeros((len(where), *part.shape[1:]), part.dtype) for part in (
        placed.positions, placed.offset, placed.validity, placed.measured, placed.reach)))
    everywhere.positions[numbers], everywhere.reach[numbers] = placed.positions, placed.reach
    gatherer, memory = Gatherer(context, cache, everywhere, settings, seed, keeps_light=True), HitMemory()
    sums, emitted = np.zeros((2, count, k, 3)), None
    light, glow = np.zeros((count, PROBE_RAYS, 3), np.float32), None
    distance, weight = np.zeros((count, tiles, 2), np.float32), np.zeros((count, tiles), np.float32)
    items = _items(numbers[placed.measured])
    for item, hits, texel, gathered in zip(items, *gather(gatherer, items, progress, "rays from probes"), strict=True):
        own = where[gathered.probes]
        sums[int(item.first[0] > 0), own] += gathered.sh
        distance[own] += gathered.distance
        weight[own] += gathered.distance_weight
        memory.keep(item, hits, texel, gathered)
        ray = where[item.probes][:, None, :], (item.first[:, None] + np.arange(item.count))[:, :, None]
        light[ray] = gathered.along.light
        if gathered.emitted is not None:
            emitted = np.zeros((count, k, 3)) if emitted is None else emitted
            emitted[own] += gathered.emitted
            glow = np.zeros_like(light) if glow is None else glow
            glow[ray] = gathered.along.emitted
    return StartedProbes(volume, start, settings, seed, rows, placed, sums[0], sums[1], emitted, light, glow, distance, weight,
                         (memory,))


def _items(probes: np.ndarray) -> list[Item]:
    """PROBE_RAYS rays of each of ``probes`` (m,), sorted; groups share directions as those of a bake do. Those of which a part is
    asked for are traced probe by probe: an item for each number of probes that a group may have takes longer."""
    _, begin, count = np.unique(probes // GROUP, return_index=True, return_counts=True)
    whole = np.flatnonzero(count == GROUP)
    single = np.setdiff1d(np.arange(len(probes)), begin[whole, None] + np.arange(GROUP))
    items = []
    for members in (probes[begin[whole, None] + np.arange(GROUP)], probes[single, None]):
        step = max(1, ITEM_RAYS // (HALF_RAYS * max(members.shape[1], 1)))
        for some in (members[i:i + step] for i in range(0, len(members), step)):
            items += [Item(some[:, 0] // GROUP, some, np.full(len(some), first), HALF_RAYS) for first in (0, HALF_RAYS)]
    return items
