"""The bake: place probes, trace in rounds, grow the surface cache with what rays meet, stop each probe when it is good enough."""

import time
from functools import cached_property

import numpy as np

from ...errors import BakeError
from ...numerics import octahedral, sh
from ...numerics.grid import cell_size
from ...progress import Progress
from ...scene import ProbeVolume
from ...transport.context import LightContext
from ...transport.parallel import parallel_for
from ...transport.surface_cache import SurfaceCache
from ...transport.texel_light import ALL_SOURCES
from ...transport.texels import Focus, TexelLayout
from ..base import Checkpoint, ProbeGrid
from .adaptive import FIRST_ROUND, SAMPLING_SHARE, STRIDE, ErrorModel, ladder
from .gather import GROUP, RAYS_PER_LIGHT_SAMPLE, Gatherer, Item
from .placement import Placement, place
from .relight import HitMemory
from .settings import ProbeSettings

# Rays of a probe in one block: a multiple of what light samples come with, and a divisor of the first round.
BLOCK_RAYS = 64
# Rays of one work item, and of all the items that are held in memory between tracing and shading.
ITEM_RAYS, BATCH_RAYS = 1 << 16, 1 << 22
# Texels that the surfaces around the probes are divided into at 1 % error; the number grows as the error falls, and falls more
# slowly as it grows: a coarse bake has few rays to average the texels' noise.
TEXELS = 16000
CACHE_RAYS = 64
# So many times more where lamps are too many for shadow rays at every hit, and texels hold their light.
MANY_LAMPS = 3.0
# Direct light that varies by less than this over a texel is taken from the texel, at 1 % error.
SMOOTHNESS = 0.1


