"""The bake of transfer: probes' rays once, the surface cache of what they meet, and every light as columns over both.

Two passes over the same rays. The first finds which texels there are; then the lights are solved on them: those of the file each
in a context of its own, as a bake of probes would (so that a light may be dimmed to the digit), skies, suns and lamp sites as
columns of one system. The second pass gathers all of them.
"""

from dataclasses import dataclass, fields, replace

import numpy as np

from ...numerics import dome, sh
from ...progress import Progress
from ...scene import PointLight, ProbeVolume
from ...scene.memory import require_memory
from ...transport.cache.columns import sky_columns, solve_columns, source_columns
from ...transport.cache.relighting import light_again
from ...transport.cache.sun_columns import sun_columns
from ...transport.cache.surface_cache import Traced
from ...transport.context import LightContext
from ...transport.parallel import parallel_for, thread_count
from ..base import Checkpoint, ProbeGrid
from ..lamp_light import LampLight
from ..lattice.coverage import require_open
from ..lattice.dilation import dilate
from ..lattice.placement import Placement, place
from ..probes.bake import surface_cache
from ..probes.distances import mean_distances
from ..probes.gather import GROUP, RAYS_PER_LIGHT_SAMPLE, Gatherer
from ..probes.item_rays import ITEM_RAYS
from ..probes.items import Item
from .columns import LightColumn
from .data import TransferGrid
from .halves import early_light, standard_error
from .hits import gathered, hits_of, radiance_of, sun_seen
from .settings import TransferSettings

# Samples of each lamp that has an extent, where its direct light is in the bake.
LAMP_SAMPLES = 64
# Points of a texel at which a lamp at a site is sampled: many texels make a probe's light.
SITE_SAMPLES = 4
# The solution of a column may be off by this share of the target.
SOLVER_SHARE, COLUMN_SHARE = 0.01, 0.03
# A lamp at a site is a ball of this share of the least distance between sites, so that no texel is lit by a point that touches it.
SITE_RADIUS = 0.05
# How far the bake is when rays are traced, texels lit and solved, and all is gathered.
_PLACED, _REACHED, _LIT, _SOLVED = 0.01, 0.05, 0.1, 0.82


@dataclass(eq=False)
class _Sums:
    """What all probes (p) have found; see TransferGrid, but for probes in one list and colours last. ``early`` (p, k, 3) is the
    light of the bake as the first half of their rays has it."""

    sky: np.ndarray
    response: np.ndarray
    lights: np.ndarray
    distance: np.ndarray
    distance_weight: np.ndarray
    early: np.ndarray


