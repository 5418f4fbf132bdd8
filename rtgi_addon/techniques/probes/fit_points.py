"""Where a fit asks for light, and how much there is: on the surfaces that probes see, close above them, and in the air.

On surfaces the cache knows it, as a mean over each texel. Off them a few rays a point do, as from probes; all normals are asked for
there, as things that move have them. What no probe sees is no place where probes are read, and is left out.
"""

from copy import copy

import numpy as np

from ...numerics import sh
from ...numerics.grid import cell_size, transform_points
from ...numerics.sampling import about, cosine_hemisphere, fibonacci_sphere, hash_u32, sobol_owen, sphere_from_square
from ...progress import Progress
from ...transport.cache.texel_table import SurfaceHits
from ...transport.parallel import CHUNK, chunks
from ...transport.rays.tracer import SEGMENT, offset_origins
from ...transport.vectors import dot, luminance, normalized
from ..lamp_light import LampLight
from ..lattice.field import ProbeField
from ..lattice.fitting import DARK, Targets, numbers_of
from .gather import GROUP, SOLVER_SHARE, Gatherer, gather
from .gathering import RAYS_LABEL, in_the_air, items_of
from .relight import HitMemory, Relit, relit_sums
from .shares import TEXEL_COST

# Rays from every probe that tell which texels probes see.
SIGHT_RAYS = 64
# Points of each kind for every probe, the fewest and the most of them on surfaces, the part of those that is kept to off them; and
# under how many normals each point off a surface is read.
SURFACE_POINTS, AIR_POINTS = 64, 64
FEWEST_POINTS, MOST_POINTS = 2048, 1 << 15
OFF_PART, NORMALS = 3, 3
# Rays from each of those: their noise is averaged over many.
AIR_RAYS = 64
# What a point that is read costs in a whole fit, in rays, and where coefficients are fitted alone; and the share of its bake's work
# that a fit may take: where the bake was cheap there are fewer points, down to the fewest.
READ_COST, LINEAR_COST, WORK_SHARE = 40.0, 20.0, 0.7
# One point of so many is kept from the fit, to judge it.
HELD = 4
# So many points of a probe, within those limits, are close above what is dark, and weigh this share of the others above surfaces:
# few are drawn there by area, and light that leaks is where a probe behind a wall was made to look as if it saw past it.
DARK_POINTS, DARK_SHARE = 32, 0.1
# Points close above surfaces lie up to this share of a cell off them.
NEAR = 0.5


