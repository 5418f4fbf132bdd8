"""Lamps in physical units (PHYSICS.md §1). Extraction turns Blender's watts into these; transport reads only these.

Sources: Blender manual, Light Objects; Cycles `light.cpp`; every conversion is checked against Cycles in tests/blender.
"""

from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True, eq=False)
class SunLight:
    """A distant light: ``direction_world`` (3,) unit, the way the light travels; ``irradiance`` (3,) on a facing plane
    [W·m⁻²]; ``angle`` the full angular diameter [rad] (0 = a point)."""

    name: str
    direction_world: np.ndarray
    irradiance: np.ndarray
    angle: float = 0.0
    casts_shadow: bool = True


@dataclass(frozen=True, eq=False)
class PointLight:
    """A point or sphere: ``position_world`` (3,), ``intensity`` (3,) [W·sr⁻¹] = Φ/4π, ``radius`` [m].

    ``soft_falloff`` True: a disk of that radius facing the receiver (Blender's Soft Falloff); False: a sphere.
    """

    name: str
    position_world: np.ndarray
    intensity: np.ndarray
    radius: float = 0.0
    soft_falloff: bool = True
    casts_shadow: bool = True


@dataclass(frozen=True, eq=False)
class SpotLight:
    """A point light within a cone about ``direction_world`` (3,) unit. ``cone_angle`` is the full angle [rad]; ``blend`` 0–1
    the soft edge: intensity × smoothstep((z − cos(cone/2)) / (blend·(1 − cos(cone/2)))), z = cosine to the axis, as in Cycles.

    ``world_from_local`` (3, 3) carries a scaled or sheared lamp's elliptical cone (columns: its axes; light travels along −Z): z
    is then that of −normalize(world_from_local⁻¹·d). The direction d leads from the point sampled on the lamp to the receiver.
    """

    name: str
    position_world: np.ndarray
    direction_world: np.ndarray
    intensity: np.ndarray
    cone_angle: float
    blend: float = 0.0
    radius: float = 0.0
    soft_falloff: bool = True
    world_from_local: np.ndarray | None = None
    casts_shadow: bool = True


@dataclass(frozen=True, eq=False)
class AreaLight:
    """A one-sided rectangle or ellipse: centre ``position_world``; ``half_u_world``, ``half_v_world`` (3,) half axes (half the
    sides, or the radii of the ellipse); it emits ``radiance`` (3,) [W·sr⁻¹·m⁻²] to the side of ``normal_world`` (3,) unit.

    ``shape`` is 'RECTANGLE' or 'ELLIPSE' (Blender's SQUARE and DISK are these with equal axes). ``spread`` s [rad] is Blender's
    beam spread: π = none; below it radiance × max(0, tan(s/2) − tan θ)/(tan(s/2) − s/2), θ from the normal, which keeps the flux;
    0 = a parallel beam of irradiance π·radiance. The normal is the lamp's own −Z, also where a parent shears it.
    """

    name: str
    position_world: np.ndarray
    half_u_world: np.ndarray
    half_v_world: np.ndarray
    normal_world: np.ndarray
    radiance: np.ndarray
    shape: str = "RECTANGLE"
    spread: float = float(np.pi)
    casts_shadow: bool = True

    @property
    def area(self) -> float:
        """Surface area [m²] of the (possibly sheared) shape."""
        parallelogram = 4.0 * float(np.linalg.norm(np.cross(self.half_u_world, self.half_v_world)))
        return parallelogram * (np.pi / 4.0 if self.shape == "ELLIPSE" else 1.0)


Light = SunLight | PointLight | SpotLight | AreaLight
