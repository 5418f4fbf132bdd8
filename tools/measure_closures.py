"""Measure what closures reflect of a uniform sky, with Cycles: `python tools/measure_closures.py` (needs Blender's Python module).

Prints the tables of `rtgi_addon/blender/materials/measured.py`: the bihemispherical albedo of white Toon and Sheen closures over
their parameters, as the mean over the disk of a smooth sphere in a white furnace, seen by an orthographic camera.
"""

import tempfile
from pathlib import Path

import bpy
import numpy as np

SIDE, SAMPLES = 32, 128
# Beyond this share of the disk's radius the silhouette's facets disturb: the rim is taken to go on as it is just inside.
RIM, RIM_FROM = 0.985, 0.93


def furnace():
    """(scene, material): a sphere in a white furnace before a camera, and the material that it shows."""
    bpy.ops.wm.read_factory_settings(use_empty=True)
    import addon_utils  # there once bpy is

    addon_utils.enable("cycles")
    scene, render = bpy.context.scene, bpy.context.scene.render
    render.engine, scene.cycles.samples, scene.cycles.pixel_filter_type = "CYCLES", SAMPLES, "BOX"
    scene.cycles.use_adaptive_sampling = scene.cycles.use_denoising = False
    render.resolution_x = render.resolution_y = SIDE
    render.resolution_percentage = 100
    if hasattr(render.image_settings, "media_type"):
        render.image_settings.media_type = "IMAGE"
    render.image_settings.file_format, render.image_settings.color_depth = "OPEN_EXR", "32"
    scene.world = bpy.data.worlds.new("white")
    scene.world.use_nodes = True
    scene.world.node_tree.nodes["Background"].inputs[0].default_value = (1.0, 1.0, 1.0, 1.0)
    bpy.ops.mesh.primitive_uv_sphere_add(segments=128, ring_count=64, radius=1.0)
    bpy.ops.object.shade_smooth()
    material = bpy.data.materials.new("closure")
    material.use_nodes = True
    bpy.context.object.data.materials.append(material)
    camera = bpy.data.objects.new("camera", bpy.data.cameras.new("camera"))
    camera.data.type, camera.data.ortho_scale = "ORTHO", 2.0
    camera.location, camera.rotation_euler = (0.0, -5.0, 0.0), (np.pi / 2, 0.0, 0.0)
    scene.collection.objects.link(camera)
    scene.camera = camera
    return scene, material


def albedo(scene, material, kind: str, **settings) -> float:
    """Of a white closure node of ``kind``, with inputs and properties by name."""
    tree = material.node_tree
    tree.nodes.clear()
    node = tree.nodes.new(kind)
    for name, value in settings.items():
        if name in node.inputs:
            node.inputs[name].default_value = value
        else:
            setattr(node, name, value)
    node.inputs["Color"].default_value = (1.0, 1.0, 1.0, 1.0)
    tree.links.new(node.outputs[0], tree.nodes.new("ShaderNodeOutputMaterial").inputs["Surface"])
    with tempfile.TemporaryDirectory() as folder:
        scene.render.filepath = str(Path(folder) / "furnace.exr")
        bpy.ops.render.render(write_still=True)
        image = bpy.data.images.load(scene.render.filepath)
        pixels = np.empty(SIDE * SIDE * image.channels, np.float32)
        image.pixels.foreach_get(pixels)
        bpy.data.images.remove(image)
    centre = (np.arange(SIDE) + 0.5) / SIDE * 2.0 - 1.0
    radius, grey = np.hypot(*np.meshgrid(centre, centre)), pixels.reshape(SIDE, SIDE, -1)[..., 0]
    inside = grey[radius < RIM].mean()
    return float(inside * RIM**2 + grey[(radius > RIM_FROM) & (radius < RIM)].mean() * (1.0 - RIM**2))


def main() -> None:
    """Print the tables."""
    scene, material = furnace()
    toon = [[round(albedo(scene, material, "ShaderNodeBsdfToon", Size=size, Smooth=smooth), 3) for smooth in np.linspace(0, 1, 5)]
            for size in np.linspace(0, 1, 6)]
    print("TOON =", toon)
    for name in ("MICROFIBER", "ASHIKHMIN"):
        print(name, "=", [round(albedo(scene, material, "ShaderNodeBsdfSheen", distribution=name, Roughness=roughness), 4)
                          for roughness in np.linspace(0, 1, 9)])


if __name__ == "__main__":
    main()
