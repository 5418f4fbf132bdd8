"""One point of a lamp that a whole frame is lit from: its shadow views, and what direct_light.comp.glsl needs to know of it.

Every frame takes another point, so that soft shadows and the light of wide lamps settle as frames are averaged. Where a lamp has an
analytic sample per receiver (transport/lamps.py) the shader uses that, and only its visibility comes from the shared point.
"""

from dataclasses import dataclass, replace

import numpy as np

from ..numerics.sampling import disk_from_square, frame
from ..scene import AreaLight, Light, PointLight, SpotLight, SunLight
from ..transport.area_lamps import AreaLamps
from ..transport.shadow_views import ShadowView, views_of_light

SUN, POINT, SPOT, AREA = range(4)
_KINDS = {SunLight: SUN, PointLight: POINT, SpotLight: SPOT, AreaLight: AREA}
# What stands for a tangent without bound in a shader.
_NO_SPREAD = 1e30


@dataclass(frozen=True, eq=False)
class LampSample:
    """``light`` seen through one of its points: ``placed`` is a lamp without extent there, which ``shadow_views`` are made for;
    ``uniforms`` are the lamp's members of the struct DIRECT_LIGHT."""

    light: Light
    placed: Light
    uniforms: dict

    def shadow_views(self, bounds: np.ndarray, resolution: int, focus: np.ndarray | None = None) -> tuple[ShadowView, ...]:
        """Views of a scene within ``bounds`` (2, 3) as the point lights it; a sun's is fitted to the box ``focus`` (2, 3)."""
        return views_of_light(self.placed, bounds, resolution, focus=focus, area_points=1)


def sample_lamp(light: Light, u: np.ndarray, gain: float = 1.0) -> LampSample:
    """The point of ``light`` for ``u`` (3,) in [0, 1), as if it were ``gain`` times as bright."""
    kind = _KINDS[type(light)]
    placed, uniforms = {SUN: _sun, POINT: _point, SPOT: _spot, AREA: _area}[kind](light, np.asarray(u, np.float64))
    strength = gain * np.broadcast_to(np.asarray(uniforms["strength"], np.float64), (3,))
    return LampSample(light, placed, {**_DARK, "kind": kind, **uniforms, "strength": strength})


# The members of the struct that not every lamp has.
_DARK = {"position": np.zeros(3), "shift": np.zeros(3), "axis": np.zeros(3), "radius": 0.0, "soft_falloff": 0,
         "local_from_world": np.zeros((4, 4)), "cos_half_cone": -1.0, "inverse_blend": 0.0,
         "tan_half_spread": _NO_SPREAD, "spread_gain": 1.0, "beam": np.zeros((4, 4)), "ellipse": 0}


def _sun(light: SunLight, u: np.ndarray):
    axis = np.asarray(light.direction_world, np.float64)
    one_minus_cos = 2.0 * np.sin(0.25 * light.angle) ** 2
    xy = disk_from_square(u[:2])
    squared = float(xy @ xy)
    xy = xy * np.sqrt(max(one_minus_cos * (2.0 - one_minus_cos * squared), 0.0))
    tangent, bitangent = frame(-axis)
    towards = tangent * xy[0] + bitangent * xy[1] - axis * (1.0 - squared * one_minus_cos)
    towards /= np.linalg.norm(towards)
    strength = np.asarray(light.irradiance, np.float64) * (2.0 / (2.0 - one_minus_cos))
    return replace(light, direction_world=-towards), {"axis": towards, "strength": strength}


def _point(light: PointLight | SpotLight, u: np.ndarray):
    shift = light.radius * ball_point(u)
    position = np.asarray(light.position_world, np.float64)
    uniforms = {"position": position, "shift": shift, "radius": light.radius, "soft_falloff": int(light.soft_falloff),
                "strength": light.intensity}
    return replace(light, position_world=position + shift), uniforms


def _spot(light: SpotLight, u: np.ndarray):
    placed, uniforms = _point(light, u)
    local_from_world = np.eye(4)
    axis = np.asarray(light.direction_world, np.float64)
    if light.world_from_local is None:
        tangent, bitangent = frame(-axis)
        local_from_world[:3, :3] = [tangent, bitangent, -axis]
    else:
        # The pseudo-inverse: a lamp scaled to nothing along an axis is still a lamp.
        local_from_world[:3, :3] = np.linalg.pinv(np.asarray(light.world_from_local, np.float64))
    cosine = np.cos(0.5 * light.cone_angle)
    return placed, {**uniforms, "axis": -axis, "local_from_world": local_from_world, "cos_half_cone": cosine,
                    "inverse_blend": 1.0 / max((1.0 - cosine) * light.blend, 1e-7)}


def _area(light: AreaLight, u: np.ndarray):
    row = AreaLamps.of([light]).take(0)
    s, t = disk_from_square(u[:2]) if row.ellipse else 2.0 * u[:2] - 1.0
    if row.tan_half_spread == 0:
        s = t = 0.0
    shift = (row.a * s + row.shear * row.b * t) * row.u + row.b * t * row.v
    # Rows that take a point relative to the centre to the square or the disk that stands for the lamp.
    beam = np.zeros((4, 4))
    beam[0, :3] = (row.u - row.shear * row.v) / row.a
    beam[1, :3] = row.v / row.b
    position = np.asarray(light.position_world, np.float64)
    collimated = row.tan_half_spread == 0
    strength = np.asarray(light.radiance, np.float64) * (np.pi if collimated else row.area)
    uniforms = {"position": position, "shift": shift, "axis": row.normal, "strength": strength, "beam": beam,
                "ellipse": int(row.ellipse), "tan_half_spread": min(float(row.tan_half_spread), _NO_SPREAD),
                "spread_gain": row.spread_gain}
    return replace(light, position_world=position + shift), uniforms


def ball_point(u: np.ndarray) -> np.ndarray:
    """A point (3,) of the unit ball for ``u`` (3,) in [0, 1), so distributed that it lies evenly over a disk from wherever it is
    seen: radii have density r²/√(1 − r²) (the Abel transform of a constant)."""
    # With r = sin t the share of points within r is (2t − sin 2t)/π; Newton's steps converge from the middle.
    t = 0.25 * np.pi
    for _ in range(30):
        t -= (2.0 * t - np.sin(2.0 * t) - np.pi * u[2]) / max(4.0 * np.sin(t) ** 2, 1e-6)
        t = min(max(t, 0.0), 0.5 * np.pi)
    z = 1.0 - 2.0 * u[0]
    ring, azimuth = 2.0 * np.sqrt(max(u[0] * (1.0 - u[0]), 0.0)), 2.0 * np.pi * u[1]
    return np.sin(t) * np.array([ring * np.cos(azimuth), ring * np.sin(azimuth), z])