class FitPoints:
    """Points for a fit of ``bake``, a finished ProbeBake whose probes ``field`` reads; the same ``seed`` gives the same points.

    Raises Cancelled; BakeError as the surface cache does.
    """

    def __init__(self, bake, field: ProbeField, seed: int, progress: Progress):
        self._bake, self._field = bake, field
        self._spacing = min(float(cell_size(volume.world_from_local, volume.resolution).min()) for volume in bake.volumes)
        probes = int(bake.placement.measured.sum())
        texels = self._seen_texels(progress.span(0.0, 0.2))
        self._cache = self._bounced_once_more(bake.cache)
        unlit = self._dark_ones(texels)
        surface, air, dark = self._counts(probes, len(unlit) > 0)
        self._place_on_surfaces(texels, surface, hash_u32(seed, 1))
        above, dark = self._above_surfaces(texels, air, hash_u32(seed, 2)), self._above_surfaces(unlit, dark, hash_u32(seed, 5))
        beside = [np.concatenate([above[0], dark[0]]), np.concatenate([above[1], dark[1]], axis=1)]
        self._off = [beside, self._in_the_air(air, hash_u32(seed, 3))]
        self._weights = [np.repeat([1.0, DARK_SHARE], [len(above[0]), len(dark[0])]), np.ones(len(self._off[1][0]))]
        self._memory = HitMemory()
        self._light = self._gathered(np.concatenate([points for points, _ in self._off]), int(hash_u32(seed, 4)),
                                     progress.span(0.2, 1.0))

    def _bounced_once_more(self, cache):
        """``cache``, or where bounces are limited one more of them: what probes show at a surface has been reflected once more than
        what their rays find on it."""
        bounces = self._bake.settings.bounces
        if bounces is None:
            return cache
        further = copy(cache)
        further.solved = 0
        further.solve(bounces + 1, SOLVER_SHARE * self._bake.settings.target, Progress(), bright=cache is self._bake.cache)
        return further

    def _counts(self, probes: int, any_dark: bool) -> tuple[int, int, int]:
        """Points on surfaces, in the air and above the dark."""
        bake, wanted = self._bake, ((SURFACE_POINTS, 1), (AIR_POINTS, OFF_PART), (DARK_POINTS * any_dark, OFF_PART))
        least = [FEWEST_POINTS // part if each else 0 for each, part in wanted]
        counts = [int(np.clip(each * probes, few, MOST_POINTS // part)) for few, (each, part) in zip(least, wanted, strict=True)]
        work = WORK_SHARE * (bake.ray_count + TEXEL_COST * bake.cache.rays * bake.cache.count)
        surface, air, dark = counts
        off = 2 * air + dark
        read = surface + NORMALS * off
        numbers = probes * numbers_of(bake.settings.order, bake.settings.visibility_resolution)
        share = work / (off * AIR_RAYS + READ_COST * read)
        # Fewer points than there are numbers do not tell distances.
        self.tell_distances = min(1.0, share) * read >= numbers
        if not self.tell_distances:
            share = work / (off * AIR_RAYS + LINEAR_COST * read)
        return tuple(max(few, int(min(1.0, share) * count)) for few, count in zip(least, counts, strict=True))

    def _seen_texels(self, progress: Progress) -> np.ndarray:
        """Texels (t,) that probes see, on surfaces inside the volumes or less than half a cell outside."""
        bake, context = self._bake, self._bake.context
        origins = bake.placement.positions[bake.placement.measured]
        directions = fibonacci_sphere(SIGHT_RAYS)
        parts = []
        for span in chunks(len(origins), CHUNK // SIGHT_RAYS):
            rays = np.tile(directions, (len(origins[span]), 1))
            hits = context.tracer.intersect(np.repeat(origins[span], SIGHT_RAYS, axis=0), rays)
            rows = np.flatnonzero(hits.primitive >= 0)
            primitive, u, v = hits.primitive[rows], hits.u[rows], hits.v[rows]
            rows = rows[self._within(context.geometry.points(primitive, u, v))]
            primitive, u, v = hits.primitive[rows], hits.u[rows], hits.v[rows]
            front = dot(context.geometry.normals_world[primitive], rays[rows]) < 0
            parts.append(SurfaceHits(primitive, u, v, bake.cache.layout.slots(primitive, u, v, front)))
        if not any(len(part.slots) for part in parts):
            return np.zeros(0, np.int32)
        texels = bake.cache.reach(parts, progress)
        bake.cache.solve(bake.settings.bounces, SOLVER_SHARE * bake.settings.target, progress)
        return np.unique(np.concatenate(texels))

    def _within(self, points: np.ndarray) -> np.ndarray:
        return np.min([lookup.distance(points) for lookup in self._field.lookups], axis=0) <= 0.5 * self._spacing

    def _drawn(self, texels: np.ndarray, count: int, seed) -> tuple[np.ndarray, np.ndarray]:
        """``count`` draws from ``texels``, of each in proportion to its area: those drawn (m,), and how often (m,)."""
        cache = self._bake.cache
        if not len(texels):
            return texels, np.zeros(0, np.int64)
        area = cache.layout.areas(cache.table.slots[texels]) * cache.table.accepted[texels].mean(axis=1)
        ends = np.cumsum(np.maximum(area, 1e-30))
        places = (np.arange(count) + sobol_owen(1, 1, seed)[0, 0]) / count * ends[-1]
        drawn = np.minimum(np.searchsorted(ends, places, side="right"), len(texels) - 1)
        found, times = np.unique(drawn, return_counts=True)
        return texels[found], times

    def _place_on_surfaces(self, texels: np.ndarray, count: int, seed) -> None:
        self.texels, self._times = self._drawn(texels, count, seed)
        surface = self._bake.cache.sampler.on_texels(self.texels, 1)
        self._surface = offset_origins(surface.points, surface.face, surface.face), surface.shading

    def _above_surfaces(self, texels: np.ndarray, count: int, seed) -> tuple[np.ndarray, np.ndarray]:
        """Points (n, 3) close above surfaces, and (NORMALS, n, 3) normals that lean about the surfaces' own."""
        texels, times = self._drawn(texels, count, seed)
        surface = self._bake.cache.sampler.on_texels(np.repeat(texels, times), 1)
        numbers = sobol_owen(len(surface.points), 1 + 2 * NORMALS, seed)
        base = offset_origins(surface.points, surface.face, surface.face)
        room = self._bake.context.tracer.intersect(base, surface.face).t
        height = np.minimum(numbers[:, 0] * np.float32(NEAR * self._spacing), 0.5 * room)
        normals = [normalized(about(surface.face, cosine_hemisphere(numbers[:, 1 + 2 * i:3 + 2 * i]))) for i in range(NORMALS)]
        return base + surface.face * height[:, None], np.stack(normals)

    def _dark_ones(self, texels: np.ndarray) -> np.ndarray:
        """Those of ``texels`` that get less than DARK of the mean light."""
        cache = self._bake.cache
        light = luminance(self._on_surfaces(self._bake.context, self._cache, texels))
        area = cache.layout.areas(cache.table.slots[texels])
        return texels[light < DARK * np.average(light, weights=area)] if len(texels) and area.any() else texels[:0]

    def _in_the_air(self, count: int, seed) -> tuple[np.ndarray, np.ndarray]:
        """Up to ``count`` points (n, 3) all over the volumes that a probe beside them sees, and (NORMALS, n, 3) normals."""
        found = []
        size = np.array([lookup.cell_volume * len(lookup.positions) for lookup in self._field.lookups])
        shares = np.maximum(1, np.round(count * size / size.sum())).astype(int)
        for number, (lookup, share) in enumerate(zip(self._field.lookups, shares, strict=True)):
            local = 2.0 * sobol_owen(share, 3, hash_u32(seed, number)).astype(np.float64) - 1.0
            points = transform_points(lookup.volume.world_from_local, local)
            found.append(points[self._seen(lookup, points)])
        points = np.concatenate(found).astype(np.float32)
        numbers = sobol_owen(len(points), 2 * NORMALS, hash_u32(seed, 7))
        return points, np.stack([sphere_from_square(numbers[:, 2 * i:2 * i + 2]) for i in range(NORMALS)])

    def _seen(self, lookup, points: np.ndarray) -> np.ndarray:
        """(n,) bool: whether any of the live probes around ``points`` (n, 3) sees them."""
        index, trilinear = lookup.neighbours(points, np.zeros_like(points))
        row, corner = np.nonzero((trilinear > 0) & lookup.live[index])
        origins = (lookup.positions[index[row, corner]] + lookup.centre).astype(np.float32)
        hidden = self._bake.context.tracer.occluded(origins, points[row].astype(np.float32) - origins, SEGMENT)
        return np.bincount(row[~hidden], minlength=len(points)) > 0

    def _gathered(self, points: np.ndarray, seed: int, progress: Progress) -> np.ndarray:
        """SH (n, k, 3) of the light at ``points`` (n, 3)."""
        bake = self._bake
        self._gatherer = Gatherer(bake.context, bake.cache, in_the_air(points), bake.settings, seed)
        self._sums = np.zeros((len(points), sh.coefficient_count(bake.settings.order), 3))
        self._emitted = None if bake.emitted is None else np.zeros_like(self._sums)
        items = items_of(np.arange(len(points)), GROUP, AIR_RAYS)
        for item, traced, texel, gathered in zip(items, *gather(self._gatherer, items, progress, RAYS_LABEL), strict=True):
            self._memory.keep(item, traced, texel, gathered)
            self._sums[gathered.probes] += gathered.sh
            if gathered.emitted is not None:
                self._emitted[gathered.probes] += gathered.emitted
        return self._sums / AIR_RAYS

    @property
    def rays(self) -> int:
        """Rays of the points in the air, and of the probes' look at surfaces."""
        return sum(len(points) for points, _ in self._off) * AIR_RAYS + int(self._bake.placement.measured.sum()) * SIGHT_RAYS

    def targets(self) -> list[Targets]:
        """What probes should give on surfaces, close above them and in the air; each set weighs 1."""
        return self._targets(self._bake.context, self._cache, self._light, self._bake.lamp_light)

    def _targets(self, context, cache, light: np.ndarray, lamp_light: LampLight) -> list[Targets]:
        """As ``targets``, of the surfaces' light in ``cache``, the SH of ``light`` (n, k, 3) off them, and ``lamp_light``."""
        order, first = self._bake.settings.order, 0
        on_surfaces = self._on_surfaces(context, cache, self.texels)
        if lamp_light:
            on_surfaces = on_surfaces + lamp_light.irradiance(*self._surface)
            light = light + lamp_light.coefficients(np.concatenate([points for points, _ in self._off]), order)
        targets = [Targets(*self._surface, on_surfaces, self._times / max(1, self._times.sum()))]
        for (points, normals), weights in zip(self._off, self._weights, strict=True):
            own, first = light[first:first + len(points)], first + len(points)
            basis = sh.evaluate(normals, order) * sh.cosine_coefficients(order)
            irradiance = np.einsum("mnk,nkc->mnc", basis, own).reshape(-1, 3)
            weight = np.tile(weights, NORMALS) / max(1.0, NORMALS * weights.sum())
            targets.append(Targets(np.tile(points, (NORMALS, 1)), normals.reshape(-1, 3), irradiance, weight))
        return targets

    def held(self) -> list[np.ndarray]:
        """(n,) bool for each of ``targets``: a fourth of the points, which a fit does not see."""
        return [np.arange(len(self.texels)) % HELD == 0, *(np.tile(np.arange(len(points)) % HELD == 0, NORMALS)
                                                           for points, _ in self._off)]

    def relit(self, other: Relit, progress: Progress) -> list[Targets]:
        """The same under ``other`` light. Raises BakeError if the hits were too many to keep."""
        gatherer = self._gatherer.under(other.context, other.cache)
        sums = relit_sums(self._memory, gatherer, np.zeros_like(self._sums), self._emitted, progress)
        return self._targets(other.context, self._bounced_once_more(other.cache), sums / AIR_RAYS, other.lamp_light)

    def _on_surfaces(self, context, cache, texels: np.ndarray) -> np.ndarray:
        """Irradiance (n, 3) of ``texels`` (n,) without that of lamps."""
        irradiance = cache.irradiance_rest[texels].copy()
        if context.environment.bright.count:
            surface = cache.sampler.on_texels(texels, cache.points)
            irradiance += cache.light.mean([cache.sources.count - 1], cache.table.slots[texels], surface)
        return irradiance
