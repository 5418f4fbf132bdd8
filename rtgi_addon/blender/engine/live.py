"""What viewports show of a scene: read once, kept up to date while the user works, shared by every viewport of it.

Small changes (lamps, transforms) are read on the spot from the viewport's own dependency graph. Everything else waits for a
timer: reading a world or a material can take Blender operators, which are not allowed in the middle of a redraw.
"""

import time
import traceback
from dataclasses import replace

import bpy

from ...errors import BakeError
from ...scene import Scene
from ..extract import extract_scene
from ..extract.refresh import refresh_scene
from ..extract.world import read_mist, read_world
from ..remembered import reuse
from ..session import redraw, session

# Edits that come faster than a scene is read are read once, this share of the time that reading takes after the last of them.
_REST, _LONGEST = 1.0, 2.0
# What only a whole reading takes in.
_DEEP = (bpy.types.Mesh, bpy.types.Curve, bpy.types.MetaBall, bpy.types.Material, bpy.types.Image, bpy.types.Texture,
         bpy.types.Collection, bpy.types.NodeTree)
_SHALLOW_OBJECTS = {"LIGHT", "LIGHT_PROBE", "CAMERA", "EMPTY", "SPEAKER"}


class LiveScene:
    """One view layer of one scene as viewports show it: ``scene`` (None before the first reading) and ``error``, why not."""

    def __init__(self):
        self.scene: Scene | None = None
        self.error = ""
        self.wants_all = self.wants_world = True
        self._seconds = 0.0

    @property
    def pending(self) -> bool:
        """True while something has changed that only ``read`` takes in."""
        return self.wants_all or self.wants_world

    def take_updates(self, depsgraph) -> None:
        """See what Blender says has changed: read what moves at once, and ask for the rest to be read later."""
        moved = False
        for update in depsgraph.updates:
            entry = update.id
            if isinstance(entry, bpy.types.Object):
                moved = True
                self.wants_all |= update.is_updated_geometry and entry.type not in _SHALLOW_OBJECTS
            elif isinstance(entry, (bpy.types.Light, bpy.types.LightProbe, bpy.types.Scene)):
                moved = True
            elif isinstance(entry, bpy.types.World):
                self.wants_world = True
            elif isinstance(entry, _DEEP) and not entry.is_embedded_data:
                self.wants_all = True
        if moved and self.scene is not None and not self.wants_all:
            refreshed = refresh_scene(self.scene, depsgraph)
            self.wants_all = refreshed is None
            self.scene = refreshed or self.scene
        self.ask()

    def ask(self) -> None:
        """Have what is pending read soon."""
        if self.pending:
            _serve_in(min(_REST * self._seconds, _LONGEST))

    def read(self, depsgraph) -> None:
        """Read what was asked for. Where Blender's operators may run."""
        started = time.monotonic()
        try:
            if self.wants_all or self.scene is None:
                self.scene = extract_scene(depsgraph, reuse=True)
                session.note_media(depsgraph.scene.name, self.scene)
            else:
                self._read_world(depsgraph)
            self.error = ""
        except BakeError as error:
            self.error = str(error)
        except Exception as error:
            traceback.print_exc()
            self.error = f"The scene cannot be read, {type(error).__name__}: {error} (details in the console)"
        finally:
            self.wants_all = self.wants_world = False
            self._seconds = time.monotonic() - started

    def _read_world(self, depsgraph) -> None:
        shown = depsgraph.view_layer.world_override or depsgraph.scene.original.world
        with reuse():
            world = read_world(shown, [])
        self.scene = replace(self.scene, world=world, mist=read_mist(shown))


_live: dict[tuple[str, str], LiveScene] = {}


def live_scene(depsgraph) -> LiveScene:
    """What viewports show of the view layer that ``depsgraph`` evaluates."""
    return _live.setdefault((depsgraph.scene.name, depsgraph.view_layer.name), LiveScene())


def forget() -> None:
    """Drop every scene: another file is open, or the add-on goes."""
    _live.clear()
    if bpy.app.timers.is_registered(_serve):
        bpy.app.timers.unregister(_serve)


def _serve_in(seconds: float) -> None:
    if bpy.app.timers.is_registered(_serve):
        bpy.app.timers.unregister(_serve)
    bpy.app.timers.register(_serve, first_interval=seconds)


def _serve() -> float | None:
    """Read what waits, in the context of a window that shows it. While Blender renders, readings that take operators would fail."""
    if bpy.app.is_job_running("RENDER"):
        return _LONGEST
    for window in bpy.context.window_manager.windows:
        live = _live.get((window.scene.name, window.view_layer.name))
        if live is not None and live.pending:
            with bpy.context.temp_override(window=window):
                live.read(bpy.context.evaluated_depsgraph_get())
    redraw()
    return None
