"""What lines look up of a scene's materials and instances."""

import numpy as np

from ...scene import Scene
from .settings import StylizedSettings


def excluded(scene: Scene, pass_index: int, collection: str) -> tuple[np.ndarray, np.ndarray]:
    """Which instances (n,) and which materials (m,) bool have no lines of their own: those with ``pass_index`` (0: none), and the
    objects of ``collection`` (empty: none). At least one of each, so that nothing seen is excluded by nothing."""
    instances = [(pass_index > 0 and item.pass_index == pass_index) or (collection != "" and collection in item.collections)
                 for item in scene.instances]
    materials = [pass_index > 0 and item.pass_index == pass_index for item in scene.materials]
    return np.array(instances or [False], bool), np.array(materials or [False], bool)


def line_colours(scene: Scene, settings: StylizedSettings) -> np.ndarray:
    """(m, 4) float32: RGB and opacity of the lines of each material, at least one."""
    count = max(len(scene.materials), 1)
    if settings.line_by_material and scene.materials:
        colours = np.array([item.line_color for item in scene.materials], np.float32)
    else:
        colours = np.tile(np.float32([*settings.line_color, 1.0]), (count, 1))
    colours[:, 3] *= np.float32(settings.line_opacity)
    return colours
