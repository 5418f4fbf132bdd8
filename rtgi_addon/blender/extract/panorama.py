"""Any world as an equirectangular map: a small Cycles panorama of it alone, as a diffuse ray sees it."""

import tempfile
from pathlib import Path

import addon_utils
import bpy
import numpy as np

# What a diffuse bounce ray reports through the Light Path node; worlds often show the camera something else.
_DIFFUSE_RAY = {"Is Diffuse Ray": 1.0, "Is Reflection Ray": 1.0, "Ray Length": 1e5, "Ray Depth": 1.0, "Diffuse Depth": 1.0}


def render_panorama(world, width: int = 1024, samples: int = 1024) -> np.ndarray:
    """Radiance (width/2, width, 3) float32 of ``world`` in ``scene.World.equirect``'s layout.

    Each texel averages its own square of directions. Cycles stops a texel when its noise is below 1 %, and spends up to
    ``samples`` where a sun disc's edge makes it worth while, so the sun keeps its energy. Everything it makes is removed.
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
            camera = _panoramic_camera(scene)
            made.append((bpy.data.cameras, camera))
            scene.world = copy
            _cheap_settings(scene, width, samples)
            scene.render.filepath = str(Path(folder) / "world.exr")
            bpy.ops.render.render(scene=scene.name, write_still=True)
            image = bpy.data.images.load(scene.render.filepath)
            made.append((bpy.data.images, image))
            pixels = np.empty(width * (width // 2) * 4, np.float32)
            image.pixels.foreach_get(pixels)
        finally:
            for collection, datablock in made:
                collection.remove(datablock)
            if not had_cycles:
                addon_utils.disable("cycles")
    return np.ascontiguousarray(pixels.reshape(width // 2, width, 4)[..., :3])


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


def _cheap_settings(scene, width, samples):
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
    cycles.samples, cycles.use_adaptive_sampling = samples, True
    cycles.adaptive_threshold, cycles.adaptive_min_samples = 0.01, 16
    cycles.use_denoising = False
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
