"""What the add-on does when Blender opens a file, undoes, or changes the scene. Nothing here runs while a bake only traces."""

import time

import bpy
from bpy.app.handlers import persistent

from .bundles import find_last_bakes
from .fingerprint import fingerprint
from .session import redraw, session
from .ui import properties
from .ui.modal_job import forget_jobs

# Scenes whose digest takes longer than this are not compared again: any change to them counts as one [s].
_PATIENCE = 0.25
_DELAY = 0.5
_slow: set[str] = set()


@persistent
def cancel_before_load(*_) -> None:
    """Another file is coming: what is under way for this one has nobody left to report to."""
    forget_jobs()
    _slow.clear()


@persistent
def compare_after_load(*_) -> None:
    """A file was opened: find its last bake, and see whether it still is what was baked."""
    find_last_bakes()
    _compare_soon()


@persistent
def keep_record_through_undo(scene, *_) -> None:
    """Undo takes the scene's memory of its last bake back, but not the files: write it again."""
    record = session.records.get(scene.name) if scene is not None else None
    if record:
        for name, value in record.items():
            setattr(scene.rtgi.last_bake, name, value)


@persistent
def compare_after_change(scene, depsgraph) -> None:
    """Something was edited: once the user pauses, see whether the last bake still holds."""
    if not scene.rtgi.last_bake.fingerprint:
        return
    changed = [update for update in depsgraph.updates if update.is_updated_geometry or update.is_updated_transform
               or update.is_updated_shading]
    if not changed:
        return
    if scene.name in _slow:
        session.stale[scene.name] = True
        redraw()
    else:
        _compare_soon()


def _compare_soon() -> None:
    if bpy.app.background:
        return
    if bpy.app.timers.is_registered(_compare):
        bpy.app.timers.unregister(_compare)
    # Others are dropped when a file was opened, after its handlers have run.
    bpy.app.timers.register(_compare, first_interval=_DELAY, persistent=True)


def _compare() -> None:
    scene = bpy.context.scene
    if scene is None or not scene.rtgi.last_bake.fingerprint:
        return
    started = time.monotonic()
    now = fingerprint(scene, bpy.context.evaluated_depsgraph_get())
    if time.monotonic() - started > _PATIENCE:
        _slow.add(scene.name)
    stale = now != scene.rtgi.last_bake.fingerprint
    if session.stale.get(scene.name) != stale:
        session.stale[scene.name] = stale
        redraw()


_HANDLERS = {
    "load_pre": cancel_before_load, "load_post": compare_after_load, "undo_post": keep_record_through_undo,
    "redo_post": keep_record_through_undo, "depsgraph_update_post": compare_after_change,
}


def register() -> None:
    """Hook into Blender's events."""
    for event, handler in _HANDLERS.items():
        getattr(bpy.app.handlers, event).append(handler)
    properties.on_change.append(_compare_soon)


def unregister() -> None:
    """Unhook, and forget what was known: the properties it is about are going away."""
    if bpy.app.timers.is_registered(_compare):
        bpy.app.timers.unregister(_compare)
    properties.on_change.clear()
    for event, handler in _HANDLERS.items():
        handlers = getattr(bpy.app.handlers, event)
        if handler in handlers:
            handlers.remove(handler)
    cancel_before_load()
