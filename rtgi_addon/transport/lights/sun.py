"""Suns: light from one direction, or evenly from a disk in the sky (Cycles ``kernel/light/distant.h``)."""

from dataclasses import dataclass, replace

import numpy as np

from ...numerics.sampling import disk_from_square, frame
from ...scene import SunLight
from ..vectors import dot, normalized
from .beam import Beam
from .cone import uniform_in_cone
from .kind import Emission, LampKind, Rows, one_minus_cosine, per_point, unit_axis
from .shadow_view import corners, look_along, parallel


@dataclass(frozen=True, eq=False)
class SunRows(Rows):
    """``direction`` of travel and ``irradiance`` (m, 3), ``one_minus_cos`` (m,) of half the sun's angle."""

    direction: np.ndarray
    irradiance: np.ndarray
    one_minus_cos: np.ndarray


class Sun(LampKind):
    """See the module's docstring."""

    light, name, is_distant = SunLight, "SUN", True

    def rows(self, lights):
        """See LampKind."""
        return SunRows.of([(light.direction_world, light.irradiance, _one_minus_cos(light)) for light in lights])

    def sample(self, rows, points, uv):
        """See LampKind."""
        n = len(points)
        direction = per_point(rows.direction, n)
        np.negative(direction, out=direction)
        wide = np.flatnonzero(np.broadcast_to(rows.one_minus_cos > 0, (n,)))
        if wide.size:
            direction[wide], _ = uniform_in_cone(direction[wide], np.broadcast_to(rows.one_minus_cos, (n,))[wide], uv[wide])
        # Radiance S/(π·sin²) over a cap of solid angle 2π(1 − cos): S·2/(1 + cos) a sample, S·1 for the facing plane's mean.
        gain = np.float32(2.0) / (np.float32(2.0) - rows.one_minus_cos)
        return direction, np.full(n, np.inf, np.float32), per_point(rows.irradiance * gain[:, None], n)

    def meet(self, rows, points, directions):
        """See LampKind."""
        n = len(points)
        width = np.broadcast_to(rows.one_minus_cos, (n,))
        met = (width > 0) & (one_minus_cosine(directions, -rows.direction) <= width)
        density = np.where(met, np.float32(0.5 / np.pi) / np.where(met, width, np.float32(1.0)), np.float32(0.0))
        gain = np.float32(2.0) / (np.float32(2.0) - rows.one_minus_cos)
        return np.full(n, np.inf, np.float32), per_point(rows.irradiance * gain[:, None], n), density

    def importance(self, rows, points, normals):
        """See LampKind."""
        sine = np.sqrt(np.maximum(rows.one_minus_cos * (2.0 - rows.one_minus_cos), 0.0))
        cosine = -dot(normals, rows.direction)
        return rows.irradiance * (np.maximum(cosine + sine, 0.0) / (1.0 + sine))[:, None]

    def plain(self, light):
        """See LampKind."""
        return SunLight(light.name, light.direction_world, light.irradiance, 0.0)

    def is_delta(self, light):
        """See LampKind."""
        return light.angle == 0

    def measure(self, light, scene_radius):
        """See LampKind."""
        return np.pi * scene_radius**2

    def emit(self, light, u, beam):
        """See LampKind."""
        directions = _directions(light, u[:, 2:])
        origins, area = beam.origins(directions, u[:, :2])
        # Irradiance S is that of a facing plane, S/(π·sin²) the radiance, 2π(1 − cos) the solid angle: S·2/(1 + cos) in all.
        gain = 1.0 / np.cos(0.25 * light.angle) ** 2
        power = np.asarray(light.irradiance, np.float32) * (area * np.float32(gain))[:, None]
        return Emission(origins, directions, power, beam.domain(directions, origins))

    def connect(self, light, points, u, beam: Beam):
        """See LampKind."""
        directions = np.repeat(unit_axis(light.direction_world)[None], len(points), axis=0) if light.angle == 0 else _directions(
            light, u)
        along = np.einsum("ij,ij->i", points - beam.centre, directions) + beam.radius
        origins = points - directions * along[:, None]
        return origins.astype(np.float32), directions, beam.domain(directions, points), along > 0

    def views(self, light, bounds, focus, resolution, area_points):
        """Fitted to the focus's bounding sphere, whose size does not change as the sun turns; the texel lattice goes through the
        world's origin, so texels stay where they are when the focus moves."""
        focus = bounds if focus is None else np.asarray(focus, np.float64)
        rotation = look_along(light.direction_world)
        radius = max(0.5 * float(np.linalg.norm(focus[1] - focus[0])), 1e-6)
        half = radius * resolution / max(resolution - 2, 1)
        texel = 2.0 * half / resolution
        centre = focus.mean(axis=0) @ rotation
        centre[:2] = np.round(centre[:2] / texel) * texel
        depth = corners(bounds) @ rotation[:, 2]
        margin = 1e-3 * max(float(np.ptp(depth)), radius)
        # The eye lies before everything that can cast a shadow into the focus.
        centre[2] = float(depth.max()) + 2.0 * margin
        far = centre[2] - float(depth.min()) + margin
        return [parallel(rotation, rotation @ centre, half, half, margin, far)]

    def power_per_measure(self, light, view):
        """See LampKind."""
        return np.ones(view.resolution**2)

    def shader_point(self, light, u):
        """See LampKind."""
        axis = np.asarray(light.direction_world, np.float64)
        one_minus_cos = _one_minus_cos(light)
        xy = disk_from_square(u[:2])
        squared = float(xy @ xy)
        xy = xy * np.sqrt(max(one_minus_cos * (2.0 - one_minus_cos * squared), 0.0))
        tangent, bitangent = frame(-axis)
        towards = tangent * xy[0] + bitangent * xy[1] - axis * (1.0 - squared * one_minus_cos)
        towards /= np.linalg.norm(towards)
        strength = np.asarray(light.irradiance, np.float64) * (2.0 / (2.0 - one_minus_cos))
        return replace(light, direction_world=-towards), {"axis": towards, "strength": strength}


def _one_minus_cos(light: SunLight) -> float:
    # 1 − cos keeps small angles exact.
    return 2.0 * np.sin(0.25 * light.angle) ** 2


def _directions(light: SunLight, u: np.ndarray) -> np.ndarray:
    """Unit directions (n, 3) of travel, uniform over the solid angle of the sun's disk."""
    axis, one_minus_cos = unit_axis(light.direction_world)[None], _one_minus_cos(light)
    xy = disk_from_square(u)
    squared = (xy**2).sum(axis=1)
    xy = xy * np.sqrt(np.maximum(one_minus_cos * (2.0 - one_minus_cos * squared), 0.0))[:, None]
    tangent, bitangent = frame(axis)
    return normalized((tangent * xy[:, :1] + bitangent * xy[:, 1:] + axis * (1.0 - squared * one_minus_cos)[:, None])
                      .astype(np.float32))
