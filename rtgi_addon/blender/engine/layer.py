"""What is drawn over a picture of the engine: overlays of the bake that it shows, made anew when that is another."""

import bpy
import numpy as np

from ...numerics.colour import linear_from_srgb
from ...techniques.voxels.field import VoxelField
from ..ui.leaks import leaks
from ..ui.preview_settings import overlay_settings
from .shown import Shown

# Opacity of a leak's disc: where nothing is off, and at most, so that the surface still shows.
_FAINTEST, _STRONGEST = 0.15, 0.9


class OverlayLayer:
    """The overlays of one viewport or render. GPU objects: main thread only."""

    def __init__(self):
        self._overlays = self._of = self._texture = self._drawn = None

    def draw(self, scene: bpy.types.Scene, shown: Shown, seen, size: tuple[int, int], renderer):
        """The overlays' texture over the latest frame of ``renderer``, a picture of the CameraView ``seen`` of ``size`` pixels;
        None where ``scene`` asks for nothing that there is."""
        from ...preview.overlays import Overlays  # importable once there is a GPU
        settings, field = overlay_settings(scene), renderer.lit_by
        found = leaks.of(scene, shown.field) if settings.leaks else None
        if (settings, field, found) != self._of:
            self._overlays = Overlays(settings, _grids(settings, field), None if found is None else leak_discs(found),
                                      spheres=None if field is None else field.spheres, voxels=voxels_of(field))
            self._of, self._drawn = (settings, field, found), None
        if self._overlays.is_empty:
            return None
        before = self._drawn
        if before is None or not seen.equals(before[0]) or (size, renderer.scene, renderer) != before[1:]:
            self._texture = self._overlays.draw(seen, size, renderer.gbuffer)
            self._drawn = seen, size, renderer.scene, renderer
        return self._texture


def _grids(settings, field) -> tuple:
    """The probe grids of what is shown, if something of them is asked for: other techniques take a while to make them."""
    wanted = settings.bounds or settings.probes != "none"
    return field.grids() if wanted and field is not None else ()


def voxels_of(field):
    """The lit voxels that ``field`` is gathered from, None for one that is not."""
    return field.hierarchy if isinstance(field, VoxelField) else None


def leak_discs(found):
    """A LeakMap as discs on the surfaces: blue where it is too dark, red where it is too bright, clear where it is right."""
    from ...evaluate.error_map import FULL_SCALE, error_colours
    from ...preview.overlay_shapes import Discs
    alpha = np.minimum(_FAINTEST + np.abs(found.error / FULL_SCALE), _STRONGEST)
    return Discs(found.receivers.points, found.receivers.normals, found.radius,
                 np.concatenate([linear_from_srgb(error_colours(found.error)), alpha[:, None]], axis=1))
