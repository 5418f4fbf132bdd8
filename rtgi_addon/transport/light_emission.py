"""Rays that leave light sources with equal shares of their power: where light paths begin.

Every lamp is sampled from four numbers, two for the direction (or, for a sun, the place in its beam) and two for the rest, so that
the first pair alone is low-discrepancy over what the light paths spread out in first.

Point and spot lamps with a radius send a parallel beam as wide as themselves along each direction, which is a sphere's emission
exactly. Blender's soft falloff is a disk that turns to every receiver, which no emitter is: its power is that of the sphere, and
``near_gain`` makes up for the distance, so that only the shape of penumbrae nearer than a few radii differs.
"""

from functools import lru_cache
from typing import NamedTuple

import numpy as np

from ..numerics.sampling import cosine_hemisphere, disk_from_square, frame, sphere_from_square
from ..scene import AreaLight, Light, PointLight, SpotLight, SunLight
from .lamps import spot_attenuation
from .vectors import dot, normalized

_TABLE = 2048
# Beams from afar are sampled in nested disks about the focus, each so many times as wide as the one before.
DISK_RATIO = 3.0


class Emission(NamedTuple):
    """Rays with ``origins`` and unit ``directions`` (n, 3), the ``power`` (n, 3) [W] over density of each (their mean is the power
    that reaches into the scene), and ``domain`` (n, 3): where in the lamp's distribution each lies, near rays close together."""

    origins: np.ndarray
    directions: np.ndarray
    power: np.ndarray
    domain: np.ndarray


