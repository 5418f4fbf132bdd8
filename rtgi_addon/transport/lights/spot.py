"""Spots: point lamps within a cone, elliptical where they are scaled (Cycles ``kernel/light/spot.h``)."""

from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from ...numerics.sampling import frame
from ...scene import SpotLight
from ..vectors import normalized
from .kind import unit_axis
from .point import Point, PointRows, row_values, towards_centre
from .shadow_view import cube_views, look_along, pinhole
from .tabulated import CELLS, cumulated, invert

# A cone wider than this half tangent is cut into the faces of a cube: a single frustum would spend its texels on the rim.
MAX_TANGENT = 2.0


@dataclass(frozen=True, eq=False)
class SpotRows(PointRows):
    """Points with ``local_from_world`` (m, 3, 3), in whose space light travels along −Z, ``cos_half_cone`` (m,) and
    ``inverse_blend`` (m,): one over the blend's share of 1 − cos."""

    local_from_world: np.ndarray
    cos_half_cone: np.ndarray
    inverse_blend: np.ndarray


class Spot(Point):
    """See the module's docstring."""

    light, name, fills_views = SpotLight, "SPOT", False

    def rows(self, lights):
        """See LampKind."""
        return SpotRows.of([(*row_values(light), *_cone(light)) for light in lights])

    def sample(self, rows, points, uv):
        """See LampKind."""
        direction, distance, irradiance = super().sample(rows, points, uv)
        return direction, distance, irradiance * self._shining(rows, points, direction)

    def meet(self, rows, points, directions):
        """See LampKind."""
        distance, irradiance, density = super().meet(rows, points, directions)
        return distance, irradiance * self._shining(rows, points, directions), density

    def _shining(self, rows, points, direction) -> np.ndarray:
        """What (n, 1) the cone leaves of light that comes to ``points`` from unit ``direction`` (n, 3)."""
        attenuation = _attenuation(rows, direction)
        hard_sphere = ~rows.soft_falloff & (rows.radius > 0)
        if hard_sphere.any():
            # As in Cycles, the cone does not apply inside the lamp's own sphere.
            distance_squared = towards_centre(rows, points)[1]
            attenuation = np.where(hard_sphere & (distance_squared <= rows.radius**2), np.float32(1.0), attenuation)
        return attenuation[:, None]

    def importance(self, rows, points, normals):
        """See LampKind."""
        irradiance = super().importance(rows, points, normals)
        towards, distance_squared = towards_centre(rows, points)
        distance = np.sqrt(distance_squared)[:, None]
        # A wide lamp is seen under other angles than its centre; the local axes may stretch them further.
        stretch = np.sqrt(np.sum(rows.local_from_world**2, axis=(1, 2)))
        margin = np.where(rows.radius > 0, 2.0 * stretch * np.minimum(rows.radius / distance[:, 0], 1.0) + 1e-3, 0.0)
        return irradiance * _attenuation(rows, towards / distance, margin)[:, None]

    def measure(self, light, scene_radius):
        """See LampKind."""
        return 4.0 * np.pi * (0.5 * (1.0 - np.cos(0.5 * light.cone_angle)))

    def _emitted(self, light, u):
        """Within the cone, with density close to the blend."""
        one_minus, cdf = _blend_table(float(light.cone_angle), float(light.blend))
        depth, density = invert(one_minus, cdf, u[:, 0])
        sine = np.sqrt(np.maximum(depth * (2.0 - depth), 0.0))
        azimuth = 2.0 * np.pi * u[:, 1].astype(np.float64)
        local = np.stack([sine * np.cos(azimuth), sine * np.sin(azimuth), depth - 1.0], axis=1)
        solid_angle = 2.0 * np.pi / density
        if light.world_from_local is None:
            axis = unit_axis(light.direction_world)[None]
            tangent, bitangent = frame(-axis.astype(np.float64))
            world = local @ np.concatenate([tangent, bitangent, -axis])
        else:
            matrix = np.asarray(light.world_from_local, np.float64)
            world = local @ matrix.T
            length = np.linalg.norm(world, axis=1)
            # Solid angle under a linear map: dω' = |det M|/|M d|³ dω.
            solid_angle = solid_angle * abs(np.linalg.det(matrix)) / np.maximum(length, 1e-300) ** 3
        directions = normalized(world.astype(np.float32))
        return directions, (spot_attenuation(light, directions) * solid_angle).astype(np.float32)

    def connect(self, light, points, u, beam):
        """See LampKind."""
        origins, directions, domain, _ = super().connect(light, points, u, beam)
        return origins, directions, domain, spot_attenuation(light, directions) > 0

    def views(self, light, bounds, focus, resolution, area_points):
        """One frustum around the cone, or the faces of a cube where it is wide."""
        rotation = look_along(light.direction_world)
        axes = rotation if light.world_from_local is None else np.asarray(light.world_from_local, np.float64)
        half = 0.5 * min(light.cone_angle, np.pi)
        if half < 0.5 * np.pi - 1e-3:
            angle = np.linspace(0.0, 2.0 * np.pi, 256, endpoint=False)
            rim = np.stack([np.tan(half) * np.cos(angle), np.tan(half) * np.sin(angle), np.full(angle.size, -1.0)])
            x, y, z = rotation.T @ (axes @ rim)
            if np.all(z < 0):
                # The rim is sampled: a thousandth more than its extremes covers the arcs between.
                tangent = 1.001 * float(np.max(np.abs(np.stack([x, y]) / z)))
                if tangent <= MAX_TANGENT:
                    return [pinhole(rotation, light.position_world, bounds, tangent)]
        return cube_views(light.position_world, bounds)

    def power_per_measure(self, light, view):
        """See LampKind."""
        return spot_attenuation(light, view.directions())

    def shader_point(self, light, u):
        """See LampKind."""
        placed, uniforms = super().shader_point(light, u)
        local_from_world = np.eye(4)
        local_from_world[:3, :3], cosine, inverse_blend = _cone(light)
        axis = -np.asarray(light.direction_world, np.float64)
        return placed, {**uniforms, "axis": axis, "local_from_world": local_from_world, "cos_half_cone": cosine,
                        "inverse_blend": inverse_blend}


