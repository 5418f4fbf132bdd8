"""Overlays over what somebody else has drawn: probes as spheres, the boxes of their volumes and voxels as cubes, by Blender's own
shaders, against the depth that is bound. Nothing here knows our G-buffer; `overlays` is for our own pictures."""

from collections.abc import Sequence

import gpu
import numpy as np

from ..techniques.base import ProbeGrid
from ..transport.voxels.hierarchy import Hierarchy
from .overlay_colours import sphere_colours
from .overlay_shapes import box_lines
from .overlay_voxels import cube_colours
from .settings import OverlaySettings

_LINE_COLOR = 0.9, 0.45, 0.05, 1.0


class PlainOverlays:
    """What ``settings`` asks to be shown of ``grids`` and of lit ``voxels``. GPU objects: main thread only."""

    def __init__(self, settings: OverlaySettings, grids: Sequence[ProbeGrid], voxels: Hierarchy | None = None):
        self._smooth, self._uniform = (gpu.shader.from_builtin(name) for name in ("SMOOTH_COLOR", "UNIFORM_COLOR"))
        self._balls = self._lines = self._cubes = None
        if settings.voxels != "none" and voxels is not None:
            positions, colours = cube_colours(voxels, settings.voxel_level, settings.voxels)
            self._cubes = _batch("TRIS", pos=positions, color=colours)
        if settings.probes != "none":
            positions, colours = sphere_colours(grids, settings)
            self._balls = _batch("TRIS", pos=positions, color=colours)
        if settings.bounds:
            self._lines = _batch("LINES", pos=box_lines([grid.volume for grid in grids]))

    def draw(self) -> None:
        """Draw with the matrices that are bound; the states that it sets are as before."""
        before = gpu.state.depth_test_get(), gpu.state.depth_mask_get()
        gpu.state.depth_test_set("LESS_EQUAL")
        gpu.state.depth_mask_set(True)
        try:
            for solid in (self._balls, self._cubes):
                if solid is not None:
                    solid.draw(self._smooth)
            if self._lines is not None:
                self._uniform.bind()
                self._uniform.uniform_float("color", _LINE_COLOR)
                self._lines.draw(self._uniform)
        finally:
            gpu.state.depth_test_set(before[0])
            gpu.state.depth_mask_set(before[1])


def _batch(kind: str, **attributes: np.ndarray):
    """A batch of ``kind`` of float attributes (n, c) by name."""
    layout = gpu.types.GPUVertFormat()
    for name, values in attributes.items():
        layout.attr_add(id=name, comp_type="F32", len=values.shape[1], fetch_mode="FLOAT")
    buffer = gpu.types.GPUVertBuf(layout, len(next(iter(attributes.values()))))
    for name, values in attributes.items():
        buffer.attr_fill(name, np.ascontiguousarray(values, np.float32))
    return gpu.types.GPUBatch(type=kind, buf=buffer)
