"""Light at what rays hit, read from a solved surface cache: a texel's own where that is smooth over it, by shadow rays from the hit
itself elsewhere. Probes and pictures look at surfaces through this."""

from dataclasses import dataclass, replace
from typing import NamedTuple, Protocol

import numpy as np

from ... import kernels
from ...numerics.sampling import hash_u32, unit_interval, wrapped
from ..paths.scattering import Walks
from .surface_cache import SurfaceCache
from .surface_points import SurfacePoints
from .texel_light import ALL_SOURCES, CHOICES
from .texel_table import SurfaceHits

# How far one lamp's numbers are shifted from the one's before it: the square of the golden ratio's fraction, whose multiples fill
# the interval evenly.
_TURN = 0.381966


class Arrivals(NamedTuple):
    """How rays of density ``pdf`` [1/sr] arrived: under which ``cosine`` (h,), from ``reach`` (h,) [m] away; ``per_light`` of them
    go with one sample of a light."""

    cosine: np.ndarray
    reach: np.ndarray
    pdf: float
    per_light: float


class HitRays(Protocol):
    """Rays that hit surfaces; every method is asked for some ``rows`` (m,) of the hits alone."""

    def take(self, rows: np.ndarray) -> "HitRays":
        """The given hits only."""

    def points(self, rows: np.ndarray) -> np.ndarray:
        """Where they hit (m, 3), world."""

    def lit_sides(self, rows: np.ndarray) -> tuple[np.ndarray, np.ndarray] | None:
        """``points``, and the normals (m, 3) of the sides that were met; None where that is not told at once."""
        return None

    def reach(self, rows: np.ndarray) -> np.ndarray:
        """How far they went (m,) [m]."""

    def cosine(self, rows: np.ndarray) -> np.ndarray:
        """Cosine (m,) between the front's normal at the hits and the way back along the rays."""

    def numbers(self, rows: np.ndarray, count: int) -> np.ndarray:
        """(m, count) in [0, 1): a place on a lamp (2), then, as a third, the choice of one."""

    def share(self, rows: np.ndarray, pdf_area: np.ndarray) -> np.ndarray:
        """Balance heuristic (m, 1) of the rays for light that samples with ``pdf_area`` (m,) [m⁻²] find as well."""

    def arrivals(self) -> Arrivals | None:
        """What ``share`` makes that of, of all hits; None where it is none of such densities."""
        return None


@dataclass(frozen=True, eq=False)
class EndRays(HitRays):
    """The last pieces of ``walks`` whose ``ends`` (h,) are on surfaces, met under ``cosine`` (h,), as HitLight asks about them; see
    HitRays. ``seed`` tells their numbers apart."""

    walks: Walks
    ends: np.ndarray
    cosines: np.ndarray
    seed: int

    def take(self, rows: np.ndarray) -> "EndRays":
        return replace(self, ends=self.ends[rows], cosines=self.cosines[rows])

    def points(self, rows: np.ndarray) -> np.ndarray:
        chosen = self.ends[rows]
        return self.walks.points[chosen] + self.walks.directions[chosen] * self.walks.t[chosen][:, None]

    def reach(self, rows: np.ndarray) -> np.ndarray:
        return self.walks.t[self.ends[rows]]

    def cosine(self, rows: np.ndarray) -> np.ndarray:
        return -self.cosines[rows]

    def numbers(self, rows: np.ndarray, count: int) -> np.ndarray:
        bits = np.ascontiguousarray(self.walks.directions[self.ends[rows]], np.float32).view(np.uint32)
        return unit_interval(np.stack([hash_u32(bits[:, 0], bits[:, 1], bits[:, 2], d, self.seed) for d in range(count)], axis=1))

    def share(self, rows: np.ndarray, pdf_area: np.ndarray) -> np.ndarray:
        return np.ones((len(rows), 1), np.float32)


