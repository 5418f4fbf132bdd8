"""Pictures of what a bake is made of, to be laid over the preview: probes, volumes, voxels, marks on surfaces.

Drawn into a texture of their own, twice as fine as the picture, against the picture's G-buffer; ``present`` brings it over what is
bound, ``laid_over`` over an image.
"""

from collections.abc import Mapping, Sequence

import gpu
import numpy as np

from ..effects.spheres.maps import SphereProbes
from ..scene import ProbeVolume
from ..techniques.base import ProbeGrid
from ..transport.views.camera import CameraView
from ..transport.voxels.hierarchy import Hierarchy
from .device import RenderTarget, bind, vertex_buffer
from .overlay_shapes import Discs, box_lines, mirror_rows, probe_rows, sphere_triangles
from .overlay_voxels import cube_triangles, voxel_rows
from .packing import fold
from .program import Program
from .settings import OverlaySettings
from .sphere_textures import MEMBERS, SAMPLERS, SphereTextures, sphere_constants
from .textures import download, upload
from .uniforms import UniformStruct

# Texels of the overlay along a pixel's side: averaged when it is shown.
FINER = 2
# How far behind a surface something counts as on it: metres a metre of depth.
TOLERANCE = 2e-3
LINE_COLOR = 0.9, 0.45, 0.05

FRAME = UniformStruct("OverlayFrame", (
    ("mat4", "clip_from_world"), ("vec3", "position_world"), ("float", "tolerance"), ("vec3", "forward_world"), ("int", "shading"),
    ("vec3", "line_color"), ("int", "orthographic"), ("ivec2", "size")))
_GBUFFER = ("gbuffer_position", "gbuffer_normal")
_COMMON = {"uniforms": (("overlay", FRAME),), "inputs": (("VEC3", "corner"),), "outputs": (("VEC4", "color"),)}
DISC = Program("overlay_disc", samplers=("marks", *_GBUFFER), varyings=(("VEC3", "position_world"), ("VEC2", "across")),
               flat_varyings=(("VEC4", "tint"),), **_COMMON)
LINE = Program("overlay_line", samplers=_GBUFFER, varyings=(("VEC3", "position_world"),), **_COMMON)
VOXEL = Program("overlay_voxel", samplers=("marks", *_GBUFFER), varyings=(("VEC3", "position_world"),),
                flat_varyings=(("VEC4", "tint"),), **_COMMON)
_SQUARE = np.float32([[-1, -1, 0], [1, -1, 0], [1, 1, 0], [-1, -1, 0], [1, 1, 0], [-1, 1, 0]])


def probe_program(order: int) -> Program:
    """Spheres of probes with SH of so high an order."""
    return Program("overlay_probe", samplers=("marks", *_GBUFFER), defines=(("SH_ORDER", str(order)),),
                   varyings=(("VEC3", "position_world"), ("VEC3", "normal_world")), flat_varyings=(("INT", "probe"),), **_COMMON)


def mirror_program(spheres: SphereProbes) -> Program:
    """Balls that mirror what ``spheres`` saw."""
    return Program("overlay_mirror", uniforms=(("overlay", FRAME), ("spheres", UniformStruct("MirrorMaps", MEMBERS))),
                   inputs=(("VEC3", "corner"),), outputs=(("VEC4", "color"),), samplers=("marks", *_GBUFFER, *SAMPLERS),
                   varyings=(("VEC3", "position_world"), ("VEC3", "normal_world")), flat_varyings=(("INT", "probe"),),
                   defines=sphere_constants(spheres))


