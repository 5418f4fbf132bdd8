"""Pictures of what a bake is made of, to be laid over the preview: probes, volumes, marks on surfaces.

Drawn into a texture of their own, twice as fine as the picture, against the picture's G-buffer; ``present`` brings it over what is
bound, ``laid_over`` over an image.
"""

from collections.abc import Mapping, Sequence

import gpu
import numpy as np

from ..scene import ProbeVolume
from ..techniques.base import ProbeGrid
from .camera_view import CameraView
from .device import RenderTarget, bind, vertex_buffer
from .overlay_shapes import Discs, box_lines, probe_rows, sphere_triangles
from .packing import fold
from .program import Program
from .settings import OverlaySettings
from .textures import download, upload
from .uniforms import UniformStruct

# Texels of the overlay along a pixel's side: averaged when it is shown.
FINER = 2
# How far behind a surface something counts as on it: metres a metre of depth.
TOLERANCE = 2e-3
LINE_COLOR = 0.9, 0.45, 0.05

FRAME = UniformStruct("OverlayFrame", (
    ("mat4", "clip_from_world"), ("vec3", "position_world"), ("float", "tolerance"), ("vec3", "forward_world"), ("int", "shading"),
    ("vec3", "line_color"), ("ivec2", "size")))
_GBUFFER = ("gbuffer_position", "gbuffer_normal")
_COMMON = {"uniforms": (("overlay", FRAME),), "inputs": (("VEC3", "corner"),), "outputs": (("VEC4", "color"),)}
DISC = Program("overlay_disc", samplers=("marks", *_GBUFFER), varyings=(("VEC3", "position_world"), ("VEC2", "across")),
               flat_varyings=(("VEC4", "tint"),), **_COMMON)
LINE = Program("overlay_line", samplers=_GBUFFER, varyings=(("VEC3", "position_world"),), **_COMMON)
_SQUARE = np.float32([[-1, -1, 0], [1, -1, 0], [1, 1, 0], [-1, -1, 0], [1, 1, 0], [-1, 1, 0]])


def probe_program(order: int) -> Program:
    """Spheres of probes with SH of so high an order."""
    return Program("overlay_probe", samplers=("marks", *_GBUFFER), defines=(("SH_ORDER", str(order)),),
                   varyings=(("VEC3", "position_world"), ("VEC3", "normal_world")), flat_varyings=(("INT", "probe"),), **_COMMON)


class Overlays:
    """What ``settings`` asks to be shown of ``grids`` and their volumes, and ``discs`` on surfaces. GPU objects: main thread."""

    def __init__(self, settings: OverlaySettings, grids: Sequence[ProbeGrid] = (), discs: Discs | None = None,
                 volumes: Sequence[ProbeVolume] | None = None):
        self._settings = settings
        self._target: RenderTarget | None = None
        self._probes = self._discs = self._lines = None
        if settings.probes != "none" and grids:
            rows, order = probe_rows(grids, settings.probe_size)
            self._probes = _Marks(probe_program(order), sphere_triangles(), rows)
        if settings.leaks and discs is not None and len(discs.points):
            self._discs = _Marks(DISC, _SQUARE, discs.rows)
        lines = box_lines([grid.volume for grid in grids] if volumes is None else volumes)
        if settings.bounds and len(lines):
            self._lines = gpu.types.GPUBatch(type="LINES", buf=vertex_buffer({"corner": lines}))

    @property
    def is_empty(self) -> bool:
        """True if there is nothing to draw."""
        return self._probes is None and self._discs is None and self._lines is None

    def draw(self, view: CameraView, size: tuple[int, int], gbuffer: Mapping[str, gpu.types.GPUTexture]) -> gpu.types.GPUTexture:
        """The overlays (premultiplied RGBA32F, scene-linear) over a picture of ``view`` of ``size`` (width, height) pixels, whose
        surfaces are in ``gbuffer``: its ``position`` and ``normal``, of any size."""
        fine = FINER * size[0], FINER * size[1]
        if self._target is None or self._target.size != fine:
            self._target = RenderTarget(*fine, ("RGBA32F",), depth=True)
        drawn = view.drawn(size)
        frame = {"clip_from_world": drawn.clip_from_world, "position_world": drawn.uniforms["position_world"],
                 "forward_world": drawn.uniforms["forward_world"], "tolerance": TOLERANCE, "line_color": LINE_COLOR, "size": fine,
                 "shading": int(self._settings.probes == "validity")}
        samplers = {"gbuffer_position": gbuffer["position"], "gbuffer_normal": gbuffer["normal"]}
        with self._target.drawing():
            if self._probes is not None:
                self._probes.draw(frame, samplers)
            if self._lines is not None:
                shader, _alive = bind(LINE, uniforms={"overlay": frame}, samplers=samplers)
                self._lines.draw(shader)
            if self._discs is not None:
                gpu.state.blend_set("ALPHA_PREMULT")
                gpu.state.depth_mask_set(False)
                self._discs.draw(frame, samplers)
        return self._target.colors[0]


class _Marks:
    """``rows`` (n, c) of a list, each drawn as ``corners`` (3t, 3) by ``program``."""

    def __init__(self, program: Program, corners: np.ndarray, rows: np.ndarray):
        self._program, self._count = program, len(rows)
        self._batch = gpu.types.GPUBatch(type="TRIS", buf=vertex_buffer({"corner": corners}))
        self._list = upload(fold(rows))

    def draw(self, frame: dict, samplers: Mapping[str, gpu.types.GPUTexture]) -> None:
        shader, _alive = bind(self._program, uniforms={"overlay": frame}, samplers={"marks": self._list, **samplers})
        self._batch.draw_instanced(shader, instance_start=0, instance_count=self._count)


def laid_over(image: np.ndarray, overlay: gpu.types.GPUTexture) -> np.ndarray:
    """``image`` (h, w, 4), premultiplied, row 0 at the bottom, under the picture that ``Overlays.draw`` made of its size."""
    height, width = image.shape[:2]
    over = download(overlay).reshape(height, FINER, width, FINER, 4).mean(axis=(1, 3))
    return (over + image * (1.0 - over[..., 3:])).astype(np.float32)
