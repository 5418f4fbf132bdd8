"""Points on surfaces from the camera's G-buffer, with the light that leaves them: what is put into voxels
(transport/voxels/moving.py) of things that these do not know yet.

A lattice of pixels in the window of the picture that such things are in, which moves from frame to frame, is copied into a small
G-buffer of its own. That is lit as the picture is, by lamps and by the indirect light of the frame before, but without mirrors.
"""

from typing import NamedTuple

import numpy as np

from ..scene import Scene
from ..scene.lights import NOT_AT_ALL, lamps_to_add
from ..transport.views.camera import CameraView
from ..transport.views.gbuffer import GBUFFER
from ..transport.voxels.moving import CameraPoints
from .device import dispatch
from .indirect_pass import draw_indirect
from .programs import CAMERA_POINTS, POINT_TARGETS
from .textures import download, empty

# A pixel that grazes a surface more than this cosine would stand for more of it than it sees.
GRAZING = 0.05
# Steps of the lattice from frame to frame, as shares of its cells: the additive sequence that covers the square best (M. Roberts,
# 2018).
_STEPS = np.array([0.7548776662466927, 0.5698402909980532])


class Lattice(NamedTuple):
    """``count`` (x, y) of the pixels in the window of ``extent`` (x, y) pixels from ``corner`` (x, y), moved by ``shift`` (x, y) of
    its parts."""

    corner: tuple[int, int]
    extent: tuple[int, int]
    count: tuple[int, int]
    shift: tuple[int, int]

    @property
    def pixels(self) -> np.ndarray:
        """(ny, nx, 2) int64: x and y of each."""
        x, y = ((index * extent + shift) // count + corner for index, extent, shift, count, corner in
                zip((np.arange(count) for count in self.count), self.extent, self.shift, self.count, self.corner, strict=True))
        return np.stack(np.meshgrid(x, y), axis=-1)

    @property
    def share(self) -> float:
        """Pixels that one of it stands for."""
        return self.extent[0] * self.extent[1] / (self.count[0] * self.count[1])


def lattice(view: CameraView, boxes: np.ndarray, size: tuple[int, int], points: int, frame: int) -> Lattice | None:
    """At most so many ``points`` of the pixels of a picture of ``size`` (width, height) that ``view`` may see ``boxes`` (b, 8, 3)
    in, by their world corners; None where it sees none of them."""
    low, high = np.full(2, np.inf), np.full(2, -np.inf)
    for corners in boxes:
        places, w = view.project(np.asarray(corners, np.float64))
        if np.all(w <= 0):
            continue
        # What goes on behind the eye may be anywhere in the picture.
        ends = (places.min(axis=0), places.max(axis=0)) if np.all(w > 0) else (np.zeros(2), np.ones(2))
        low, high = np.minimum(low, ends[0]), np.maximum(high, ends[1])
    # A pixel more to all sides, for the jitter of frames.
    first = np.clip(np.floor(np.clip(low, -1.0, 2.0) * size) - 1, 0, size).astype(int)
    extent = np.clip(np.ceil(np.clip(high, -1.0, 2.0) * size) + 1, 0, size).astype(int) - first
    if np.any(extent <= 0):
        return None
    # As long and as wide as the window, in pixels that are as far apart either way.
    step = max(1.0, float(np.sqrt(extent.prod() / points)))
    count = np.clip((extent / step).astype(int), 1, extent)
    count[np.argmax(count)] = max(1, min(count.max(), points // count.min()))
    shift = np.floor(np.mod(0.5 + _STEPS * frame, 1.0) * extent).astype(int)
    return Lattice(*(tuple(int(value) for value in part) for part in (first, extent, count, shift)))


class PointLight(NamedTuple):
    """What lights points: ``lamps`` (direct_light.DirectLight) of ``drawn`` (capture.Drawn), and ``indirect`` (indirect_pass.
    Indirect)."""

    lamps: object
    drawn: object
    indirect: object


def read_points(of: Lattice, view: CameraView, size: tuple[int, int], frame: int, gbuffer, light: PointLight) -> CameraPoints:
    """What the pixels of a lattice see of the ``gbuffer`` (textures by name) that ``view`` was drawn into at ``size``. Main thread
    only."""
    width, height = of.count
    small = {name: empty(width, height) for name in GBUFFER}
    dispatch(CAMERA_POINTS, of.count, uniforms={"points": {
        "corner": of.corner, "extent": of.extent, "count": of.count, "shift": of.shift}},
        samplers={f"gbuffer_{name}": gbuffer[name] for name in POINT_TARGETS},
        images={f"point_{name}": small[name] for name in POINT_TARGETS})
    direct, irradiance = empty(width, height), empty(width, height)
    drawn = light.drawn
    if drawn.surfaces is not None:
        light.lamps.draw(drawn.scene, _lamps(drawn.scene, light.indirect), drawn.surfaces, drawn.bounds, view, frame, small, direct)
    draw_indirect(light.indirect, small, irradiance)
    arrays = {name: download(small[name]) for name in POINT_TARGETS}
    return points_of(arrays, download(direct), download(irradiance), view, of.share / (size[0] * size[1]))


def points_of(gbuffer, direct: np.ndarray, irradiance: np.ndarray, view: CameraView, share: float) -> CameraPoints:
    """The points of a G-buffer (h, w, 4) by name, lit by ``direct`` radiance and indirect ``irradiance`` (h, w, 4); each stands for
    so large a ``share`` of the picture."""
    seen = np.any(gbuffer["normal"][..., :3] != 0, axis=-1)
    positions, normals, albedo, emission = (gbuffer[name][seen].astype(np.float64) for name in
                                            ("position", "geometry", "albedo", "emission"))
    leaving = direct[seen][:, :3] + emission[:, :3] + albedo[:, :3] / np.pi * irradiance[seen][:, :3]
    areas = view.footprint(positions[:, :3], normals[:, :3], GRAZING) * share
    return CameraPoints(positions[:, :3], normals[:, :3], areas, leaving, albedo[:, :3], albedo[:, 3].astype(np.int64))


def _lamps(scene: Scene, indirect) -> tuple:
    """The lamps whose light is in voxels, but for those that ``indirect`` has."""
    # Lamps that no bake knows shine, and nothing that they light does.
    known = tuple(light for light in scene.lights if light.bake != NOT_AT_ALL)
    return lamps_to_add(known, indirect.direct_lamps)
