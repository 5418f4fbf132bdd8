"""Media on the GPU: slices, lamps by shadow maps, sums and picture, each a program (effects/media has the same in numpy).

The volume's textures hold its slices side by side. Grids are marched through on the way to a lamp, where numpy integrates; all else
is the same to float precision.
"""

from math import ceil, sqrt
from typing import NamedTuple

import gpu
import numpy as np

from ...effects import Chosen
from ...effects.media.froxels import BEND, Columns, Near, Shape, shape_of
from ...effects.media.history import MOST, is_lit_alike, share_before
from ...scene import Scene
from ...techniques.base import MAX_TEXTURE_SIDE, Field
from ...transport.lights.kinds import DEFINES as LAMP_KINDS
from ...transport.views.camera import CameraView
from ..device import dispatch, uniform_buffer
from ..direct_light import LampPart
from ..media_programs import FROXELS, MEDIA_GATHER, MEDIA_HISTORY, MEDIA_LIGHT, MEDIA_NEAR, MEDIA_SHOW, MEDIA_SLICES
from ..media_textures import MediaTextures
from ..textures import empty
from .ambient_texture import AmbientTexture
from .base import GpuFrame

# Texels of one of the volume's nine textures at most: 128 MB each.
MOST_TEXELS = 1 << 23
_SUN, _AREA = (int(dict(LAMP_KINDS)[name]) for name in ("LAMP_SUN", "LAMP_AREA"))
_SLICES = "slice_depth", "slice_direct", "slice_indirect"
_GATHERED = "gathered_depth", "gathered_direct", "gathered_indirect"


class _Kept(NamedTuple):
    """How the slices of the sample before came about: see effects.media.history.Kept."""

    scene: Scene
    lit_by: Field | None
    shape: Shape
    view: CameraView
    offset: tuple[float, float]
    jitter: np.ndarray
    count: int
    number: int


