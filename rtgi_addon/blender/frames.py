"""Other frames of the open file: for what is read of several of them."""

import bpy

from ..progress import Progress
from ..scene import Scene
from .extract import extract_scene

# Images that change with the frame: what Cycles said of nodes that show one must be asked again.
_MOVING_IMAGES = {"SEQUENCE", "MOVIE"}


def read_at(frame: int, progress: Progress | None = None) -> Scene:
    """The scene of Blender's context at ``frame``, which then is its current one. What only Cycles can tell of materials and the
    world is asked again only where it may have changed. Raises as ``extract_scene``."""
    scene = bpy.context.scene
    scene.frame_set(frame)
    still = not any(image.source in _MOVING_IMAGES for image in bpy.data.images)
    return extract_scene(progress=progress, reuse=still)


def frames_of(scene: bpy.types.Scene) -> range:
    """The frames that an animation of ``scene`` renders."""
    return range(scene.frame_start, scene.frame_end + 1, scene.frame_step)


def current_frame() -> float:
    """The frame of Blender's context."""
    return bpy.context.scene.frame_current_final


def frames_per_second() -> float:
    """How many frames of Blender's context are a second."""
    render = bpy.context.scene.render
    return render.fps / render.fps_base
