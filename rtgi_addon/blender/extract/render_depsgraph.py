"""Evaluating a scene the way F12 does, without rendering it and without leaving a trace.

The dependency graph a script can ask for is the viewport's: viewport subdivision levels, viewport modifiers, viewport visibility.
Blender builds the render's only for a RenderEngine, so a throw-away engine "renders" a copy of the scene (objects are shared, not
copied; its own render result, settings and camera) and reads from inside its ``render`` callback.
"""

import bpy

from ...errors import BakeError

_ENGINE_ID = "RTGI_EXTRACT"
# Side of the picture that nobody looks at [pixels].
_PICTURE_SIDE = 16


def read_for_render(scene, view_layer, read):
    """Call ``read(depsgraph)`` with a render-mode dependency graph of ``view_layer`` of ``scene``, and return what it returns.

    The graph and everything evaluated in it die when this returns. Exceptions of ``read`` are raised again. Raises BakeError
    where Blender refuses to evaluate (a render is already running).
    """
    outcome = []

    class _Reader(bpy.types.RenderEngine):
        bl_idname = _ENGINE_ID
        bl_label = "RTGI extraction"
        bl_use_preview = False
        bl_use_postprocess = False

        def render(self, depsgraph):
            if outcome:  # a second view layer or view
                return
            try:
                outcome.append((read(depsgraph), None))
            except BaseException as error:  # Blender swallows whatever leaves this callback
                outcome.append((None, error))

    copy = scene.copy()
    camera = None
    bpy.utils.register_class(_Reader)
    try:
        camera = _prepare(copy, view_layer.name)
        bpy.ops.render.render(scene=copy.name)
    except RuntimeError as error:
        if not outcome:
            raise BakeError(f"Blender cannot evaluate scene {scene.name!r} for render ({str(error).strip()})",
                            "let the running render finish, then bake again") from error
    finally:
        bpy.data.scenes.remove(copy)
        if camera is not None:
            bpy.data.cameras.remove(camera)  # takes its object along
        bpy.utils.unregister_class(_Reader)
    if not outcome:
        raise BakeError(f"Blender did not evaluate scene {scene.name!r} for render",
                        "let the running render finish, then bake again")
    result, error = outcome[0]
    if error is not None:
        raise error
    return result


def _prepare(scene, layer_name):
    """Make rendering the scene copy cost nothing; return the camera made for it, or None. The render needs one to start."""
    render = scene.render
    render.engine = _ENGINE_ID
    render.resolution_x = render.resolution_y = _PICTURE_SIDE
    render.resolution_percentage = 100
    for option in ("use_compositing", "use_sequencer", "use_border", "use_motion_blur", "use_multiview", "use_freestyle",
                   "use_persistent_data", "use_stamp"):
        if hasattr(render, option):
            setattr(render, option, False)
    for layer in scene.view_layers:
        layer.use = layer.name == layer_name
    if scene.camera is not None:
        return None
    camera = bpy.data.cameras.new("rtgi extraction")
    holder = bpy.data.objects.new(camera.name, camera)
    holder.hide_render = holder.hide_viewport = True
    scene.collection.objects.link(holder)
    scene.camera = holder
    return camera
