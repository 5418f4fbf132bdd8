"""Irradiance on a square as Cycles sees it, to hold extracted lamps and worlds against. Needs the bpy module."""

import tempfile
from pathlib import Path

import addon_utils
import bpy
import numpy as np
from mathutils import Matrix

CAMERA_HEIGHT = 0.02


def cycles_irradiance(world_from_square, size=4.0, pixels=12, samples=512, seed=1) -> np.ndarray:
    """Irradiance (pixels, pixels, 3) [W·m⁻²] from what is in the current scene on a square of side ``size`` in the local XY plane
    of ``world_from_square`` (4, 4), facing +Z. Row 0 is at −Y, column 0 at −X; each value is its pixel's mean.

    Direct light only. The square is white and diffuse: E = π·L. It and the camera are gone afterwards.
    """
    addon_utils.enable("cycles")
    scene = bpy.context.scene
    world_from_square = np.asarray(world_from_square, np.float64)
    square, camera = _add_square(world_from_square, size), _add_camera(world_from_square, size)
    scene.collection.objects.link(square)
    scene.collection.objects.link(camera)
    scene.camera = camera
    render, cycles = scene.render, scene.cycles
    render.engine = "CYCLES"
    render.resolution_x = render.resolution_y = pixels
    render.resolution_percentage = 100
    cycles.device, cycles.samples, cycles.seed = "CPU", samples, seed
    cycles.use_adaptive_sampling = cycles.use_denoising = False
    cycles.max_bounces, cycles.pixel_filter_type = 0, "BOX"
    cycles.sample_clamp_direct, cycles.light_sampling_threshold = 0.0, 0.0
    if hasattr(render.image_settings, "media_type"):
        render.image_settings.media_type = "IMAGE"
    render.image_settings.file_format, render.image_settings.color_depth = "OPEN_EXR", "32"
    try:
        with tempfile.TemporaryDirectory() as folder:
            render.filepath = str(Path(folder) / "e.exr")
            bpy.ops.render.render(write_still=True)
            image = bpy.data.images.load(render.filepath)
            values = np.empty(pixels * pixels * 4, np.float32)
            image.pixels.foreach_get(values)
            bpy.data.images.remove(image)
    finally:
        material = square.data.materials[0]
        bpy.data.meshes.remove(square.data)
        bpy.data.materials.remove(material)
        bpy.data.cameras.remove(camera.data)
    return np.pi * values.reshape(pixels, pixels, 4)[..., :3]


def points_in_pixels(world_from_square, size, pixels, offsets) -> np.ndarray:
    """The points at ``offsets`` (count, 2) in [0, 1) of every pixel of that square: (pixels, pixels, count, 3) world space."""
    world_from_square = np.asarray(world_from_square, np.float64)
    local = np.zeros((pixels, pixels, len(offsets), 4))
    local[..., 3] = 1.0
    local[..., 0] = ((np.arange(pixels)[None, :, None] + offsets[:, 0]) / pixels - 0.5) * size
    local[..., 1] = ((np.arange(pixels)[:, None, None] + offsets[:, 1]) / pixels - 0.5) * size
    return (local @ world_from_square.T)[..., :3]


def _add_square(world_from_square, size):
    half = 0.51 * size
    mesh = bpy.data.meshes.new("square")
    mesh.from_pydata([(-half, -half, 0), (half, -half, 0), (half, half, 0), (-half, half, 0)], [], [(0, 1, 2, 3)])
    material = bpy.data.materials.new("white")
    if material.node_tree is None:
        material.use_nodes = True
    nodes = material.node_tree.nodes
    nodes.clear()
    diffuse, output = nodes.new("ShaderNodeBsdfDiffuse"), nodes.new("ShaderNodeOutputMaterial")
    diffuse.inputs["Color"].default_value = (1, 1, 1, 1)
    material.node_tree.links.new(diffuse.outputs[0], output.inputs["Surface"])
    mesh.materials.append(material)
    square = bpy.data.objects.new("square", mesh)
    square.matrix_world = _matrix(world_from_square)
    return square


def _add_camera(world_from_square, size):
    data = bpy.data.cameras.new("above square")
    data.type, data.ortho_scale, data.clip_start = "ORTHO", size, CAMERA_HEIGHT / 2
    camera = bpy.data.objects.new("above square", data)
    lift = np.eye(4)
    lift[2, 3] = CAMERA_HEIGHT
    camera.matrix_world = _matrix(world_from_square @ lift)
    return camera


def _matrix(values):
    return Matrix(values.tolist())
