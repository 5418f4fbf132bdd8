"""One point of a lamp that a whole frame is lit from: its shadow views, and what direct_light.comp.glsl needs to know of it.

Every frame takes another point, so that soft shadows and the light of wide lamps settle as frames are averaged. Where a lamp has an
analytic sample per receiver (transport/lights) the shader uses that, and only its visibility comes from the shared point.
"""

from dataclasses import dataclass

import numpy as np

from ..scene import Light
from ..transport.lights.area import UNBOUNDED
from ..transport.lights.kinds import kind_number, kind_of
from ..transport.lights.profile import profile_of
from ..transport.lights.shadow_view import ShadowView
from ..transport.views.shadow_views import views_of_light

# The members of the struct LAMP that not every lamp has.
_DARK = {"position": np.zeros(3), "shift": np.zeros(3), "axis": np.zeros(3), "radius": 0.0, "soft_falloff": 0,
         "local_from_world": np.zeros((4, 4)), "cos_half_cone": -1.0, "inverse_blend": 0.0,
         "tan_half_spread": UNBOUNDED, "spread_gain": 1.0, "beam": np.zeros((4, 4)), "ellipse": 0,
         "profile_from_world": np.zeros((4, 4)), "profile": 0, "profile_of_normals": 0, "profile_reach": 1.0}


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
    u, profile = np.asarray(u, np.float64), profile_of(light)
    if profile is not None:
        # The frame's one place on the lamp, by its brightness.
        warped, weight = profile.warp_receiving(u[None, :2])
        u, gain = np.concatenate([warped[0], u[2:]]).astype(np.float64), gain * float(weight[0])
    placed, uniforms = kind_of(light).shader_point(light, u)
    if profile is not None:
        local_from_world = np.eye(4)
        local_from_world[:3, :3] = np.asarray(light.profile.world_from_profile).T
        uniforms = {**uniforms, "profile": 1, "profile_from_world": local_from_world, "profile_reach": light.profile.reach,
                    "profile_of_normals": int(light.profile.of_normals and light.radius > 0)}
        if profile.has_places:
            gain = gain * profile.of_place(np.asarray(placed.position_world, np.float32)[None])[0]
    strength = gain * np.broadcast_to(np.asarray(uniforms["strength"], np.float64), (3,))
    return LampSample(light, placed, {**_DARK, "kind": kind_number(light), **uniforms, "strength": strength,
                                       "scattered": light.scattered})
