"""Cycles' pictures through the scene's own camera, as what effects' pictures are held to."""

import tempfile
from pathlib import Path

import bpy
import numpy as np

from ...errors import BakeError
from ...evaluate.pictures import picture_noise
from ...progress import Progress
from ...scene import Camera
from ..worker import main_thread
from .reference import CyclesSettings, render_picture, rendering

# Samples of a pixel and render, and renders of each of the two pictures at most.
SAMPLES, MOST_RENDERS = 32, 32
# The noise of a pixel at which rendering stops, relative to the picture's mean. It cancels in errors; what is left of it there is
# its square over the root of the number of pixels.
NOISE = 0.05


class CyclesPictures:
    """See evaluate.pictures.PictureReference. Renders on Blender's main thread, wherever it is asked from, nothing that trades bias
    for speed, lamps hidden from the camera, no depth of field, until a pixel's noise is ``noise``."""

    kind = "Cycles"

    def __init__(self, noise: float = NOISE, threads: int | None = None, scene: bpy.types.Scene | None = None):
        self.noise, self.threads, self.scene = noise, threads, scene

    def pictures(self, camera: Camera, size: tuple[int, int], progress: Progress) -> np.ndarray:
        """See PictureReference. Raises BakeError where the camera is not an object of the file."""
        return main_thread.call(progress, self._pictures, camera.name, size, progress)

    def _pictures(self, name: str, size: tuple[int, int], progress: Progress) -> np.ndarray:
        scene = self.scene or bpy.context.scene
        camera = scene.objects.get(name)
        if camera is None or camera.type != "CAMERA":
            raise BakeError(f"the camera {name!r} is no object of the scene of its own", "give the scene an active camera")
        aspect = scene.render.pixel_aspect_x, scene.render.pixel_aspect_y
        focus, total = camera.data.dof.use_dof, np.zeros((2, size[1], size[0], 3))
        with rendering(scene, CyclesSettings(samples=SAMPLES, threads=self.threads)), tempfile.TemporaryDirectory() as folder:
            camera.data.dof.use_dof = False
            try:
                scene.camera = camera
                scene.render.resolution_x, scene.render.resolution_y = size
                scene.render.pixel_aspect_x, scene.render.pixel_aspect_y = aspect
                scene.cycles.pixel_filter_type, scene.cycles.filter_width = "BLACKMAN_HARRIS", 1.5
                for count in range(1, MOST_RENDERS + 1):
                    for which in range(2):
                        progress.step((2 * count - 2 + which) / (2 * MOST_RENDERS), f"Cycles' picture, render {count}")
                        scene.cycles.seed = 2 * count + which
                        total[which] += render_picture(scene, Path(folder))
                    if picture_noise(total / count) <= self.noise:
                        break
            finally:
                camera.data.dof.use_dof = focus
        return total / count
