"""A radiosity cache on the scene's surfaces: cosine rays once, any number of bounces and any lamps afterwards.

Every texel that a probe's ray reaches, or that another texel sees, traces R cosine-distributed rays from points spread over its
visible part; the texels these hit are kept as a sparse form-factor matrix F of equal weights 1/R. Irradiance is then E = E₀ + F·ρE
(Goral et al. 1984, eq. 7, with the form factors sampled as in Keller 1996), iterated without new rays. F depends on neither
lamps nor world. What the method is not: exact in space. A texel holds the mean over its area, so irradiance from other
surfaces is blurred to texel size; the light of lamps is therefore taken at the hit point wherever rays can be afforded.
"""

import numpy as np

from ..errors import BakeError
from ..numerics.sampling import cosine_hemisphere, frame, hash_u32, sobol_owen
from ..progress import Progress
from .bright import TEXEL_SAMPLES, BrightSurfaces
from .context import LightContext
from .light_changes import FEW_CHANGES, changed_sources
from .parallel import CHUNK, parallel_for
from .rays import offset_origins
from .solver import solve_radiosity
from .sources import Sources
from .texel_light import ALL_SOURCES, TexelLight
from .texel_table import SurfaceHits, TexelTable
from .texels import TexelLayout
from .vectors import dot

# Rays that leave from one point of a texel; R over this many points stand for the texel's area.
RAYS_PER_POINT = 4
# Emitters covering more than this share of all surfaces are found by the rays themselves; sampling them adds only noise.
WIDE_EMITTERS = 0.2
# Emissive triangles are sampled this often from each texel.
EMITTER_SAMPLES = 16
# Rows that every batch of traced texels appends.
_ROWS = ("irradiance_sky", "irradiance_emission", "irradiance_direct", "smooth", "choices", "choice_weights", "albedo")


