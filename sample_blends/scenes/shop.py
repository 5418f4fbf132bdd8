"""A place whose lights are switched: what radiance transfer, relighting and light groups are tried on."""

import math

import bpy

from . import kit

# The custom property by which objects, materials and collections name their light group.
GROUP = "rtgi_light_group"


def evening_shop():
    """A shop open to the street at dusk: ceiling lamps, a neon sign and a shelf's light, each in a light group of its own, a low
    sun and a sky."""
    plaster = kit.material("Plaster", (0.72, 0.7, 0.66))
    tiles = kit.material("Tiles", (0.5, 0.48, 0.45))
    wood = kit.material("Wood", (0.4, 0.24, 0.12))
    teal = kit.material("Teal", (0.1, 0.4, 0.42))
    neon = kit.material("Neon", 0.2, emission=(1.0, 0.12, 0.35), strength=12.0)
    glow = kit.material("Glow", 0.5, emission=(0.6, 1.0, 0.75), strength=5.0)
    neon[GROUP], glow[GROUP] = "Neon", "Shelf"
    kit.world(bpy.context.scene, (0.25, 0.38, 0.75), 0.6)
    kit.box("Street", (-6.0, -7.0, -0.2), (6.0, 4.2, 0.0), tiles)
    for name, low, high, coat in (
            ("Wall West", (-3.2, 0.0, -0.1), (-3.0, 4.2, 3.1), plaster), ("Wall East", (3.0, 0.0, -0.1), (3.2, 4.2, 3.1), teal),
            ("Wall North", (-3.1, 4.0, -0.1), (3.1, 4.2, 3.1), plaster), ("Roof", (-3.2, -0.6, 3.0), (3.2, 4.2, 3.2), plaster),
            ("Counter", (-0.6, 1.6, -0.05), (2.2, 2.3, 1.0), wood), ("Shelf", (-2.95, 1.0, 0.9), (-2.5, 3.4, 1.0), wood),
            ("Cabinet", (-2.95, 1.0, -0.05), (-2.5, 3.4, 0.25), wood)):
        kit.box(name, low, high, coat)
    kit.box("Sign", (-1.2, -0.66, 2.45), (1.2, -0.6, 2.75), neon)
    kit.box("Light Strip", (-2.9, 1.1, 0.84), (-2.6, 3.3, 0.88), glow)
    lamps = bpy.data.collections.new("Ceiling Lamps")
    lamps[GROUP] = "Lamps"
    bpy.context.scene.collection.children.link(lamps)
    for number, x in enumerate((-1.5, 1.5)):
        obj = kit.lamp(f"Ceiling Lamp {number + 1}", "AREA", (x, 2.2, 2.9), 45.0, (1.0, 0.82, 0.6), target=(x, 2.2, 0.0), size=0.6)
        bpy.context.scene.collection.objects.unlink(obj)
        lamps.objects.link(obj)
    kit.lamp("Sun", "SUN", (-6.0, -8.0, 3.0), 2.5, (1.0, 0.7, 0.42), target=(0.0, 0.5, 0.0), angle=math.radians(0.53))
    kit.probe_volume("Probes", (-3.0, -2.4, 0.0), (3.0, 4.0, 3.0), (9, 10, 5))
    kit.camera((2.3, -4.6, 1.9), (-0.4, 1.8, 1.1), lens=24.0)