def spot_attenuation(light: SpotLight, directions: np.ndarray) -> np.ndarray:
    """Intensity (n,) relative to the full one that a spot without radius sends into unit world ``directions`` (n, 3)."""
    return _attenuation(SpotRows.of([(*row_values(light), *_cone(light))]), -np.asarray(directions, np.float32))


def _cone(light: SpotLight) -> tuple[np.ndarray, float, float]:
    """A lamp's own values in ``SpotRows``."""
    cosine = np.cos(0.5 * light.cone_angle)
    if light.world_from_local is None:
        axis = np.asarray(light.direction_world, np.float64).reshape(1, 3)
        tangent, bitangent = frame(-axis)
        local_from_world = np.concatenate([tangent, bitangent, -axis])
    else:
        # The pseudo-inverse: a lamp scaled to nothing along an axis is still a lamp.
        local_from_world = np.linalg.pinv(np.asarray(light.world_from_local, np.float64))
    return local_from_world, cosine, 1.0 / max((1.0 - cosine) * light.blend, 1e-7)


def _attenuation(rows: SpotRows, direction: np.ndarray, margin=0.0) -> np.ndarray:
    m = rows.local_from_world
    x, y, z = ((m[:, i, 0] * direction[:, 0] + m[:, i, 1] * direction[:, 1] + m[:, i, 2] * direction[:, 2]) for i in range(3))
    # The light travels along −Z, so +Z of the direction back to the lamp is the cosine to the axis.
    cosine = z / np.sqrt(np.maximum(x * x + y * y + z * z, np.finfo(np.float32).tiny))
    t = np.clip((cosine + margin - rows.cos_half_cone) * rows.inverse_blend, 0.0, 1.0)
    return t * t * (3.0 - 2.0 * t)


@lru_cache(maxsize=64)
def _blend_table(cone_angle: float, blend: float) -> tuple[np.ndarray, np.ndarray]:
    """Cells of 1 − cosθ in the cone, and the cumulated smoothstep over them (see ``SpotLight``)."""
    # A little beyond the edge, since rounded directions there are still within it.
    extent = 1.0 - np.cos(0.5 * cone_angle)
    depth = np.linspace(0.0, extent, CELLS + 1)
    middle = 0.5 * (depth[1:] + depth[:-1])
    t = np.clip((extent - middle) / max(extent * blend, 1e-7), 0.0, 1.0)
    return depth, cumulated(t * t * (3.0 - 2.0 * t))