class Beam:
    """Parallel light from afar over a scene with ``bounds`` (2, 3), denser about the sphere of ``centre`` (3,) and ``radius``.

    The density over the area across a direction is a mixture of uniform disks, from the focus to what covers the scene, so that a
    ground plane of kilometres leaves rays for a lawn, and none of the plane is left out.
    """

    def __init__(self, bounds: np.ndarray, centre: np.ndarray, radius: float):
        bounds = np.asarray(bounds, np.float64)
        self.centre = np.asarray(centre, np.float64)
        farthest = np.maximum(np.abs(bounds - self.centre).max(axis=0), 1e-9)
        self.radius = 1.0001 * float(np.linalg.norm(farthest))
        count = 1 + max(0, int(np.ceil(np.log(self.radius / min(max(radius, 1e-6), self.radius)) / np.log(DISK_RATIO) - 1e-6)))
        squared = (self.radius * DISK_RATIO ** -np.arange(count, dtype=np.float64)[::-1]) ** 2
        self._squared = np.concatenate([[0.0], squared])
        self._density = np.array([np.sum(1.0 / squared[k:]) for k in range(count)]) / (np.pi * count)
        self._cdf = np.concatenate([[0.0], np.cumsum(self._density * np.pi * np.diff(self._squared))])

    def origins(self, directions: np.ndarray, u: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Starting points (n, 3) before the scene of rays along ``directions`` (n, 3), and the inverse density (n,) [m²]."""
        disk = disk_from_square(u.astype(np.float64))
        share = (disk**2).sum(axis=1)
        squared = np.interp(share, self._cdf, self._squared)
        level = np.clip(np.searchsorted(self._squared, squared, side="right") - 1, 0, len(self._density) - 1)
        offset = disk * np.sqrt(squared / np.maximum(share, 1e-300))[:, None]
        tangent, bitangent = frame(directions.astype(np.float64))
        start = self.centre - directions * self.radius + tangent * offset[:, :1] + bitangent * offset[:, 1:]
        return start.astype(np.float32), (1.0 / self._density[level]).astype(np.float32)

    def domain(self, directions: np.ndarray, points: np.ndarray) -> np.ndarray:
        """Where (n, 3) ``points`` lie in the beam along ``directions``: across it, with radii such that the density is uniform."""
        offset = points - self.centre
        offset = offset - directions * np.einsum("ij,ij->i", offset, directions)[:, None]
        squared = np.einsum("ij,ij->i", offset, offset)
        share = np.interp(squared, self._squared, self._cdf)
        return (offset * np.sqrt(share / np.maximum(squared, 1e-300))[:, None]).astype(np.float32)


def emit(light: Light, u: np.ndarray, beam: Beam) -> Emission:
    """Rays of ``light`` for ``u`` (n, 4) in [0, 1)."""
    if isinstance(light, SunLight):
        return _emit_sun(light, u, beam)
    if isinstance(light, AreaLight):
        return _emit_area(light, u)
    directions, solid_angle = _spot_directions(light, u) if isinstance(light, SpotLight) else _all_directions(u)
    power = np.asarray(light.intensity, np.float32) * solid_angle[:, None]
    return Emission(_beside(light, directions, u[:, 2:]), directions, power, directions)


def connect(light: Light, points: np.ndarray, u: np.ndarray, beam: Beam):
    """The rays by which ``light`` would reach ``points`` (n, 3), each with its second pair of numbers ``u`` (n, 2): origins and
    unit directions (n, 3), the ``domain`` (n, 3) as in Emission, and whether the lamp shines that way at all (n,) bool."""
    if isinstance(light, SunLight):
        directions = np.repeat(_axis(light)[None], len(points), axis=0) if light.angle == 0 else _sun_directions(light, u)
        along = np.einsum("ij,ij->i", points - beam.centre, directions) + beam.radius
        origins = points - directions * along[:, None]
        return origins.astype(np.float32), directions, beam.domain(directions, points), along > 0
    if isinstance(light, AreaLight):
        origins = _area_points(light, u)
        directions = normalized(points - origins)
        return origins, directions, _area_domain(light, directions), _area_shines(light, origins, points)
    centre = np.asarray(light.position_world, np.float32)
    directions = normalized(points - centre)
    if light.radius > 0:
        # The place on the lamp turns with the direction; a few steps settle both.
        for _ in range(4):
            directions = normalized(points - _beside(light, directions, u))
    origins = _beside(light, directions, u)
    shines = np.ones(len(points), bool)
    if isinstance(light, SpotLight):
        shines = spot_attenuation(light, directions) > 0
    return origins, directions, directions, shines


def near_gain(light: Light, points: np.ndarray) -> np.ndarray:
    """What (n,) a lamp's soft falloff leaves of a sphere's light at ``points`` (n, 3): d²/(d² + r²); 1 for other lamps."""
    radius = getattr(light, "radius", 0.0) if getattr(light, "soft_falloff", False) else 0.0
    if radius == 0:
        return np.ones(len(points), np.float32)
    away = points - np.asarray(light.position_world, np.float32)
    squared = dot(away, away)
    return (squared / (squared + np.float32(radius**2))).astype(np.float32)


def _axis(light) -> np.ndarray:
    direction = np.asarray(light.direction_world, np.float64)
    return (direction / np.linalg.norm(direction)).astype(np.float32)


def _sun_directions(light: SunLight, u: np.ndarray) -> np.ndarray:
    """Unit directions (n, 3), uniform over the solid angle of the sun's disk."""
    axis, one_minus_cos = _axis(light)[None], 2.0 * np.sin(0.25 * light.angle) ** 2
    xy = disk_from_square(u)
    squared = (xy**2).sum(axis=1)
    xy = xy * np.sqrt(np.maximum(one_minus_cos * (2.0 - one_minus_cos * squared), 0.0))[:, None]
    tangent, bitangent = frame(axis)
    return normalized((tangent * xy[:, :1] + bitangent * xy[:, 1:] + axis * (1.0 - squared * one_minus_cos)[:, None])
                      .astype(np.float32))


def _emit_sun(light: SunLight, u: np.ndarray, beam: Beam) -> Emission:
    directions = _sun_directions(light, u[:, 2:])
    origins, area = beam.origins(directions, u[:, :2])
    # Irradiance S is that of a facing plane, S/(π·sin²) the radiance, 2π(1 − cos) the solid angle: S·2/(1 + cos) in all.
    gain = 1.0 / np.cos(0.25 * light.angle) ** 2
    power = np.asarray(light.irradiance, np.float32) * (area * np.float32(gain))[:, None]
    return Emission(origins, directions, power, beam.domain(directions, origins))


def _all_directions(u: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    return sphere_from_square(u[:, :2]).astype(np.float32), np.full(len(u), 4.0 * np.pi, np.float32)


def _spot_directions(light: SpotLight, u: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Directions (n, 3) within the cone with density close to the blend, and attenuation over density (n,) [sr]."""
    one_minus, cdf = _blend_table(float(light.cone_angle), float(light.blend))
    depth, density = _invert(one_minus, cdf, u[:, 0])
    sine = np.sqrt(np.maximum(depth * (2.0 - depth), 0.0))
    azimuth = 2.0 * np.pi * u[:, 1].astype(np.float64)
    local = np.stack([sine * np.cos(azimuth), sine * np.sin(azimuth), depth - 1.0], axis=1)
    solid_angle = 2.0 * np.pi / density
    if light.world_from_local is None:
        tangent, bitangent = frame(-_axis(light)[None].astype(np.float64))
        world = local @ np.concatenate([tangent, bitangent, -_axis(light)[None]])
    else:
        matrix = np.asarray(light.world_from_local, np.float64)
        world = local @ matrix.T
        length = np.linalg.norm(world, axis=1)
        # Solid angle under a linear map: dω' = |det M|/|M d|³ dω.
        solid_angle = solid_angle * abs(np.linalg.det(matrix)) / np.maximum(length, 1e-300) ** 3
    directions = normalized(world.astype(np.float32))
    return directions, (spot_attenuation(light, directions) * solid_angle).astype(np.float32)


@lru_cache(maxsize=64)
def _blend_table(cone_angle: float, blend: float) -> tuple[np.ndarray, np.ndarray]:
    """Cells of 1 − cosθ in the cone, and the cumulated smoothstep over them (see ``SpotLight``)."""
    # A little beyond the edge, since rounded directions there are still within it.
    extent = 1.0 - np.cos(0.5 * cone_angle)
    depth = np.linspace(0.0, extent, _TABLE + 1)
    middle = 0.5 * (depth[1:] + depth[:-1])
    t = np.clip((extent - middle) / max(extent * blend, 1e-7), 0.0, 1.0)
    return depth, _cumulated(t * t * (3.0 - 2.0 * t))


def _emit_area(light: AreaLight, u: np.ndarray) -> Emission:
    axes = _area_frame(light)
    origins = _area_points(light, u[:, 2:])
    flux = np.pi * light.area * np.asarray(light.radiance, np.float32)
    if light.spread <= 0:
        # A parallel beam spreads out over the lamp's surface alone.
        origins = _area_points(light, u[:, :2])
        directions = np.repeat(axes[2:].astype(np.float32), len(u), axis=0)
        return Emission(origins, directions, np.tile(flux, (len(u), 1)), origins)
    if light.spread >= np.pi - 1e-6:
        local, gain = cosine_hemisphere(u[:, :2]), np.ones(len(u))
    else:
        half = 0.5 * float(light.spread)
        theta, cdf = _spread_table(half)
        angle, density = _invert(theta, cdf, u[:, 0])
        azimuth = 2.0 * np.pi * u[:, 1].astype(np.float64)
        local = np.stack([np.sin(angle) * np.cos(azimuth), np.sin(angle) * np.sin(azimuth), np.cos(angle)], axis=1)
        excess = np.tan(half) - half if half > 0.05 else half**3 / 3.0
        gain = 2.0 * _spread_profile(angle, half) / excess / density
    directions = normalized((local @ axes).astype(np.float32))
    return Emission(origins, directions, flux * gain[:, None].astype(np.float32), _area_domain(light, directions))


def _spread_profile(angle: np.ndarray, half: float) -> np.ndarray:
    """Power per angle from the normal: (tan h − tan θ)·cosθ·sinθ."""
    return np.maximum(np.tan(half) * np.cos(angle) - np.sin(angle), 0.0) * np.sin(angle)


@lru_cache(maxsize=64)
def _spread_table(half: float) -> tuple[np.ndarray, np.ndarray]:
    theta = np.linspace(0.0, half, _TABLE + 1)
    return theta, _cumulated(_spread_profile(0.5 * (theta[1:] + theta[:-1]), half))


def _cumulated(profile: np.ndarray) -> np.ndarray:
    # No cell is left out, however dim: what its middle misses may lie at its edge.
    profile = profile + 1e-4 * profile.max()
    return np.concatenate([[0.0], np.cumsum(profile)]) / profile.sum()


def _invert(edges: np.ndarray, cdf: np.ndarray, u: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Values (n,) float64 with the piecewise constant density of ``cdf`` over ``edges``, and that density (n,)."""
    u = u.astype(np.float64)
    cell = np.clip(np.searchsorted(cdf, u, side="right") - 1, 0, len(edges) - 2)
    width, mass = edges[cell + 1] - edges[cell], cdf[cell + 1] - cdf[cell]
    return edges[cell] + width * (u - cdf[cell]) / mass, mass / width


def _area_frame(light: AreaLight) -> np.ndarray:
    """Rows: an orthonormal frame (3, 3) about the lamp's normal, turning with its axes."""
    normal = np.asarray(light.normal_world, np.float64)
    tangent = np.asarray(light.half_u_world, np.float64)
    tangent = tangent - normal * (tangent @ normal)
    tangent /= max(np.linalg.norm(tangent), 1e-300)
    return np.stack([tangent, np.cross(normal, tangent), normal])


def _area_points(light: AreaLight, u: np.ndarray) -> np.ndarray:
    st = disk_from_square(u) if light.shape == "ELLIPSE" else 2.0 * u - 1.0
    return (np.asarray(light.position_world, np.float64) + st[:, :1] * np.asarray(light.half_u_world, np.float64)
            + st[:, 1:] * np.asarray(light.half_v_world, np.float64)).astype(np.float32)


def _area_domain(light: AreaLight, directions: np.ndarray) -> np.ndarray:
    """The projected hemisphere (Nusselt), where cosine emission is uniform."""
    local = directions @ _area_frame(light).T.astype(np.float32)
    return np.concatenate([local[:, :2], np.zeros((len(local), 1), np.float32)], axis=1)


def _area_shines(light: AreaLight, origins: np.ndarray, points: np.ndarray) -> np.ndarray:
    normal = np.asarray(light.normal_world, np.float32)
    away = normalized(points - origins)
    cosine = away @ normal
    if light.spread >= np.pi - 1e-6:
        return cosine > 0
    return cosine > max(np.cos(0.5 * light.spread), 1e-6)


def _beside(light: PointLight | SpotLight, directions: np.ndarray, u: np.ndarray) -> np.ndarray:
    """Where (n, 3) rays along ``directions`` leave the lamp: its centre, or its sphere across the whole width."""
    centre = np.asarray(light.position_world, np.float32)
    if light.radius <= 0:
        return np.repeat(centre[None], len(directions), axis=0)
    xy = disk_from_square(u)
    tangent, bitangent = frame(directions)
    # The disk, not the sphere's front: a soft lamp may touch what it hangs on, and lights it from its middle.
    return (centre + np.float32(light.radius) * (tangent * xy[:, :1] + bitangent * xy[:, 1:])).astype(np.float32)
