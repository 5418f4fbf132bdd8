"""Any world as an equirectangular map: a small Cycles panorama of it alone, as a diffuse ray sees it."""

import tempfile
from pathlib import Path

import addon_utils
import bpy
import numpy as np

from ...errors import BakeError

# What a diffuse bounce ray reports through the Light Path node; worlds often show the camera something else.
_DIFFUSE_RAY = {"Is Diffuse Ray": 1.0, "Is Reflection Ray": 1.0, "Ray Length": 1e5, "Ray Depth": 1.0, "Diffuse Depth": 1.0}
_SAMPLES = 4
# Texels this much brighter than the mean share this many samples among them.
_BRIGHT, _BRIGHT_SAMPLES = 16.0, 4_000_000


def render_panorama(world, width: int = 1024) -> np.ndarray:
    """Radiance (width/2, width, 3) float32 of ``world`` in ``scene.World.equirect``'s layout.

    Each texel averages its own square of directions: four samples first, thousands around texels far brighter than the rest, so
    that a sun disc two texels wide keeps its energy to about 0.1 %. Everything made for it is removed again. Raises
    BakeError where Cycles cannot render.
    """
    with tempfile.TemporaryDirectory(prefix="rtgi-world-") as folder:
        made = []
        had_cycles = addon_utils.check("cycles")[1]
        if not had_cycles:
            addon_utils.enable("cycles")
        try:
            scene = bpy.data.scenes.new("rtgi world")
            made.append((bpy.data.scenes, scene))
            copy = world.copy()
            made.append((bpy.data.worlds, copy))
            _see_as_diffuse_ray(copy.node_tree, made)
            if not copy.cycles_visibility.camera:
                copy.cycles_visibility.camera = True
            copy.cycles.sampling_method = "NONE"  # nothing here is lit: spare Cycles the importance map
            made.append((bpy.data.cameras, _panoramic_camera(scene)))
            scene.world = copy
            _cheap_settings(scene, width)
            scene.render.filepath = str(Path(folder) / "world.exr")
            equirect = _render(scene, _SAMPLES)
            box = _bright_box(equirect)
            if box is not None:
                rows, columns = box
                scene.render.use_border, scene.render.use_crop_to_border = True, False
                scene.render.border_min_y, scene.render.border_max_y = rows.start * 2 / width, rows.stop * 2 / width
                scene.render.border_min_x, scene.render.border_max_x = columns.start / width, columns.stop / width
                texels = (rows.stop - rows.start) * (columns.stop - columns.start)
                equirect[box] = _render(scene, int(np.clip(_BRIGHT_SAMPLES // texels, _SAMPLES, 8192)))[box]
        except RuntimeError as error:
            raise BakeError(f"Cycles cannot render world {world.name!r} ({str(error).strip()})",
                            "let a running render finish, check that Cycles is installed, then bake again") from error
        finally:
            for collection, datablock in made:
                collection.remove(datablock)
            if not had_cycles:
                addon_utils.disable("cycles")
    return equirect


def _render(scene, samples) -> np.ndarray:
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


def _bright_box(equirect) -> tuple[slice, slice] | None:
    """The rows and columns around all texels far brighter than the mean, or None."""
    luminance = equirect.mean(axis=2)
    bright = luminance > _BRIGHT * np.mean(luminance)
    if not bright.any():
        return None
    height, width = luminance.shape
    rows, columns = np.flatnonzero(bright.any(axis=1)), np.flatnonzero(bright.any(axis=0))
    return (slice(max(rows[0] - 2, 0), min(rows[-1] + 3, height)), slice(max(columns[0] - 2, 0), min(columns[-1] + 3, width)))


def _panoramic_camera(scene):
    """A camera at the origin whose picture is the equirect map of the world's axes."""
    camera = bpy.data.cameras.new("rtgi world")
    holder = bpy.data.objects.new(camera.name, camera)
    scene.collection.objects.link(holder)
    scene.camera = holder
    camera.type = "PANO"
    settings = camera if hasattr(camera, "panorama_type") else camera.cycles
    settings.panorama_type = "EQUIRECTANGULAR"
    # Blender's cameras look along −Z with +Y up, its panoramas put their middle where the camera looks: turn it to +X, +Z up.
    holder.rotation_euler = (np.pi / 2.0, 0.0, -np.pi / 2.0)
    return camera


def _cheap_settings(scene, width):
    render, cycles = scene.render, scene.cycles
    render.engine = "CYCLES"
    render.resolution_x, render.resolution_y, render.resolution_percentage = width, width // 2, 100
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
    cycles.sample_clamp_direct = cycles.sample_clamp_indirect = 0.0


def _see_as_diffuse_ray(tree, made):
    """Replace what Light Path nodes feed by a diffuse ray's constants, in ``tree`` and in copies of the groups that use them."""
    for node in list(tree.nodes):
        if node.type == "GROUP" and node.node_tree is not None and _asks_light_path(node.node_tree):
            node.node_tree = node.node_tree.copy()
            made.append((bpy.data.node_groups, node.node_tree))
            _see_as_diffuse_ray(node.node_tree, made)
        elif node.type == "LIGHT_PATH":
            for output in node.outputs:
                targets = [link.to_socket for link in output.links]
                if targets:
                    constant = tree.nodes.new("ShaderNodeValue")
                    constant.outputs[0].default_value = _DIFFUSE_RAY.get(output.name, 0.0)
                    for target in targets:
                        tree.links.new(constant.outputs[0], target)


def _asks_light_path(tree) -> bool:
    return any(node.type == "LIGHT_PATH" or (node.type == "GROUP" and node.node_tree and _asks_light_path(node.node_tree))
               for node in tree.nodes)