class Overlays:
    """What ``settings`` asks to be shown of ``grids``, their volumes and the probes ``spheres``, of lit ``voxels``, and ``discs``
    on surfaces. GPU objects: main thread."""

    def __init__(self, settings: OverlaySettings, grids: Sequence[ProbeGrid] = (), discs: Discs | None = None,
                 volumes: Sequence[ProbeVolume] | None = None, spheres: SphereProbes | None = None,
                 voxels: Hierarchy | None = None):
        self._settings = settings
        self._target: RenderTarget | None = None
        self._probes = self._discs = self._lines = self._mirrors = self._voxels = None
        if settings.voxels != "none" and voxels is not None:
            self._voxels = _Marks(VOXEL, cube_triangles(), voxel_rows(voxels, settings.voxel_level, settings.voxels))
        if settings.probes == "light" and spheres is not None and spheres.maps:
            self._mirrors = _Marks(mirror_program(spheres), sphere_triangles(48, 24), mirror_rows(spheres, settings.probe_size),
                                   SphereTextures(spheres))
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
        return all(part is None for part in (self._probes, self._discs, self._lines, self._mirrors, self._voxels))

    def draw(self, view: CameraView, size: tuple[int, int], gbuffer: Mapping[str, gpu.types.GPUTexture]) -> gpu.types.GPUTexture:
        """The overlays (premultiplied RGBA32F, scene-linear) over a picture of ``view`` of ``size`` (width, height) pixels, whose
        surfaces are in ``gbuffer``: its ``position`` and ``normal``, of any size."""
        fine = FINER * size[0], FINER * size[1]
        if self._target is None or self._target.size != fine:
            self._target = RenderTarget(*fine, ("RGBA32F",), depth=True)
        drawn = view.drawn(size)
        frame = {"clip_from_world": drawn.clip_from_world, "position_world": drawn.uniforms["position_world"],
                 "forward_world": drawn.uniforms["forward_world"], "tolerance": TOLERANCE, "line_color": LINE_COLOR, "size": fine,
                 "orthographic": drawn.uniforms["orthographic"], "shading": int(self._settings.probes == "validity")}
        samplers = {"gbuffer_position": gbuffer["position"], "gbuffer_normal": gbuffer["normal"]}
        with self._target.drawing():
            if self._probes is not None:
                self._probes.draw(frame, samplers)
            for marks in (self._mirrors, self._voxels):
                if marks is not None:
                    marks.draw(frame, samplers)
            if self._lines is not None:
                shader, _alive = bind(LINE, uniforms={"overlay": frame}, samplers=samplers)
                self._lines.draw(shader)
            if self._discs is not None:
                gpu.state.blend_set("ALPHA_PREMULT")
                gpu.state.depth_mask_set(False)
                self._discs.draw(frame, samplers)
        return self._target.colors[0]


class _Marks:
    """``rows`` (n, c) of a list, each drawn as ``corners`` (3t, 3) by ``program``, which may read the maps of ``spheres``."""

    def __init__(self, program: Program, corners: np.ndarray, rows: np.ndarray, spheres: SphereTextures | None = None):
        self._program, self._count, self._spheres = program, len(rows), spheres
        self._batch = gpu.types.GPUBatch(type="TRIS", buf=vertex_buffer({"corner": corners}))
        self._list = upload(fold(rows))

    def draw(self, frame: dict, samplers: Mapping[str, gpu.types.GPUTexture]) -> None:
        uniforms, samplers = {"overlay": frame}, {"marks": self._list, **samplers}
        if self._spheres is not None:
            uniforms, samplers = {**uniforms, "spheres": self._spheres.values}, {**samplers, **self._spheres.samplers}
        shader, _alive = bind(self._program, uniforms=uniforms, samplers=samplers)
        self._batch.draw_instanced(shader, instance_start=0, instance_count=self._count)


def laid_over(image: np.ndarray, overlay: gpu.types.GPUTexture) -> np.ndarray:
    """``image`` (h, w, 4), premultiplied, row 0 at the bottom, under the picture that ``Overlays.draw`` made of its size."""
    height, width = image.shape[:2]
    over = download(overlay).reshape(height, FINER, width, FINER, 4).mean(axis=(1, 3))
    return (over + image * (1.0 - over[..., 3:])).astype(np.float32)