class SurfaceCache:
    """Irradiance per texel, from ``rays`` cosine rays and up to ``lamp_samples`` shadow rays per source for each.

    After ``reach`` and ``solve`` these arrays have a row per texel, and a last row of zeros for rays that left the scene (−1):
    ``irradiance_rest`` (everything but the light of ``sources``), ``irradiance_direct`` (n + 1, 3) [W·m⁻²], ``albedo`` (n + 1, 3),
    ``smooth`` (n + 1, 1) bool: direct light varies by less than ``smoothness`` (relative) over the texel, so its mean will do.
    """

    def __init__(self, context: LightContext, layout: TexelLayout, seed: int, rays: int = 64, lamp_samples: int = 8,
                 smoothness: float = 0.1, max_texels: int = 1 << 20):
        self.context, self.layout, self.sources = context, layout, Sources(context)
        self.rays = max(RAYS_PER_POINT * 2, int(rays) // RAYS_PER_POINT * RAYS_PER_POINT)
        self.points = self.rays // RAYS_PER_POINT
        self.lamp_samples = min(int(lamp_samples), self.points)
        self.smoothness = smoothness
        self._seed, self._max_texels = int(seed), max_texels
        self._sobol = sobol_owen(self.rays, 6, hash_u32(seed, 0x7E8E1))
        self.table = TexelTable(context, layout, lambda slots: self.numbers(slots, 0, 2, self.points), self.points)
        self.form_factors: list[np.ndarray] = []
        self._ray_density: list[np.ndarray] = []
        none = np.zeros((1, 3), np.float32)
        self.irradiance_sky = self.irradiance_emission = self.irradiance_direct = self.albedo = self.irradiance_rest = none
        self.choices, self.choice_weights = TexelLight.no_choices()
        self.smooth = np.ones((1, 1), bool)
        self.bright = self._nothing_bright()
        self._first_bounce, self._solved = none, 0
        emitters, areas = context.emitters, context.geometry.areas
        wide = emitters.count and areas[emitters.primitive].sum(dtype=np.float64) > WIDE_EMITTERS * areas.sum(dtype=np.float64)
        self.emitter_samples = 0 if wide or not emitters.count else min(EMITTER_SAMPLES, self.points)
        self._light = TexelLight(self)

    @property
    def count(self) -> int:
        """Number of texels that have traced their rays."""
        return len(self.albedo) - 1

    def reach(self, parts: list[SurfaceHits], progress: Progress) -> list[np.ndarray]:
        """The texel (n,) int32 of every hit of each part, after bringing those into use and all that their rays reach in turn.

        Raises BakeError when the scene needs more than ``max_texels``.
        """
        texels = self.table.resolve(parts)
        while self.count < self.table.count:
            if self.table.count > self._max_texels:
                raise BakeError(f"the surface cache needs more than {self._max_texels:,} texels",
                                "raise the texel size, or place the probe volumes closer to what they light")
            self._trace_batch(np.arange(self.count, self.table.count), progress)
        return texels

    def _trace_batch(self, texels: np.ndarray, progress: Progress) -> None:
        per_chunk = max(1, CHUNK // self.rays)
        spans = [texels[i:i + per_chunk] for i in range(0, len(texels), per_chunk)]
        parts = parallel_for(lambda i: self._trace(spans[i]), len(spans), self.context.threads, progress,
                             f"surface cache, {self.table.count:,} texels")
        resolved = self.table.resolve([part[0] for part in parts])
        for (_, found, density, *_), texel in zip(parts, resolved, strict=True):
            block = np.full(density.size, -1, np.int32)
            block[found] = texel
            self.form_factors.append(block.reshape(density.shape))
            self._ray_density.append(density)
        for column, name in enumerate(_ROWS, start=3):
            old = getattr(self, name)
            setattr(self, name, np.concatenate([old[:-1], *(part[column] for part in parts), old[-1:]]))

    def numbers(self, slots: np.ndarray, first: int, last: int, count: int) -> np.ndarray:
        """(count, n, last − first): the shared Sobol points, shifted on the torus by a hash of each texel's slot."""
        shifts = np.stack([hash_u32(slots, d, self._seed) for d in range(first, last)], axis=-1)
        shifted = self._sobol[:count, None, first:last] + (shifts >> np.uint32(8)).astype(np.float32) * np.float32(2.0**-24)
        return shifted - np.floor(shifted)

    def surface(self, texels: np.ndarray, count: int):
        """``count`` points on the visible part of each texel: primitive, u, v (count·n,), position, shading normal and face normal
        (count·n, 3) turned to the texel's side."""
        slots = self.table.slots[texels]
        primitive, u, v = self.layout.sample(slots, self.numbers(slots, 0, 2, count))
        seeds = self.table.seeds.take(texels)
        accepted = self.table.accepted[texels, :count].T
        primitive, u, v = (np.where(accepted, part, seed).reshape(-1) for part, seed in
                           ((primitive, seeds.primitive), (u, seeds.u), (v, seeds.v)))
        return self.surface_at(np.tile(slots, count), primitive, u, v)

    def surface_at(self, slots: np.ndarray, primitive: np.ndarray, u: np.ndarray, v: np.ndarray, points: np.ndarray | None = None):
        """As ``surface``, for given points (m,) on ``slots`` (m,), whose positions (m, 3) may be known."""
        geometry, surfaces = self.context.geometry, self.context.surfaces
        side = np.where(slots & 1, np.float32(1), np.float32(-1))[:, None]
        face = geometry.normals_world[primitive] * side
        shading = surfaces.shading_normal(primitive, u, v) * side if surfaces.has_smooth_normals else face
        return primitive, u, v, geometry.points(primitive, u, v) if points is None else points, shading, face

    def _trace(self, texels: np.ndarray):
        """One chunk: what the texels' rays hit, and what world, emission and lamps give the texels."""
        n, rays, slots = len(texels), self.rays, self.table.slots[texels]
        surface = self.surface(texels, self.points)
        points, shading, face = (np.tile(part, (RAYS_PER_POINT, 1)) for part in surface[3:])
        directions, cosine = self._directions(slots, shading)
        hits = self.context.tracer.intersect(offset_origins(points, face, directions), directions)
        facing = dot(face, directions) > 0
        found = np.flatnonzero((hits.primitive >= 0) & facing)
        primitive, u, v, t = hits.primitive[found], hits.u[found], hits.v[found], hits.t[found]
        cosine_hit = dot(self.context.geometry.normals_world[primitive], directions[found])
        surface_hits = SurfaceHits(primitive, u, v, self.layout.slots(primitive, u, v, cosine_hit < 0))
        # Density of the ray per area of the surface that it met.
        density = np.zeros(rays * n, np.float32)
        density[found] = cosine[found] * np.float32(1 / np.pi) * np.abs(cosine_hit) / np.maximum(t * t, np.float32(1e-20))
        sky = self._sky(directions, np.flatnonzero((hits.primitive < 0) & facing), n)
        emission = np.zeros((n, 3), np.float32)
        if self.context.surfaces.has_emission:
            emission = self._emission_of_hits(surface_hits, found, density[found], n)
        if self.emitter_samples:
            emission = emission + self._sample_emitters(slots, surface)
        return (surface_hits, found, density.reshape(rays, n), sky, emission, *self._light.direct(texels, surface),
                self._mean_albedo(surface, n))

    def _directions(self, slots, shading) -> tuple[np.ndarray, np.ndarray]:
        local = cosine_hemisphere(self.numbers(slots, 2, 4, self.rays).reshape(-1, 2))
        tangent, bitangent = frame(shading)
        return tangent * local[:, :1] + bitangent * local[:, 1:2] + shading * local[:, 2:], local[:, 2]

    def _sky(self, directions, escaped, n: int) -> np.ndarray:
        if escaped.size == 0 or self.context.environment.is_black:
            return np.zeros((n, 3), np.float32)
        return self._mean_over_rays(escaped, self.context.environment.base_radiance(directions[escaped]), n)

    def _mean_over_rays(self, rows, radiance, n: int) -> np.ndarray:
        """π × the mean over each texel's rays of ``radiance`` on ``rows``: an irradiance (n, 3)."""
        full = np.zeros((self.rays * n, 3), np.float32)
        full[rows] = radiance
        return full.reshape(self.rays, n, 3).sum(axis=0) * np.float32(np.pi / self.rays)

    def _mean_albedo(self, surface, n: int) -> np.ndarray:
        count = n if self.context.surfaces.has_uniform_albedo else len(surface[0])
        primitive, u, v = (part[:count] for part in surface[:3])
        return self.context.surfaces.albedo(primitive, u, v).reshape(-1, n, 3).mean(axis=0)

    def _emission_of_hits(self, hits: SurfaceHits, found, density, n: int) -> np.ndarray:
        rows = np.flatnonzero(self.context.surfaces.emissive[self.context.geometry.material[hits.primitive]])
        radiance = self.context.surfaces.emission(hits.primitive[rows], hits.u[rows], hits.v[rows])
        if self.emitter_samples:
            # Balance heuristic (Veach 1995) against the same light found by sampling emitters.
            by_ray = self.rays * density[rows]
            by_light = self.emitter_samples * self.context.emitters.pdf_area(hits.primitive[rows])
            radiance = radiance * (by_ray / np.maximum(by_ray + by_light, 1e-30))[:, None]
        return self._mean_over_rays(found[rows], radiance, n)

    def _sample_emitters(self, slots, surface) -> np.ndarray:
        m, n = self.emitter_samples, len(slots)
        count = m * n
        points, shading, face = (part[:count] for part in surface[3:])
        xi = np.concatenate([self.numbers(slots, 4, 6, m), self.numbers(slots, 3, 4, m)], axis=2).reshape(count, 3)
        target, normal, radiance, pdf_area, _ = self.context.emitters.sample(xi)
        towards = target - points
        squared = np.maximum(dot(towards, towards), np.float32(1e-20))
        direction = towards / np.sqrt(squared)[:, None]
        # Irradiance per radiance and area of the emitter, and the rays' density there but for π.
        transfer = np.maximum(dot(shading, direction), 0) * np.abs(dot(normal, direction)) / squared
        rows = np.flatnonzero((transfer > 0) & (dot(face, direction) > 0))
        origins = offset_origins(points[rows], face[rows], direction[rows])
        rows = rows[~self.context.tracer.occluded(origins, direction[rows], np.sqrt(squared[rows]) * np.float32(1 - 1e-4))]
        result = np.zeros((count, 3), np.float32)
        weight = transfer[rows] / (m * pdf_area[rows] + self.rays * transfer[rows] / np.float32(np.pi))
        result[rows] = radiance[rows] * weight[:, None]
        return result.reshape(m, n, 3).sum(axis=0)

    def _sample_bright(self, texels: np.ndarray) -> np.ndarray:
        """Irradiance (n, 3) of the bright surfaces' first reflection, balanced against the rays that hit them."""
        m, n = min(TEXEL_SAMPLES, self.points), len(texels)
        _, _, _, points, shading, face = self.surface(texels, m)
        jitter = self.numbers(self.table.slots[texels], 4, 5, m)[..., 0]
        numbers = (np.arange(m, dtype=np.float32)[:, None] + jitter) / np.float32(m)
        _, irradiance = self.bright.connect(numbers.reshape(-1), points, m, self.rays / np.pi, (shading, face))
        return irradiance.reshape(m, n, 3).sum(axis=0)

    def relight(self, context: LightContext, progress: Progress) -> "SurfaceCache":
        """The same texels and hits under other lamps and another world, for ``solve`` with ``bright`` False: no form-factor ray is
        traced again. Direct light is known as its mean over each texel alone: ``smooth`` is True throughout."""
        other = object.__new__(SurfaceCache)
        other.__dict__.update(self.__dict__)
        other.context, other.sources, other._solved = context, Sources(context), 0
        other.bright = other._nothing_bright()
        other._light = TexelLight(other)
        other.smooth = np.ones_like(self.smooth)
        world_changed = context.environment is not self.context.environment
        gone, came = changed_sources(self.context, context)
        few = other.sources.count > ALL_SOURCES and len(gone) + len(came) <= FEW_CHANGES
        ends = np.cumsum([block.shape[1] for block in self.form_factors])

        def work(i):
            texels = np.arange(ends[i] - self.form_factors[i].shape[1], ends[i])
            surface = self.surface(texels, self.points if world_changed else self.lamp_samples)
            sky = self.irradiance_sky[texels]
            if world_changed:
                shading, face = (np.tile(part, (RAYS_PER_POINT, 1)) for part in surface[4:])
                directions = self._directions(self.table.slots[texels], shading)[0]
                escaped = (self.form_factors[i].reshape(-1) < 0) & (dot(face, directions) > 0)
                sky = other._sky(directions, np.flatnonzero(escaped), len(texels))
            if not few:
                return sky, other._light.direct(texels, surface)[0]
            direct = self.irradiance_direct[texels]
            direct = direct + other._mean_light(other.sources, came, texels, surface)
            return sky, direct - other._mean_light(self.sources, gone, texels, surface)

        parts = parallel_for(work, len(ends), context.threads, progress, "direct light on the surface cache")
        none = np.zeros((1, 3), np.float32)
        other.irradiance_sky, other.irradiance_direct = (
            np.concatenate([*(part[column] for part in parts), none]) for column in range(2))
        return other

    def _mean_light(self, sources: Sources, chosen: list[int], texels: np.ndarray, surface) -> np.ndarray:
        """Mean direct irradiance (n, 3) of the ``chosen`` of ``sources`` over the first points of ``surface``."""
        samples, n = self.lamp_samples, len(texels)
        points, shading, face = (part[:samples * n] for part in surface[3:])
        uv = self.numbers(self.table.slots[texels], 4, 6, samples).reshape(-1, 2)
        light = np.zeros((samples * n, 3), np.float32)
        for source in chosen:
            light += sources.irradiance(source, points, shading, face, np.zeros(len(points), np.float32), uv)
        return light.reshape(samples, n, 3).mean(axis=0)

    def state(self) -> dict[str, np.ndarray]:
        """Everything that was measured, for a checkpoint."""
        arrays = {f"table.{name}": value for name, value in self.table.state().items()}
        arrays |= {f"bright.{name}": value for name, value in self.bright.state().items()}
        arrays |= {name: getattr(self, name) for name in (*_ROWS, "irradiance_rest")}
        widths = np.array([block.shape[1] for block in self.form_factors], np.int64)
        empty = np.zeros((self.rays, 0), np.int32)
        return arrays | {"first_bounce": self._first_bounce, "solved": np.array(self._solved), "widths": widths,
                         "form_factors": np.concatenate([empty, *self.form_factors], axis=1),
                         "ray_density": np.concatenate([empty.astype(np.float32), *self._ray_density], axis=1)}

    def restore(self, arrays: dict[str, np.ndarray]) -> None:
        """Take up from ``state``."""
        self.table.restore({name.removeprefix("table."): value for name, value in arrays.items() if name.startswith("table.")})
        bright = {name.removeprefix("bright."): value for name, value in arrays.items() if name.startswith("bright.")}
        self.bright = BrightSurfaces.restored(self.context, bright)
        for name in (*_ROWS, "irradiance_rest"):
            setattr(self, name, arrays[name])
        self._first_bounce, self._solved = arrays["first_bounce"], int(arrays["solved"])
        ends = np.cumsum(arrays["widths"])[:-1]
        self.form_factors = np.split(arrays["form_factors"], ends, axis=1) if len(arrays["widths"]) else []
        self._ray_density = np.split(arrays["ray_density"], ends, axis=1) if len(arrays["widths"]) else []

    def solve(self, bounces: int | None, tolerance: float, progress: Progress, bright: bool = True) -> None:
        """Spread light between texels: ``bounces`` reflections in all (None: until the change is below ``tolerance``).

        A probe's own look at a surface is one reflection, so ``bounces`` − 1 of them happen here. ``bright`` False leaves brightly
        lit surfaces to the rays that hit them, which costs no further ray and gives more noise.
        """
        if self._solved == self.count:
            return
        if self._solved == 0:
            looked_at = self.count if bright else 0
            slots, radiance = self.table.slots[:looked_at], self._reflected()[:looked_at]
            self.bright = BrightSurfaces(self.context, self.layout, slots, radiance, self._light.radiance_at, self._seed)
            self._first_bounce = np.zeros((1, 3), np.float32)
        self.bright.cover(self.table.slots)
        self._first_bounce = self._gather_first_bounce(progress)
        fixed = self.irradiance_sky + self.irradiance_emission
        received = solve_radiosity(self.form_factors, fixed, self._first_bounce, self.albedo, bounces, tolerance,
                                   self.context.threads, progress)
        self.irradiance_rest = fixed + received
        self._solved = self.count

    def _nothing_bright(self) -> BrightSurfaces:
        none = np.zeros(0, np.int32)
        return BrightSurfaces(self.context, self.layout, none, np.zeros((0, 3), np.float32), None, self._seed)

    def _reflected(self) -> np.ndarray:
        return self.albedo * self.irradiance_direct * np.float32(1 / np.pi)

    def _gather_first_bounce(self, progress: Progress) -> np.ndarray:
        """Irradiance (n + 1, 3) that texels receive from what lamps light directly; rows known from an earlier call are kept."""
        radiance = self._reflected()
        ends = np.cumsum([block.shape[1] for block in self.form_factors])
        start = int(np.searchsorted(ends, len(self._first_bounce) - 1, side="right"))

        def work(i):
            block, density = self.form_factors[i], self._ray_density[i]
            incoming = np.take(radiance, block, axis=0, mode="wrap")
            if not self.bright.count:
                return incoming.sum(axis=0) * np.float32(np.pi / self.rays)
            by_light = min(TEXEL_SAMPLES, self.points) * np.take(self.bright.pdf_area, block, mode="wrap")
            weight = np.where(by_light > 0, self.rays * density / np.maximum(self.rays * density + by_light, 1e-30), 1)
            hit = np.einsum("rnc,rn->nc", incoming, weight) * np.float32(np.pi / self.rays)
            return hit + self._sample_bright(np.arange(ends[i] - block.shape[1], ends[i]))

        blocks = range(start, len(ends))
        parts = parallel_for(lambda k: work(blocks[k]), len(blocks), self.context.threads, progress, "light from bright surfaces")
        return np.concatenate([self._first_bounce[:-1], *parts, self._first_bounce[-1:]])
