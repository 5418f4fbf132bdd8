"""Cameras that a render can see through."""

import numpy as np

from ...scene import Camera


def read_camera(obj, depsgraph, render, notes: list[str]) -> Camera | None:
    """An evaluated CAMERA object at the resolution of ``render`` (the scene's render settings); None (and a note) for panoramic
    and scripted lenses.

    Sensor fit, shift, pixel aspect and clipping are in ``clip_from_camera`` (Blender's own matrix). The object's scale does not
    count, as in Blender.
    """
    if obj.data.type not in {"PERSP", "ORTHO"}:
        notes.append(f"camera {obj.name} is neither perspective nor orthographic: it is left out")
        return None
    scale = render.resolution_percentage / 100.0
    width, height = (max(int(side * scale), 1) for side in (render.resolution_x, render.resolution_y))
    clip_from_camera = obj.calc_matrix_camera(depsgraph, x=width, y=height, scale_x=render.pixel_aspect_x,
                                              scale_y=render.pixel_aspect_y)
    world_from_camera = np.array(obj.matrix_world.normalized(), np.float64)
    return Camera(obj.name, world_from_camera, np.array(clip_from_camera, np.float64), (width, height))
