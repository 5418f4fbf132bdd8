"""Point lamps: a point, a sphere, or, by Blender's Soft Falloff, a disk that faces each receiver (Cycles ``kernel/light/point.h``).

As the beginning of paths a lamp with a radius sends a parallel beam as wide as itself along each direction, which is a sphere's
emission exactly. A disk that turns to every receiver is no emitter at all: its power is that of the sphere, and ``near_gain`` makes
up for the distance, so that only the shape of penumbrae nearer than a few radii differs.
"""

from dataclasses import dataclass, replace

import numpy as np

from ...numerics.sampling import disk_from_square, frame, sphere_from_square
from ...scene import Light, PointLight, SpotLight
from ..vectors import dot, normalized
from .cone import uniform_in_cone
from .kind import Emission, LampKind, Rows, one_minus_cosine
from .shadow_view import cube_views, look_along, pinhole

# Squared distances below this [m²] are taken as this: a point on top of a lamp gets a huge irradiance, never an infinite one.
MIN_DISTANCE_SQUARED = np.float32(1e-12)
# Steps of Newton's method: many, for towards the centre the root becomes a triple one.
_NEWTON_STEPS = 30


@dataclass(frozen=True, eq=False)
class PointRows(Rows):
    """``position`` and ``intensity`` (m, 3), ``radius`` (m,), ``soft_falloff`` (m,) bool."""

    position: np.ndarray
    intensity: np.ndarray
    radius: np.ndarray
    soft_falloff: np.ndarray


