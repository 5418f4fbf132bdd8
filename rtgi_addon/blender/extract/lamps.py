"""Blender's lamps as physical ones, with the numbers Cycles gives them (Cycles ``scene/light.cpp`` and ``kernel/light``; every
conversion is held against Cycles renders in tests/blender/extract/test_lamps.py).

Power P [W] × 2^exposure × colour × temperature gives: sun E = P; point and spot I = P/4π, whatever the cone; area L = P/(π·A).
With Normalize off P is multiplied by π·sin²(angle/2), 4π·radius² or A, so that the radiance no longer depends on the size.
"""

from dataclasses import replace

import numpy as np

from ...scene import AreaLight, PointLight, SpotLight, SunLight
from ..ui.role_properties import lamp_role
from .lamp_nodes import node_factor
from .light_groups import light_group
from .linking import Links, resolve

# Light reflected so often is as good as all of it.
_ENDLESS = 128

# Share of its squared scale by which a lamp may be stretched and still count as a sphere.
_ROUND = 1e-5


def read_lamp(obj, matrix_world, notes: list[str]):
    """The lamp of an evaluated LIGHT object under ``matrix_world`` as a ``scene.Light``; None if it sends out no diffuse light.

    What cannot be read exactly is added to ``notes`` by the object's name. Nodes that make no constant of its light are left out:
    `lamp_profiles` has Cycles say what they make.
    """
    lamp = obj.data
    if lamp.type == "AREA" and _cycles(lamp, "is_portal", False):
        return None
    world_from_local = np.array(matrix_world, np.float64)
    factor = node_factor(lamp)
    color = np.array(lamp.color, np.float64) * (np.array(lamp.temperature_color) if lamp.use_temperature else 1.0)
    power = color * lamp.energy * 2.0 ** lamp.exposure * (1.0 if factor is None else factor)
    if not np.any(power != 0):
        return None
    if not obj.visible_diffuse:
        notes.append(f"lamp {obj.name} is invisible to diffuse rays: it is left out")
        return None
    light = plain_lamp(obj.name, lamp, world_from_local, power)
    if light is None:
        return None
    bounces = int(_cycles(lamp, "max_bounces", _ENDLESS))
    return replace(light, max_bounces=bounces if bounces < _ENDLESS else None, bake=lamp_role(lamp),
                   light_group=light_group(obj), scattered=float(lamp.volume_factor) if obj.visible_volume_scatter else 0.0)


def plain_lamp(name: str, lamp, world_from_local: np.ndarray, power: np.ndarray):
    """A lamp of ``power`` (3,) [W] with the settings of ``lamp``, Blender's or what has its attributes, and without nodes; None if
    it has no extent to shine from."""
    return _READERS[lamp.type](name, lamp, world_from_local, power)


def linked(light, links: Links | None, identities: list[tuple[int, ...]]):
    """``light`` with its linking over the instances that go by ``identities``."""
    return light if links is None else replace(light, linking=resolve(links, identities))


def _sun(name, lamp, world_from_local, power):
    area = np.pi * np.sin(lamp.angle / 2.0) ** 2 if lamp.angle > 0.0 else 1.0
    return SunLight(name, _axis(world_from_local), _rgb(power if lamp.normalize else power * area), float(lamp.angle),
                    casts_shadow=bool(lamp.use_shadow))


def _point(name, lamp, world_from_local, power):
    return PointLight(name, _position(world_from_local), _intensity(lamp, power), float(lamp.shadow_soft_size),
                      bool(lamp.use_soft_falloff), casts_shadow=bool(lamp.use_shadow))


def _spot(name, lamp, world_from_local, power):
    linear = world_from_local[:3, :3]
    gram = linear.T @ linear
    is_round = np.allclose(gram, np.eye(3) * gram[2, 2], rtol=0.0, atol=_ROUND * gram[2, 2])
    return SpotLight(name, _position(world_from_local), _axis(world_from_local), _intensity(lamp, power), float(lamp.spot_size),
                     float(lamp.spot_blend), float(lamp.shadow_soft_size), bool(lamp.use_soft_falloff),
                     None if is_round else linear, casts_shadow=bool(lamp.use_shadow))


def _area(name, lamp, world_from_local, power):
    size_y = lamp.size_y if lamp.shape in {"RECTANGLE", "ELLIPSE"} else lamp.size
    half_u, half_v = world_from_local[:3, 0] * lamp.size / 2.0, world_from_local[:3, 1] * size_y / 2.0
    is_ellipse = lamp.shape in {"DISK", "ELLIPSE"}
    # Cycles takes the product of the sides, which is the area unless a parent shears the lamp.
    area = np.linalg.norm(half_u) * np.linalg.norm(half_v) * (np.pi if is_ellipse else 4.0)
    if area == 0.0:
        return None
    return AreaLight(name, _position(world_from_local), half_u, half_v, _axis(world_from_local),
                     _rgb(power / np.pi / (area if lamp.normalize else 1.0)), "ELLIPSE" if is_ellipse else "RECTANGLE",
                     float(lamp.spread), casts_shadow=bool(lamp.use_shadow))


_READERS = {"SUN": _sun, "POINT": _point, "SPOT": _spot, "AREA": _area}


def _intensity(lamp, power):
    """Radiant intensity (3,) of a point or spot lamp. Cycles counts 4 as the area of a lamp without size."""
    radius = lamp.shadow_soft_size
    area = 4.0 * np.pi * radius * radius if radius > 0.0 else 4.0
    return _rgb(power / (4.0 * np.pi) * (1.0 if lamp.normalize else area))


def _axis(world_from_local):
    """The way a lamp shines: its −Z axis in world space, unit (whatever the other axes do: Cycles takes no cross product)."""
    axis = -world_from_local[:3, 2]
    length = np.linalg.norm(axis)
    return axis / length if length > 0.0 else np.array([0.0, 0.0, -1.0])


def _position(world_from_local):
    return world_from_local[:3, 3].copy()


def _rgb(values):
    return np.asarray(values, np.float32)


def _cycles(lamp, name, default):
    """A setting of the Cycles add-on, which may be switched off."""
    return getattr(getattr(lamp, "cycles", None), name, default)