class HitLight:
    """Reads a ``cache`` that is solved for the texels it is asked about. Threads may ask at once."""

    def __init__(self, cache: SurfaceCache):
        self._cache = cache

    def reflected(self, hits: SurfaceHits, texel: np.ndarray, albedo: np.ndarray, rays: HitRays) -> np.ndarray:
        """Radiance (h, 3) [W·sr⁻¹·m⁻²] that surfaces reflect, or pass on diffusely, along ``rays`` that found ``hits`` (h,), on the
        texels ``texel`` (h,): without what they emit, and without what is sampled as a bright surface. ``albedo`` is that of the
        hits (h, 3), or of all triangles (t, 3)."""
        cache, surfaces = self._cache, self._cache.context.surfaces
        by_triangle = len(albedo) != len(texel)
        if kernels.is_available() and not surfaces.has_translucency and (not cache.bright.count or rays.arrivals() is not None):
            return self._reflected(hits, texel, albedo, rays, by_triangle)
        if by_triangle:
            albedo = np.take(albedo, hits.primitive, axis=0)
        radiance = self._arriving(hits, texel, texel, rays)
        radiance *= albedo
        if surfaces.has_translucency:
            rows = np.flatnonzero(cache.rows.opposite[texel, 0] >= 0)
            chosen, opposite = hits.take(rows), cache.rows.opposite[texel[rows], 0]
            passed = surfaces.translucency(chosen.primitive, chosen.u, chosen.v, rays.cosine(rows))
            other = replace(chosen, slots=chosen.slots ^ 1)
            radiance[rows] += self._arriving(other, opposite, texel[rows], rays.take(rows)) * passed
        radiance *= np.float32(1.0 / np.pi)
        return radiance

    def _reflected(self, hits: SurfaceHits, texel: np.ndarray, albedo: np.ndarray, rays: HitRays, by_triangle: bool) -> np.ndarray:
        """See reflected: in one pass, where nothing passes diffusely."""
        cache, n, direct, arrivals = self._cache, len(texel), None, None
        rows, texel = cache.rows, np.ascontiguousarray(texel, np.int32)
        texels, uneven = len(rows.smooth), np.empty(0, np.int64)
        if cache.sources.count:
            uneven = np.empty(n, np.int64)
            uneven = uneven[:kernels.call("uneven", texels, rows.smooth, n, texel, uneven)]
            if uneven.size:
                direct = self._direct_at(hits.take(uneven), texel[uneven], rays, uneven)
            arrivals = rays.arrivals() if cache.bright.count else None
        radiance = np.empty((n, 3), np.float32)
        cosine, reach, pdf, per_light = arrivals or Arrivals(None, None, 0.0, 1.0)
        if texels != len(cache.irradiance_rest) or texels != len(rows.irradiance_direct) or (
                arrivals is not None and texels != len(cache.bright.pdf_area)):
            raise ValueError(f"{texels} texels, of which {len(cache.irradiance_rest)} are solved")
        of_texels = rows.irradiance_direct if cache.sources.count else None
        kernels.call("reflected", texels, cache.irradiance_rest, of_texels, rows.smooth,
                     None if arrivals is None else cache.bright.pdf_area, n, texel, len(uneven), direct, len(albedo),
                     np.ascontiguousarray(albedo, np.float32), hits.primitive if by_triangle else None, pdf, per_light, cosine,
                     reach, radiance)
        return radiance

    def _arriving(self, hits: SurfaceHits, texel: np.ndarray, seen: np.ndarray, rays: HitRays) -> np.ndarray:
        """Irradiance (h, 3) that hits on the side of ``texel`` (h,) receive, less what is sampled as a bright surface of those that
        are ``seen`` (h,): the same, or those on the other side."""
        cache = self._cache
        irradiance = np.take(cache.irradiance_rest, texel, axis=0, mode="wrap")
        if cache.sources.count:
            direct = self._direct(hits, texel, rays)
            if cache.bright.count:
                pdf = np.take(cache.bright.pdf_area, seen, mode="wrap")
                sampled = np.flatnonzero(pdf)
                direct[sampled] *= rays.share(sampled, pdf[sampled])
            irradiance += direct
        return irradiance

    def _direct(self, hits: SurfaceHits, texel: np.ndarray, rays: HitRays) -> np.ndarray:
        """Irradiance (h, 3) of lamps and bright sky at hits: the texel's mean where that is smooth, shadow rays from the hit
        elsewhere."""
        cache = self._cache
        total = np.take(cache.rows.irradiance_direct, texel, axis=0, mode="wrap")
        uneven = np.flatnonzero(~np.take(cache.rows.smooth[:, 0], texel, mode="wrap"))
        if uneven.size:
            total[uneven] = self._direct_at(hits.take(uneven), texel[uneven], rays, uneven)
        return total

    def _direct_at(self, hits: SurfaceHits, texel: np.ndarray, rays: HitRays, rows: np.ndarray) -> np.ndarray:
        """One shadow ray from each of the hits (c,), ``rows`` (c,) of the rays, to each of a few sources, or to one picked from the
        texel's."""
        cache, reach, known = self._cache, rays.reach(rows), rays.lit_sides(rows)
        if known is None or cache.context.surfaces.has_smooth_normals:
            points = rays.points(rows) if known is None else known[0]
            surface = cache.sampler.at(hits.slots, hits.primitive, hits.u, hits.v, points)
        else:
            points, face = known
            surface = SurfacePoints(hits.primitive, hits.u, hits.v, points, face, face)
        if cache.sources.count <= ALL_SOURCES:
            numbers = None if cache.sources.is_delta.all() else rays.numbers(rows, 2)
            total = np.zeros((len(rows), 3), np.float32)
            for source in range(cache.sources.count):
                delta = cache.sources.is_delta[source]
                uv, turn = (np.zeros((len(rows), 2), np.float32), 0.0) if delta else (numbers, _TURN * source)
                total += cache.sources.irradiance(source, points, surface.shading, surface.face, reach, uv, surface.primitive, turn)
            return total
        numbers = rays.numbers(rows, 3)
        column = np.minimum((numbers[:, 2] * CHOICES).astype(np.int64), CHOICES - 1)
        source, weight = cache.rows.choices[texel, column], cache.rows.choice_weights[texel, column]
        light = cache.sources.irradiance(source.astype(np.int64), points, surface.shading, surface.face, reach, numbers[:, :2],
                                         surface.primitive)
        return light * weight[:, None]


def shifted_for(numbers: np.ndarray, source: int) -> np.ndarray:
    """``numbers`` (n, 2) in [0, 1) with another shift on the torus for each further ``source``, so that lamps are not sampled in
    step."""
    return wrapped(numbers + np.float32(_TURN * source))
