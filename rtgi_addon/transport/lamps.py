"""Direct light of lamps: one unbiased sample of a sun, point, spot or area lamp for every point of an array.

The geometry and the falloffs are those of Cycles (`kernel/light/{sun,point,spot,area}.h`), so that a bake and a render agree.
Results depend on each row alone, never on how rows are grouped into calls.
"""

from dataclasses import dataclass

import numpy as np

from ..numerics.sampling import disk_from_square, frame
from ..scene import AreaLight, Light, PointLight, SpotLight, SunLight
from .area_lamps import AreaLamps, area_importance, sample_area
from .vectors import dot, luminance, normalized

SUN, POINT, SPOT, AREA = range(4)
# Squared distances below this [m²] are taken as this: a point on top of a lamp gets a huge irradiance, never an infinite one.
MIN_DISTANCE_SQUARED = np.float32(1e-12)


@dataclass(frozen=True, eq=False)
class LampSample:
    """One sample per point: ``direction`` (n, 3) unit towards the lamp, ``distance`` (n,) [m] to it (infinite for a sun) and
    ``irradiance`` (n, 3) [W·m⁻²] on a plane facing ``direction``: E = mean over samples of irradiance·max(0, n·direction)·V."""

    direction: np.ndarray
    distance: np.ndarray
    irradiance: np.ndarray


@dataclass(frozen=True, eq=False)
class _Lamps:
    """Suns, points and spots as rows: what ``strength`` (m, 3) means is the kind's own (irradiance or intensity)."""

    position: np.ndarray
    direction: np.ndarray
    strength: np.ndarray
    radius: np.ndarray
    soft_falloff: np.ndarray
    one_minus_cos: np.ndarray
    local_from_world: np.ndarray
    cos_half_cone: np.ndarray
    inverse_blend: np.ndarray

    def take(self, rows) -> "_Lamps":
        return _Lamps(*(getattr(self, name)[rows] for name in self.__dataclass_fields__))


class LampTable:
    """All lamps of a scene as a structure of arrays, in the scene's order.

    ``kind`` (L,) int8 is SUN, POINT, SPOT or AREA; ``casts_shadow`` (L,) bool: False asks for no shadow ray; ``is_delta`` (L,)
    bool: the sample does not depend on ``uv``, so one per point is exact; ``power_estimate`` (L,) float32 luminous power
    [W], for suns irradiance times ``scene_radius``²·π.
    """

    def __init__(self, lights: tuple[Light, ...], scene_radius: float = 1.0):
        self.count = len(lights)
        kinds = {SunLight: SUN, PointLight: POINT, SpotLight: SPOT, AreaLight: AREA}
        self.kind = np.array([kinds[type(light)] for light in lights], np.int8)
        self.casts_shadow = np.array([light.casts_shadow for light in lights], bool)
        self._row = np.zeros(self.count, np.intp)
        for kind in range(4):
            of_kind = np.flatnonzero(self.kind == kind)
            self._row[of_kind] = np.arange(of_kind.size)
        chosen = [[light for light in lights if kinds[type(light)] == kind] for kind in range(4)]
        self._tables = [_sun_rows(chosen[SUN]), _point_rows(chosen[POINT]), _point_rows(chosen[SPOT]), AreaLamps.of(chosen[AREA])]
        self.is_delta = np.array([_is_delta(light) for light in lights], bool)
        self.power_estimate = np.array([_luminous_power(light, scene_radius) for light in lights], np.float32)

    def sample(self, lamp_index, points: np.ndarray, uv: np.ndarray) -> LampSample:
        """Sample lamp ``lamp_index`` (one for all, or (n,)) from ``points`` (n, 3) with ``uv`` (n, 2) in [0, 1)."""
        return LampSample(*self._by_kind(_SAMPLERS, (3, 0, 3), lamp_index, points, uv))

    def irradiance_unshadowed(self, lamp_index, points: np.ndarray, normals: np.ndarray) -> np.ndarray:
        """Estimate (n, 3) [W·m⁻²] of a lamp's irradiance without occlusion, from its centre: for importance only.

        It is positive wherever the true irradiance may be, also where only part of a lamp is above the horizon.
        """
        return self._by_kind(_IMPORTANCES, (3,), lamp_index, points, normals)[0]

    def _by_kind(self, functions, widths, lamp_index, points, other):
        if np.ndim(lamp_index) == 0:
            kind, row = self.kind[lamp_index], self._row[lamp_index]
            return functions[kind](self._tables[kind].take(slice(row, row + 1)), points, other)
        n = len(points)
        results = tuple(np.empty((n, 3) if width else n, np.float32) for width in widths)
        kinds = self.kind[lamp_index]
        for kind in range(4):
            rows = np.flatnonzero(kinds == kind)
            if rows.size:
                table = self._tables[kind].take(self._row[lamp_index[rows]])
                for result, part in zip(results, functions[kind](table, points[rows], other[rows]), strict=True):
                    result[rows] = part
        return results