class MediaHalf:
    """See Half."""

    def __init__(self, chosen: Chosen):
        self.chosen = chosen
        self.passes: dict[str, gpu.types.GPUTexture] = {}
        self._media, self._made_for = MediaTextures(), None
        self._ambient = AmbientTexture()
        self._kept: _Kept | None = None

    def draw(self, frame: GpuFrame) -> gpu.types.GPUTexture:
        """See Half."""
        settings, scene = self.chosen.settings, frame.scene
        tile = fitting_tile(frame.size, settings.tile, settings.slices)
        shape = shape_of(scene, frame.view, frame.size, tile, settings.slices, settings.reach)
        if shape is None:
            self.passes, self._kept = {}, None
            return frame.light
        self._allocate(shape)
        kept = self._kept if settings.steady else None
        if kept is not None and not (kept.lit_by is frame.field and is_lit_alike(kept.scene, scene)):
            kept = None
        number = frame.index if kept is None else kept.number + 1
        media = self._media.of(scene.media)
        ambient = self._ambient.of(frame)
        values = {**froxel_values(shape, frame.view, number, frame.offset, self._blocks), "media": media.count,
                  "all_orders": int(settings.orders == "all"), **ambient.values}
        froxels = uniform_buffer(FROXELS, values)
        seen = {f"gbuffer_{name}": frame.gbuffer[name] for name in ("position", "normal")}
        whole = shape.columns[0] * self._blocks, shape.columns[1] * self._rows
        dispatch(MEDIA_SLICES, whole, uniforms={"froxels": froxels},
                 samplers={**media.samplers, "ambient": ambient.texture}, images=self._slices)
        self._near.clear(format="FLOAT", value=(0.0,) * 4)
        # How deep media are before a place is known before their light is.
        dispatch(MEDIA_GATHER, shape.columns, uniforms={"froxels": froxels}, samplers=self._slices, images=self._gathered)
        for lamp in frame.lamps.parts(scene, frame.lamps_added, frame.drawn.surfaces, frame.drawn.bounds, frame.view, number):
            near = near_lamp(shape, frame.view, lamp)
            uniforms = {**lamp.uniforms, "camera": frame.lamps.camera(frame.view, frame.size), "froxels": froxels,
                        "near": {"centre": near.centre, "reach": near.reach}}
            dispatch(MEDIA_LIGHT, whole, uniforms=uniforms,
                     samplers={**lamp.samplers, **media.samplers, **{name: self._slices[name] for name in _SLICES}},
                     images={"slice_direct": self._slices["slice_direct"]})
            if near.reach > 0:
                dispatch(MEDIA_NEAR, frame.size, uniforms=uniforms,
                         samplers={**lamp.samplers, **media.samplers, **seen, **self._slices, **self._gathered},
                         images={"near_light": self._near})
        self._go_on(kept, frame, froxels, whole)
        if settings.steady:
            count = 0 if kept is None else kept.count
            self._kept = _Kept(scene, frame.field, shape, frame.view, tuple(frame.offset), values["jitter"],
                               min(count + 1, MOST - 1), number)
        dispatch(MEDIA_GATHER, shape.columns, uniforms={"froxels": froxels}, samplers=self._slices, images=self._gathered)
        dispatch(MEDIA_SHOW, frame.size, uniforms={"froxels": froxels},
                 samplers={"light": frame.light, "near_light": self._near, **seen, **self._slices, **self._gathered},
                 images={"result": self._result, **self.passes})
        return self._result

    def _go_on(self, kept: _Kept | None, frame: GpuFrame, froxels, whole: tuple[int, int]) -> None:
        """Mix the slices with those of the sample before, and leave them for the next one."""
        share = 0.0 if kept is None else share_before(kept.count, frame.index)
        if share > 0:
            view, shape = kept.view, kept.shape
            before = {"clip_from_world": view.drawn(shape.size, kept.offset).clip_from_world, "position_world": view.position,
                      "orthographic": int(view.orthographic), "forward_world": view.forward, "tile": shape.tile,
                      "columns": shape.columns, "jitter": kept.jitter, "slices": shape.slices, "blocks": self._blocks,
                      "start": shape.start, "far": shape.far, "bend": shape.bend, "growth": np.log1p(1.0 / BEND), "share": share}
            dispatch(MEDIA_HISTORY, whole, uniforms={"froxels": froxels, "before": before},
                     samplers={"slice_depth": self._slices["slice_depth"],
                               **{name.replace("slice", "before"): texture for name, texture in self._before.items()}},
                     images={name: self._slices[name] for name in _SLICES[1:]})

    def _allocate(self, shape: Shape) -> None:
        kind = shape.size, shape.tile, shape.slices
        if kind == self._made_for:
            self._slices, self._before = self._before, self._slices
            return
        # One slice more: what is gathered is known at every limit.
        self._blocks = ceil(sqrt(shape.slices + 1))
        self._rows = -(-(shape.slices + 1) // self._blocks)
        size = shape.columns[0] * self._blocks, shape.columns[1] * self._rows
        self._slices, self._before, self._gathered = ({name: empty(*size) for name in names}
                                                      for names in (_SLICES, _SLICES, _GATHERED))
        self._kept = None
        self._result, self._near = empty(*shape.size), empty(*shape.size)
        self.passes = {name: empty(*shape.size) for name in self.chosen.effect.passes}
        self._made_for = kind


def near_lamp(shape: Shape, view: CameraView, lamp: LampPart) -> Near:
    """About what of ``lamp`` pixels have its light by themselves: of an area lamp about the point that lights this sample. Its
    reach is 0 where columns do."""
    values, nowhere = lamp.uniforms["lamp"], Near(np.zeros(3), 0.0)
    is_area = values["kind"] == _AREA
    if values["kind"] == _SUN or values["scattered"] == 0 or (is_area and values["tan_half_spread"] == 0):
        return nowhere
    centre = np.asarray(values["position"], np.float64) + (np.asarray(values["shift"], np.float64) if is_area else 0.0)
    return Near.of(shape, view, centre, 0.0 if is_area else float(values["radius"])) or nowhere


def fitting_tile(size: tuple[int, int], tile: int, slices: int) -> int:
    """The smallest tile from ``tile`` on whose volume, for a picture of ``size``, a GPU takes and has the memory for."""
    blocks = ceil(sqrt(slices + 1))
    while True:
        sides = [-(-side // tile) * blocks for side in size]
        if max(sides) <= MAX_TEXTURE_SIDE and sides[0] * sides[1] <= MOST_TEXELS:
            return tile
        tile += 1


def froxel_values(shape: Shape, view: CameraView, index: int, offset, blocks: int) -> dict:
    """The members of FROXELS that a volume of ``shape`` in sample number ``index`` has; its slices lie in rows of ``blocks``."""
    base, across, up = view.rays(shape.size, offset)
    origin, origin_across, origin_up = view.position, np.zeros(3), np.zeros(3)
    if view.orthographic:
        corners, directions, _ = view.through(np.array([0.0, 1.0, 0.0]), np.array([0.0, 0.0, 1.0]), shape.size, offset)
        origin, right, top = corners - directions * view.depths[0]
        origin_across, origin_up = right - origin, top - origin
    jitter = Columns.of(shape, view, index, offset).jitter
    return {"size": shape.size, "columns": shape.columns, "tile": shape.tile, "slices": shape.slices, "blocks": blocks,
            "index": index, "start": shape.start, "bend": shape.bend, "growth": np.log1p(1.0 / BEND), "jitter": jitter,
            "orthographic": int(view.orthographic), "ray_base": base, "ray_across": across, "ray_up": up, "origin_base": origin,
            "origin_across": origin_across, "origin_up": origin_up, "position_world": view.position, "forward_world": view.forward}


HALF = MediaHalf
