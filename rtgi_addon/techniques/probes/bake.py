"""The bake: place probes, trace in rounds, grow the surface cache with what the rays meet, stop each probe when it is good enough."""

import numpy as np

from ...errors import BakeError
from ...numerics import sh
from ...numerics.grid import cell_size
from ...progress import Progress
from ...scene import ProbeVolume, Scene
from ...transport.context import LightContext
from ...transport.parallel import parallel_for
from ...transport.surface_cache import SurfaceCache
from ...transport.texels import Focus, TexelLayout
from ..base import Checkpoint, ProbeGrid
from .adaptive import FIRST_ROUND, SAMPLING_SHARE, ErrorModel
from .gather import GROUP, RAYS_PER_LIGHT_SAMPLE, Gatherer, Item
from .placement import Placement, place
from .settings import ProbeSettings

# Rays of one work item, and of all the items that are held in memory between tracing and shading.
ITEM_RAYS, BATCH_RAYS = 1 << 16, 1 << 22
# Texels that the surfaces around the probes are divided into at 1 % error; the number grows as the error falls.
TEXELS = 6000
CACHE_RAYS = 64


class ProbeBake:
    """One bake of all volumes of a scene, from rays to grids."""

    def __init__(self, scene: Scene, settings: ProbeSettings, seed: int, progress: Progress, threads: int | None,
                 checkpoint: Checkpoint):
        self.scene, self.settings, self.seed = scene, settings, seed
        self._progress, self._checkpoint = progress, checkpoint
        progress.stage("ray tracer")
        progress.step(0.0, "building the ray tracer")
        self.context = LightContext(scene, threads)
        progress.stage("placement")
        self.placement: Placement = place(self.context, scene.volumes, settings.virtual_offset, progress.span(0.01, 0.03))
        self._check_placement()
        refine = settings.target / 0.01
        size = settings.texel_size or texel_size(self.context, scene.volumes, TEXELS / refine)
        layout = TexelLayout(self.context.geometry, Focus(*focus(scene.volumes), size))
        rays = settings.cache_rays or int(np.clip(CACHE_RAYS * 2 ** round(np.log2(1.0 / refine)), 16, 1024))
        self.cache = SurfaceCache(self.context, layout, seed, rays)
        self.gatherer = Gatherer(self.context, self.cache, self.placement, settings, seed)
        count = len(self.placement.positions)
        self.model = ErrorModel(count, sh.coefficient_count(settings.order))
        side = settings.visibility_resolution
        self._distance = np.zeros((count, side * side, 2), np.float32)
        self._distance_weight = np.zeros((count, side * side), np.float32)
        self.ray_count = 0

    def _check_placement(self) -> None:
        start = 0
        for volume in self.scene.volumes:
            stop = start + int(np.prod(volume.resolution))
            if not self.placement.measured[start:stop].any():
                raise BakeError(f"every probe of the volume {volume.name!r} lies inside geometry",
                                "move or resize it so that it covers open space")
            start = stop

    def run(self) -> None:
        """Trace until every probe has met its error or its number of rays. Raises Cancelled or BakeError."""
        self._progress.stage("rays")
        progress = self._progress.span(0.03, 0.95)
        probes = np.flatnonzero(self.placement.measured)
        fixed = self.settings.rays
        first = FIRST_ROUND if fixed is None else max(16, -(-fixed // 32) * 16)
        first = min(first, self.settings.max_rays) if fixed is None else first
        self._first_round(probes, first, progress)
        if fixed is not None:
            self._double(probes, progress.span(0.5, 1.0))
            return
        target = self.settings.error * SAMPLING_SHARE
        while True:
            error = self.model.error(probes, np.unique(probes // GROUP, return_inverse=True)[1])
            relative = error / np.maximum(self.model.scale(probes), 1e-30)
            probes = probes[(relative > target) & (self.model.rays[probes] * 2 <= self.settings.max_rays)]
            if probes.size == 0:
                return
            before = self.model.half_difference(probes)
            self._double(probes, progress.span(0.3, 1.0))
            self.model.measure_doubling(probes, before)

    def _first_round(self, probes: np.ndarray, rays: int, progress: Progress) -> None:
        quarter = rays // 4 // RAYS_PER_LIGHT_SAMPLE * RAYS_PER_LIGHT_SAMPLE
        if quarter == 0:
            bounds = [0, rays // 2, rays // 2, rays, rays]
        else:
            bounds = [0, quarter, 2 * quarter, 3 * quarter, rays]
        sums = np.zeros((4, len(probes), *self.model.total.shape[1:]))
        row = np.zeros(len(self.placement.positions), np.int64)
        row[probes] = np.arange(len(probes))
        items = [(part, item) for part in range(4) if bounds[part + 1] > bounds[part]
                 for item in self._items(probes, bounds[part], bounds[part + 1])]

        def add(index, gathered):
            part, item = items[index]
            sums[part, row[item.probes]] += gathered.sh

        self._run_items([item for _, item in items], add, progress.span(0.0, 0.3))
        self.model.add_first(probes, sums, rays)
        if quarter:
            means = sums / np.diff(bounds)[:, None, None, None]
            spread = ((means - means.mean(axis=0)) ** 2).sum(axis=(0, 2, 3)) / 3.0
            self.model.measure_first(probes, spread)

    def _double(self, probes: np.ndarray, progress: Progress) -> None:
        sums = np.zeros(self.model.total.shape)
        rays = self.model.rays[probes]
        items = [item for count in np.unique(rays) for item in self._items(probes[rays == count], int(count), int(2 * count))]

        def add(index, gathered):
            sums[items[index].probes] += gathered.sh

        self._run_items(items, add, progress)
        self.model.add_doubling(probes, sums[probes])

    @staticmethod
    def _items(probes: np.ndarray, first: int, last: int) -> list[Item]:
        """Cut the rays ``first`` … ``last`` of ``probes`` into items, group by group."""
        items = []
        for members in np.split(probes, np.flatnonzero(np.diff(probes // GROUP)) + 1):
            step = max(RAYS_PER_LIGHT_SAMPLE, ITEM_RAYS // len(members) // RAYS_PER_LIGHT_SAMPLE * RAYS_PER_LIGHT_SAMPLE)
            items += [Item(int(members[0]) // GROUP, members, start, min(start + step, last))
                      for start in range(first, last, step)]
        return items

    def _run_items(self, items: list[Item], add, progress: Progress) -> None:
        """Trace items, grow the cache by what they hit, shade them; in batches that bound memory. The batches depend on the
        items alone, so the result is the same for any number of threads."""
        start = 0
        threads = self.context.threads
        while start < len(items):
            stop, rays = start, 0
            while stop < len(items) and (stop == start or rays + items[stop].ray_count <= BATCH_RAYS):
                rays += items[stop].ray_count
                stop += 1
            batch = items[start:stop]
            part = progress.span(start / len(items), stop / len(items))
            traced = parallel_for(lambda i, batch=batch: self.gatherer.trace(batch[i]), len(batch), threads,
                                  part.span(0.0, 0.4), "probe rays")
            texels = [None] * len(batch)
            if self.settings.bounces != 0:
                texels = self.cache.reach([one.surface for one in traced], part.span(0.4, 0.5))
                self.cache.solve(self.settings.bounces, 0.01 * self.settings.target, part.span(0.5, 0.6))
            gathered = parallel_for(lambda i, args=(batch, traced, texels): self.gatherer.shade(*(arg[i] for arg in args)),
                                    len(batch), threads, part.span(0.6, 1.0), "light at probe rays")
            for index, (item, one) in enumerate(zip(batch, gathered, strict=True), start=start):
                add(index, one)
                self._distance[item.probes] += one.distance.transpose(1, 0, 2)
                self._distance_weight[item.probes] += one.distance_weight
            self.ray_count += rays
            start = stop

    def grids(self) -> tuple[ProbeGrid, ...]:
        """The measured probes as one grid per volume; probes inside geometry hold zeros."""
        coefficients = self.model.coefficients().astype(np.float32)
        probes = np.flatnonzero(self.model.rays > 0)
        error = np.full(len(coefficients), np.nan, np.float32)
        error[probes] = self.model.error(probes, np.unique(probes // GROUP, return_inverse=True)[1])
        side = self.settings.visibility_resolution
        visibility = self._distance / np.maximum(self._distance_weight, 1e-30)[:, :, None]
        result, start = [], 0
        for volume in self.scene.volumes:
            shape = tuple(reversed(volume.resolution))
            span = slice(start, start + int(np.prod(shape)))
            start = span.stop
            result.append(ProbeGrid(
                volume, coefficients[span].reshape(*shape, -1, 3), self.placement.validity[span].reshape(shape),
                visibility[span].reshape(*shape, side, side, 2), self.placement.offset[span].reshape(*shape, 3),
                error[span].reshape(shape)))
        return tuple(result)


def focus(volumes: tuple[ProbeVolume, ...]) -> tuple[np.ndarray, float]:
    """Centre (3,) and radius [m] of a sphere around all volumes."""
    unit = np.array([[x, y, z, 1] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)], np.float64)
    corners = np.concatenate([(unit @ np.asarray(volume.world_from_local).T)[:, :3] for volume in volumes])
    center = 0.5 * (corners.min(axis=0) + corners.max(axis=0))
    return center, float(np.linalg.norm(corners - center, axis=1).max())


def texel_size(context: LightContext, volumes: tuple[ProbeVolume, ...], texels: float) -> float:
    """Side [m] of the cache's texels: no more than half a cell, and small enough for some ``texels`` on what lies near."""
    center, radius = focus(volumes)
    corners = context.geometry.triangles_world
    gap = np.maximum(np.maximum(corners.min(axis=1) - center, center - corners.max(axis=1)), 0)
    distance = np.sqrt((gap**2).sum(axis=1))
    # A triangle counts by what of it lies within the focus, or by how small it looks from there.
    share = np.minimum(1.0, (radius / np.maximum(distance, radius)) ** 2)
    area = np.minimum(context.geometry.areas * share, 4.0 * np.pi * radius**2).sum(dtype=np.float64)
    spacing = min(cell_size(volume.world_from_local, volume.resolution).min() for volume in volumes)
    return float(min(0.5 * spacing, np.sqrt(max(area, 1e-12) / texels)))
