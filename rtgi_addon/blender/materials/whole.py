"""One ``Material`` from what a shader answers different rays: its sides, its answer to shadow rays and to the camera, and the mean
of what varies with the angle."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from ...scene import Channel, Material
from .circumstances import ANGLE, DEPTH, KIND, SIDE, Ray
from .shaders import Surface, ratio
from .values import Value, apply

# From one angle to the next a ray turns about the normal by the golden angle.
_TURN = np.pi * (3.0 - 5.0**0.5)
_CHANNELS = ("albedo", "emission", "alpha", "base_color", "metallic", "roughness", "specular", "tint", "translucency")
_ALIKE = 1e-3


def whole_material(source, asked: frozenset, surface_of: Callable[[Ray], Surface], angles: int, extraction: str,
                   remark: Callable[[str], None]) -> Material:
    """The material of a bpy material (or None: unnamed) whose shader asks ``asked`` and shows ``surface_of(ray)``.

    What varies with the angle is averaged over ``angles`` directions of a cosine-weighted hemisphere: what a wall of it reflects,
    and what it shows from all around. ``remark`` takes what a ``Material`` cannot hold. Raises Unreadable.
    """
    known: dict[Ray, Surface] = {}

    def surface(ray: Ray) -> Surface:
        ray = ray.seen_by(asked)
        if ray not in known:
            known[ray] = surface_of(ray)
        return known[ray]

    def seen(kind: str, back: bool, further: int = 0) -> list[Surface]:
        # Cells of equal cosine-weighted solid angle are equal in the squared cosine.
        rays = [Ray(kind, further, back, float(np.sqrt((i + 0.5) / angles)), i * _TURN) for i in range(angles)]
        return [surface(ray) for ray in (rays if ANGLE in asked else rays[:1])]

    def side(kind: str, back: bool) -> Material:
        surfaces = seen(kind, back)
        found = _material(source, averaged(surfaces), extraction)
        if len(surfaces) > 1:
            found = replace(found, albedo_by_angle=_profile(surfaces, "albedo"), emission_by_angle=_profile(surfaces, "emission"))
        if KIND in asked and kind == "diffuse":
            shadow = averaged(seen("shadow", back))
            passing = {"shadow_alpha": _channel(shadow.alpha), "shadow_tint": _channel(shadow.tint)}
            if not (_same_channel(passing["shadow_alpha"], found.alpha) and _same_channel(passing["shadow_tint"], found.tint)):
                found = replace(found, **passing)
        if not (found.is_opaque or getattr(source, "use_transparent_shadow", True)):
            found = replace(found, shadow_alpha=Channel.of(1.0), point_alpha=None)
        return found

    def both(kind: str) -> Material:
        front = side(kind, False)
        back = side(kind, True) if SIDE in asked else front
        return front if _same(front, back) else replace(front, back=back)

    material = both("diffuse")
    if KIND in asked:
        camera = both("camera")
        if not _same(material, camera):
            material = replace(material, camera=camera)
    if KIND in asked and not _same_channel(material.emission, side("light", False).emission):
        remark("its light depends on the kind of ray, and Cycles, which also samples it as a lamp, shows only part of it")
    if DEPTH in asked and not _same(side("diffuse", False), _material(source, averaged(seen("diffuse", False, 1)), extraction)):
        remark("its answer differs with the number of reflections, and is taken as it is after the first")
    return material


def averaged(surfaces: list[Surface]) -> Surface:
    """The mean of a surface under angles of equal weight: of what it covers, and of what it reflects and emits of that."""
    first = surfaces[0]
    if len(surfaces) == 1:
        return first
    alpha = _mean([surface.alpha for surface in surfaces])
    even = all(_alike(surface.alpha, first.alpha) for surface in surfaces)

    def covered(name: str) -> Value:
        if even:
            return _mean([getattr(surface, name) for surface in surfaces])
        return ratio(_mean([surface.alpha * getattr(surface, name) for surface in surfaces]), alpha)

    shown = [surface.albedo if surface.base_color is None else surface.base_color for surface in surfaces]
    rest = {name: _mean([getattr(surface, name) for surface in surfaces]) for name in ("metallic", "roughness", "specular")}
    tint = first.tint
    if not all(_alike(surface.tint, tint) for surface in surfaces):
        tint = ratio(_mean([(1.0 - surface.alpha) * surface.tint for surface in surfaces]), 1.0 - alpha).clamped()
    return Surface(covered("albedo"), covered("emission"), alpha, _mean(shown), **rest, tint=tint,
                   translucency=covered("translucency"), glass=first.glass,
                   clear=_mean([surface.transparency for surface in surfaces]) if first.glass else None)


def _mean(values: list[Value]) -> Value:
    if all(_alike(value, values[0]) for value in values):
        return values[0]
    total = values[0]
    for value in values[1:]:
        total = total + value
    return total * (1.0 / len(values))


def _alike(a: Value, b: Value) -> bool:
    if a is b:
        return True
    same_factors = (a.texture is b.texture and a.texture_channel == b.texture_channel and a.mapping == b.mapping
                    and a.attribute == b.attribute and a.cut == b.cut)
    return same_factors and np.array_equal(a.constant, b.constant) and np.array_equal(_offset(a), _offset(b))


def _offset(value: Value):
    return np.zeros(3, np.float32) if value.offset is None else value.offset


def _profile(surfaces: list[Surface], name: str) -> np.ndarray | None:
    """(angles, 3) float32: albedo or emission at each angle, from grazing to straight on, over its mean, for the surface as a
    whole; None where it does not vary."""
    shown = np.array([(getattr(surface, name) * surface.alpha).mean() for surface in surfaces], np.float64)
    mean = shown.mean(axis=0)
    profile = np.where(mean > 0.0, shown / np.where(mean > 0.0, mean, 1.0), 1.0)
    return None if np.abs(profile - 1.0).max() < _ALIKE else profile.astype(np.float32)


def _material(source, surface: Surface, extraction: str) -> Material:
    """A surface as a Material. Raises Unreadable if a channel cannot hold it."""
    alpha, threshold = surface.alpha, None
    if alpha.cut is not None:
        threshold, above = alpha.cut
        alpha = replace(alpha, cut=None)
        if not above:
            alpha, threshold = 1.0 - alpha, 1.0 - threshold
    base = surface.albedo if surface.base_color is None else surface.base_color
    return Material(
        source.name, _channel(surface.albedo), _channel(surface.emission), _channel(alpha), threshold, _channel(base),
        _channel(surface.metallic), _channel(surface.roughness), source.use_backface_culling, extraction,
        _channel(surface.specular), _channel(surface.tint), _channel(surface.translucency), surface.glass,
        None if surface.clear is None else _channel(1.0 - surface.clear))


def _channel(value: Value) -> Channel:
    return (value if value.cut is None else apply(np.positive, value)).channel()


def _same(a: Material, b: Material) -> bool:
    if a is b:
        return True
    if a.alpha_threshold != b.alpha_threshold or (a.back is None) != (b.back is None):
        return False
    return (all(_same_channel(getattr(a, name), getattr(b, name)) for name in _CHANNELS)
            and _same_channel(a.shadow_alpha, b.shadow_alpha) and _same_channel(a.shadow_tint, b.shadow_tint)
            and (a.back is None or _same(a.back, b.back)))


def _same_channel(a: Channel | None, b: Channel | None) -> bool:
    if a is None or b is None:
        return a is b
    placed = [(channel.texture_channel, channel.uv_layer, channel.attribute) for channel in (a, b)]
    arrays = [(channel.constant, channel.uv_transform, channel.offset, None if channel.texture is None else channel.texture.pixels)
              for channel in (a, b)]
    return placed[0] == placed[1] and all(
        x is y or (x is not None and y is not None and np.array_equal(x, y)) for x, y in zip(*arrays, strict=True))
