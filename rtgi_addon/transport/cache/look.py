"""Radiance along any rays, with the light of what they hit read from a surface cache: what pictures see of a scene."""

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np

from ... import kernels
from ...numerics.sampling import about, cosine_hemisphere, sobol_tables
from ...progress import Progress
from ..context import LightContext
from ..lights.links import LightLinks
from ..paths.direct import Receiver, sample_environment
from ..paths.numbers import SCATTER, PathNumbers
from ..rays.ray_counter import record
from ..rays.tracer import Tracer, offset_origins
from ..vectors import dot
from .hit_light import HitLight, HitRays
from .relighting import light_again
from .surface_cache import SurfaceCache, Traced
from .texel_table import SurfaceHits
from .texels import Focus, TexelLayout, size_for

# Texels around what a picture shows, rays from each, and by how much direct light may vary over one that counts as smooth: as a
# bake to half a per cent has them. Every pixel looks at many, so their noise is a small part of its own.
TEXELS, RAYS, SMOOTHNESS = 24000, 128, 0.05
# The solution may be off by this share.
TOLERANCE = 1e-3
# What numbers a ray draws beside those of transport.paths.numbers: lamps at its hit, and a point of the bright surfaces.
_AT_HIT, _BRIGHT_SURFACES = 16, 17
# Density of cosine-distributed rays per projected solid angle.
_COSINE_DENSITY = 1.0 / np.pi


@dataclass(frozen=True, eq=False)
class Looks:
    """Rays from ``origins`` (n, 3) along unit ``directions`` (n, 3), with ``numbers`` for them, and what they met: ``rows`` (h,) of
    those that ``hits`` (h,) surfaces, ``t`` (h,) [m] away, under ``cosine`` (h,) between the front's normal there and the way back,
    ``tint`` (n, 3) of what comes along (None: unchanged). ``density`` (n,) [1/sr] is what they were drawn with, None where no other
    samples compete with them; ``depth`` how many surfaces the paths had met before."""

    origins: np.ndarray
    directions: np.ndarray
    numbers: PathNumbers
    rows: np.ndarray
    hits: SurfaceHits
    t: np.ndarray
    cosine: np.ndarray
    tint: np.ndarray | None
    density: np.ndarray | None
    depth: int = 0

    def of(self, chosen: np.ndarray) -> "Looks":
        """Those of the rays that are ``chosen`` (n,) bool."""
        position, kept = np.cumsum(chosen) - 1, chosen[self.rows]
        optional = (None if part is None else part[chosen] for part in (self.tint, self.density))
        return Looks(self.origins[chosen], self.directions[chosen], self.numbers.take(chosen), position[self.rows[kept]],
                     self.hits.take(kept), self.t[kept], self.cosine[kept], *optional, self.depth)


