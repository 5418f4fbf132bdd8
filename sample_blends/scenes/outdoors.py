"""Scenes lit from outside: by the sky, by the sun through a window, by a photographed surrounding."""

import math
from pathlib import Path

import bpy

from . import kit


def sky_courtyard():
    """An open courtyard under an even sky: no lamp at all, half of the light comes straight from the world."""
    stone = kit.material("Stone", (0.55, 0.5, 0.42))
    brick = kit.material("Brick", (0.5, 0.2, 0.13))
    grass = kit.material("Grass", (0.12, 0.25, 0.06))
    kit.world(bpy.context.scene, (0.62, 0.78, 1.0), 1.4)
    kit.box("Ground", (-4.3, -3.3, -0.3), (4.3, 3.3, 0.0), stone)
    for name, low, high, coat in (
            ("Wall West", (-4.3, -3.3, -0.1), (-4.0, 3.3, 3.5), brick),
            ("Wall East", (4.0, -3.3, -0.1), (4.3, 3.3, 3.5), stone),
            ("Wall South", (-4.1, -3.3, -0.1), (4.1, -3.0, 3.5), stone),
            ("Wall North", (-4.1, 3.0, -0.1), (4.1, 3.3, 3.5), stone)):
        kit.box(name, low, high, coat)
    kit.box("Lawn", (-1.6, -1.4, -0.05), (1.6, 1.2, 0.06), grass)
    kit.box("Loggia Roof", (-4.05, 1.7, 2.4), (4.05, 3.05, 2.6), stone)
    for i in range(5):
        x = -3.2 + 1.6 * i
        kit.box(f"Pillar {i + 1}", (x - 0.12, 1.74, -0.05), (x + 0.12, 1.98, 2.45), stone)
    kit.box("Bench", (2.6, -1.2, -0.05), (3.1, 0.8, 0.45), brick)
    kit.probe_volume("Probes", (-4.0, -3.0, 0.0), (4.0, 3.0, 3.5), (18, 15, 9))
    kit.camera((3.7, -2.7, 2.5), (-1.6, 1.4, 0.7), lens=18.0)


def sun_window():
    """A room that the sun reaches through one window, with a little sky: a small bright patch lights everything else."""
    plaster = kit.material("Plaster", (0.78, 0.76, 0.72))
    wood = kit.material("Wood", (0.42, 0.26, 0.14))
    cloth = kit.material("Cloth", (0.15, 0.25, 0.5))
    kit.world(bpy.context.scene, (0.55, 0.75, 1.0), 1.5)
    kit.box("Floor", (-2.2, -1.7, -0.2), (2.2, 1.7, 0.0), wood)
    kit.box("Ceiling", (-2.2, -1.7, 2.6), (2.2, 1.7, 2.8), plaster)
    for name, low, high in (
            ("Wall West", (-2.2, -1.7, -0.1), (-2.0, 1.7, 2.7)), ("Wall North", (-2.1, 1.5, -0.1), (2.1, 1.7, 2.7)),
            ("Wall South", (-2.1, -1.7, -0.1), (2.1, -1.5, 2.7)),
            # The east wall is four pieces around the window.
            ("Sill", (2.0, -1.6, -0.1), (2.2, 1.6, 0.9)), ("Lintel", (2.0, -1.6, 2.1), (2.2, 1.6, 2.7)),
            ("Jamb South", (2.001, -1.6, 0.8), (2.199, -0.7, 2.2)), ("Jamb North", (2.001, 0.7, 0.8), (2.199, 1.6, 2.2))):
        kit.box(name, low, high, plaster)
    kit.box("Bed", (-1.9, -1.4, -0.05), (-0.3, -0.2, 0.45), cloth)
    kit.box("Chest", (-1.4, 0.9, -0.05), (-0.4, 1.4, 0.8), wood)
    kit.lamp("Sun", "SUN", (6.0, 2.0, 5.0), 25.0, (1.0, 0.93, 0.82), target=(-0.2, -0.2, 0.0), angle=math.radians(0.53))
    kit.probe_volume("Probes", (-2.0, -1.5, 0.0), (2.0, 1.5, 2.6), (15, 12, 9))
    kit.camera((-1.75, 0.6, 1.75), (1.2, -0.35, 0.75), lens=16.0)


def outdoor_hdri():
    """Objects on open ground under a photographed sunset (a CC0 studio light that ships with Blender), turned by 40 degrees:
    one bright patch in the surroundings gives most of the light."""
    folder = Path(bpy.utils.system_resource("DATAFILES", path="studiolights/world"))
    content = (folder / "sunset.exr").read_bytes()
    image = bpy.data.images.new("sunset.exr", 8, 8, float_buffer=True)
    image.source, image.filepath = "FILE", "//sunset.exr"  # loading it would keep the path of whoever builds the file
    image.pack(data=content, data_len=len(content))
    kit.world_image(bpy.context.scene, image, 1.0, math.radians(40.0))
    kit.box("Ground", (-8, -8, -0.5), (8, 8, 0.0), kit.material("Sand", (0.5, 0.42, 0.32)))
    clay = kit.material("Clay", (0.65, 0.3, 0.2), shader="diffuse")
    white = kit.material("White", (0.8, 0.8, 0.8), shader="diffuse")
    bpy.ops.mesh.primitive_uv_sphere_add(segments=48, ring_count=24, radius=0.8, location=(-1.5, 0.6, 0.8))
    finish("Ball", white)
    bpy.ops.mesh.primitive_torus_add(major_segments=64, minor_segments=24, major_radius=0.9, minor_radius=0.25,
                                     location=(1.3, -0.9, 0.95), rotation=(math.radians(80), 0.2, 0.5))
    finish("Ring", clay)
    kit.box("Block", (0.7, 1.2, 0.0), (2.1, 2.4, 1.8), clay, turn=0.5)
    kit.box("Screen", (-3.0, 2.6, 0.0), (0.4, 2.75, 2.2), white)
    kit.probe_volume("Probes", (-3.5, -3.0, 0.1), (3.5, 3.5, 3.1), (5, 5, 3))
    kit.camera((-3.4, -5.4, 2.3), (0.0, 0.6, 0.8), lens=28.0)


def finish(name: str, coat: bpy.types.Material) -> None:
    """Name the object an operator has just made, shade it smooth and give it ``coat``."""
    obj = bpy.context.object
    obj.name = obj.data.name = name
    obj.data.materials.append(coat)
    obj.data.shade_smooth()
