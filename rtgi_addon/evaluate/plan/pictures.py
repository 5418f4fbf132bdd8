"""What a picture by true rays would take beside the planned bake, and what media need in pictures.

A small picture is drawn with the effect `ray_traced`, a few samples of it: they tell what a sample of a pixel takes and how noisy
it is, from which follows what the whole picture takes to an error. What the surface cache takes grows with what a picture shows, so
times are rough.
"""

from dataclasses import dataclass

import numpy as np

from ...effects import Chosen, concerned, get, registry
from ...effects.base import apply_all
from ...effects.lit import draw_frame
from ...effects.media import MediaSettings
from ...effects.media.froxels import BEND, shape_of
from ...progress import Progress
from ...scene import Scene
from ...transport.context import LightContext
from ...transport.media.table import Filling
from ...transport.views.camera import CameraView
from ...transport.views.pixel_filter import sample_offset
from ..costs import metered
from ..pictures import fitted

# The longer side of the small picture [pixels], and its samples: the first one finds the surface cache as well.
LONGER_SIDE, SAMPLES = 48, 4
# Pixels of a column and slices that are asked for at most and at least.
_TILES, _SLICES = (1, 64), (16, 256)


@dataclass(frozen=True)
class PictureLook:
    """The picture through ``camera``, ``size`` (width, height), by true rays: seconds of wall clock to ``prepare`` it and
    ``per_pixel`` and sample, and the ``noise`` of a sample relative to the picture's mean."""

    camera: str
    size: tuple[int, int]
    prepare: float
    per_pixel: float
    noise: float

    def samples(self, error: float) -> int:
        """How many bring it within ``error``."""
        return max(int(np.ceil((self.noise / error) ** 2)), 1)

    def seconds(self, error: float) -> float:
        """What it takes until then."""
        return self.prepare + self.per_pixel * self.size[0] * self.size[1] * self.samples(error)


def look_at_picture(scene: Scene, threads: int | None, progress: Progress | None = None) -> PictureLook | None:
    """Draw the small picture of ``scene``; None where it has no camera or shows nothing. Raises Cancelled."""
    if not scene.cameras:
        return None
    progress, camera, effect = progress or Progress(), scene.cameras[0], get("ray_traced")
    size, view = fitted(camera.resolution, LONGER_SIDE), CameraView.of(camera)
    chosen = concerned([Chosen(effect, effect.Settings()), *(Chosen(other, other.Settings()) for other in registry().values()
                                                              if other.on_by_default)], scene)
    pictures, seconds, history = [], [], None
    for index in range(SAMPLES):
        progress.step(index / SAMPLES, "drawing by rays")
        with metered() as costs:
            if index == 0:
                context = LightContext(scene, threads, whole=True)
            frame = draw_frame(context, None, view, size, index=index, offset=sample_offset(index), history=history)
            frame = apply_all(frame, None, chosen)
            history = frame.history
        pictures.append(frame.light[..., :3].astype(np.float64))
        seconds.append(costs.seconds)
    level = float(np.mean(pictures))
    if level <= 0:
        return None
    each = float(np.median(seconds[1:]))
    noise = float(np.sqrt(np.var(pictures, axis=0, ddof=1).mean())) / level
    return PictureLook(camera.name, tuple(camera.resolution), max(seconds[0] - each, 0.0), each / (size[0] * size[1]), noise)


def media_detail(scene: Scene, fillings: list[Filling]) -> tuple[int, int] | None:
    """Pixels of a column and slices that follow the media which a camera sees: columns no wider than their cells where they are
    nearest, slices no thicker than a cell and the mean free path where they are thickest. None without a camera or such media."""
    seen = [filling for filling in fillings if filling.medium.visible_camera]
    if not scene.cameras or not seen:
        return None
    camera, defaults = scene.cameras[0], MediaSettings()
    view = CameraView.of(camera)
    shape = shape_of(scene, view, camera.resolution, defaults.tile, defaults.slices, None)
    if shape is None:
        return None
    cells = [filling.grid.cell for filling in seen if filling.grid is not None]
    paths = [1.0 / filling.majorant.mean() for filling in seen if filling.majorant.mean() > 0]
    tile, slices = defaults.tile, defaults.slices
    if cells:
        near = 1.0 if view.orthographic else max(shape.start, min(cells))
        width = 2.0 / (abs(view.clip_from_camera[0, 0]) * camera.resolution[0]) * near
        tile = int(np.clip(min(cells) // width, *_TILES))
    if cells or paths:
        # Slices grow: the last one is (1/BEND + 1)·log(1/BEND + 1)·BEND times as thick as they are on average.
        growth = (1.0 + BEND) * np.log1p(1.0 / BEND)
        thickest = min([*cells, *paths])
        slices = int(np.clip(np.ceil(growth * (shape.far - shape.start) / thickest), *_SLICES))
    return tile, slices