class CachedScene:
    """A scene whose surfaces hold their light; made ``about`` a sphere of ``radius`` [m] around ``center_world`` (3,) it is
    accurate there.

    Rays are looked along in three steps: ``look``, by any number of threads; ``settle``, once for all of them, which brings into
    the cache what they met; ``radiance``, by threads again. The same for any number of threads.
    """

    def __init__(self, context: LightContext, cache: SurfaceCache):
        self.context, self.cache = context, cache
        self._hit_light = HitLight(cache)
        self._albedo = context.surfaces.albedo_by_triangle()
        # Where everything glows, samples of it add nothing but noise.
        self._samples_emitters = cache.emitter_samples > 0

    @classmethod
    def about(cls, context: LightContext, center_world: np.ndarray, radius: float, seed: int = 0,
              links: LightLinks | None = None) -> "CachedScene":
        """The scene of ``context``, no light known yet; lights to come are linked as ``links`` say (None: as its own)."""
        size, links = size_for(context.geometry, center_world, radius, TEXELS), links or context.links
        layout = TexelLayout(context.geometry, Focus(center_world, radius, size), links.lit_alike if links.has_receivers else None)
        return cls(context, SurfaceCache(context, layout, seed, RAYS, smoothness=SMOOTHNESS))

    def under(self, context: LightContext, progress: Progress) -> "CachedScene":
        """The same surfaces, in as many texels as are in use, under the light of another ``context`` of theirs. Raises
        Cancelled."""
        cache = self.cache.under(context, Traced(self.cache.table, self.cache.form_factors, self.cache.rows))
        light_again(cache, progress)
        return CachedScene(context, cache)

    def look(self, origins: np.ndarray, directions: np.ndarray, numbers: PathNumbers,
             density: np.ndarray | None = None, depth: int = 0) -> Looks:
        """Trace rays (n,) that leave surfaces; see Looks."""
        hits = self.context.tracers.diffuse.intersect(origins, directions)
        rows = np.flatnonzero(hits.primitive >= 0)
        primitive, u, v = hits.primitive[rows], hits.u[rows], hits.v[rows]
        cosine = -dot(self.context.geometry.normals_world[primitive], directions[rows])
        slots = self.cache.layout.slots(primitive, u, v, cosine > 0)
        return Looks(origins, directions, numbers, rows, SurfaceHits(primitive, u, v, slots), hits.t[rows], cosine, hits.tint,
                     density, depth)

    def look_about(self, points: np.ndarray, normals: np.ndarray, faces: np.ndarray, numbers: PathNumbers, rays: int) -> Looks:
        """Trace ``rays`` cosine-distributed rays each from ``points`` on surfaces with unit shading ``normals`` and triangles'
        normals ``faces`` (n, 3), one after the other, by ``numbers`` for each ray; see Looks."""
        tracer = self.context.tracers.diffuse
        if kernels.is_available() and getattr(tracer, "kernel", None) is not None:
            return self._look_about(tracer, points, normals, faces, numbers, rays)
        local, point = cosine_hemisphere(numbers.draw(0, SCATTER, 2)), np.repeat(np.arange(len(points)), rays)
        directions = about(normals[point], local)
        density = local[:, 2] * np.float32(_COSINE_DENSITY)
        return self.look(offset_origins(points[point], faces[point], directions), directions, numbers, density)

    def _look_about(self, tracer: Tracer, points, normals, faces, numbers: PathNumbers, rays: int) -> Looks:
        """See look_about: in one pass, where no surface lets rays through."""
        n = len(points) * rays
        record(n)
        starts = [np.ascontiguousarray(part, np.float32) for part in (points, normals, faces)]
        if any(part.shape != (len(points), 3) for part in starts):
            raise ValueError(f"{[part.shape for part in starts]} where {len(points)} points are expected")
        origins, directions = np.empty((2, n, 3), np.float32)
        rows, primitive, slots = np.empty((3, n), np.int32)
        leaving, u, v, t, cosine = np.empty((5, n), np.float32)
        cells = self.cache.layout.cells  # held while the kernel reads it
        count = kernels.call("cosine_rays", tracer.kernel, len(cells), cells.ctypes.data, sobol_tables(), SCATTER, len(points),
                             rays, *numbers.dense(n), *starts, origins, directions, leaving, rows,
                             primitive, u, v, t, slots, cosine)
        # Copies: what is held until all is shaded is most of a sample's memory.
        rows, primitive, slots, u, v, t, cosine = (part[:count].copy() for part in (rows, primitive, slots, u, v, t, cosine))
        return Looks(origins, directions, numbers, rows.astype(np.int64), SurfaceHits(primitive, u, v, slots), t, cosine, None,
                     leaving * np.float32(_COSINE_DENSITY))

    def settle(self, looks: list[Looks], progress: Progress | None = None) -> list[np.ndarray]:
        """The texel (h,) of every hit of each of ``looks``, with the light on all of them known. Raises BakeError where there is
        not the memory for it, and Cancelled."""
        progress = progress or Progress()
        texels = self.cache.reach([look.hits for look in looks], progress)
        self.cache.solve(None, TOLERANCE, progress)
        return texels

    def radiance(self, look: Looks, texel: np.ndarray, albedo: np.ndarray | None = None,
                 unlit: np.ndarray | None = None) -> np.ndarray:
        """Radiance (n, 3) [W·sr⁻¹·m⁻²] along the rays of ``look``; ``albedo`` (h, 3) of the hits, None for all that they reflect in
        the mean over directions. Where rays have a density it is weighted against what ``sampled_irradiance`` finds as well, and
        leaves bright patches of the world to it; rays that are ``unlit`` (n,) bool leave to
        ``light_samples`` all that those sample."""
        surfaces, environment, rays = self.context.surfaces, self.context.environment, _LookRays(look)
        every, hits = np.arange(len(look.rows)), look.hits
        result = np.zeros(look.directions.shape, np.float32)
        if albedo is None and self._albedo is not None and len(self._albedo) != len(texel):
            albedo = self._albedo
        elif albedo is None:
            albedo = surfaces.albedo(hits.primitive, hits.u, hits.v, rays.cosine(every))
        seen = self._hit_light.reflected(hits, texel, albedo, rays)
        if surfaces.has_emission:
            emitted = self._emitted(look, rays)
            left_out = unlit is not None and self._samples_emitters
            seen = seen + (emitted if not left_out else np.where(unlit[look.rows, None], np.float32(0.0), emitted))
        result[look.rows] = seen
        if not environment.is_black:
            missed = np.ones(len(result), bool)
            missed[look.rows] = False
            result[missed] = environment.base_radiance(look.directions[missed])
            if environment.bright.count and look.density is None:
                shown = missed if unlit is None else missed & ~unlit
                result[shown] += environment.bright.radiance(look.directions[shown])
        return result if look.tint is None else result * look.tint

    def _emitted(self, look: Looks, rays: "_LookRays") -> np.ndarray:
        surfaces, emitters, result = self.context.surfaces, self.context.emitters, np.zeros((len(look.rows), 3), np.float32)
        rows = np.flatnonzero(surfaces.emissive[self.context.geometry.material[look.hits.primitive]])
        hits = look.hits.take(rows)
        result[rows] = surfaces.emission(hits.primitive, hits.u, hits.v, rays.cosine(rows))
        if look.density is not None and self._samples_emitters:
            result[rows] *= rays.share(rows, emitters.pdf_area(hits.primitive, hits.u, hits.v))
        return result

    def light_samples(self, points: np.ndarray, receiver: Receiver, numbers: PathNumbers,
                      per_ray: float) -> Iterator[tuple[np.ndarray, np.ndarray]]:
        """Directions (n, 3) and irradiance (n, 3) of one sample each of emissive surfaces, unless rays find these better, and of
        bright patches of the world; weighted against ``per_ray`` rays of density cosθ/π."""
        off = offset_origins(points, receiver.face, receiver.face)
        return sample_environment(self.context, off, numbers, 0, per_ray, receiver, self._samples_emitters)

    @property
    def has_samples(self) -> bool:
        """Whether there is anything that ``sampled_irradiance`` finds."""
        context = self.context
        emitters = self._samples_emitters and context.emitters.count > 0
        return bool(emitters or context.environment.bright.count or self.cache.bright.count)

    def sampled_irradiance(self, points: np.ndarray, receiver: Receiver, numbers: PathNumbers) -> np.ndarray:
        """An estimate (n, 3) [W·m⁻²] of what emissive and brightly lit surfaces and bright patches of the world give ``points``
        (n, 3) on surfaces: one sample each, weighted against one ray of density cosθ/π."""
        result = np.zeros(points.shape, np.float32)
        for samples in (self.light_samples(points, receiver, numbers, 1.0), self.bright_samples(points, receiver, numbers)):
            for _, irradiance in samples:
                result += irradiance
        return result

    def bright_samples(self, points: np.ndarray, receiver: Receiver,
                       numbers: PathNumbers) -> Iterator[tuple[np.ndarray, np.ndarray]]:
        """As ``light_samples`` of one ray, of brightly lit surfaces, if there are any."""
        if self.cache.bright.count:
            chosen = numbers.draw(0, _BRIGHT_SURFACES, 1)[:, 0]
            yield self.cache.bright.connect(chosen, points, 1.0, _COSINE_DENSITY, (receiver.shading, receiver.face))


