"""What the walks of rays in media are to a surface cache: light that texels receive from media, and further rays between texels."""

from typing import NamedTuple

import numpy as np

from ..context import LightContext
from ..paths.scattering import Walks
from ..vectors import dot
from .texel_table import SurfaceHits
from .texels import TexelLayout

# Density [m⁻²] of a walk's end on its surface: no other way of sampling finds the same, and this outweighs all.
ONLY = np.float32(1e30)


class TexelWalks(NamedTuple):
    """``irradiance`` (n, 3) that media give n texels, lamps' and the world's scattered light included; the walks ``found`` (h,), of
    R·n, that ended on surfaces: where, and under which ``cosine`` (h,) to the front's normal (negative on the front, as a ray
    comes); ``density`` (R·n,) [m⁻²], and ``tints`` (R·n, 3) of the light that comes along."""

    irradiance: np.ndarray
    found: np.ndarray
    hits: SurfaceHits
    cosine: np.ndarray
    density: np.ndarray
    tints: np.ndarray


def ends_on(context: LightContext, layout: TexelLayout, walks: Walks) -> tuple[np.ndarray, SurfaceHits, np.ndarray]:
    """Which (h,) of the ends of ``walks`` are on surfaces, where, and the cosine (h,) between their directions and the front's
    normal."""
    rows = np.flatnonzero(walks.primitive >= 0)
    primitive, u, v = walks.primitive[rows], walks.u[rows], walks.v[rows]
    cosine = dot(context.geometry.normals_world[primitive], walks.directions[rows])
    return rows, SurfaceHits(primitive, u, v, layout.slots(primitive, u, v, cosine < 0)), cosine


def light_of_ends(context: LightContext, walks: Walks, rows: np.ndarray, hits: SurfaceHits, cosine: np.ndarray) -> np.ndarray:
    """Radiance (e, 3) that emissive surfaces at the ends of walks, and the world beyond them, send along: the bright patches of the
    world are left out, which walks meet by shadow rays. ``rows``, ``hits`` and ``cosine`` are those of ``ends_on``."""
    light = np.zeros((len(walks.rows), 3), np.float32)
    if context.surfaces.has_emission and rows.size:
        light[rows] = context.surfaces.emission(hits.primitive, hits.u, hits.v, -cosine)
    if not context.environment.is_black:
        missed = np.flatnonzero(walks.primitive < 0)
        light[missed] = context.environment.base_radiance(walks.directions[missed])
    return light * walks.tint


def on_texels(context: LightContext, layout: TexelLayout, walks: Walks, rays: np.ndarray, per_texel: int, count: int) -> TexelWalks:
    """What ``walks`` of the ``rays`` (w,), of ``per_texel`` R rays from each of ``count`` n texels, bring to these."""
    on, hits, cosine = ends_on(context, layout, walks)
    radiance = np.zeros((per_texel * count, 3), np.float32)
    radiance[rays] = walks.emitted + walks.gained
    radiance[rays[walks.rows]] += light_of_ends(context, walks, on, hits, cosine)
    irradiance = radiance.reshape(per_texel, count, 3).sum(axis=0) * np.float32(np.pi / per_texel)
    found = rays[walks.rows[on]]
    density, tints = np.zeros(len(radiance), np.float32), np.zeros_like(radiance)
    density[found], tints[found] = ONLY, walks.tint[on]
    return TexelWalks(irradiance, found, hits, cosine, density, tints)