class TransferBake:
    """The transfer of ``volumes`` in the ``dark`` context of a scene, for the lights ``columns``. ``ray_count`` rays in all.

    What takes long goes to ``checkpoint`` when that is due: what lights texels, the columns as they are solved, probes as they are
    gathered. The rest is made again by whoever resumes, to the same bytes.
    """

    def __init__(self, dark: LightContext, columns: list[LightColumn], volumes: tuple[ProbeVolume, ...],
                 settings: TransferSettings, seed: int, progress: Progress, checkpoint: Checkpoint | None = None):
        self._dark, self._columns, self._volumes, self._settings, self._seed = dark, columns, volumes, settings, seed
        progress.stage("placement")
        self._placement: Placement = place(dark, volumes, settings.virtual_offset, progress.span(0.0, _PLACED))
        require_open(volumes, self._placement.measured)
        self.cache = surface_cache(dark, volumes, settings, seed)
        self._gatherer = Gatherer(dark, self.cache, self._placement, settings, seed)
        # In steps of what shares a sample of a light.
        self._rays = -(-settings.rays // RAYS_PER_LIGHT_SAMPLE) * RAYS_PER_LIGHT_SAMPLE
        self._items = items_of(np.flatnonzero(self._placement.measured), self._rays)
        self.sites = np.zeros(0, np.int64)
        self._progress, self._checkpoint = progress, checkpoint or Checkpoint()
        self.ray_count = 2 * sum(item.ray_count for item in self._items)

    def run(self) -> tuple[TransferGrid, ...]:
        """The finished grids, in the order of the volumes. Raises Cancelled and BakeError."""
        settings, progress = self._settings, self._progress
        progress.stage("rays")
        self._reach(progress.span(_PLACED, _REACHED))
        self._require_memory()
        progress.stage("lights")
        gatherers = self._light(progress.span(_REACHED, _LIT))
        progress.stage("columns")
        radiance = self._solve(progress.span(_LIT, _SOLVED)) if settings.bounces != 0 else None
        progress.stage("probes")
        return self._cut(self._gather(gatherers, radiance, progress.span(_SOLVED, 1.0)))

    def _choose_sites(self, clearance: np.ndarray) -> np.ndarray:
        """Indices (J,) of probes as far apart as can be: each is the farthest from those before it (Gonzalez 1985). Only the half
        with the most ``clearance`` (p,) [m] is asked: a lamp that nearly touches a wall lights that alone, and stands for no
        other."""
        probes = np.flatnonzero(self._placement.measured)
        probes = probes[clearance[probes] >= np.median(clearance[probes])]
        positions = self._placement.positions[probes].astype(np.float64)
        chosen, count = [], min(self._settings.sites, len(probes))
        following = int(np.argmin(np.linalg.norm(positions - positions.mean(axis=0), axis=1)))
        distance = np.full(len(positions), np.inf)
        for _ in range(count):
            chosen.append(following)
            distance = np.minimum(distance, np.linalg.norm(positions - positions[following], axis=1))
            following = int(np.argmax(distance))
        return probes[chosen]

    @property
    def _column_count(self) -> int:
        suns = len(dome.directions(self._settings.sun_side, self._settings.sun_below))
        return sh.coefficient_count(self._settings.sky_order) + suns + len(self.sites)

    @property
    def site_positions(self) -> np.ndarray:
        """Where lamps are transferred from: (J, 3) float64."""
        return self._placement.positions[self.sites].astype(np.float64)

    def _require_memory(self) -> None:
        k = sh.coefficient_count(self._settings.order)
        probes = int(self._placement.measured.sum())
        # Held as they are gathered, and once more as they are cut into volumes and filled in.
        require_memory({"transfer": 3 * 12 * k * self._column_count * probes, "rays": 16 * self.ray_count // 2})

    def _reach(self, progress: Progress) -> None:
        """Find the texels that probes' rays meet, and theirs."""
        def look(i):
            item, traced = self._items[i], self._gatherer.trace(self._items[i])
            distance = np.full(item.ray_count, np.inf, np.float32)
            distance[traced.rows] = traced.t
            return traced.surface, distance.reshape(item.shape).min(axis=1)

        traced = parallel_for(look, len(self._items), self._dark.threads, progress.span(0.0, 0.5), "probe rays")
        clearance = np.zeros(len(self._placement.positions), np.float32)
        for item, (_, nearest) in zip(self._items, traced, strict=True):
            clearance[item.probes] = nearest
        self.sites = self._choose_sites(clearance)
        self._texels: list[np.ndarray | None] = [None] * len(self._items)
        if self._settings.bounces != 0:
            self._texels = self.cache.reach([surface for surface, _ in traced], progress.span(0.5, 1.0))
            require_memory({"columns": 3 * 12 * self._column_count * self.cache.count})

    def _light(self, progress: Progress) -> list[Gatherer]:
        """Gatherers of each of the bake's lights, whose caches are solved."""
        result, settings = [], self._settings
        for number, column in enumerate(self._columns):
            span = progress.span(number / len(self._columns), (number + 1) / len(self._columns))
            cache = self.cache.under(column.context, Traced(self.cache.table, self.cache.form_factors, self.cache.rows))
            if settings.bounces != 0:
                light_again(cache, span.span(0.0, 0.5))
                cache.solve(settings.bounces, SOLVER_SHARE * settings.target, span.span(0.5, 1.0))
            result.append(Gatherer(column.context, cache, self._placement, settings, self._seed))
        return result

    def _solve(self, progress: Progress) -> np.ndarray:
        """Irradiance (n + 1, C, 3) of texels under skies, suns and lamps at sites, in this order."""
        settings = self._settings
        found = self._checkpoint.load("sources")
        sources = self._sources(progress.span(0.0, 0.38)) if found is None else found["irradiance"]
        if found is None and self._checkpoint.due:
            self._checkpoint.save("sources", {"irradiance": sources})
        return solve_columns(self.cache, sources, settings.bounces, COLUMN_SHARE * settings.target, progress.span(0.38, 1.0),
                             self._checkpoint)

    def _sources(self, progress: Progress) -> np.ndarray:
        """What texels (n + 1, C, 3) receive of each by themselves."""
        settings = self._settings
        skies = sky_columns(self.cache, settings.sky_order, progress.span(0.0, 0.08))
        suns = sun_columns(self.cache, self._dark, settings.sun_side, settings.sun_below, progress.span(0.08, 0.8))
        context = LightContext(replace(self._dark.scene, lights=_sites(self.site_positions)), self._dark.threads,
                               same_surfaces=self._dark)
        sites = source_columns(self.cache, context, SITE_SAMPLES, progress.span(0.8, 1.0))
        return np.concatenate([skies, suns, sites], axis=1)

    def _gather(self, gatherers: list[Gatherer], irradiance: np.ndarray | None, progress: Progress) -> _Sums:
        settings, count = self._settings, len(self._placement.positions)
        k, skies = sh.coefficient_count(settings.order), sh.coefficient_count(settings.sky_order)
        side = settings.visibility_resolution
        sums = _Sums(np.zeros((count, k, skies), np.float32), np.zeros((count, k, self._column_count, 3), np.float32),
                     np.zeros((count, k, len(gatherers), 3), np.float32), np.zeros((count, side * side, 2), np.float32),
                     np.zeros((count, side * side), np.float32), np.zeros((count, k, 3), np.float32))
        by_hit = self._dark.surfaces.albedo_by_triangle() is None
        radiance, passed = (None, None) if irradiance is None else radiance_of(self.cache, irradiance, by_hit)

        def look(i):
            item, texel = self._items[i], self._texels[i]
            traced = self._gatherer.trace(item)
            parts = [gatherer.shade(item, traced, texel) for gatherer in gatherers]
            early = early_light(gatherers, item, traced, texel)
            plain = self._gatherer.look(item, traced)
            found = hits_of(self._gatherer, item, traced, texel, plain.albedo, settings.order, settings.sky_order)
            response = np.zeros((*item.probes.shape, *sums.response.shape[1:]), np.float32)
            for block, row in zip(response, found, strict=True):
                for values, hits in zip(block, row, strict=True):
                    if radiance is not None and len(hits.texels):
                        values[:] = gathered(hits, radiance, passed)
                    if hits.tinted is not None:
                        values[:, :skies] += hits.tinted
            sky = np.stack([[hits.sky for hits in row] for row in found])
            return plain, np.stack([part.sh for part in parts], axis=3) if parts else None, early, sky, response

        # In batches, so that no second copy of everything is held.
        step, saved = 4 * thread_count(self._dark.threads), self._resumed(sums)
        for first in range(saved, len(self._items), step):
            batch = range(first, min(first + step, len(self._items)))
            span = progress.span(batch.start / len(self._items), batch.stop / len(self._items))
            parts = parallel_for(lambda j, batch=batch: look(batch[j]), len(batch), self._dark.threads, span, "probes")
            for plain, light, early, sky, response in parts:
                sums.distance[plain.probes], sums.distance_weight[plain.probes] = plain.distance, plain.distance_weight
                sums.sky[plain.probes], sums.response[plain.probes] = sky, response
                if light is not None:
                    sums.lights[plain.probes], sums.early[plain.probes] = light / self._rays, early
            if self._checkpoint.due:
                self._save(sums, saved, batch.stop)
                saved = batch.stop
        measured = self._placement.measured if gatherers else np.zeros(count, bool)
        self._noise = np.where(measured, standard_error(sums.lights.sum(axis=2), sums.early, self._rays), np.nan).astype(np.float32)
        for number, column in enumerate(self._columns):
            self._add_direct(sums.lights[:, :, number], column)
        return sums

    def _save(self, sums: _Sums, first: int, stop: int) -> None:
        """Leave what the probes of the items from ``first`` to ``stop`` have found, under the number of the first."""
        probes = np.concatenate([item.probes.reshape(-1) for item in self._items[first:stop]])
        self._checkpoint.save(f"probes{first}", {"stop": np.array(stop), **{
            item.name: getattr(sums, item.name)[probes] for item in fields(sums)}})

    def _resumed(self, sums: _Sums) -> int:
        """Fill ``sums`` with what was saved before an interruption; of how many items."""
        first = 0
        while (found := self._checkpoint.load(f"probes{first}")) is not None:
            stop = int(found["stop"])
            probes = np.concatenate([item.probes.reshape(-1) for item in self._items[first:stop]])
            for item in fields(sums):
                getattr(sums, item.name)[probes] = found[item.name]
            first = stop
        return first

    def _add_direct(self, coefficients: np.ndarray, column: LightColumn) -> None:
        light = LampLight(column.context, False, LAMP_SAMPLES, self._seed)
        rows = np.flatnonzero(self._placement.measured)
        if light and rows.size:
            coefficients[rows] += light.coefficients(self._placement.positions[rows], self._settings.order)

    def _cut(self, sums: _Sums) -> tuple[TransferGrid, ...]:
        settings, result, start = self._settings, [], 0
        side, skies = settings.visibility_resolution, sums.sky.shape[2]
        suns = len(dome.directions(settings.sun_side, settings.sun_below))
        visibility = mean_distances(sums.distance, sums.distance_weight, side)
        seen = np.zeros((len(sums.sky), suns), np.float32)
        rows = np.flatnonzero(self._placement.measured)
        seen[rows] = sun_seen(self._gatherer, self._placement.positions[rows],
                              dome.directions(settings.sun_side, settings.sun_below))
        for volume in self._volumes:
            shape = tuple(reversed(volume.resolution))
            span = slice(start, start + int(np.prod(shape)))
            start = span.stop
            lights = sums.lights[span]
            grid = ProbeGrid(volume, lights.sum(axis=2).reshape(*shape, -1, 3), self._placement.validity[span].reshape(shape),
                             visibility[span].reshape(*shape, side, side, 2), self._placement.offset[span].reshape(*shape, 3),
                             self._noise[span].reshape(shape))
            filled = _Filler(grid)
            response = sums.response[span].reshape(*shape, -1, sums.response.shape[2], 3)
            bounce, of_suns, local = (filled.coloured(part) for part in np.split(response, [skies, skies + suns], axis=4))
            result.append(TransferGrid(
                dilate(grid), filled(sums.sky[span].reshape(*shape, -1, skies)), bounce, of_suns,
                filled(seen[span].reshape(*shape, 1, suns))[:, :, :, 0], filled.coloured(lights.reshape(*shape, *lights.shape[1:])),
                local))
        return tuple(result)


class _Filler:
    """Gives probes of ``grid`` inside geometry the matrices of their neighbours, as ``dilate`` gives them their light."""

    def __init__(self, grid: ProbeGrid):
        self._grid = grid

    def __call__(self, matrices: np.ndarray) -> np.ndarray:
        """Of (nz, ny, nx, k, c)."""
        if matrices.shape[4] == 0:
            return matrices
        return dilate(replace(self._grid, sh=matrices)).sh

    def coloured(self, matrices: np.ndarray) -> np.ndarray:
        """(3, nz, ny, nx, k, c) of (nz, ny, nx, k, c, 3)."""
        shape = matrices.shape
        filled = self(np.ascontiguousarray(matrices).reshape(*shape[:4], -1))
        return np.ascontiguousarray(np.moveaxis(filled.reshape(shape), -1, 0))


def items_of(probes: np.ndarray, rays: int) -> list[Item]:
    """All ``rays`` of ``probes`` (m,), of which GROUP share their directions, in items of whole groups."""
    items, whole = [], len(probes) // GROUP * GROUP
    per_item = max(1, ITEM_RAYS // (rays * GROUP)) * GROUP
    for alike in [*(probes[i:min(i + per_item, whole)] for i in range(0, whole, per_item)), probes[whole:]]:
        if len(alike):
            members = alike.reshape(-1, min(GROUP, len(alike)))
            items.append(Item(members[:, 0] // GROUP, members, np.zeros(len(members), np.int64), rays))
    return items


def _sites(positions: np.ndarray) -> tuple[PointLight, ...]:
    if not len(positions):
        return ()
    gaps = np.linalg.norm(positions[:, None] - positions[None], axis=2)
    gaps[np.diag_indices(len(positions))] = np.inf
    radius = SITE_RADIUS * float(gaps.min()) if len(positions) > 1 else 0.0
    strength = np.full(3, 1.0 / (4.0 * np.pi), np.float32)
    return tuple(PointLight(f"site {number}", position, strength, radius, False) for number, position in enumerate(positions))
