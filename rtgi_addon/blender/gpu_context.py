"""Opening a GPU context in a Blender that has no window."""

import sys

import bpy

from ..errors import BakeError
from ..preview import context

# Side of the picture that starts the GPU [pixels].
_PICTURE_SIDE = 8


def open_context() -> None:
    """Make Blender's gpu module usable on this, the main thread; nothing to do where it is. Raises BakeError where it cannot be."""
    if context.is_open():
        return
    if not bpy.app.background:
        raise BakeError("Blender has a window but no GPU context on this thread", "bake from the panel, or use --device cpu")
    # The command line wins over the preferences.
    asked = sys.argv[sys.argv.index("--gpu-backend") + 1:][:1] if "--gpu-backend" in sys.argv else []
    context.require_driver((asked or [bpy.context.preferences.system.gpu_backend])[0].upper() == "VULKAN")
    if not context.initialise():
        _render_once()
    context.require()


class _Starter(bpy.types.RenderEngine):
    """Draws nothing. That it asks for the GPU makes Blender open its context, which then stays open."""

    bl_idname = "RTGI_GPU_STARTER"
    bl_label = "RTGI GPU starter"
    bl_use_gpu_context = True

    def render(self, depsgraph):
        """Leave the picture empty."""


def _render_once() -> None:
    """Before Blender 5.2: render a few pixels of a scene of our own, and leave nothing of it behind. (Blender 4.5 hangs at exit if
    an engine that has rendered is still registered.)"""
    bpy.utils.register_class(_Starter)
    scene = bpy.data.scenes.new("RTGI GPU starter")
    camera = bpy.data.cameras.new("RTGI GPU starter")
    eye = bpy.data.objects.new("RTGI GPU starter", camera)
    try:
        scene.collection.objects.link(eye)
        scene.camera = eye
        scene.render.engine = _Starter.bl_idname
        scene.render.resolution_x = scene.render.resolution_y = _PICTURE_SIDE
        bpy.ops.render.render(scene=scene.name)
    finally:
        bpy.data.scenes.remove(scene)
        bpy.data.objects.remove(eye)
        bpy.data.cameras.remove(camera)
        bpy.utils.unregister_class(_Starter)
