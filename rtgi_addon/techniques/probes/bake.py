"""The bake: place probes, trace in rounds, grow the surface cache with what rays meet, stop each probe when it is good enough."""

import time
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np

from ...numerics import sh
from ...progress import Progress
from ...scene import ProbeVolume
from ...scene.memory import require_memory
from ...transport.cache.checkpoint import cache_state, labelled, part_of, restore_cache
from ...transport.cache.surface_cache import SurfaceCache
from ...transport.cache.texel_light import ALL_SOURCES
from ...transport.cache.texels import Focus, TexelLayout, size_for
from ...transport.context import LightContext
from ..base import Checkpoint, ProbeGrid
from ..lamp_light import LampLight
from ..lattice.coverage import require_open
from ..lattice.focus import focus, spacing_of
from ..lattice.placement import Placement, place
from .adaptive import FIRST_ROUND, ErrorModel, sampling_share
from .cache_noise import cache_noise
from .distances import mean_distances
from .gather import GROUP, RAYS_PER_LIGHT_SAMPLE, Gatherer, gather
from .item_rays import BLOCK_RAYS, ITEM_RAYS
from .items import Item, batches
from .memory import RayBytes, later_bytes, working_bytes
from .reach import Reach, reach_of
from .relight import MAX_KEPT_RAYS, HitMemory
from .settings import ProbeSettings
from .shares import TEXEL_COST, Shares
from .spreading import Spreading
from .started import HALF_RAYS, Finished, StartedProbes, that_fit
from .strata import CELLS, REFINED, Spread

# Rays of all the items that are held in memory between tracing and shading.
BATCH_RAYS = 1 << 22
# The target error at which the numbers below hold.
REFERENCE_ERROR = 0.01
# Texels that the surfaces around the probes are divided into; the number grows as the error falls, and falls more
# slowly as it grows: a coarse bake has few rays to average the texels' noise.
TEXELS = 16000
# Rays from each texel; the number doubles where the error halves, within these.
CACHE_RAYS, FEWEST_CACHE_RAYS, MOST_CACHE_RAYS = 64, 32, 1024
# So many times more where lamps are too many for shadow rays at every hit, and texels hold their light.
MANY_LAMPS = 3.0
# Direct light that varies by less than this over a texel is taken from the texel.
SMOOTHNESS = 0.1
# That too goes with the error, within these.
LEAST_SMOOTHNESS, MOST_SMOOTHNESS = 0.01, 0.2
# Texels are no larger than this share of the spacing of probes, unless that made more than twice as many.
TEXEL_SHARE, MOST_REFINED = 0.25, 2.0
# Rays that a bake to a target error usually takes, in first rounds: what the progress bar goes by until errors are known.
USUAL_ROUNDS = 6.0
# How far a bake is when probes are placed, and when all rays are traced.
PLACED, TRACED = 0.02, 0.97


@dataclass(frozen=True, eq=False)
class Begun:
    """What other work on a scene has done of its bake: its ``context``, a surface ``cache`` made for the target ``error``, and the
    first rays of the probes that were ``started`` with that cache; or one that was ``finished``."""

    context: LightContext
    cache: SurfaceCache
    error: float
    started: tuple[StartedProbes, ...] = ()
    finished: Finished | None = None

    def serves(self, context: LightContext, volumes: tuple[ProbeVolume, ...], settings: ProbeSettings) -> bool:
        """Whether a bake of ``volumes`` in ``context`` with ``settings`` may go on with the cache: texels may be larger than its
        own by as much as one lattice may ask for smaller ones than another."""
        cache = self.cache
        return (context is self.context and self.error == settings.target and cache_rays(settings) == cache.rays
                and cache.layout.size <= np.sqrt(MOST_REFINED) * 1.001 * texel_size(context, volumes, settings))


class Block(NamedTuple):
    """Some of a bake's probes where they stand, a surface cache that has met what they look at, and the ``brightness`` of all
    probes (see ErrorModel)."""

    placement: Placement
    cache: SurfaceCache
    brightness: float


