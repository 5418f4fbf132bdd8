"""Lamps in physical units (docs/physics.md §1). Extraction turns Blender's watts into these; transport reads only these.

Sources: Blender manual, Light Objects; Cycles `light.cpp`; every conversion is checked against Cycles in tests/blender.
"""

from dataclasses import dataclass, field
from typing import ClassVar

import numpy as np

from .lamp_profile import LampProfile
from .linking import Linking

# What of a lamp is in a bake (``Lamp.bake``): its direct light and all that follows, what surfaces reflect of it, or nothing.
ALL_LIGHT, BOUNCES_ONLY, NOT_AT_ALL = "ALL", "BOUNCES", "NONE"


@dataclass(frozen=True, eq=False)
class Lamp:
    """What every lamp has. ``STRENGTH`` names the field (3,) in proportion to which it shines.

    ``bake`` says what of it is in a bake. ``max_bounces`` (None: no limit) is how often its light is reflected at most before it
    reaches a surface that the eye, or a probe, looks at. ``linking`` (None: everything) says what it lights and what shadows it.
    ``profile`` (None: it shines alike) is what its shader nodes make of its light; a sun has none. ``light_group`` names the group
    in which it is switched where light is transferred ("": none). ``scattered`` is the share of its light that media scatter where
    it first meets them: Blender's influence on volumes, 0 for a lamp that volumes do not see.
    """

    STRENGTH: ClassVar[str]

    name: str
    casts_shadow: bool = field(default=True, kw_only=True)
    bake: str = field(default=BOUNCES_ONLY, kw_only=True)
    max_bounces: int | None = field(default=None, kw_only=True)
    linking: Linking | None = field(default=None, kw_only=True)
    profile: LampProfile | None = field(default=None, kw_only=True)
    light_group: str = field(default="", kw_only=True)
    scattered: float = field(default=1.0, kw_only=True)

    @property
    def strength(self) -> np.ndarray:
        """The values (3,) of the field that ``STRENGTH`` names, float64."""
        return np.broadcast_to(np.asarray(getattr(self, self.STRENGTH), np.float64), (3,))


@dataclass(frozen=True, eq=False)
class SunLight(Lamp):
    """A distant light: ``direction_world`` (3,) unit, the way the light travels; ``irradiance`` (3,) on a facing plane
    [W·m⁻²]; ``angle`` the full angular diameter [rad] (0 = a point)."""

    STRENGTH: ClassVar[str] = "irradiance"

    direction_world: np.ndarray
    irradiance: np.ndarray
    angle: float = 0.0


@dataclass(frozen=True, eq=False)
class PointLight(Lamp):
    """A point or sphere: ``position_world`` (3,), ``intensity`` (3,) [W·sr⁻¹] = Φ/4π, ``radius`` [m].

    ``soft_falloff`` True: a disk of that radius facing the receiver (Blender's Soft Falloff); False: a sphere.
    """

    STRENGTH: ClassVar[str] = "intensity"

    position_world: np.ndarray
    intensity: np.ndarray
    radius: float = 0.0
    soft_falloff: bool = True


@dataclass(frozen=True, eq=False)
class SpotLight(Lamp):
    """A point light within a cone about ``direction_world`` (3,) unit. ``cone_angle`` is the full angle [rad]; ``blend`` 0–1
    the soft edge: intensity × smoothstep((z − cos(cone/2)) / (blend·(1 − cos(cone/2)))), z = cosine to the axis, as in Cycles.

    ``world_from_local`` (3, 3) carries a scaled or sheared lamp's elliptical cone (columns: its axes; light travels along −Z): z
    is then that of −normalize(world_from_local⁻¹·d). The direction d leads from the point sampled on the lamp to the receiver.
    """

    STRENGTH: ClassVar[str] = "intensity"

    position_world: np.ndarray
    direction_world: np.ndarray
    intensity: np.ndarray
    cone_angle: float
    blend: float = 0.0
    radius: float = 0.0
    soft_falloff: bool = True
    world_from_local: np.ndarray | None = None


@dataclass(frozen=True, eq=False)
class AreaLight(Lamp):
    """A one-sided rectangle or ellipse: centre ``position_world``; ``half_u_world``, ``half_v_world`` (3,) half axes (half the
    sides, or the radii of the ellipse); it emits ``radiance`` (3,) [W·sr⁻¹·m⁻²] to the side of ``normal_world`` (3,) unit.

    ``shape`` is 'RECTANGLE' or 'ELLIPSE' (Blender's SQUARE and DISK are these with equal axes). ``spread`` s [rad] is Blender's
    beam spread: π = none; below it radiance × max(0, tan(s/2) − tan θ)/(tan(s/2) − s/2), θ from the normal, which keeps the flux;
    0 = a parallel beam of irradiance π·radiance. The normal is the lamp's own −Z, also where a parent shears it.
    """

    STRENGTH: ClassVar[str] = "radiance"

    position_world: np.ndarray
    half_u_world: np.ndarray
    half_v_world: np.ndarray
    normal_world: np.ndarray
    radiance: np.ndarray
    shape: str = "RECTANGLE"
    spread: float = float(np.pi)

    @property
    def area(self) -> float:
        """Surface area [m²] of the (possibly sheared) shape."""
        parallelogram = 4.0 * float(np.linalg.norm(np.cross(self.half_u_world, self.half_v_world)))
        return parallelogram * (np.pi / 4.0 if self.shape == "ELLIPSE" else 1.0)


Light = SunLight | PointLight | SpotLight | AreaLight


def held_directly(lights: tuple[Light, ...], every: bool = False) -> tuple[int, ...]:
    """Indices of those of ``lights`` whose direct light a bake holds: ones that are set to it, or with ``every`` all that take part
    in the bake."""
    wanted = {ALL_LIGHT, BOUNCES_ONLY} if every else {ALL_LIGHT}
    return tuple(index for index, light in enumerate(lights) if light.bake in wanted)


def lamps_to_add(lights: tuple[Light, ...], held: frozenset[str] | None) -> tuple[Light, ...]:
    """Those of ``lights`` whose direct light a picture adds to a bake that holds that of lamps called ``held`` (None: of all that
    take part in bakes); ``lights`` itself where those are all."""
    added = tuple(light for light in lights if (light.bake == NOT_AT_ALL if held is None else light.name not in held))
    return lights if len(added) == len(lights) else added
