"""A radiosity cache on the scene's surfaces: cosine rays once, any number of bounces and any lamps afterwards.

Every texel that a probe's ray reaches, or that another texel sees, traces R cosine-distributed rays from points spread over its
visible part; the texels these hit are kept as a sparse form-factor matrix F of equal weights 1/R. Irradiance is then E = E₀ + F·ρE
(Goral et al. 1984, eq. 7, with the form factors sampled as in Keller 1996), iterated without new rays. F depends on neither
lamps nor world. What the method is not: exact in space. A texel holds the mean over its area, so irradiance from other
surfaces is blurred to texel size; the light of lamps is therefore taken at the hit point wherever rays can be afforded.
"""

from typing import NamedTuple

import numpy as np

from ...errors import BakeError
from ...numerics.sampling import about, cosine_hemisphere, hash_u32
from ...progress import Progress
from ...scene.memory import require_memory
from ..context import LightContext
from ..parallel import CHUNK, parallel_for
from ..paths.direct import Receiver, connect_emitters
from ..paths.scattering import walk
from ..paths.sources import Sources
from ..rays.tracer import offset_origins
from ..vectors import dot
from .bright import TEXEL_SAMPLES, BrightSurfaces, find_bright
from .form_factors import FormFactors
from .media_walks import TexelWalks, on_texels
from .memory import traced_bytes
from .solver import solve_radiosity
from .surface_points import SurfacePoints, TexelSampler
from .texel_kernels import TexelRays, texel_rays, tracer_of
from .texel_light import ALL_SOURCES, TexelLight
from .texel_numbers import BRIGHT_CHOICE, DIRECTION, EMITTER_CHOICE, LIGHT, TexelNumbers
from .texel_rows import TexelRows
from .texel_table import SurfaceHits, TexelTable
from .texels import TexelLayout, side_of

# Rays that leave from one point of a texel; R over this many points stand for the texel's area.
RAYS_PER_POINT = 4
# Emitters covering more than this share of all surfaces are found by the rays themselves; sampling them adds only noise.
WIDE_EMITTERS = 0.2
# Tells the numbers of walks in media apart from all others of a seed.
_WALKS = 0x3ED1A
# Emissive triangles are sampled this often from each texel.
EMITTER_SAMPLES = 16


def samples_emitters(context: LightContext) -> bool:
    """Whether emissive triangles are sampled, and not left to the rays that meet them."""
    emitters, area = context.emitters, context.geometry.areas.sum(dtype=np.float64)
    wide = emitters.count and emitters.effective_area > WIDE_EMITTERS * area and not context.links.emitters_have_blockers
    return bool(emitters.count and not wide)


class Traced(NamedTuple):
    """What does not depend on light, and what it gave: the ``table`` of texels, their ``form_factors`` and ``rows``."""

    table: TexelTable
    form_factors: FormFactors
    rows: TexelRows


class _Batch(NamedTuple):
    """A chunk of traced texels: the rays ``found`` (h,) that hit surfaces, where, their ``density`` there (R, n; 0: none), the
    ``angles`` (h,) at which they see what reflects by the angle (None: nothing does), the ``tints`` (R·n, 3) of what comes along
    all rays (None: unchanged), rows."""

    hits: SurfaceHits
    found: np.ndarray
    density: np.ndarray
    angles: np.ndarray | None
    tints: np.ndarray | None
    rows: TexelRows


