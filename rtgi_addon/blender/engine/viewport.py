"""A viewport: brings its renderer up to date with the scene, draws one sample more, and says what it shows."""

import traceback
from dataclasses import replace

import numpy as np

from ...errors import BakeError
from ..preview_settings import preview_settings
from ..session import session
from .live import LiveScene, live_scene
from .shown import Shown, same_light, shown_for

STALE = "The bake is out of date"


def is_stale(scene, shown: Shown) -> bool:
    """True if what is shown was baked from ``scene`` when it was another."""
    of_this = scene.rtgi.last_bake.technique == scene.rtgi.technique
    return shown.field is not None and of_this and session.stale.get(scene.name, False)


class Viewport:
    """The state of one viewport, which lives as long as Blender's engine object for it."""

    def __init__(self):
        self._renderer = None
        self._settings = self._field = self._seen = None
        self._size = (0, 0)
        self._broken = ""
        self._begun = False

    def __del__(self):
        self.close()

    def update(self, engine, context, depsgraph) -> None:
        """Take in what has changed. No GPU work: there may be no context."""
        live = live_scene(depsgraph)
        if not self._begun:
            # What happened since another viewport looked is not known.
            self._begun = live.wants_all = True
        live.take_updates(depsgraph)
        self._broken = ""
        engine.tag_redraw()

    def draw(self, engine, context, depsgraph) -> None:
        """Draw into the region that is bound."""
        live, scene = live_scene(depsgraph), depsgraph.scene.original
        shown = shown_for(scene)
        if live.scene is None:
            live.ask()
            engine.update_stats("RTGI", live.error or "Reading the scene")
            return
        if not self._broken:
            try:
                self._frame(engine, context, scene, live, shown)
            except BakeError as error:
                self._broken = str(error)
            except Exception as error:
                traceback.print_exc()
                self._broken = f"{type(error).__name__}: {error} (details in the console)"
        engine.update_stats("RTGI", self._broken or self._status(scene, live, shown))

    def _frame(self, engine, context, scene, live: LiveScene, shown: Shown) -> None:
        from ...preview.camera_view import CameraView
        from ...preview.present import present
        from ...preview.renderer import PreviewRenderer
        settings = preview_settings(scene, final=False)
        if self._renderer is None or settings != self._settings or shown.field is not self._field:
            self.close()
            baked = None if shown.baked is None else shown.baked.scene
            begun = live.scene
            if baked is not None and not same_light(baked, begun):
                begun = replace(begun, lights=baked.lights, world=baked.world)
            self._renderer = PreviewRenderer(begun, shown.field, settings, (settings.mode,), baked)
            self._settings, self._field, self._seen = settings, shown.field, None
        self._renderer.update(live.scene)
        region, view = context.region, context.region_data
        seen = CameraView(np.array(view.view_matrix.inverted(), np.float64), np.array(view.window_matrix, np.float64))
        size = region.width, region.height
        same_picture = seen.equals(self._seen) and size == self._size
        if not same_picture or self._unsettled:
            self._renderer.frame(seen, size)
            self._seen, self._size = seen, size
        present(self._renderer.textures[settings.mode], size)
        if self._unsettled:
            engine.tag_redraw()

    @property
    def _unsettled(self) -> bool:
        """True while another frame would change the picture."""
        return self._renderer.busy or self._renderer.samples < self._settings.samples

    def close(self) -> None:
        """Let go of the renderer and its workers."""
        if self._renderer is not None:
            self._renderer.close()
            self._renderer = None

    def _status(self, scene, live: LiveScene, shown: Shown) -> str:
        parts = [f"Sample {self._renderer.samples} of {self._settings.samples}"]
        if self._renderer.busy:
            parts.append("Relighting")
        if is_stale(scene, shown):
            parts.append(STALE)
        return " | ".join([*parts, *(text for text in (shown.note, live.error, self._renderer.error) if text)])
