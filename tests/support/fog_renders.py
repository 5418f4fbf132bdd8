"""Media in Blender scenes for tests: nodes built by calls, cubes full of them, and what Cycles sees shine through."""

import bpy
import numpy as np
import pytest
from blend_builders import cube_mesh, link
from mathutils import Euler, Matrix

from rtgi_addon.transport.media.table import MediaTable

PLACE = Matrix.LocRotScale((0.2, -0.1, 0.3), Euler((0.3, 0.2, -0.4)), (0.8, 1.0, 1.3))
GLOW = (0.7, 0.5, 0.3)


class Nodes:
    """A new tree of nodes to be built by calls: of a material, or of a world."""

    def __init__(self, owner):
        if owner.node_tree is None:
            owner.use_nodes = True
        self.owner, self.tree = owner, owner.node_tree
        self.tree.nodes.clear()

    def __call__(self, kind, **inputs):
        node = self.tree.nodes.new(f"ShaderNode{kind}")
        for name, value in inputs.items():
            socket = node.inputs[name.replace("_", " ")]
            if hasattr(value, "is_output"):
                self.tree.links.new(value, socket)
            else:
                socket.default_value = value
        return node

    def fill(self, out, name="Volume"):
        kind = "OutputWorld" if isinstance(self.owner, bpy.types.World) else "OutputMaterial"
        self.tree.links.new(out, self(kind).inputs[name])
        return self.owner


def volume_material(build, name="fog"):
    nodes = Nodes(bpy.data.materials.new(name))
    return nodes.fill(build(nodes))


def filled_cube(build, matrix=PLACE, mesh=None):
    """A cube in the scene that ``build(nodes)``'s volume fills, and a wall far away."""
    mesh = mesh or cube_mesh()
    mesh.materials.append(volume_material(build))
    link("far", cube_mesh("far", 0.1), Matrix.Translation((40, 0, -50)))
    return link("fog", mesh, matrix)


def shone_through(resolution=8, in_the_world=None):
    """Radiance (pixels, 3) that an orthographic camera at z = 5 sees of and through what is about 0, by Cycles, before a world of
    radiance ``GLOW``; and the rays (n, 3) each, 16 a pixel. ``in_the_world(nodes)`` makes the world's volume, if it has one."""
    scene = bpy.context.scene
    nodes = Nodes(scene.world or bpy.data.worlds.new("glow"))
    scene.world = nodes.fill(nodes("Background", Color=(*GLOW, 1.0)).outputs[0], "Surface")
    if in_the_world is not None:
        nodes.tree.links.new(in_the_world(nodes), nodes.tree.get_output_node("CYCLES").inputs["Volume"])
    camera = bpy.data.cameras.new("camera")
    camera.type, camera.ortho_scale, camera.clip_start = "ORTHO", 1.5, 1e-4
    scene.camera = link("camera", camera, Matrix.Translation((0, 0, 5)))
    scene.render.engine, scene.cycles.device, scene.cycles.samples = "CYCLES", "CPU", 64
    scene.cycles.pixel_filter_type, scene.cycles.max_bounces = "BOX", 0
    scene.cycles.use_denoising = scene.cycles.use_adaptive_sampling = False
    scene.render.resolution_x = scene.render.resolution_y = resolution
    scene.view_settings.view_transform = "Standard"
    settings = scene.render.image_settings
    if hasattr(settings, "media_type"):
        settings.media_type = "IMAGE"
    settings.file_format, settings.color_depth = "OPEN_EXR", "32"
    path = f"{bpy.app.tempdir}media.exr"
    scene.render.filepath = path
    bpy.ops.render.render(write_still=True)
    image = bpy.data.images.load(path)
    pixels = np.array(image.pixels[:], np.float32).reshape(resolution, resolution, -1)[..., :3]
    x = ((np.arange(4 * resolution) + 0.5) / (4 * resolution) - 0.5) * 1.5
    origins = np.stack([*np.meshgrid(x, x), np.full((4 * resolution,) * 2, 5.0)], axis=-1).reshape(-1, 3)
    return pixels.reshape(-1, 3), origins, np.broadcast_to([0.0, 0.0, -1.0], origins.shape)


def as_we_have_it(scene, origins, directions, reach=20.0):
    table, reach = MediaTable(scene.media), np.full(len(origins), reach)
    radiance = table.transmittance(origins, directions, reach) * GLOW + table.emitted(origins, directions, reach)
    pixels = int(np.sqrt(len(origins))) // 4
    return radiance.reshape(pixels, 4, pixels, 4, 3).mean(axis=(1, 3)).reshape(-1, 3)


def difference(ours, seen):
    """The mean square difference's root over the mean."""
    return np.sqrt(np.mean((ours - seen) ** 2)) / seen.mean()


needs_grids = pytest.mark.skipif(not hasattr(bpy.types, "GeometryNodeSampleGrid"), reason="Blender reads grids from 5.0 on")