class SurfaceCache:
    """Irradiance per texel, from ``rays`` cosine rays and up to ``lamp_samples`` shadow rays per source for each.

    After ``reach`` and ``solve`` there is a row per texel, and a last row of zeros for rays that left the scene (−1), in ``rows``
    (see TexelRows) and ``irradiance_rest`` (n + 1, 3) [W·m⁻²]: everything but the light of ``sources``. Direct light that varies by
    less than ``smoothness`` (relative) over a texel counts as smooth. ``traced`` is what another cache of the same surfaces found.
    """

    def __init__(self, context: LightContext, layout: TexelLayout, seed: int, rays: int = 64, lamp_samples: int = 8,
                 smoothness: float = 0.1, max_texels: int = 1 << 20, traced: Traced | None = None):
        self.context, self.layout, self.sources = context, layout, Sources(context)
        self.rays = max(RAYS_PER_POINT * 2, int(rays) // RAYS_PER_POINT * RAYS_PER_POINT)
        self.points = self.rays // RAYS_PER_POINT
        self.lamp_samples, self.smoothness = min(int(lamp_samples), self.points), smoothness
        self.numbers, self._max_texels = TexelNumbers(seed, self.rays), max_texels
        self.light = TexelLight(self.sources, context.surfaces, self.numbers, self.lamp_samples, smoothness)
        if traced is None:
            table = TexelTable(context, layout, self.numbers, self.points)
            traced = Traced(table, FormFactors(self.rays), TexelRows.none(len(self.light.limits), self.light.choices))
        self.table, self.form_factors, self.rows = traced
        self.sampler = TexelSampler(context, layout, self.table, self.numbers)
        self.bright = BrightSurfaces(context)
        self.irradiance_rest, self.first_bounce = np.zeros((1, 3), np.float32), self._no_bounce()
        self.bounce_halves = np.zeros((1, 3), np.float32)
        self.solved = 0
        self.emitter_samples = min(EMITTER_SAMPLES, self.points) if samples_emitters(context) else 0

    def under(self, context: LightContext, traced: Traced) -> "SurfaceCache":
        """A cache with these settings in another ``context`` of the same surfaces."""
        return SurfaceCache(context, self.layout, self.numbers.seed, self.rays, self.lamp_samples, self.smoothness,
                            self._max_texels, traced)

    @property
    def count(self) -> int:
        """Number of texels that have traced their rays."""
        return self.rows.count

    @property
    def chooses_sources(self) -> bool:
        """Whether the sources are too many to sample all of them everywhere."""
        return self.sources.count > ALL_SOURCES

    def reach(self, parts: list[SurfaceHits], progress: Progress, expected: int = 0) -> list[np.ndarray]:
        """The texel (n,) int32 of every hit of each part, after bringing those into use and all that their rays reach in turn:
        about as many that ``expected`` (0: unknown) are then in use, for the progress.

        Raises BakeError when the scene needs more than ``max_texels``, or more memory than there is.
        """
        texels, before = self.table.resolve(parts), self.count
        while self.count < self.table.count:
            if self.table.count > self._max_texels:
                raise BakeError(f"the surface cache needs more than {self._max_texels:,} texels",
                                "raise the texel size, or place the probe volumes closer to what they light")
            require_memory({"the surface cache": traced_bytes(self, self.table.count - self.count)})
            whole = max(expected, self.table.count) - before
            self._trace_batch(np.arange(self.count, self.table.count), progress.span(
                (self.count - before) / whole, (self.table.count - before) / whole))
        return texels

    def _trace_batch(self, texels: np.ndarray, progress: Progress) -> None:
        per_chunk = max(1, CHUNK // self.rays)
        spans = [texels[i:i + per_chunk] for i in range(0, len(texels), per_chunk)]
        parts = parallel_for(lambda i: self._trace(spans[i]), len(spans), self.context.threads, progress,
                             f"surface cache, {self.table.count:,} texels")
        translucent, others = self._other_sides(texels)
        *resolved, opposite = self.table.resolve([*(part.hits for part in parts), others])
        for part, hit_texels in zip(parts, resolved, strict=True):
            self.form_factors.append(part.found, hit_texels, part.density, part.angles, part.tints)
        rows = self.rows.followed_by([part.rows for part in parts])
        rows.opposite[texels[translucent], 0] = opposite
        self.rows = rows

    def _other_sides(self, texels: np.ndarray) -> tuple[np.ndarray, SurfaceHits]:
        """Which (k,) of ``texels`` light passes from the other side, and where their seeds lie on that."""
        seeds = self.table.seeds.take(texels)
        chosen = np.flatnonzero(self.context.surfaces.translucent[self.context.geometry.material[seeds.primitive]])
        seeds = seeds.take(chosen)
        return chosen, SurfaceHits(seeds.primitive, seeds.u, seeds.v, seeds.slots ^ 1)

    def _trace(self, texels: np.ndarray) -> _Batch:
        """One chunk: what the texels' rays hit, and what world, emission and lamps give the texels."""
        n, slots = len(texels), self.table.slots[texels]
        surface = self.sampler.on_texels(texels, self.points)
        rays, limits = self._rays(slots, surface)
        found, primitive, cosine_hit, density, tints = rays.found, rays.primitive, rays.cosine, rays.density, rays.tint
        surface_hits = SurfaceHits(primitive, rays.u, rays.v, rays.slots)
        sky, halves = self._sky(rays.directions, rays.escaped, n, tints)
        emission = np.zeros((n, 3), np.float32)
        if self.context.surfaces.has_emission:
            emission, apart = self._emission_of_hits(surface_hits, -cosine_hit, found, density[found], surface, tints)
            halves = halves + apart
        if self.emitter_samples:
            emission = emission + self._sample_emitters(slots, surface)
        if self.walks_media:
            ends = self._walks(slots, surface, rays.directions, limits)
            emission = emission + ends.irradiance
            if self.context.media.scatters:
                found = np.concatenate([found, ends.found + self.rays * n])
                primitive, cosine_hit = np.append(primitive, ends.hits.primitive), np.append(cosine_hit, ends.cosine)
                surface_hits = SurfaceHits.join([surface_hits, ends.hits])
                density, tints = np.append(density, ends.density), np.concatenate([tints, ends.tints])
        rows = TexelRows(sky, emission, *self.light.direct(slots, surface), self._mean_albedo(slots, surface),
                         self._mean_translucency(slots, surface), np.full((n, 1), -1, np.int32), self.light.limited(slots, surface),
                         halves)
        angles = None
        if self.context.surfaces.albedo_by_angle.present:
            face = self.context.surfaces.face(primitive, -cosine_hit)
            angles = self.context.surfaces.albedo_by_angle.rows(face, cosine_hit)
        return _Batch(surface_hits, found, density.reshape(-1, n), angles, tints, rows)

    def _rays(self, slots: np.ndarray, surface: SurfacePoints) -> tuple[TexelRays, np.ndarray | None]:
        """The rays from the points of ``surface``, and how far they go (R·n,), where that matters."""
        tracer = self.context.tracers.diffuse
        if tracer_of(tracer) and not self.walks_media:
            return texel_rays(tracer_of(tracer), self.layout.tables, self.numbers.shared(DIRECTION, self.rays),
                              self.numbers.shifts(slots, DIRECTION), surface.points, surface.shading, surface.face), None
        directions, cosine, face = self._directions(slots, surface)
        hits = tracer.intersect(offset_origins(np.tile(surface.points, (RAYS_PER_POINT, 1)), face, directions), directions)
        facing = dot(face, directions) > 0
        found = np.flatnonzero((hits.primitive >= 0) & facing)
        primitive, u, v, t = hits.primitive[found], hits.u[found], hits.v[found], hits.t[found]
        cosine_hit = dot(self.context.geometry.normals_world[primitive], directions[found])
        # Density of the ray per area of the surface that it met.
        density = np.zeros(len(directions), np.float32)
        density[found] = cosine[found] * np.float32(1 / np.pi) * np.abs(cosine_hit) / np.maximum(t * t, np.float32(1e-20))
        met = self.layout.slots(primitive, u, v, cosine_hit < 0)
        escaped = np.flatnonzero((hits.primitive < 0) & facing)
        return TexelRays(directions, density, found, primitive, u, v, met, cosine_hit, escaped, hits.tint), hits.t

    @property
    def walks_media(self) -> bool:
        """Whether rays find light on their way, and not only where they end."""
        return self.context.media.scatters or self.context.media.is_emissive

    def _walks(self, slots: np.ndarray, surface: SurfacePoints, directions: np.ndarray, limits: np.ndarray) -> TexelWalks:
        """What media add to the texels' rays; those that leave into the surface itself see nothing."""
        points, face = (np.tile(part, (RAYS_PER_POINT, 1)) for part in (surface.points, surface.face))
        rows = np.flatnonzero(dot(face, directions) > 0)
        key = hash_u32(np.tile(slots, self.rays)[rows], rows // len(slots), self.numbers.seed, _WALKS)
        origins = offset_origins(points[rows], face[rows], directions[rows])
        walks = walk(self.context, self.sources, origins, directions[rows], limits[rows], key)
        return on_texels(self.context, self.layout, walks, rows, self.rays, len(slots))

    def _directions(self, slots: np.ndarray, surface: SurfacePoints) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Directions (R·n, 3) of all rays from the points of ``surface``, their cosines (R·n,) to the shading normals, and the face
        normals (R·n, 3) there."""
        shading, face = (np.tile(part, (RAYS_PER_POINT, 1)) for part in (surface.shading, surface.face))
        local = cosine_hemisphere(self.numbers.of(slots, DIRECTION, self.rays).reshape(-1, 2))
        return about(shading, local), local[:, 2], face

    def escaped_again(self, slots: np.ndarray, surface: SurfacePoints,
                      block: int) -> tuple[np.ndarray, np.ndarray, np.ndarray | None]:
        """Directions (R·n, 3) of the rays of the texels with ``slots`` (n,), those of a ``block`` of the form factors, which rows
        (e,) of them left the scene, and the tints (R·n, 3) of what comes along them (None: unchanged)."""
        escaped = self.form_factors.hits[block][:self.rays].reshape(-1) < 0
        tints = self.form_factors.tints[block][:self.rays].reshape(-1, 3) if self.form_factors.tints else None
        directions, _, face = self._directions(slots, surface)
        return directions, np.flatnonzero(escaped & (dot(face, directions) > 0)), tints

    def sky_again(self, slots: np.ndarray, surface: SurfacePoints, block: int) -> np.ndarray:
        """Irradiance of the world on the texels with ``slots`` (n,), those of a ``block`` of the form factors, and by how much more
        that is by the first half of their rays than by the second: (2, n, 3)."""
        directions, escaped, tints = self.escaped_again(slots, surface, block)
        return self._sky(directions, escaped, len(slots), tints)

    def met_again(self, texels: np.ndarray) -> TexelRows:
        """Rows of ``texels`` (n,) in use, by the light that their rays find, which are traced again: for a cache made ``under``."""
        return self._trace(texels).rows

    def _sky(self, directions, escaped, n: int, tints: np.ndarray | None) -> np.ndarray:
        """As ``_mean_over_rays``."""
        if escaped.size == 0 or self.context.environment.is_black:
            return np.zeros((2, n, 3), np.float32)
        radiance = self.context.environment.base_radiance(directions[escaped])
        return self._mean_over_rays(escaped, radiance if tints is None else radiance * tints[escaped], n)

    def _mean_over_rays(self, rows, radiance, n: int) -> np.ndarray:
        """π × the mean over each texel's rays of ``radiance`` on ``rows``, an irradiance, and by how much more that is of the first
        half of them than of the second: (2, n, 3)."""
        full = np.zeros((self.rays * n, 3), np.float32)
        full[rows] = radiance
        return self._of_halves(full.reshape(self.rays, n, 3))

    def _of_halves(self, radiance: np.ndarray) -> np.ndarray:
        """As ``_mean_over_rays`` of ``radiance`` (R, n, 3)."""
        first, second = radiance[:self.rays // 2].sum(axis=0), radiance[self.rays // 2:].sum(axis=0)
        return np.stack([first + second, 2.0 * (first - second)]) * np.float32(np.pi / self.rays)

    def _mean_albedo(self, slots: np.ndarray, surface: SurfacePoints) -> np.ndarray:
        if self.context.surfaces.has_uniform_albedo:
            surface = surface.first(len(slots))
        side = np.tile(side_of(slots)[:, 0], len(surface.u) // len(slots))
        albedo = self.context.surfaces.albedo_of_side(surface.primitive, surface.u, surface.v, side)
        return albedo.reshape(-1, len(slots), 3).mean(axis=0)

    def _mean_translucency(self, slots: np.ndarray, surface: SurfacePoints) -> np.ndarray:
        surfaces, n = self.context.surfaces, len(slots)
        if not surfaces.has_translucency:
            return np.zeros((n, 3), np.float32)
        side = np.tile(side_of(slots)[:, 0], len(surface.u) // n)
        return surfaces.translucency(surface.primitive, surface.u, surface.v, side).reshape(-1, n, 3).mean(axis=0)

    def _emission_of_hits(self, hits: SurfaceHits, cosine, found, density, surface: SurfacePoints,
                           tints) -> np.ndarray:
        context, n = self.context, RAYS_PER_POINT * len(surface.points) // self.rays
        rows = np.flatnonzero(context.surfaces.emissive[context.geometry.material[hits.primitive]])
        if context.links.restricts_emitters:
            left = surface.primitive[found[rows] % len(surface.points)]
            emitter, receiver = (context.geometry.instance[part] for part in (hits.primitive[rows], left))
            rows = rows[context.links.found_by_rays(emitter, receiver)]
        radiance = context.surfaces.emission(hits.primitive[rows], hits.u[rows], hits.v[rows], cosine[rows])
        if self.emitter_samples:
            # Balance heuristic (Veach 1995) against the same light found by sampling emitters.
            by_ray = self.rays * density[rows]
            by_light = self.emitter_samples * self.context.emitters.pdf_area(hits.primitive[rows], hits.u[rows], hits.v[rows])
            radiance = radiance * (by_ray / np.maximum(by_ray + by_light, 1e-30))[:, None]
        if tints is not None:
            radiance = radiance * tints[found[rows]]
        return self._mean_over_rays(found[rows], radiance, n)

    def _sample_emitters(self, slots: np.ndarray, surface: SurfacePoints) -> np.ndarray:
        m, n = self.emitter_samples, len(slots)
        surface = surface.first(m * n)
        xi = np.concatenate([self.numbers.of(slots, LIGHT, m), self.numbers.of(slots, EMITTER_CHOICE, m)], axis=2).reshape(-1, 3)
        _, irradiance = connect_emitters(self.context, self.context.emitters.sample(xi), surface.points, m, self.rays,
                                         Receiver(surface.shading, surface.face, surface.primitive))
        return irradiance.reshape(m, n, 3).sum(axis=0)

    def _sample_bright(self, texels: np.ndarray) -> np.ndarray:
        """Irradiance of the bright surfaces' first reflection, balanced against the rays that hit them, and by how much more
        that is of every other sample, from the first on: (2, n, 3)."""
        m, n = min(TEXEL_SAMPLES, self.points), len(texels)
        surface = self.sampler.on_texels(texels, m)
        jitter = self.numbers.of(self.table.slots[texels], BRIGHT_CHOICE, m)[..., 0]
        numbers = (np.arange(m, dtype=np.float32)[:, None] + jitter) / np.float32(m)
        _, irradiance = self.bright.connect(numbers.reshape(-1), surface.points, m, self.rays / np.pi,
                                            (surface.shading, surface.face))
        irradiance = irradiance.reshape(m, n, 3)
        first, second = irradiance[::2].sum(axis=0), irradiance[1::2].sum(axis=0)
        return np.stack([first + second, 2.0 * (first - second)])

    def solve(self, bounces: int | None, tolerance: float, progress: Progress, bright: bool = True,
              start: np.ndarray | None = None) -> None:
        """Spread light between texels: ``bounces`` reflections in all (None: until the change is below ``tolerance``).

        A probe's own look at a surface is one reflection, so ``bounces`` − 1 of them happen here. ``bright`` False leaves brightly
        lit surfaces to the rays that hit them, which costs no further ray and gives more noise. ``start`` (n + 1, 3) is what texels
        are thought to receive from one another: the nearer, the sooner.
        """
        if self.solved == self.count:
            return
        if self.solved == 0:
            looked_at = self.count if bright else 0
            self.bright = find_bright(self.context, self.layout, self.table.slots[:looked_at], self._reflected()[:looked_at],
                                      self._light_at, self.numbers.seed)
            self.first_bounce, self.bounce_halves = self._no_bounce(), np.zeros((1, 3), np.float32)
        self.bright.cover(self.table.slots)
        fixed = self.rows.irradiance_sky + self.rows.irradiance_emission
        if start is not None and bounces is None and not self.bright.count and not self.light.limits:
            # What lamps light directly goes the same way as all other light, and needs no pass of its own.
            lit = fixed + self.rows.irradiance_direct
            self.irradiance_rest = fixed + self._spread(lit, np.zeros_like(fixed), None, tolerance, progress, start=start)
            self.solved = self.count
            return
        self.first_bounce = self._gather_first_bounce(progress)
        unlimited, *limited = np.split(self.first_bounce, 1 + len(self.light.limits), axis=1)
        # A later round adds few texels: what the others received is where to go on from.
        known = None if limited or not self.solved else self.irradiance_rest[:self.solved] - fixed[:self.solved]
        self.irradiance_rest = fixed + self._spread(fixed, unlimited, bounces, tolerance, progress, known)
        for first_bounce, limit in zip(limited, self.light.limits, strict=True):
            most = limit + 1 if bounces is None else min(limit + 1, bounces)
            self.irradiance_rest += self._spread(np.zeros_like(fixed), first_bounce, most, tolerance, progress)
        self.solved = self.count

    def _spread(self, fixed, first_bounce, bounces, tolerance, progress, known=None, start=None) -> np.ndarray:
        first_bounce = np.ascontiguousarray(first_bounce)
        angles = self.context.surfaces.albedo_by_angle.table
        return solve_radiosity(self.form_factors, fixed, first_bounce, self.rows, angles, bounces, tolerance, self.context.threads,
                               progress, known, start)

    def _no_bounce(self) -> np.ndarray:
        return np.zeros((1, 3 * (1 + len(self.light.limits))), np.float32)

    def _light_at(self, slots, primitive, u, v, uv) -> tuple[np.ndarray, SurfacePoints]:
        """See LightAt."""
        surface = self.sampler.at(slots, primitive, u, v)
        # A ray would meet the point as often as it is covered; a connection always does.
        covered = self.context.surfaces.coverage(primitive, u, v, side_of(slots)[:, 0])
        return self.light.reflected(slots, surface, uv) * covered[:, None], surface

    def _reflected(self) -> np.ndarray:
        return self.rows.leaving(self.rows.irradiance_direct) * np.float32(1 / np.pi)

    def _gather_first_bounce(self, progress: Progress) -> np.ndarray:
        """Irradiance (n + 1, 3 + 3g) that texels receive from what lamps light directly: those without a limit of bounces, and then
        those of each limit; rows known from an earlier call are kept."""
        radiance = self._reflected()
        by_limit = [self.rows.leaving(limited) * np.float32(1 / np.pi) for limited in self.rows.irradiance_limited.swapaxes(0, 1)]
        unlimited = radiance - sum(by_limit) if by_limit else radiance
        known, spans = len(self.first_bounce) - 1, self.form_factors.spans()
        start = sum(span.stop <= known for span in spans)

        def work(i):
            block, density = self.form_factors.hits[i], self.form_factors.density[i]
            by_angle = self.context.surfaces.albedo_by_angle.table
            if by_limit:
                # The pool of bright points does not tell whose light it is.
                seen = [self.form_factors.seen(i, leaving, by_angle).sum(axis=0) for leaving in (unlimited, *by_limit)]
                return np.concatenate(seen, axis=1) * np.float32(np.pi / self.rays), np.zeros((block.shape[1], 3), np.float32)
            incoming = self.form_factors.seen(i, radiance, by_angle)
            if not self.bright.count:
                return of_halves(incoming)
            by_light = min(TEXEL_SAMPLES, self.points) * np.take(self.bright.pdf_area, block, mode="wrap")
            weight = np.where(by_light > 0, self.rays * density / np.maximum(self.rays * density + by_light, 1e-30), 1)
            return of_halves(incoming * weight[:, :, None]) + self._sample_bright(np.arange(spans[i].start, spans[i].stop))

        def of_halves(incoming):
            # Walks in media follow the rays.
            return sum(self._of_halves(part) for part in incoming.reshape(-1, self.rays, *incoming.shape[1:]))

        blocks = range(start, len(spans))
        parts = parallel_for(lambda k: work(blocks[k]), len(blocks), self.context.threads, progress, "light from bright surfaces")
        self.bounce_halves = np.concatenate([self.bounce_halves[:-1], *(part[1] for part in parts), self.bounce_halves[-1:]])
        return np.concatenate([self.first_bounce[:-1], *(part[0] for part in parts), self.first_bounce[-1:]])