class ProbeBake:
    """One bake of ``volumes`` with one set of settings, from rays to grids: the light of ``context``, and of lamps ``lamp_light``.

    Rounds follow one another until ``_plan`` wants no more rays; within a round, batches of items. Between batches the whole
    state is in arrays, and goes to ``checkpoint`` when that is due. ``begun`` lends its cache where it serves. A ``block`` is a
    part of the probes of ``volumes``, that stand already, and the cache that knows what they look at.
    """

    def __init__(self, context: LightContext, volumes: tuple[ProbeVolume, ...], settings: ProbeSettings, seed: int,
                 progress: Progress, checkpoint: Checkpoint, name: str, lamp_light: LampLight, begun: Begun | None = None,
                 block: Block | None = None):
        self.context, self.volumes, self.settings, self.lamp_light = context, volumes, settings, lamp_light
        self._seed = seed
        self._progress, self._checkpoint, self._name = progress, checkpoint, name
        started, known = (), block is not None
        if block is None:
            progress.stage("placement")
            known = begun is not None and begun.serves(context, volumes, settings)
            started = that_fit(begun.started, volumes, settings, seed) if known else ()
            self.placement: Placement = place(context, volumes, settings.virtual_offset, progress.span(0.0, PLACED),
                                              [(one.numbers, one.placement) for one in started])
            require_open(volumes, self.placement.measured)
            self.cache = begun.cache if known else surface_cache(context, volumes, settings, seed)
        else:
            self.placement, self.cache, _ = block
        measured = self.placement.positions[self.placement.measured]
        if known:
            # It has met more than a pilot would guess: on nine samples all but 0 to 12 % of what the bake then did.
            self._reach = Reach(self.cache.count, 1.0)
        else:
            self._reach = reach_of(context, self.cache.layout, measured, seed) if settings.bounces != 0 else Reach(0, 1.0)
        require_memory(working_bytes(self.cache, settings, self._reach, len(measured), BATCH_RAYS, MAX_KEPT_RAYS))
        count = len(self.placement.positions)
        self._spreading = Spreading(count, seed) if settings.rays is None and self._most >= REFINED else None
        strata = self._spreading and self._spreading.strata
        self.gatherer = Gatherer(context, self.cache, self.placement, settings, seed, strata, keeps_light=strata is not None)
        self.model = ErrorModel(count, sh.coefficient_count(settings.order), None if block is None else block.brightness)
        side = settings.visibility_resolution
        self._distance = np.zeros((count, side * side, 2), np.float32)
        self._distance_weight = np.zeros((count, side * side), np.float32)
        self._sums = np.zeros_like(self.model.total)
        self.emitted = np.zeros_like(self.model.total) if context.surfaces.has_emission or context.media.is_emissive else None
        self._goal: np.ndarray | None = None
        self._needed: np.ndarray | None = None
        self._cache_noise: float | None = None
        self._round = self._next = self.ray_count = 0
        self.memory = HitMemory()
        if context.media.scatters:
            # Walks in media met the lamps where they were.
            self.memory.forget()
        for one in started:
            self._go_on_with(one)

    def _go_on_with(self, started: StartedProbes) -> None:
        """Take over the first rays of probes, which make the first of _rounds."""
        # Nobody may want some of them.
        rows = started.placement.measured & self.placement.measured[started.numbers]
        probes, k = started.numbers[rows], self.model.total.shape[1]
        for sums in (started.first, started.second):
            self.model.add(probes, sums[rows, :k], np.full(len(probes), HALF_RAYS))
        self._distance[probes], self._distance_weight[probes] = started.distance[rows], started.weight[rows]
        if self.emitted is not None and started.emitted is not None:
            self.emitted[probes] = started.emitted[rows, :k]
        if self._spreading is not None:
            self._spreading.keep(probes, started.light[rows], None if started.glow is None else started.glow[rows])
        for memory in started.memory:
            self.memory.take_over(memory)
        self.ray_count += len(probes) * 2 * HALF_RAYS

    def run(self) -> None:
        """Trace until every probe has met its error or its number of rays. Raises Cancelled or BakeError."""
        self._progress.stage("rays")
        state = self._checkpoint.load(self._name)
        if state is not None:
            self._restore(state)
        while True:
            if self._goal is None:
                self._goal = self._plan()
                if self._goal is None:
                    return
                if self._round == len(self._rounds) + 1:
                    # Now the probes themselves have said how many they want, spread as they are.
                    require_memory(later_bytes(self.context, self._reach.hits, self.model.rays, self._rays_needed(), BATCH_RAYS,
                                               MAX_KEPT_RAYS))
                self._next = 0
                self._sums[:] = 0
                if self._spreading is not None and self._round >= len(self._rounds):
                    # Where twice as many will do they are spread well enough.
                    probes = np.flatnonzero((self.model.rays == CELLS) & (self._rays_needed() > REFINED))
                    turned = self._spreading.refine(self.gatherer, probes, self.model.total, self.emitted)
                    self.model.turned[turned] = CELLS
            self._trace_round()
            added = self._goal - self.model.rays
            probes = np.flatnonzero(added)
            self.model.add(probes, self._sums[probes], added[probes])
            self._goal = self._needed = None
            self._round += 1

    @cached_property
    def _rounds(self) -> list[int]:
        """Rays that every probe has after each of the first rounds: doubled, so that there are differences to read the error and
        how it falls from."""
        step, settings = RAYS_PER_LIGHT_SAMPLE, self.settings
        last = min(FIRST_ROUND, self._most) if settings.rays is None else -(-settings.rays // (2 * step)) * 2 * step
        return sorted({max(step, last // part // step * step) for part in (4, 2, 1)})

    @property
    def _most(self) -> int:
        """The most rays of a probe: in whole samples of light, and as often doubled as may be where they are spread anew."""
        most = self.settings.max_rays
        if most >= REFINED and self.settings.rays is None:
            return 1 << (most.bit_length() - 1)
        return max(2 * RAYS_PER_LIGHT_SAMPLE, most // RAYS_PER_LIGHT_SAMPLE * RAYS_PER_LIGHT_SAMPLE)

    def _plan(self) -> np.ndarray | None:
        """How many rays each probe (p,) shall have after the next round, or None when enough were traced."""
        rays, measured = self.model.rays, self.placement.measured
        if self._round < len(self._rounds):
            return np.maximum(rays, np.where(measured, self._rounds[self._round], 0))
        if self.settings.rays is not None:
            return None
        needed = self._rays_needed()
        return np.minimum(2 * rays, needed) if np.any(needed > rays) else None

    def _rays_needed(self) -> np.ndarray:
        """Rays (p,) that the probes are now thought to take to the target."""
        if self._needed is None:
            probes, self._needed = np.flatnonzero(self.placement.measured), self.model.rays.copy()
            if self._cache_noise is None:
                self._cache_noise = cache_noise(self.gatherer, probes, self.model.scale(probes), self._seed)
            target = self.settings.error * sampling_share(self._cache_noise, self.settings.error)
            self._needed[probes] = self.model.rays_needed(probes, self._groups(probes), target, self._most)
        return self._needed

    def _expected_rays(self) -> float:
        """Rays that the whole bake is now thought to take, for the progress bar."""
        if self.settings.rays is not None:
            return self.placement.measured.sum() * float(self.settings.rays)
        if self._round < len(self._rounds):
            return USUAL_ROUNDS * FIRST_ROUND * self.placement.measured.sum()
        return float(self._rays_needed().sum())

    @staticmethod
    def _groups(probes: np.ndarray) -> np.ndarray:
        return np.unique(probes // GROUP, return_inverse=True)[1].reshape(-1)

    def _items(self) -> list[Item]:
        """The rays of this round in blocks of up to BLOCK_RAYS a probe, gathered into items of blocks of one shape."""
        before, goal = self.model.rays, self._goal
        probes = np.flatnonzero(goal > before)
        key = np.stack([probes // GROUP, before[probes], goal[probes], np.full(len(probes), -1)], axis=1)
        found, which, sizes = np.unique(key, axis=0, return_inverse=True, return_counts=True)
        few = sizes < GROUP
        if 0 < ((found[:, 2] - found[:, 1]) * sizes)[few].sum() <= ITEM_RAYS:
            # One item of single probes takes less than one for each number of probes that a part of a group may have.
            key[:, 3] = np.where(few[which.reshape(-1)], probes, -1)
            found, which, sizes = np.unique(key, axis=0, return_inverse=True, return_counts=True)
        key, which = found, which.reshape(-1)
        order = np.argsort(which, kind="stable")
        members = np.zeros((len(key), GROUP), np.int64)
        members[which[order], np.arange(len(order)) - np.repeat(np.cumsum(sizes) - sizes, sizes)] = probes[order]
        blocks = -(-(key[:, 2] - key[:, 1]) // BLOCK_RAYS)
        of_key = np.repeat(np.arange(len(key)), blocks)
        first = key[of_key, 1] + BLOCK_RAYS * (np.arange(len(of_key)) - np.repeat(np.cumsum(blocks) - blocks, blocks))
        count = np.minimum(BLOCK_RAYS, key[of_key, 2] - first)
        spread = None if self._spreading is None else self._spreading.spread(key)
        starts = np.cumsum(key[:, 2] - key[:, 1]) - key[:, 2]
        items = []
        for rays, size in np.unique(np.stack([count, sizes[of_key]], axis=1), axis=0).tolist():
            alike = np.flatnonzero((count == rays) & (sizes[of_key] == size))
            step = max(1, ITEM_RAYS // (rays * size))
            for chunk in (alike[i:i + step] for i in range(0, len(alike), step)):
                which = (starts[of_key[chunk]] + first[chunk])[:, None] + np.arange(rays)
                anew = None if spread is None else Spread(*(part[which] for part in spread))
                items.append(Item(key[of_key[chunk], 0], members[of_key[chunk], :size], first[chunk], rays, anew))
        return items

    def _trace_round(self) -> None:
        """Trace items, grow the cache by what they hit, shade them; in batches that bound memory. The batches depend on the
        items alone, so the result is the same for any number of threads."""
        items, expected, started, before = self._items(), self._expected_rays(), time.monotonic(), self.ray_count
        of_texel = TEXEL_COST * self.cache.rays
        for batch in batches(items[self._next:], BATCH_RAYS):
            rays = sum(item.ray_count for item in batch)
            rate = (self.ray_count - before) / max(time.monotonic() - started, 1e-3)
            label = f"probe rays, {rate / 1e6:.1f} M/s" if rate else "probe rays"
            # The first batch meets nearly all texels that there will be, and in small bakes those are most of the work.
            texels = max(self._reach.texels, self.cache.count)
            new = of_texel * (texels - self.cache.count)
            total = expected + of_texel * texels
            low = self.ray_count + of_texel * self.cache.count
            done = [min(1.0, work / total) for work in (low, low + rays + new)]
            self._run_batch(batch, label, self._progress.span(PLACED, TRACED).span(*done), Shares.of(rays, new, texels))
            self.ray_count += rays
            self._next += len(batch)
            if self._checkpoint.due:
                self._checkpoint.save(self._name, self._state())

    def _run_batch(self, batch: list[Item], label: str, progress: Progress, shares: Shares) -> None:
        # All of them: a part of the probes may stand where more rays hit than elsewhere.
        require_memory({"rays": int(RayBytes.of(self.context).held * sum(item.ray_count for item in batch))})
        for item, hits, texel, sums in zip(batch, *gather(self.gatherer, batch, progress, label, shares), strict=True):
            self._sums[sums.probes] += sums.sh
            self._distance[sums.probes] += sums.distance
            self._distance_weight[sums.probes] += sums.distance_weight
            self.memory.keep(item, hits, texel, sums)
            if sums.emitted is not None:
                self.emitted[sums.probes] += sums.emitted
            if sums.along is not None:
                self._spreading.keep_item(item, sums.along)

    def _state(self) -> dict[str, np.ndarray]:
        numbers = np.array([self._round, self._next, self.ray_count], np.int64)
        kept = labelled("cache", cache_state(self.cache)) | labelled("model", self.model.state())
        if self._spreading is not None:
            kept |= labelled("spreading", self._spreading.state())
        return kept | {"numbers": numbers, "goal": self._goal, "sums": self._sums, "distance": self._distance,
                       "distance_weight": self._distance_weight,
                       "cache_noise": np.array([np.nan if self._cache_noise is None else self._cache_noise])}

    def _restore(self, arrays: dict[str, np.ndarray]) -> None:
        restore_cache(self.cache, part_of(arrays, "cache"))
        self.model.restore(part_of(arrays, "model"))
        if self._spreading is not None:
            self._spreading.restore(part_of(arrays, "spreading"))
        self._round, self._next, self.ray_count = (int(number) for number in arrays["numbers"])
        self._goal, self._sums = arrays["goal"], arrays["sums"]
        self._distance, self._distance_weight = arrays["distance"], arrays["distance_weight"]
        noise = float(arrays["cache_noise"][0])
        self._cache_noise = None if np.isnan(noise) else noise
        self.memory.forget()

    def grids(self) -> tuple[ProbeGrid, ...]:
        """The measured probes as one grid per volume; probes inside geometry hold zeros."""
        return self.cut(*self.measured())

    def measured(self) -> tuple[np.ndarray, np.ndarray]:
        """Coefficients (p, k, 3) and standard errors (p,) float32 of all probes; 0 and NaN inside geometry."""
        coefficients = self.model.coefficients()
        probes = np.flatnonzero(self.model.rays > 0)
        if self.lamp_light and probes.size:
            self._progress.step(TRACED, "light of lamps")
            coefficients[probes] += self.lamp_light.coefficients(self.placement.positions[probes], self.settings.order)
        error = np.full(len(coefficients), np.nan, np.float32)
        # Of the cache no probe knows its own part.
        of_cache = np.sqrt(self._cache_noise or 0.0) * self.model.scale(probes)
        error[probes] = np.hypot(self.model.error(probes, self._groups(probes)), of_cache) / np.sqrt(3.0 * coefficients.shape[1])
        return coefficients.astype(np.float32), error

    def cut(self, coefficients: np.ndarray, error: np.ndarray) -> tuple[ProbeGrid, ...]:
        """Grids of the volumes from ``coefficients`` (p, k, 3) and ``error`` (p,) of all probes."""
        side = self.settings.visibility_resolution
        visibility = self.visibility
        result, start = [], 0
        for volume in self.volumes:
            shape = tuple(reversed(volume.resolution))
            span = slice(start, start + int(np.prod(shape)))
            start = span.stop
            result.append(ProbeGrid(
                volume, coefficients[span].reshape(*shape, -1, 3), self.placement.validity[span].reshape(shape),
                visibility[span].reshape(*shape, side, side, 2), self.placement.offset[span].reshape(*shape, 3),
                error[span].reshape(shape)))
        return tuple(result)

    @cached_property
    def visibility(self) -> np.ndarray:
        """Mean and mean squared distance (p, T², 2) after the last round; a cell that no ray fell into takes a mean of those around
        it."""
        return mean_distances(self._distance, self._distance_weight, self.settings.visibility_resolution)


def surface_cache(context: LightContext, volumes: tuple[ProbeVolume, ...], settings: ProbeSettings, seed: int) -> SurfaceCache:
    """The empty surface cache for a bake of ``volumes``."""
    lit_alike = context.links.lit_alike if context.links.has_receivers else None
    layout = TexelLayout(context.geometry, Focus(*focus(volumes), texel_size(context, volumes, settings)), lit_alike)
    smoothness = float(np.clip(SMOOTHNESS * settings.target / REFERENCE_ERROR, LEAST_SMOOTHNESS, MOST_SMOOTHNESS))
    return SurfaceCache(context, layout, seed, cache_rays(settings), smoothness=smoothness)


def cache_rays(settings: ProbeSettings) -> int:
    """Rays from each texel of the surface cache: as set, or what goes with the target error."""
    wanted = CACHE_RAYS * 2 ** round(np.log2(REFERENCE_ERROR / settings.target))
    return settings.cache_rays or int(np.clip(wanted, FEWEST_CACHE_RAYS, MOST_CACHE_RAYS))


def texel_size(context: LightContext, volumes: tuple[ProbeVolume, ...], settings: ProbeSettings) -> float:
    """Side [m] of the cache's texels: as set, or small enough for the number that goes with target error and lamps on what lies
    near, or for twice as many where probes stand so dense, and so close to walls, that a texel should be no more than a quarter of
    a cell."""
    if settings.texel_size:
        return settings.texel_size
    return texel_for(usual_texel(context, volumes, settings), spacing_of(volumes))


def usual_texel(context: LightContext, volumes: tuple[ProbeVolume, ...], settings: ProbeSettings) -> float:
    """Side [m] of the cache's texels that goes with target error and lamps, however dense the probes of ``volumes`` are."""
    return size_for(context.geometry, *focus(volumes), usual_texels(context, settings))


def usual_texels(context: LightContext, settings: ProbeSettings) -> float:
    """About how many texels of that size there are around the probes."""
    refine = settings.target / REFERENCE_ERROR
    return TEXELS / min(refine, np.sqrt(refine)) * (MANY_LAMPS if context.lamps.count > ALL_SOURCES else 1.0)


def texel_for(usual: float, spacing: float) -> float:
    """Side [m] of the cache's texels where probes stand ``spacing`` [m] apart and ``usual_texel`` would do otherwise."""
    return float(np.clip(TEXEL_SHARE * spacing, usual / np.sqrt(MOST_REFINED), usual))
