"""Asking Cycles about worlds and materials before a render begins, because during one it cannot be asked (see `remembered`).

Without a window Blender says in time that a render is about to begin. With one it says so on the render's own thread, where
nothing may be changed: there the scene is looked after from a timer, whenever it was changed.
"""

import threading

import bpy
from bpy.app.handlers import persistent

from ...errors import BakeError
from ..extract import extract_scene
from ..extract.world import read_world
from ..materials import MaterialReader
from ..remembered import reuse
from .engine import ENGINE_ID

_DELAY = 0.5


@persistent
def warm_up_before_render(scene, *_) -> None:
    """A render of ``scene`` is about to begin."""
    if scene.render.engine == ENGINE_ID and threading.current_thread() is threading.main_thread():
        warm_up(scene)


@persistent
def warm_up_after_change(scene, depsgraph) -> None:
    """Something was edited: once the user pauses, have the answers ready for F12."""
    if bpy.app.background or scene.render.engine != ENGINE_ID or bpy.app.is_job_running("RENDER"):
        return
    if any(isinstance(update.id, (bpy.types.World, bpy.types.Material, bpy.types.NodeTree, bpy.types.Mesh, bpy.types.Scene))
           and (update.is_updated_shading or update.is_updated_geometry) for update in depsgraph.updates):
        _warm_up_in(_DELAY)


def warm_up(scene: bpy.types.Scene) -> None:
    """Have remembered what Cycles says of the world and the materials of ``scene`` that only it understands."""
    try:
        with reuse():
            read_world(scene.world, [])
        if _needs_cycles(scene):
            with bpy.context.temp_override(scene=scene, view_layer=scene.view_layers[0]):
                extract_scene(context=bpy.context, reuse=True)
    except BakeError:
        # The render will meet the same trouble, and has somebody to tell.
        return


def _needs_cycles(scene) -> bool:
    """True if some material that is in use has nodes that only Cycles understands."""
    reader = MaterialReader(scene, None)
    used = {slot.material for obj in scene.objects if not obj.hide_render for slot in obj.material_slots if slot.material}
    return any(reader.read(material) is None for material in used)


def _warm_up_in(seconds: float) -> None:
    if bpy.app.timers.is_registered(_warm_up_current):
        bpy.app.timers.unregister(_warm_up_current)
    bpy.app.timers.register(_warm_up_current, first_interval=seconds)


def _warm_up_current() -> float | None:
    scene = bpy.context.scene
    if bpy.app.is_job_running("RENDER"):
        return _DELAY
    if scene is not None and scene.render.engine == ENGINE_ID:
        warm_up(scene)
    return None


def register() -> None:
    """Hook into Blender's events."""
    bpy.app.handlers.render_init.append(warm_up_before_render)
    bpy.app.handlers.depsgraph_update_post.append(warm_up_after_change)


def unregister() -> None:
    """Unhook."""
    bpy.app.handlers.render_init.remove(warm_up_before_render)
    bpy.app.handlers.depsgraph_update_post.remove(warm_up_after_change)
    if bpy.app.timers.is_registered(_warm_up_current):
        bpy.app.timers.unregister(_warm_up_current)