@dataclass(frozen=True, eq=False)
class _LookRays(HitRays):
    """Looks as HitLight asks about them; see HitRays."""

    looks: Looks

    def take(self, rows: np.ndarray) -> "_LookRays":
        look = self.looks
        return _LookRays(replace(look, rows=look.rows[rows], hits=look.hits.take(rows), t=look.t[rows], cosine=look.cosine[rows]))

    def points(self, rows: np.ndarray) -> np.ndarray:
        ray = self.looks.rows[rows]
        return self.looks.origins[ray] + self.looks.directions[ray] * self.reach(rows)[:, None]

    def reach(self, rows: np.ndarray) -> np.ndarray:
        return self.looks.t[rows]

    def cosine(self, rows: np.ndarray) -> np.ndarray:
        return self.looks.cosine[rows]

    def numbers(self, rows: np.ndarray, count: int) -> np.ndarray:
        return self.looks.numbers.take(self.looks.rows[rows]).draw(self.looks.depth, _AT_HIT, count)

    def share(self, rows: np.ndarray, pdf_area: np.ndarray) -> np.ndarray:
        if self.looks.density is None:
            return np.ones((len(rows), 1), np.float32)
        density = self.looks.density[self.looks.rows[rows]]
        by_ray = density * np.abs(self.cosine(rows)) / np.maximum(self.reach(rows) ** 2, np.float32(1e-20))
        return (by_ray / np.maximum(by_ray + pdf_area, 1e-30))[:, None]
