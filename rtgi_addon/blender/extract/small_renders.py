"""Small Cycles renders of a scene of their own: what makes them plain, and their pixels."""

import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import addon_utils
import bpy
import numpy as np

from ...errors import BakeError


@contextmanager
def small_scene(name: str, what: str) -> Iterator[tuple]:
    """An empty Cycles scene that costs little to render, and a list for (collection, datablock) of all that is made for it: they
    are removed again, in reverse. ``what`` is named by the BakeError that is raised where Cycles cannot render."""
    made = []
    had_cycles = addon_utils.check("cycles")[1]
    with tempfile.TemporaryDirectory(prefix="rtgi-render-") as folder:
        if not had_cycles:
            addon_utils.enable("cycles")
        try:
            scene = owned(made, bpy.data.scenes, bpy.data.scenes.new(name))
            _cheap_settings(scene)
            scene.render.filepath = str(Path(folder) / "picture.exr")
            yield scene, made
        except RuntimeError as error:
            raise BakeError(f"Cycles cannot render {what} ({str(error).strip()})",
                            "let a running render finish, check that Cycles is installed, then bake again") from error
        finally:
            for collection, datablock in reversed(made):
                collection.remove(datablock)
            if not had_cycles:
                addon_utils.disable("cycles")


def owned(made: list, collection, datablock):
    """``datablock``, which is removed from ``collection`` with the others that were ``made``."""
    made.append((collection, datablock))
    return datablock


def rendered(scene, samples: int) -> np.ndarray:
    """(h, w, 3) float32, row 0 at the bottom: what the camera of a ``small_scene`` sees."""
    scene.cycles.samples = samples
    bpy.ops.render.render(scene=scene.name, write_still=True)
    image = bpy.data.images.load(scene.render.filepath)
    try:
        width, height = image.size
        pixels = np.empty(width * height * image.channels, np.float32)
        image.pixels.foreach_get(pixels)
    finally:
        bpy.data.images.remove(image)
    return np.ascontiguousarray(pixels.reshape(height, width, -1)[..., :3])


def add_camera(scene, made: list, kind: str):
    """A camera object for ``scene``; ``kind`` as Blender's, 'PANO' is an equirectangular one."""
    camera = owned(made, bpy.data.cameras, bpy.data.cameras.new(scene.name))
    holder = owned(made, bpy.data.objects, bpy.data.objects.new(scene.name, camera))
    scene.collection.objects.link(holder)
    scene.camera = holder
    camera.type = kind
    if kind == "PANO":
        panorama_settings(camera).panorama_type = "EQUIRECTANGULAR"
    return holder


def panorama_settings(camera):
    """What holds a camera's panoramic settings: Cycles' own part of it before they became Blender's."""
    return camera if hasattr(camera, "panorama_type") else camera.cycles


def _cheap_settings(scene) -> None:
    render, cycles = scene.render, scene.cycles
    render.engine = "CYCLES"
    render.resolution_percentage = 100
    render.film_transparent = False
    render.use_compositing = render.use_sequencer = False
    settings = render.image_settings
    if hasattr(settings, "media_type"):
        settings.media_type = "IMAGE"
    settings.file_format, settings.color_mode, settings.color_depth, settings.exr_codec = "OPEN_EXR", "RGB", "32", "NONE"
    cycles.device = "CPU"
    cycles.use_adaptive_sampling = cycles.use_denoising = False
    cycles.max_bounces = 0
    cycles.film_exposure = 1.0
    cycles.pixel_filter_type = "BOX"
    cycles.sample_clamp_direct = cycles.sample_clamp_indirect = cycles.light_sampling_threshold = 0.0
