"""The views from which lamps are captured into reflective shadow maps, and the power that leaves a lamp through each texel."""

import numpy as np

from ...scene import Light
from ..lights.kinds import kind_of
from ..lights.shadow_view import ShadowView
from ..lights.shaped import view_share


def views_of(context, lamp: int, resolution: int = 512, *, focus: np.ndarray | None = None,
             area_points: int = 4) -> tuple[ShadowView, ...]:
    """The views of lamp ``lamp`` of ``context``; none where it gives no light.

    A sun is fitted to the box ``focus`` (2, 3) (None: the whole scene) and moves in whole texels; a point lamp gets the faces of a
    cube, or a frustum around the scene if it is far outside; a spot a frustum around its cone, or cube faces if that is wide; an
    area lamp ``area_points`` stratified points with a hemicube each, or a frustum if its beam is narrow.
    """
    return lit_views(context.scene.lights[lamp], np.array(context.geometry.bounds(), np.float64), resolution, lamp, focus=focus,
                     area_points=area_points)


def lit_views(light: Light, bounds: np.ndarray, resolution: int, lamp: int = 0, *, focus: np.ndarray | None = None,
              area_points: int = 4) -> tuple[ShadowView, ...]:
    """As ``views_of`` for a scene of which only ``bounds`` (2, 3) are known."""
    views = views_of_light(light, bounds, resolution, lamp, focus=focus, area_points=area_points)
    return views if kind_of(light).fills_views else tuple(view for view in views if texel_power(light, view).any())


def views_of_light(light: Light, bounds: np.ndarray, resolution: int, lamp: int = 0, *, focus: np.ndarray | None = None,
                   area_points: int = 4) -> tuple[ShadowView, ...]:
    """As ``lit_views``, but a wide spot gets all the faces of its cube."""
    if not np.any(light.strength > 0):
        return ()
    placed = kind_of(light).views(light, bounds, focus, resolution, area_points)
    return tuple(ShadowView(lamp, face, view.world_from_view, view.clip_from_view, view.orthographic, resolution, view.near,
                            view.far, view.share) for face, view in enumerate(placed))


def texel_power(light: Light, view: ShadowView) -> np.ndarray:
    """Power (resolution, resolution, 3) float32 [W] that ``light`` sends through each texel of ``view``; what its profile makes of
    the distance to what it meets is not in it."""
    per_measure = kind_of(light).power_per_measure(light, view)
    power = (per_measure * view.texel_measure().ravel())[:, None] * light.strength
    share = view_share(light, view)
    if share is not None:
        power = power * share
    return power.reshape(view.resolution, view.resolution, 3).astype(np.float32)