class ProbeBake:
    """One bake of the volumes of ``scene`` with one set of settings, from rays to grids.

    Rounds follow one another until ``_plan`` wants no more rays; within a round, batches of items. Between batches the whole
    state is in arrays, and goes to ``checkpoint`` when that is due.
    """

    def __init__(self, context: LightContext, volumes: tuple[ProbeVolume, ...], settings: ProbeSettings, seed: int,
                 progress: Progress, checkpoint: Checkpoint, name: str):
        self.context, self.volumes, self.settings = context, volumes, settings
        self._progress, self._checkpoint, self._name = progress, checkpoint, name
        progress.stage("placement")
        self.placement: Placement = place(context, volumes, settings.virtual_offset, progress.span(0.0, 0.02))
        self._check_placement()
        self.cache = surface_cache(context, volumes, settings, seed)
        self.gatherer = Gatherer(context, self.cache, self.placement, settings, seed)
        count = len(self.placement.positions)
        self.model = ErrorModel(count, sh.coefficient_count(settings.order))
        side = settings.visibility_resolution
        self._distance = np.zeros((count, side * side, 2), np.float32)
        self._distance_weight = np.zeros((count, side * side), np.float32)
        self._sums = np.zeros_like(self.model.total)
        self.emitted = np.zeros_like(self.model.total) if context.surfaces.has_emission else None
        self._goal: np.ndarray | None = None
        self._round = self._next = self.ray_count = 0
        self.memory = HitMemory()

    def _check_placement(self) -> None:
        start = 0
        for volume in self.volumes:
            stop = start + int(np.prod(volume.resolution))
            if not self.placement.measured[start:stop].any():
                raise BakeError(f"every probe of the volume {volume.name!r} lies inside geometry",
                                "move or resize it so that it covers open space")
            start = stop

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
                self._next = 0
                self._sums[:] = 0
            self._trace_round()
            added = self._goal - self.model.rays
            probes = np.flatnonzero(added)
            self.model.add(probes, self._sums[probes], added[probes])
            self._goal = None
            self._round += 1

    def _plan(self) -> np.ndarray | None:
        """How many rays each probe (p,) shall have after the next round, or None when enough were traced."""
        rays, measured, settings = self.model.rays, self.placement.measured, self.settings
        step = 2 * RAYS_PER_LIGHT_SAMPLE
        first = min(FIRST_ROUND, settings.max_rays) if settings.rays is None else -(-settings.rays // step) * step
        if self._round < 2:
            # Two halves, so that there is a difference to read the error from.
            return np.where(measured, first // step * RAYS_PER_LIGHT_SAMPLE if self._round == 0 else first, 0)
        if settings.rays is not None:
            return None
        probes = np.flatnonzero(measured)
        needed = self.model.rays_needed(probes, self._groups(probes), settings.error * SAMPLING_SHARE)
        wanting = (needed > rays[probes]) & (rays[probes] < settings.max_rays)
        probes, needed = probes[wanting], needed[wanting]
        if probes.size == 0:
            return None
        goal = rays.copy()
        goal[probes] = ladder(np.maximum(STRIDE * needed, rays[probes] + 1), settings.max_rays)
        return goal

    def _expected_rays(self) -> float:
        """Rays that the whole bake is now thought to take, for the progress bar."""
        goal = float(self._goal.sum())
        if self.settings.rays is not None:
            return self.placement.measured.sum() * float(self.settings.rays)
        if self._round < 2:
            return 6.0 * FIRST_ROUND * self.placement.measured.sum()
        probes = np.flatnonzero(self.placement.measured)
        needed = self.model.rays_needed(probes, self._groups(probes), self.settings.error * SAMPLING_SHARE)
        return max(goal, float(np.clip(needed, self._goal[probes], self.settings.max_rays).sum()))

    @staticmethod
    def _groups(probes: np.ndarray) -> np.ndarray:
        return np.unique(probes // GROUP, return_inverse=True)[1].reshape(-1)

    def _items(self) -> list[Item]:
        """The rays of this round in blocks of up to BLOCK_RAYS a probe, gathered into items of blocks of one shape."""
        before, goal = self.model.rays, self._goal
        probes = np.flatnonzero(goal > before)
        key = np.stack([probes // GROUP, before[probes], goal[probes]], axis=1)
        key, which, sizes = np.unique(key, axis=0, return_inverse=True, return_counts=True)
        which = which.reshape(-1)
        order = np.argsort(which, kind="stable")
        members = np.zeros((len(key), GROUP), np.int64)
        members[which[order], np.arange(len(order)) - np.repeat(np.cumsum(sizes) - sizes, sizes)] = probes[order]
        blocks = -(-(key[:, 2] - key[:, 1]) // BLOCK_RAYS)
        of_key = np.repeat(np.arange(len(key)), blocks)
        first = key[of_key, 1] + BLOCK_RAYS * (np.arange(len(of_key)) - np.repeat(np.cumsum(blocks) - blocks, blocks))
        count = np.minimum(BLOCK_RAYS, key[of_key, 2] - first)
        items = []
        for rays, size in np.unique(np.stack([count, sizes[of_key]], axis=1), axis=0).tolist():
            alike = np.flatnonzero((count == rays) & (sizes[of_key] == size))
            step = max(1, ITEM_RAYS // (rays * size))
            for chunk in (alike[i:i + step] for i in range(0, len(alike), step)):
                items.append(Item(key[of_key[chunk], 0], members[of_key[chunk], :size], first[chunk], rays))
        return items

    def _trace_round(self) -> None:
        """Trace items, grow the cache by what they hit, shade them; in batches that bound memory. The batches depend on the
        items alone, so the result is the same for any number of threads."""
        items, expected, started, before = self._items(), self._expected_rays(), time.monotonic(), self.ray_count
        while self._next < len(items):
            stop, rays = self._next, 0
            while stop < len(items) and (stop == self._next or rays + items[stop].ray_count <= BATCH_RAYS):
                rays += items[stop].ray_count
                stop += 1
            rate = (self.ray_count - before) / max(time.monotonic() - started, 1e-3)
            label = f"probe rays, {rate / 1e6:.1f} M/s" if rate else "probe rays"
            self._run_batch(items[self._next:stop], label, self._progress.span(
                0.02 + 0.95 * min(1.0, self.ray_count / expected), 0.02 + 0.95 * min(1.0, (self.ray_count + rays) / expected)))
            self.ray_count += rays
            self._next = stop
            if self._checkpoint.due:
                self._checkpoint.save(self._name, self._state())

    def _run_batch(self, batch: list[Item], label: str, progress: Progress) -> None:
        threads = self.context.threads
        traced = parallel_for(lambda i: self.gatherer.trace(batch[i]), len(batch), threads, progress.span(0.0, 0.4), label)
        texels = [None] * len(batch)
        if self.settings.bounces != 0:
            texels = self.cache.reach([one.surface for one in traced], progress.span(0.4, 0.5))
            self.cache.solve(self.settings.bounces, 0.01 * self.settings.target, progress.span(0.5, 0.6))
        gathered = parallel_for(lambda i: self.gatherer.shade(batch[i], traced[i], texels[i]), len(batch), threads,
                                progress.span(0.6, 1.0), label)
        for item, hits, texel, one in zip(batch, traced, texels, gathered, strict=True):
            self._sums[one.probes] += one.sh
            self._distance[one.probes] += one.distance
            self._distance_weight[one.probes] += one.distance_weight
            self.memory.keep(item, hits, texel, one)
            if one.emitted is not None:
                self.emitted[one.probes] += one.emitted

    def _state(self) -> dict[str, np.ndarray]:
        arrays = {f"cache.{name}": value for name, value in self.cache.state().items()}
        arrays |= {f"model.{name}": value for name, value in self.model.state().items()}
        numbers = np.array([self._round, self._next, self.ray_count], np.int64)
        return arrays | {"numbers": numbers, "goal": self._goal, "sums": self._sums, "distance": self._distance,
                         "distance_weight": self._distance_weight}

    def _restore(self, arrays: dict[str, np.ndarray]) -> None:
        def part(prefix):
            return {name.removeprefix(prefix): value for name, value in arrays.items() if name.startswith(prefix)}

        self.cache.restore(part("cache."))
        self.model.restore(part("model."))
        self._round, self._next, self.ray_count = (int(number) for number in arrays["numbers"])
        self._goal, self._sums = arrays["goal"], arrays["sums"]
        self._distance, self._distance_weight = arrays["distance"], arrays["distance_weight"]
        self.memory.forget()

    def grids(self) -> tuple[ProbeGrid, ...]:
        """The measured probes as one grid per volume; probes inside geometry hold zeros."""
        coefficients = self.model.coefficients()
        probes = np.flatnonzero(self.model.rays > 0)
        if self.settings.direct and probes.size:
            self._progress.step(0.98, "light of lamps")
            coefficients[probes] += self.gatherer.lamps(probes)
        error = np.full(len(coefficients), np.nan, np.float32)
        error[probes] = self.model.error(probes, self._groups(probes)) / np.sqrt(3.0 * coefficients.shape[1])
        return self.cut(coefficients.astype(np.float32), error)

    def cut(self, coefficients: np.ndarray, error: np.ndarray) -> tuple[ProbeGrid, ...]:
        """Grids of the volumes from ``coefficients`` (p, k, 3) and ``error`` (p,) of all probes."""
        side = self.settings.visibility_resolution
        visibility = self._visibility
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
    def _visibility(self) -> np.ndarray:
        """Mean and mean squared distance (p, T², 2) after the last round; a cell that no ray fell into takes a mean of those around
        it."""
        return mean_distances(self._distance, self._distance_weight, self.settings.visibility_resolution)


def mean_distances(sums: np.ndarray, weight: np.ndarray, resolution: int) -> np.ndarray:
    """Mean and mean squared distance (p, T², 2) from ``sums`` (p, T², 2) over the rays in each cell of a tile of ``resolution`` T
    and their numbers ``weight`` (p, T²)."""
    directions = octahedral.texel_directions(resolution).reshape(-1, 3)
    around = (np.maximum(directions @ directions.T, 0) ** 64 * 1e-4).astype(np.float32)
    return (sums + np.matmul(around, sums)) / np.maximum(weight + weight @ around, 1e-30)[:, :, None]


def surface_cache(context: LightContext, volumes: tuple[ProbeVolume, ...], settings: ProbeSettings, seed: int) -> SurfaceCache:
    """The empty surface cache for a bake of ``volumes``."""
    refine = settings.target / 0.01
    texels = TEXELS / min(refine, np.sqrt(refine)) * (MANY_LAMPS if context.lamps.count > ALL_SOURCES else 1.0)
    size = settings.texel_size or texel_size(context, volumes, texels)
    layout = TexelLayout(context.geometry, Focus(*focus(volumes), size))
    rays = settings.cache_rays or cache_rays(settings)
    return SurfaceCache(context, layout, seed, rays, smoothness=float(np.clip(SMOOTHNESS * refine, 0.01, 0.2)))


def cache_rays(settings: ProbeSettings) -> int:
    """Rays from each texel of the surface cache that go with the target error."""
    return int(np.clip(CACHE_RAYS * 2 ** round(np.log2(0.01 / settings.target)), 32, 1024))


def focus(volumes: tuple[ProbeVolume, ...]) -> tuple[np.ndarray, float]:
    """Centre (3,) and radius [m] of a sphere around all volumes."""
    unit = np.array([[x, y, z, 1] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)], np.float64)
    corners = np.concatenate([(unit @ np.asarray(volume.world_from_local).T)[:, :3] for volume in volumes])
    center = 0.5 * (corners.min(axis=0) + corners.max(axis=0))
    return center, float(np.linalg.norm(corners - center, axis=1).max())


def texel_size(context: LightContext, volumes: tuple[ProbeVolume, ...], texels: float) -> float:
    """Side [m] of the cache's texels: small enough for some ``texels`` on what lies near, or for twice as many where probes stand
    so dense, and so close to walls, that a texel should be no more than a quarter of a cell."""
    center, radius = focus(volumes)
    corners = context.geometry.triangles_world
    gap = np.maximum(np.maximum(corners.min(axis=1) - center, center - corners.max(axis=1)), 0)
    distance = np.sqrt((gap**2).sum(axis=1))
    # A triangle counts by what of it lies within the focus, or by how small it looks from there.
    share = np.minimum(1.0, (radius / np.maximum(distance, radius)) ** 2)
    area = np.minimum(context.geometry.areas * share, 4.0 * np.pi * radius**2).sum(dtype=np.float64)
    spacing = min(cell_size(volume.world_from_local, volume.resolution).min() for volume in volumes)
    size = np.sqrt(max(area, 1e-12) / texels)
    return float(np.clip(0.25 * spacing, size / np.sqrt(2.0), size))
