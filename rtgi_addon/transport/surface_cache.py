"""A radiosity cache on the scene's surfaces: cosine rays once, any number of bounces and any lamps afterwards.

Every texel that a probe's ray reaches, or that another texel sees, traces R cosine-distributed rays from points spread over its
area; the texels these hit are kept as a sparse form-factor matrix F of equal weights 1/R. Radiosity is then B = ρ(E + F·B)
(Goral et al. 1984, eq. 7, with the form factors sampled as in Keller 1996), iterated without new rays. F depends on neither
lamps nor world. What the method is not: exact in space. A texel holds the mean over its area, so irradiance from other
surfaces is blurred to texel size; the light of lamps is therefore taken at the hit point wherever rays can be afforded.
"""

import numpy as np

from ..errors import BakeError
from ..numerics.sampling import cosine_hemisphere, frame, hash_u32, sobol_owen
from ..progress import Progress
from .context import LightContext
from .sources import Sources
from .parallel import CHUNK, parallel_for
from .rays import offset_origins
from .solver import solve_radiosity
from .texels import TexelLayout
from .vectors import dot

# Sources up to this number are all sampled at every point; beyond, each point samples this many chosen by importance.
ALL_SOURCES = 4
# How many choices a texel keeps for the hits that fall into it, where there are too many sources to sample all.
CHOICES = 16
# Share of a texel's choices made by power alone: a lamp that the texel's centre misjudges still gets its light across.
DEFENSIVE = np.float32(0.2)
# Emitters covering more than this share of all surfaces are found by the rays themselves; sampling them adds only noise.
WIDE_EMITTERS = 0.2
# Emissive triangles are sampled this often from each texel.
EMITTER_SAMPLES = 16