def _rows(lights, **fields) -> _Lamps:
    def column(name, shape, default):
        values = [default if fields.get(name) is None else fields[name](light) for light in lights]
        return np.array(values, np.float32).reshape(len(lights), *shape)

    return _Lamps(column("position", (3,), np.zeros(3)), column("direction", (3,), np.zeros(3)),
                  column("strength", (3,), np.zeros(3)), column("radius", (), 0.0), column("soft_falloff", (), 0.0) > 0,
                  column("one_minus_cos", (), 0.0), column("local_from_world", (3, 3), np.zeros((3, 3))),
                  column("cos_half_cone", (), -1.0), column("inverse_blend", (), 0.0))


def _sun_rows(lights: list[SunLight]) -> _Lamps:
    return _rows(lights, direction=lambda light: light.direction_world, strength=lambda light: light.irradiance,
                 one_minus_cos=lambda light: 2.0 * np.sin(0.25 * light.angle) ** 2)


def _point_rows(lights: list[PointLight] | list[SpotLight]) -> _Lamps:
    fields = {"position": lambda light: light.position_world, "strength": lambda light: light.intensity,
              "radius": lambda light: light.radius, "soft_falloff": lambda light: light.soft_falloff}
    if lights and isinstance(lights[0], SpotLight):
        fields |= {"direction": lambda light: light.direction_world, "local_from_world": _spot_local_from_world,
                   "cos_half_cone": lambda light: np.cos(0.5 * light.cone_angle),
                   "inverse_blend": lambda light: 1.0 / max((1.0 - np.cos(0.5 * light.cone_angle)) * light.blend, 1e-7)}
    return _rows(lights, **fields)


def _spot_local_from_world(light: SpotLight) -> np.ndarray:
    if light.world_from_local is not None:
        # The pseudo-inverse: a lamp scaled to nothing along an axis is still a lamp.
        return np.linalg.pinv(np.asarray(light.world_from_local, np.float64))
    axis = np.asarray(light.direction_world, np.float64).reshape(1, 3)
    tangent, bitangent = frame(-axis)
    return np.concatenate([tangent, bitangent, -axis])


def _is_delta(light: Light) -> bool:
    if isinstance(light, SunLight):
        return light.angle == 0
    return light.spread == 0 if isinstance(light, AreaLight) else light.radius == 0


def _luminous_power(light: Light, scene_radius: float) -> float:
    if isinstance(light, SunLight):
        return np.pi * scene_radius**2 * float(luminance(light.irradiance))
    if isinstance(light, AreaLight):
        # The spread only turns the light, it keeps the flux.
        return np.pi * light.area * float(luminance(light.radiance))
    share = 0.5 * (1.0 - np.cos(0.5 * light.cone_angle)) if isinstance(light, SpotLight) else 1.0
    return 4.0 * np.pi * share * float(luminance(light.intensity))


def _sample_sun(lamps: _Lamps, points: np.ndarray, uv: np.ndarray):
    n = len(points)
    direction = _per_point(lamps.direction, n)
    np.negative(direction, out=direction)
    wide = np.flatnonzero(np.broadcast_to(lamps.one_minus_cos > 0, (n,)))
    if wide.size:
        direction[wide], _ = _cone(direction[wide], np.broadcast_to(lamps.one_minus_cos, (n,))[wide], uv[wide])
    # Uniform radiance S/(π·sin²) over a cap of solid angle 2π(1 − cos): S·2/(1 + cos) a sample, S·1 for the facing plane's mean.
    gain = np.float32(2.0) / (np.float32(2.0) - lamps.one_minus_cos)
    return direction, np.full(n, np.inf, np.float32), _per_point(lamps.strength * gain[:, None], n)


def _sample_point(lamps: _Lamps, points: np.ndarray, uv: np.ndarray):
    towards, distance_squared = _towards(lamps, points)
    distance = np.sqrt(distance_squared)
    direction = towards / distance[:, None]
    factor = 1.0 / distance_squared
    if lamps.radius.any():
        radius = np.broadcast_to(lamps.radius, distance.shape)
        soft = np.broadcast_to(lamps.soft_falloff, distance.shape)
        disk, sphere = np.flatnonzero(soft & (radius > 0)), np.flatnonzero(~soft & (radius > 0))
        if disk.size:
            _sample_disk(disk, radius, towards, direction, distance, factor, uv)
        if sphere.size:
            _sample_sphere(sphere, radius, direction, distance, factor, uv)
    return direction, distance, lamps.strength * factor[:, None]


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
    ratio = np.square(r / d)
    outside = ratio < 1.0
    spread = np.where(outside, ratio / (1.0 + np.sqrt(np.maximum(1.0 - ratio, 0.0))), np.float32(2.0))
    direction[rows], cosine = _cone(axis, spread, uv[rows])
    chord = np.sqrt(np.maximum(r * r - d * d + np.square(d * cosine), 0.0))
    # Inside, the sampled direction leaves through the far side; outside, it meets the near one.
    distance[rows] = np.maximum(d * cosine + np.where(outside, -chord, chord), 0.0)
    factor[rows] = 2.0 * spread / (r * r)


