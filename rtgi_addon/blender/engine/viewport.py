"""A viewport: brings its renderer up to date with the scene, draws one sample more, and says what it shows."""

import traceback
from dataclasses import replace

import numpy as np
from bpy.app.translations import pgettext_iface as iface_

from ...effects import notes_of
from ...errors import BakeError
from ...scene import Scene, drawn_otherwise
from ...techniques.transfer.controls import controlled
from ..session import session
from ..translations import sentence
from ..ui.effect_settings import chosen_effects
from ..ui.light_settings import controls_of
from ..ui.preview_settings import preview_settings
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
        self._controlled = None

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
        from ...preview.present import present
        from ...transport.views.camera import CameraView
        settings, effects = preview_settings(scene, final=False), chosen_effects(scene)
        region, view = context.region, context.region_data
        seen = CameraView(np.array(view.view_matrix.inverted(), np.float64), np.array(view.window_matrix, np.float64))
        size = region.width, region.height
        lit = self._lit(live.scene, scene)
        self.picture.frame(lit, shown, settings, effects, seen, size)
        preview = scene.rtgi_preview
        if preview.compare:
            split = round(preview.split * size[0])
            self.other.frame(lit, shown_for(scene, preview.compare_technique), settings, effects, seen, size)
            present(self.picture.texture, size, (0, split))
            present(self.other.texture, size, (split, size[0]))
        else:
            self.other.close()
            present(self.picture.texture, size)
        shows = context.space_data is None or context.space_data.overlay.show_overlays
        overlay = self._layer.draw(scene, shown, seen, size, self.picture.renderer) if shows else None
        if overlay is not None:
            present(overlay, size)
        if self.unsettled:
            engine.tag_redraw()

    def _lit(self, read: Scene, scene):
        """``read`` in the light that the sliders of ``scene`` make: the same object as long as both stay."""
        controls = controls_of(scene)
        if self._controlled is None or self._controlled[0] is not read or self._controlled[1] != controls:
            lit = controlled(read, controls)
            # What is to be followed in another way is another scene to whoever follows it.
            again = self._controlled is not None and lit is self._controlled[2]
            self._controlled = read, controls, replace(lit) if again else lit
        return self._controlled[2]

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
        notes = [shown.note, live.error, renderer.error, *renderer.notes, drawn_otherwise(renderer.scene),
                 *notes_of(chosen_effects(scene), renderer.scene)]
        if scene.rtgi_preview.compare:
            other = shown_for(scene, scene.rtgi_preview.compare_technique)
            notes.append(other.note and iface_("Right of the line: {note}").format(note=sentence(other.note)))
        return " | ".join([*parts, *(sentence(text) for text in notes if text)])
