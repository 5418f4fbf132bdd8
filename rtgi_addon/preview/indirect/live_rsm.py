"""Reflective shadow maps in the preview: when a lamp or an object moves they are drawn and made ready to be sampled on the GPU."""

from dataclasses import replace

import numpy as np

from ...scene import Medium
from ...techniques.kernels import NUMPY
from ...techniques.rsm.field import RsmField, map_views
from ...techniques.rsm.gather import MAX_SLANT, Pattern, places, shared_samples
from ...techniques.rsm.settings import RsmSettings
from ...transport.vectors import luminance
from ...transport.views.shadow_views import texel_power
from ..capture import CapturedTextures, Drawn, draw_capture
from ..device import dispatch, uniform_buffer
from ..media_textures import MediaTextures
from ..programs import RSM_QUANTIZE, RSM_STORE, RSM_SUM_ROWS, indirect_program
from ..textures import empty, upload
from .base import FieldLight
from .probes import grid_tables
from .relighting import RelitLight
from .rsm import IN_MEDIA, STRUCT, Sheet, least_of, map_rows, map_tables, media_between, pattern_rows, rsm_values
from .tables import UNIFORMS


def rsm_light(field: RsmField, samples: int | None) -> FieldLight:
    """The irradiance function of ``field``. One whose every sample has a shadow ray is read from its probe grids instead: a shader
    has no rays."""
    if not field.capture.settings.visibility:
        return RsmLight(field.capture.settings, field.pattern, samples, field.maps, media_between(field.capture.context.scene))

    def relight(scene, progress):
        # A worker's kernels are numpy's: Blender's GPU works on the main thread only.
        return replace(field.capture, context=field.capture.context.relit(scene), kernels=NUMPY).field(progress)

    return RelitLight(field, grid_tables, relight)


def live_rsm_light(settings: RsmSettings, samples: int | None) -> "RsmLight":
    """Reflective shadow maps as ``settings`` have them, without any bake: dark before the first capture."""
    return RsmLight(settings, Pattern(settings.samples, settings.disk_radius, settings.disk_share, 0), samples)


class RsmLight(FieldLight):
    """``maps``, and then those of the scenes that are captured, read by ``pattern``, with ``samples`` texels a lamp (None: the
    pattern's), through ``media``."""

    captures = True

    def __init__(self, settings: RsmSettings, pattern: Pattern, samples: int | None = None, maps: tuple = (),
                 media: tuple[Medium, ...] = ()):
        self._settings, self._least, self._media = settings, least_of(samples), MediaTextures()
        self._pattern = pattern if samples is None else replace(pattern, samples=samples)
        super().__init__(map_tables(maps, self._pattern, self._least, media))

    def capture(self, drawn: Drawn) -> bool:
        """See FieldLight."""
        # Nothing to meet: views would be fitted to no extent.
        views = [] if drawn.surfaces is None else [view for of_lamp in map_views(drawn.scene, drawn.bounds, self._settings)
                                                   for view in of_lamp]
        # By what the lamp sends through each map: what that meets is known to the GPU only.
        strength = np.array([float(luminance(texel_power(drawn.scene.lights[view.lamp], view).sum(axis=(0, 1), dtype=np.float64)))
                             for view in views])
        views, strength = [view for view, power in zip(views, strength, strict=True) if power > 0], strength[strength > 0]
        counts, before = shared_samples(strength, np.array([view.lamp for view in views], np.intp), self._pattern.samples,
                                        self._least)
        parts = [places(self._pattern, count, first) for count, first in zip(counts, before, strict=True)]
        sheet = Sheet([view.resolution for view in views])
        texels, cumulative = empty(3 * sheet.size[0], sheet.size[1]), empty(*sheet.size, "R32F")
        for view, place in zip(views, sheet.places, strict=True):
            _store(draw_capture(drawn, view), place, texels, cumulative)
        self.samplers = {"texels": texels, "cumulative": cumulative, "maps": upload(map_rows(views, sheet, parts)),
                         "pattern": upload(pattern_rows(parts))}
        media = media_between(drawn.scene)
        if media:
            self.samplers.update(self._media.of(media).samplers)
        self.program = indirect_program("indirect_rsm", ((UNIFORMS, STRUCT),), tuple(self.samplers), IN_MEDIA if media else ())
        self.uniforms = {UNIFORMS: uniform_buffer(STRUCT, rsm_values(len(views), self._pattern, len(media)))}
        self.error = None
        return True


def _store(drawn: CapturedTextures, place: tuple[int, int], texels, cumulative) -> None:
    """A captured map into its place on the sheet."""
    size, view = drawn.view.resolution, drawn.view
    rows, quantized_rows, running = empty(size, 1), empty(size, 1), empty(size, size, "R32F")
    flux = {"map_flux": drawn.flux}
    dispatch(RSM_SUM_ROWS, (size, 1), samplers=flux, images={"rows": rows})
    dispatch(RSM_QUANTIZE, (size, 1), samplers={**flux, "rows": rows},
             images={"quantized_rows": quantized_rows, "running": running})
    dispatch(RSM_STORE, (size, 1), uniforms={"parameters": {
        "eye": view.position_world, "orthographic": int(view.orthographic), "forward": -view.world_from_view[:3, 2],
        "max_slant": MAX_SLANT, "place": place}},
        samplers={**flux, "map_position": drawn.position, "map_normal": drawn.normal, "map_power": drawn.power,
                  "quantized_rows": quantized_rows, "running": running},
        images={"texels": texels, "cumulative": cumulative})