def spot_attenuation(light: SpotLight, directions: np.ndarray) -> np.ndarray:
    """Intensity (n,) relative to the full one that a spot without radius sends into unit world ``directions`` (n, 3)."""
    return _spot_attenuation(_point_rows([light]), -np.asarray(directions, np.float32))


def _sample_spot(lamps: _Lamps, points: np.ndarray, uv: np.ndarray):
    direction, distance, irradiance = _sample_point(lamps, points, uv)
    attenuation = _spot_attenuation(lamps, direction)
    hard_sphere = ~lamps.soft_falloff & (lamps.radius > 0)
    if hard_sphere.any():
        # As in Cycles, the cone does not apply inside the lamp's own sphere.
        distance_squared = _towards(lamps, points)[1]
        attenuation = np.where(hard_sphere & (distance_squared <= lamps.radius**2), np.float32(1.0), attenuation)
    return direction, distance, irradiance * attenuation[:, None]


def _spot_attenuation(lamps: _Lamps, direction: np.ndarray, margin=0.0) -> np.ndarray:
    m = lamps.local_from_world
    x, y, z = ((m[:, i, 0] * direction[:, 0] + m[:, i, 1] * direction[:, 1] + m[:, i, 2] * direction[:, 2]) for i in range(3))
    # The light travels along −Z, so +Z of the direction back to the lamp is the cosine to the axis.
    cosine = z / np.sqrt(np.maximum(x * x + y * y + z * z, np.finfo(np.float32).tiny))
    t = np.clip((cosine + margin - lamps.cos_half_cone) * lamps.inverse_blend, 0.0, 1.0)
    return t * t * (3.0 - 2.0 * t)


def _sun_importance(lamps: _Lamps, points: np.ndarray, normals: np.ndarray):
    sine = np.sqrt(np.maximum(lamps.one_minus_cos * (2.0 - lamps.one_minus_cos), 0.0))
    cosine = -dot(normals, lamps.direction)
    return (lamps.strength * (np.maximum(cosine + sine, 0.0) / (1.0 + sine))[:, None],)


def _point_importance(lamps: _Lamps, points: np.ndarray, normals: np.ndarray):
    towards, distance_squared = _towards(lamps, points)
    distance = np.sqrt(distance_squared)
    extent = np.minimum(lamps.radius / distance, 1.0)
    cosine = np.maximum(dot(towards, normals) / distance + extent, 0.0) / (1.0 + extent)
    return (lamps.strength * (cosine / np.maximum(distance_squared, lamps.radius**2))[:, None],)


def _spot_importance(lamps: _Lamps, points: np.ndarray, normals: np.ndarray):
    irradiance, = _point_importance(lamps, points, normals)
    towards, distance_squared = _towards(lamps, points)
    distance = np.sqrt(distance_squared)[:, None]
    # A wide lamp is seen under other angles than its centre; the local axes may stretch them further.
    stretch = np.sqrt(np.sum(lamps.local_from_world**2, axis=(1, 2)))
    margin = np.where(lamps.radius > 0, 2.0 * stretch * np.minimum(lamps.radius / distance[:, 0], 1.0) + 1e-3, 0.0)
    return (irradiance * _spot_attenuation(lamps, towards / distance, margin)[:, None],)


def _towards(lamps: _Lamps, points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    towards = lamps.position - points
    return towards, np.maximum(dot(towards, towards), MIN_DISTANCE_SQUARED)


def _cone(axis: np.ndarray, one_minus_cos: np.ndarray, uv: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Uniform directions in a cone about ``axis`` (n, 3), and their cosines; 1 − cos keeps small angles exact."""
    xy = disk_from_square(uv)
    squared = xy[:, 0] * xy[:, 0] + xy[:, 1] * xy[:, 1]
    cosine = 1.0 - squared * one_minus_cos
    xy = xy * np.sqrt(np.maximum(one_minus_cos * (2.0 - one_minus_cos * squared), 0.0))[:, None]
    tangent, bitangent = frame(axis)
    return normalized(tangent * xy[:, :1] + bitangent * xy[:, 1:] + axis * cosine[:, None]), cosine


def _per_point(rows: np.ndarray, n: int) -> np.ndarray:
    return np.repeat(rows, n, axis=0) if len(rows) != n else rows.copy()


_SAMPLERS = (_sample_sun, _sample_point, _sample_spot, sample_area)
_IMPORTANCES = (_sun_importance, _point_importance, _spot_importance, area_importance)
