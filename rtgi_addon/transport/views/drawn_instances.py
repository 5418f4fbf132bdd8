"""Which instances of a scene a raster pass draws, so that pictures and maps meet what rays do (`rays.kinds`, `lights.links`)."""

import numpy as np

from ...scene import Light, Scene
from ...scene.scene import DYNAMIC


def seen_by_cameras(scene: Scene) -> np.ndarray:
    """(i,) bool: the instances in pictures."""
    return np.array([instance.visible_camera for instance in scene.instances], bool)


def in_the_way(scene: Scene, light: Light) -> np.ndarray:
    """(i,) bool: the instances that cast shadows of ``light``."""
    shadowing = np.array([instance.visible_shadow for instance in scene.instances], bool)
    blockers = None if light.linking is None else light.linking.blockers
    return shadowing if blockers is None else shadowing & blockers


def met_by(scene: Scene, light: Light) -> np.ndarray:
    """(i,) bool: the instances that a map of what ``light`` meets shows. What no bake knows reflects nothing of it."""
    baked = np.array([instance.bake != DYNAMIC for instance in scene.instances], bool)
    if light.casts_shadow:
        return baked & in_the_way(scene, light)
    return baked & np.array([instance.visible_camera or instance.visible_diffuse or instance.visible_shadow
                             for instance in scene.instances], bool)


def lit_by(scene: Scene, light: Light) -> np.ndarray:
    """(i,) bool: the instances that ``light`` lights."""
    receivers = None if light.linking is None else light.linking.receivers
    return np.ones(len(scene.instances), bool) if receivers is None else np.asarray(receivers, bool)
