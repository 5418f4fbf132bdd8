"""What is drawn over a picture of the engine: overlays of the bake that it shows, made anew when that is another."""

import bpy
import numpy as np

from ..leaks_ui import leaks
from ..preview_settings import overlay_settings
from .shown import Shown


class OverlayLayer:
    """The overlays of one viewport or render. GPU objects: main thread only."""

    def __init__(self):
        self._overlays = self._of = self._texture = self._drawn = None

    def draw(self, scene: bpy.types.Scene, shown: Shown, seen, size: tuple[int, int], renderer):
        """The overlays' texture over the latest frame of ``renderer``, a picture of the CameraView ``seen`` of ``size`` pixels;
        None where ``scene`` asks for nothing that there is."""
        from ...preview.overlays import Overlays  # importable once there is a GPU
        settings = overlay_settings(scene)
        found = leaks.of(scene, shown.field) if settings.leaks else None
        if (settings, shown.field, found) != self._of:
            self._overlays = Overlays(settings, _grids(settings, shown), None if found is None else leak_discs(found))
            self._of, self._drawn = (settings, shown.field, found), None
        if self._overlays.is_empty:
            return None
        before = self._drawn
        if before is None or not seen.equals(before[0]) or (size, renderer.scene, renderer) != before[1:]:
            self._texture = self._overlays.draw(seen, size, renderer.gbuffer)
            self._drawn = seen, size, renderer.scene, renderer
        return self._texture


def _grids(settings, shown: Shown) -> tuple:
    """The probe grids of what is shown, if something of them is asked for: other techniques take a while to make them."""
    wanted = settings.bounds or settings.probes != "none"
    return shown.field.grids() if wanted and shown.field is not None else ()


def leak_discs(found):
    """A LeakMap as discs on the surfaces: blue where it is too dark, red where it is too bright, clear where it is right."""
    from ...evaluate.error_map import COLOURS, FULL_SCALE
    from ...preview.overlay_shapes import Discs
    share = np.clip(found.error / FULL_SCALE, -1.0, 1.0)
    place = (0.5 + 0.5 * share) * (len(COLOURS) - 1)
    encoded = np.stack([np.interp(place, np.arange(len(COLOURS)), channel) for channel in COLOURS.T], axis=1)
    linear = np.where(encoded <= 0.04045, encoded / 12.92, ((encoded + 0.055) / 1.055) ** 2.4)
    alpha = np.minimum(0.15 + np.abs(share), 0.9)
    return Discs(found.receivers.points, found.receivers.normals, found.radius, np.concatenate([linear, alpha[:, None]], axis=1))
