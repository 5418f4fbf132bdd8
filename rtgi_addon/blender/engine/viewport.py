"""A viewport: brings its renderer up to date with the scene, draws one sample more, and says what it shows."""

import traceback

import numpy as np
from bpy.app.translations import pgettext_iface as iface_

from ...errors import BakeError
from ..preview_settings import preview_settings
from ..session import session
from ..translations import sentence
from .layer import OverlayLayer
from .live import LiveScene, live_scene
from .picture import Picture
from .shown import Shown, shown_for

STALE = "The bake is out of date"


def is_stale(scene, shown: Shown) -> bool:
    """True if what is shown was baked from ``scene`` when it was another, and does not follow it."""
    if shown.live is not None:
        return False
    of_this = scene.rtgi.last_bake.technique == scene.rtgi.technique
    return shown.field is not None and of_this and session.stale.get(scene.name, False)


class Viewport:
    """The state of one viewport, which lives as long as Blender's engine object for it."""

    def __init__(self):
        self.picture, self.other = Picture(), Picture()
        self._layer = OverlayLayer()
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
            engine.update_stats("RTGI", sentence(live.error or "Reading the scene"))
            return
        if not self._broken:
            try:
                self._frame(engine, context, scene, live, shown)
            except BakeError as error:
                self._broken = str(error)
            except Exception as error:
                traceback.print_exc()
                self._broken = f"{type(error).__name__}: {error} (details in the console)"
        engine.update_stats("RTGI", sentence(self._broken) or self._status(scene, live, shown))

    def _frame(self, engine, context, scene, live: LiveScene, shown: Shown) -> None:
        from ...preview.camera_view import CameraView
        from ...preview.present import present
        settings = preview_settings(scene, final=False)
        region, view = context.region, context.region_data
        seen = CameraView(np.array(view.view_matrix.inverted(), np.float64), np.array(view.window_matrix, np.float64))
        size = region.width, region.height
        self.picture.frame(live.scene, shown, settings, seen, size)
        preview = scene.rtgi_preview
        if preview.compare:
            split = round(preview.split * size[0])
            self.other.frame(live.scene, shown_for(scene, preview.compare_technique), settings, seen, size)
            present(self.picture.texture, size, (0, split))
            present(self.other.texture, size, (split, size[0]))
        else:
            self.other.close()
            present(self.picture.texture, size)
        overlay = self._layer.draw(scene, shown, seen, size, self.picture.renderer)
        if overlay is not None:
            present(overlay, size)
        if self.unsettled:
            engine.tag_redraw()

    @property
    def unsettled(self) -> bool:
        """True while another frame would change what is seen."""
        return self.picture.unsettled or self.other.unsettled

    def close(self) -> None:
        """Let go of renderers and their workers."""
        self.picture.close()
        self.other.close()

    def _status(self, scene, live: LiveScene, shown: Shown) -> str:
        renderer = self.picture.renderer
        parts = [iface_("Sample {sample} of {samples}").format(sample=renderer.samples, samples=renderer.settings.samples)]
        if renderer.busy:
            parts.append(iface_("Relighting"))
        if is_stale(scene, shown):
            parts.append(iface_(STALE))
        notes = [shown.note, live.error, renderer.error]
        if scene.rtgi_preview.compare:
            other = shown_for(scene, scene.rtgi_preview.compare_technique)
            notes.append(other.note and iface_("Right of the line: {note}").format(note=sentence(other.note)))
        return " | ".join([*parts, *(sentence(text) for text in notes if text)])
