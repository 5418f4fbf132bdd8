"""Asking Cycles about worlds, materials and lamps before a render begins, because during one it cannot be asked (see `remembered`).

Without a window Blender says in time that a render is about to begin. With one it says so on the render's own thread, where
nothing may be changed: there the scene is looked after from a timer, whenever it was changed.
"""

import threading

import bpy
from bpy.app.handlers import persistent

from ...errors import BakeError
from ..extract import extract_scene
from ..extract.lamp_nodes import node_factor
from ..extract.world import read_world
from ..materials import MaterialReader
from ..remembered import reuse
from .engine import ENGINE_ID

_DELAY = 0.5
_ASKED = (bpy.types.World, bpy.types.Material, bpy.types.Light, bpy.types.NodeTree, bpy.types.Mesh, bpy.types.Scene)


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
    if any(_may_ask(update) for update in depsgraph.updates):
        _warm_up_in(_DELAY)


def _may_ask(update) -> bool:
    """Whether something may have changed that Cycles is asked about."""
    if isinstance(update.id, bpy.types.Object):
        # A lamp's nodes may look at where it stands.
        return update.id.type == "LIGHT" and update.is_updated_transform
    return isinstance(update.id, _ASKED) and (update.is_updated_shading or update.is_updated_geometry)


def warm_up(scene: bpy.types.Scene) -> None:
    """Have remembered what Cycles says of the world, the materials and the lamps of ``scene`` that only it understands."""
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
    """True if some lamp or some material that is in use has nodes that only Cycles understands."""
    if any(obj.type == "LIGHT" and not obj.hide_render and node_factor(obj.data) is None for obj in scene.objects):
        return True
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
