"""Reflective shadow maps: what a lamp lights first, as texels of position, normal and reflected flux.

Source: C. Dachsbacher and M. Stamminger, "Reflective Shadow Maps", I3D 2005. A texel is a small diffuse light that sends
I(ω) = Φ/π·max(0, n·ω) [W·sr⁻¹]; Φ is the power that its lamp puts through the texel times the albedo it meets there, so a map's
total is what the scene inside the view reflects.

What a map is not: it holds the first bounce of lamps alone (no world, no emissive surfaces, no second bounce), the nearest surface
of each texel alone (a lamp that casts no shadows is taken to cast them), and one colour and normal for all that a texel covers.
"""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from .shadow_views import ShadowView, texel_power
from .vectors import dot, normalized


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
    hits = context.tracer.intersect(origins, directions, np.ones(len(origins), np.float32))
    rows = np.flatnonzero(hits.primitive >= 0)
    primitive, u, v = hits.primitive[rows], hits.u[rows], hits.v[rows]
    side = -np.copysign(np.float32(1.0), dot(context.geometry.normals_world[primitive], directions[rows]))[:, None]
    size = view.resolution
    position, normal, flux = (np.zeros((size * size, 3), np.float32) for _ in range(3))
    position[rows] = context.geometry.points(primitive, u, v)
    normal[rows] = normalized(context.surfaces.shading_normal(primitive, u, v)) * side
    power = texel_power(context.scene.lights[view.lamp], view).reshape(-1, 3)
    flux[rows] = power[rows] * context.surfaces.albedo(primitive, u, v)
    shape = (size, size, 3)
    return ReflectiveShadowMap(view, position.reshape(shape), normal.reshape(shape), flux.reshape(shape),
                               hits.primitive.reshape(size, size).astype(np.int32, copy=False))
