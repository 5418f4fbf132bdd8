"""Reflective shadow maps: what a lamp lights first, as texels of position, normal and reflected flux.

Source: C. Dachsbacher and M. Stamminger, "Reflective Shadow Maps", I3D 2005. A texel is a small diffuse light that sends
I(ω) = Φ/π·max(0, n·ω) [W·sr⁻¹]; Φ is the power that its lamp puts through the texel times the albedo it meets there, so a map's
total is what the scene inside the view reflects.

What a map is not: it holds the first bounce of lamps alone (no world, no emissive surfaces, no second bounce), of each texel the
nearest surface alone that casts a shadow (a lamp that casts none is taken to; what casts none itself stays unlit), and one colour
and normal for all that a texel covers.
"""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from ..lights.shadow_view import ShadowView
from ..lights.shaped import distance_share
from ..vectors import normalized, sides_met
from .shadow_views import texel_power


class Texels(NamedTuple):
    """Texels that reflect light, as rows: ``positions`` (n, 3) [m], unit ``normals`` (n, 3), reflected ``flux`` (n, 3) [W], all
    float32, and ``primitive`` (n,) int32, the triangle that each lies on."""

    positions: np.ndarray
    normals: np.ndarray
    flux: np.ndarray
    primitive: np.ndarray


@dataclass(frozen=True, eq=False)
class ReflectiveShadowMap:
    """What ``view`` sees, row 0 at the bottom.

    ``position`` (h, w, 3) float32 world [m]; ``normal`` (h, w, 3) float32 unit shading normal on the side that faces the lamp;
    ``flux`` (h, w, 3) float32 [W] reflected; ``primitive`` (h, w) int32, −1 where nothing is (the other arrays are 0 there).
    """

    view: ShadowView
    position: np.ndarray
    normal: np.ndarray
    flux: np.ndarray
    primitive: np.ndarray

    @property
    def total_flux(self) -> np.ndarray:
        """(3,) float64 [W]: all that the surfaces in view reflect."""
        return self.flux.sum(axis=(0, 1), dtype=np.float64)

    def lights(self) -> Texels:
        """The texels whose flux is not zero, row by row."""
        chosen = (self.primitive >= 0) & np.any(self.flux > 0, axis=-1)
        return Texels(self.position[chosen], self.normal[chosen], self.flux[chosen], self.primitive[chosen])


def capture(context, view: ShadowView) -> ReflectiveShadowMap:
    """Fill ``view`` by rays through the texels' centres. The same for any number of threads."""
    origins, directions = view.rays()
    light, links = context.scene.lights[view.lamp], context.links
    tracer = context.bare.light
    if light.casts_shadow:
        tracer = context.shadows.tracer(int(links.lamp_blockers(view.lamp)), bool(context.lamps.is_delta[view.lamp]))
    hits = tracer.intersect(origins, directions, np.ones(len(origins), np.float32))
    rows = np.flatnonzero(hits.primitive >= 0)
    primitive, u, v = hits.primitive[rows], hits.u[rows], hits.v[rows]
    side = sides_met(context.geometry.normals_world[primitive], directions[rows])
    size = view.resolution
    position, normal, flux = (np.zeros((size * size, 3), np.float32) for _ in range(3))
    position[rows] = context.geometry.points(primitive, u, v)
    normal[rows] = normalized(context.surfaces.shading_normal(primitive, u, v)) * side
    power = texel_power(light, view).reshape(-1, 3)
    travelled = position[rows] - view.position_world.astype(np.float32)
    if view.orthographic:
        travelled = travelled * view.world_from_view[:3, 2].astype(np.float32)
    nearer = distance_share(light, np.abs(travelled.sum(axis=1)) if view.orthographic else np.linalg.norm(travelled, axis=1))
    if nearer is not None:
        power[rows] *= nearer
    if hits.tint is not None:
        power = power * hits.tint
    if light.casts_shadow and not context.media_in_shadow.is_empty:
        power[rows] *= _left_by_media(context, view, position[rows])
    flux[rows] = power[rows] * context.surfaces.albedo_of_side(primitive, u, v, side[:, 0])
    if links.has_receivers:
        flux[rows] *= links.lamp_lights(view.lamp, context.geometry.instance[primitive])[:, None]
    shape = (size, size, 3)
    return ReflectiveShadowMap(view, position.reshape(shape), normal.reshape(shape), flux.reshape(shape),
                               hits.primitive.reshape(size, size).astype(np.int32, copy=False))


def _left_by_media(context, view: ShadowView, points: np.ndarray) -> np.ndarray:
    """What media leave (n, 3) of the lamp's light on its way to ``points`` (n, 3) that ``view`` sees."""
    forward = -view.world_from_view[:3, 2]
    from_eye = points.astype(np.float64) - view.position_world
    distances = from_eye @ forward if view.orthographic else np.linalg.norm(from_eye, axis=1)
    directions = np.tile(-forward, (len(points), 1)) if view.orthographic else -from_eye / np.maximum(distances, 1e-12)[:, None]
    if context.lamps.is_distant[view.lamp]:
        distances = None
    return context.media_in_shadow.transmittance(points, directions, distances)


def left_unlit(context) -> list[str]:
    """Names of the instances that lamps light and no map shows: those that cast no shadow themselves."""
    visible = context.geometry.visibility
    rows = np.flatnonzero((visible.camera | visible.diffuse) & ~visible.shadow)
    return list(dict.fromkeys(context.scene.instances[row].name for row in rows))