class SurfaceCache:
    """Irradiance per texel. ``rays`` cosine rays and ``lamp_samples`` shadow rays per source are spent on each texel.

    After ``extend`` and ``solve``: ``texel(slots)`` gives rows into ``irradiance_rest`` (n + 1, 3) (everything but the sources
    of ``Sources``: world, emission and bounces), ``irradiance_direct`` (n + 1, 3) [W·m⁻²] and ``albedo`` (n + 1, 3). The last
    row is zero and stands for rays that left the scene.
    """

    def __init__(self, context: LightContext, layout: TexelLayout, seed: int, rays: int = 64, lamp_samples: int = 8,
                 max_texels: int = 1 << 20):
        self.context, self.layout, self.sources = context, layout, Sources(context)
        self.rays, self.lamp_samples = int(rays), min(int(lamp_samples), int(rays))
        self.ray_count = 0
        self._seed, self._max_texels = int(seed), max_texels
        self._points = sobol_owen(self.rays, 6, hash_u32(seed, 0x7E8E1))
        self._texel_of_slot = np.full(layout.slot_count, -1, np.int32)
        self._slots = np.zeros(0, np.int32)
        self._hits: list[np.ndarray] = []
        self._solved = 0
        none = np.zeros((1, 3), np.float32)
        self.irradiance_sky, self.irradiance_emission, self.irradiance_direct = none, none, none
        self.irradiance_rest, self.albedo = none, none
        self.choices = np.zeros((1, CHOICES), np.int32)
        self.choice_weights = np.zeros((1, CHOICES), np.float32)
        emitters = context.emitters
        areas = context.geometry.areas
        wide = emitters.count and areas[emitters.primitive].sum(dtype=np.float64) > WIDE_EMITTERS * areas.sum(dtype=np.float64)
        self.emitter_samples = 0 if wide or not emitters.count else min(EMITTER_SAMPLES, self.rays)

    @property
    def count(self) -> int:
        """Number of texels in use."""
        return len(self._slots)

    def texel(self, slots: np.ndarray) -> np.ndarray:
        """Texel (n,) int32 of each slot, −1 (the zero row) for a slot of −1."""
        return np.where(slots < 0, np.int32(-1), self._texel_of_slot[slots])

    def extend(self, wanted: np.ndarray, progress: Progress) -> None:
        """Bring the slots marked in ``wanted`` (slot_count,) bool into use, and every slot their rays reach in turn.

        Raises BakeError when the scene needs more than ``max_texels``.
        """
        pending = np.flatnonzero(wanted & (self._texel_of_slot < 0)).astype(np.int32)
        while pending.size:
            if self.count + pending.size > self._max_texels:
                raise BakeError(f"the surface cache needs more than {self._max_texels:,} texels",
                                "raise the texel size, or place the probe volumes closer to what they light")
            self._texel_of_slot[pending] = np.arange(self.count, self.count + pending.size, dtype=np.int32)
            self._slots = np.concatenate([self._slots, pending])
            pending = self._trace_batch(pending, progress)

    def _trace_batch(self, slots: np.ndarray, progress: Progress) -> np.ndarray:
        per_chunk = max(1, CHUNK // self.rays)
        spans = [slice(i, min(i + per_chunk, len(slots))) for i in range(0, len(slots), per_chunk)]
        parts = parallel_for(lambda i: self._trace(slots[spans[i]]), len(spans), self.context.threads, progress,
                             f"surface cache, {self.count:,} texels")
        mark = np.zeros(self.layout.slot_count, bool)
        for hit_slots, *_ in parts:
            mark[hit_slots[hit_slots >= 0]] = True
        self._hits += [part[0] for part in parts]
        rows = ["irradiance_sky", "irradiance_emission", "irradiance_direct", "albedo"]
        if self.sources.count > ALL_SOURCES:
            rows += ["choices", "choice_weights"]
        for column, name in enumerate(rows, start=1):
            old = getattr(self, name)
            setattr(self, name, np.concatenate([old[:-1], *(part[column] for part in parts), old[-1:]]))
        return np.flatnonzero(mark & (self._texel_of_slot < 0)).astype(np.int32)

    def _numbers(self, slots: np.ndarray, first: int, last: int) -> np.ndarray:
        """(rays, n, last − first): the shared Sobol points, shifted on the torus by a hash of each texel's slot."""
        shifts = np.stack([hash_u32(slots, d, self._seed) for d in range(first, last)], axis=-1)
        shifted = self._points[:, None, first:last] + (shifts >> np.uint32(8)).astype(np.float32) * np.float32(2.0**-24)
        return shifted - np.floor(shifted)

    def _surface(self, slots: np.ndarray, xi: np.ndarray):
        """Points on texels: primitive, u, v (m·n,), position, shading and face normals (m·n, 3) turned to the slot's side."""
        geometry, surfaces = self.context.geometry, self.context.surfaces
        primitive, u, v = (part.reshape(-1) for part in self.layout.sample(slots, xi))
        side = np.tile(np.where(slots & 1, np.float32(1), np.float32(-1)), len(xi))[:, None]
        face = geometry.normals_world[primitive] * side
        shading = surfaces.shading_normal(primitive, u, v) * side if surfaces.has_smooth_normals else face
        return primitive, u, v, geometry.points(primitive, u, v), shading, face

    def _trace(self, slots: np.ndarray):
        """One chunk of texels: the slots their rays hit (R, n), what world and emission give them, direct light and albedo."""
        n, rays = len(slots), self.rays
        surface = self._surface(slots, self._numbers(slots, 0, 2))
        _, _, _, points, shading, face = surface
        directions, cosine = self._directions(slots, shading)
        hits = self.context.tracer.intersect(offset_origins(points, face, directions), directions)
        facing = dot(face, directions) > 0
        miss = hits.primitive < 0
        found = np.flatnonzero(~miss & facing)
        hit_slots = np.full(rays * n, -1, np.int32)
        primitive, u, v = hits.primitive[found], hits.u[found], hits.v[found]
        cosine_hit = dot(self.context.geometry.normals_world[primitive], directions[found])
        hit_slots[found] = self.layout.slots(primitive, u, v, cosine_hit < 0)
        sky = self._sky(directions, np.flatnonzero(miss & facing), n)
        emission = np.zeros((n, 3), np.float32)
        if self.context.surfaces.has_emission:
            emissive = self.context.surfaces.emissive[self.context.geometry.material[primitive]]
            rows = np.flatnonzero(emissive)
            weight = self._weight_of_hit(hits.t[found[rows]], cosine_hit[rows], primitive[rows], cosine[found[rows]] / np.pi)
            radiance = np.zeros((rays * n, 3), np.float32)
            radiance[found[rows]] = self.context.surfaces.emission(primitive[rows], u[rows], v[rows]) * weight[:, None]
            emission = radiance.reshape(rays, n, 3).sum(axis=0) * np.float32(np.pi / rays)
        if self.emitter_samples:
            emission += self._sample_emitters(slots, points, shading, face)
        direct, choices, weights = self._direct_light(slots, surface)
        return hit_slots.reshape(rays, n), sky, emission, direct, self._mean_albedo(surface, n), choices, weights

    def _directions(self, slots, shading) -> tuple[np.ndarray, np.ndarray]:
        local = cosine_hemisphere(self._numbers(slots, 2, 4).reshape(-1, 2))
        tangent, bitangent = frame(shading)
        return tangent * local[:, :1] + bitangent * local[:, 1:2] + shading * local[:, 2:], local[:, 2]

    def _sky(self, directions, escaped, n: int) -> np.ndarray:
        if escaped.size == 0 or self.context.environment.is_black:
            return np.zeros((n, 3), np.float32)
        radiance = np.zeros((self.rays * n, 3), np.float32)
        radiance[escaped] = self.context.environment.base_radiance(directions[escaped])
        return radiance.reshape(self.rays, n, 3).sum(axis=0) * np.float32(np.pi / self.rays)

    def _mean_albedo(self, surface, n: int) -> np.ndarray:
        primitive, u, v = surface[:3]
        by_triangle = self.context.surfaces.has_uniform_albedo
        samples = 1 if by_triangle else self.rays
        albedo = self.context.surfaces.albedo(primitive[: samples * n], u[: samples * n], v[: samples * n])
        return albedo.reshape(samples, n, 3).mean(axis=0)

    def _weight_of_hit(self, t, cosine_hit, primitive, pdf_direction):
        """Balance heuristic (Veach 1995) for emission found by a ray, against the same light found by sampling emitters."""
        if not self.emitter_samples:
            return np.ones(len(t), np.float32)
        pdf_light = self.context.emitters.pdf_area(primitive) * t * t / np.maximum(np.abs(cosine_hit), 1e-6)
        return (self.rays * pdf_direction / (self.rays * pdf_direction + self.emitter_samples * pdf_light)).astype(np.float32)

    def _sample_emitters(self, slots, points, shading, face) -> np.ndarray:
        m, n = self.emitter_samples, len(slots)
        count = m * n
        xi = np.concatenate([self._numbers(slots, 4, 6)[:m], self._numbers(slots, 3, 4)[:m]], axis=2).reshape(count, 3)
        target, normal, radiance, pdf_area, _ = self.context.emitters.sample(xi)
        points, shading, face = points[:count], shading[:count], face[:count]
        towards = target - points
        distance = np.sqrt(np.maximum(dot(towards, towards), 1e-20))
        direction = towards / distance[:, None]
        cosine, cosine_light = dot(shading, direction), np.abs(dot(normal, direction))
        rows = np.flatnonzero((cosine > 0) & (dot(face, direction) > 0) & (cosine_light > 1e-6))
        origins = offset_origins(points[rows], face[rows], direction[rows])
        rows = rows[~self.context.tracer.occluded(origins, direction[rows], distance[rows] * np.float32(1 - 1e-4))]
        pdf_light = pdf_area[rows] * distance[rows] ** 2 / cosine_light[rows]
        weight = 1.0 / (m * pdf_light + self.rays * cosine[rows] / np.pi)
        result = np.zeros((count, 3), np.float32)
        result[rows] = radiance[rows] * (cosine[rows] * weight)[:, None]
        return result.reshape(m, n, 3).sum(axis=0)

    def _direct_light(self, slots, surface):
        """Mean direct irradiance (n, 3) over each texel, and its choice of sources where there are too many to sample all."""
        _, _, _, points, shading, face = surface
        n, samples, sources = len(slots), self.lamp_samples, self.sources.count
        result = np.zeros((n, 3), np.float32)
        if sources == 0:
            return result, None, None
        choices, weights, picks = None, None, range(sources)
        if sources > ALL_SOURCES:
            choices, weights = self._choose(slots, points[:n], shading[:n])
            # Every sample point takes its share of the choices, so that all of them are used.
            picks = range(CHOICES // samples if CHOICES > samples else 1)
        count = samples * n
        zero = np.zeros(count, np.float32)
        uv = self._numbers(slots, 4, 6)[:samples].reshape(count, 2)
        for pick in picks:
            source, weight = pick, np.float32(1)
            if choices is not None:
                column = (np.arange(samples) + pick * samples) % CHOICES
                source = choices[:, column].T.reshape(-1)
                weight = weights[:, column].T.reshape(-1, 1) / np.float32(len(picks))
            light = self.sources.irradiance(source, points[:count], shading[:count], face[:count], zero, uv) * weight
            result += light.reshape(samples, n, 3).mean(axis=0)
        return result, choices, weights

    def _choose(self, slots, points, normals):
        """Pick CHOICES sources per texel in proportion to their unshadowed light at one of its points (stratified)."""
        importance = np.stack([self.sources.importance(i, points, normals) for i in range(self.sources.count)], axis=1)
        importance = importance.astype(np.float64)
        total = importance.sum(axis=1, keepdims=True)
        uniform = 1.0 / self.sources.count
        probability = np.where(total > 0, (1 - DEFENSIVE) * importance / np.maximum(total, 1e-30) + DEFENSIVE * uniform, uniform)
        cdf = np.cumsum(probability, axis=1)
        cdf /= cdf[:, -1:]
        jitter = (hash_u32(slots, 97, self._seed) >> np.uint32(8)) * 2.0**-24
        targets = (np.arange(CHOICES) + jitter[:, None]) / CHOICES
        # One flat search over all rows: row i's distribution is moved to [i, i + 1).
        offset = np.arange(len(slots))[:, None]
        flat = np.searchsorted((cdf + offset).reshape(-1), (targets + offset).reshape(-1), side="right")
        choice = np.minimum(flat.reshape(targets.shape) - offset * self.sources.count, self.sources.count - 1)
        # Shuffle the strata (a rotation by a hash), or each sample point would always meet the same kind of source.
        turn = (hash_u32(slots, 98, self._seed) % np.uint32(CHOICES))[:, None]
        order = (np.arange(CHOICES) * 7 + turn) % CHOICES
        choice = np.take_along_axis(choice, order, axis=1)
        weight = 1.0 / np.take_along_axis(probability, choice, axis=1)
        return choice.astype(np.int32), weight.astype(np.float32)

    def relight(self, context: LightContext, progress: Progress) -> "SurfaceCache":
        """The same texels and hits under other lamps and another world: no form-factor ray is traced again."""
        other = object.__new__(SurfaceCache)
        other.__dict__.update(self.__dict__)
        other.context, other.sources, other._solved = context, Sources(context), 0
        world_changed = context.environment is not self.context.environment
        hits = np.concatenate(self._hits, axis=1) if world_changed else None
        per_chunk = max(1, CHUNK // (self.rays if world_changed else self.lamp_samples))
        spans = [slice(i, min(i + per_chunk, self.count)) for i in range(0, self.count, per_chunk)]

        def work(i):
            slots = self._slots[spans[i]]
            samples = self.rays if world_changed else self.lamp_samples
            surface = self._surface(slots, self._numbers(slots, 0, 2)[:samples])
            sky = None
            if world_changed:
                directions = self._directions(slots, surface[4])[0]
                escaped = (hits[:, spans[i]].reshape(-1) < 0) & (dot(surface[5], directions) > 0)
                sky = other._sky(directions, np.flatnonzero(escaped), len(slots))
            return other._direct_light(slots, surface)[0], sky

        parts = parallel_for(work, len(spans), context.threads, progress, "direct light on the surface cache")
        none = np.zeros((1, 3), np.float32)
        other.irradiance_direct = np.concatenate([part[0] for part in parts] + [none])
        if world_changed:
            other.irradiance_sky = np.concatenate([part[1] for part in parts] + [none])
        return other

    def solve(self, bounces: int | None, tolerance: float, progress: Progress) -> None:
        """Spread light between texels: ``bounces`` reflections in all (None: until the change is below ``tolerance``).

        A probe's own look at a surface is one reflection, so ``bounces`` − 1 of them happen here.
        """
        if self._solved == self.count:
            return
        form_factors = [self.texel(hits) for hits in self._hits]
        fixed = self.irradiance_sky + self.irradiance_emission
        source = fixed + self.irradiance_direct
        gathered = solve_radiosity(form_factors, source, self.albedo, bounces, tolerance, self.context.threads, progress)
        self.irradiance_rest = fixed + gathered
        self._solved = self.count