class Point(LampKind):
    """See the module's docstring."""

    light, name = PointLight, "POINT"

    def rows(self, lights):
        """See LampKind."""
        return PointRows.of([row_values(light) for light in lights])

    def sample(self, rows, points, uv):
        """See LampKind."""
        towards, distance_squared = towards_centre(rows, points)
        distance = np.sqrt(distance_squared)
        direction = towards / distance[:, None]
        factor = 1.0 / distance_squared
        if rows.radius.any():
            radius = np.broadcast_to(rows.radius, distance.shape)
            soft = np.broadcast_to(rows.soft_falloff, distance.shape)
            disk, sphere = np.flatnonzero(soft & (radius > 0)), np.flatnonzero(~soft & (radius > 0))
            if disk.size:
                _sample_disk(disk, radius, towards, direction, distance, factor, uv)
            if sphere.size:
                _sample_sphere(sphere, radius, direction, distance, factor, uv)
        return direction, distance, rows.intensity * factor[:, None]

    def meet(self, rows, points, directions):
        """See LampKind."""
        towards, distance_squared = towards_centre(rows, points)
        d = np.sqrt(distance_squared)
        radius, soft = (np.broadcast_to(part, d.shape) for part in (rows.radius, rows.soft_falloff))
        off = one_minus_cosine(directions, towards / d[:, None])
        cosine = np.float32(1.0) - off
        spread = _spread(radius, d)
        # A disk is as wide as its tangent says, a sphere as its sine.
        sine_squared = off * (np.float32(2.0) - off)
        on_disk = (cosine > 0) & (distance_squared * sine_squared <= np.square(radius * cosine))
        met = (radius > 0) & np.where(soft, on_disk, off <= spread)
        ahead, area = np.maximum(cosine, np.float32(1e-6)), np.where(met, np.pi * radius * radius, np.float32(1.0))
        by_area = distance_squared / (ahead**3 * area)
        density = np.where(soft, by_area, np.float32(0.5 / np.pi) / np.where(met, spread, np.float32(1.0)))
        density = np.where(met, density, np.float32(0.0)).astype(np.float32)
        distance = np.where(soft, d / ahead, _to_sphere(radius, d, cosine, radius < d))
        factor = np.float32(1.0) / (area * np.where(met, density, np.float32(1.0)))
        return distance.astype(np.float32), rows.intensity * factor[:, None].astype(np.float32), density

    def importance(self, rows, points, normals):
        """See LampKind."""
        towards, distance_squared = towards_centre(rows, points)
        distance = np.sqrt(distance_squared)
        extent = np.minimum(rows.radius / distance, 1.0)
        cosine = np.maximum(dot(towards, normals) / distance + extent, 0.0) / (1.0 + extent)
        return rows.intensity * (cosine / np.maximum(distance_squared, rows.radius**2))[:, None]

    def measure(self, light, scene_radius):
        """See LampKind."""
        return 4.0 * np.pi

    def emit(self, light, u, beam):
        """See LampKind."""
        directions, solid_angle = self._emitted(light, u)
        power = np.asarray(light.intensity, np.float32) * solid_angle[:, None]
        return Emission(_beside(light, directions, u[:, 2:]), directions, power, directions)

    def _emitted(self, light, u: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Directions (n, 3), and intensity relative to the lamp's over their density (n,) [sr]."""
        return sphere_from_square(u[:, :2]).astype(np.float32), np.full(len(u), 4.0 * np.pi, np.float32)

    def connect(self, light, points, u, beam):
        """See LampKind."""
        centre = np.asarray(light.position_world, np.float32)
        directions = normalized(points - centre)
        if light.radius > 0:
            # The place on the lamp turns with the direction; a few steps settle both.
            for _ in range(4):
                directions = normalized(points - _beside(light, directions, u))
        return _beside(light, directions, u), directions, directions, np.ones(len(points), bool)

    def near_gain(self, light, points):
        """What a lamp's soft falloff leaves of a sphere's light: d²/(d² + r²)."""
        if light.radius == 0 or not light.soft_falloff:
            return np.ones(len(points), np.float32)
        away = points - np.asarray(light.position_world, np.float32)
        squared = dot(away, away)
        return (squared / (squared + np.float32(light.radius**2))).astype(np.float32)

    def views(self, light, bounds, focus, resolution, area_points):
        """One frustum around the scene's bounding sphere where that takes less than a cube's face, else a cube."""
        position = light.position_world
        towards = bounds.mean(axis=0) - np.asarray(position, np.float64)
        distance, radius = np.linalg.norm(towards), 0.5 * np.linalg.norm(bounds[1] - bounds[0])
        if distance > 1.5 * radius:
            # The sphere's silhouette; a thousandth more keeps its rim off the map's edge.
            return [pinhole(look_along(towards), position, bounds, 1.001 * radius / np.sqrt(distance**2 - radius**2))]
        return cube_views(position, bounds)

    def power_per_measure(self, light, view):
        """See LampKind."""
        return np.ones(view.resolution**2)

    def shader_point(self, light, u):
        """See LampKind."""
        shift = light.radius * ball_point(u)
        position = np.asarray(light.position_world, np.float64)
        uniforms = {"position": position, "shift": shift, "radius": light.radius, "soft_falloff": int(light.soft_falloff),
                    "strength": light.intensity}
        return replace(light, position_world=position + shift), uniforms


def row_values(light: Light) -> tuple:
    """A lamp's values in ``PointRows``."""
    return light.position_world, light.intensity, light.radius, bool(light.soft_falloff)


def towards_centre(rows: PointRows, points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """From ``points`` (n, 3) to the lamps' centres, and the squared distances (n,)."""
    towards = rows.position - points
    return towards, np.maximum(dot(towards, towards), MIN_DISTANCE_SQUARED)


def ball_point(u: np.ndarray) -> np.ndarray:
    """A point (3,) of the unit ball for ``u`` (3,) in [0, 1), so distributed that it lies evenly over a disk from wherever it is
    seen: radii have density r²/√(1 − r²) (the Abel transform of a constant)."""
    # With r = sin t the share of points within r is (2t − sin 2t)/π; Newton's steps converge from the middle.
    t = 0.25 * np.pi
    for _ in range(_NEWTON_STEPS):
        t -= (2.0 * t - np.sin(2.0 * t) - np.pi * u[2]) / max(4.0 * np.sin(t) ** 2, 1e-6)
        t = min(max(t, 0.0), 0.5 * np.pi)
    z = 1.0 - 2.0 * u[0]
    ring, azimuth = 2.0 * np.sqrt(max(u[0] * (1.0 - u[0]), 0.0)), 2.0 * np.pi * u[1]
    return np.sin(t) * np.array([ring * np.cos(azimuth), ring * np.sin(azimuth), z])


def _sample_disk(rows, radius, towards, direction, distance, factor, uv):
    """Soft falloff: a disk facing the point, radiance I/(πr²), by area; writes direction, distance and E/I in place."""
    axis, height = direction[rows], distance[rows]
    xy = disk_from_square(uv[rows]) * radius[rows, None]
    tangent, bitangent = frame(axis)
    away = towards[rows] + tangent * xy[:, :1] + bitangent * xy[:, 1:]
    squared = height * height + xy[:, 0] * xy[:, 0] + xy[:, 1] * xy[:, 1]
    length = np.sqrt(squared)
    direction[rows] = away / length[:, None]
    distance[rows] = length
    factor[rows] = height / (length * squared)


def _sample_sphere(rows, radius, direction, distance, factor, uv):
    """A sphere of radiance I/(πr²), by the solid angle it fills, which is everything from inside; writes in place."""
    axis, d, r = direction[rows], distance[rows], radius[rows]
    spread = _spread(r, d)
    direction[rows], cosine = uniform_in_cone(axis, spread, uv[rows])
    distance[rows] = _to_sphere(r, d, cosine, r < d)
    factor[rows] = 2.0 * spread / (r * r)


def _spread(radius, distance) -> np.ndarray:
    """1 − cos (n,) of half the angle that a sphere fills; everything from inside."""
    ratio = np.square(radius / distance)
    return np.where(ratio < 1.0, ratio / (1.0 + np.sqrt(np.maximum(1.0 - ratio, 0.0))), np.float32(2.0))


def _to_sphere(radius, distance, cosine, outside) -> np.ndarray:
    """How far (n,) it is to a sphere whose centre is ``distance`` away, under ``cosine`` to that."""
    chord = np.sqrt(np.maximum(radius * radius - distance * distance + np.square(distance * cosine), 0.0))
    # Inside, the direction leaves through the far side; outside, it meets the near one.
    return np.maximum(distance * cosine + np.where(outside, -chord, chord), 0.0)


def _beside(light: PointLight | SpotLight, directions: np.ndarray, u: np.ndarray) -> np.ndarray:
    """Where (n, 3) rays along ``directions`` leave the lamp: its centre, or its sphere across the whole width."""
    centre = np.asarray(light.position_world, np.float32)
    if light.radius <= 0:
        return np.repeat(centre[None], len(directions), axis=0)
    xy = disk_from_square(u)
    tangent, bitangent = frame(directions)
    # The disk, not the sphere's front: a soft lamp may touch what it hangs on, and lights it from its middle.
    return (centre + np.float32(light.radius) * (tangent * xy[:, :1] + bitangent * xy[:, 1:])).astype(np.float32)
