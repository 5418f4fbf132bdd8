"""Scenes whose air absorbs, scatters and glows."""

import math

import bpy

from . import kit

HALL = (9.0, 4.0, 5.0)  # half length, half width, height [m]


def filled(name: str, low, high, **values) -> bpy.types.Object:
    """A box from ``low`` to ``high`` filled with a Volume Coefficients medium: ``absorption``, ``scatter`` [1/m] and ``emission``
    (RGB each), ``anisotropy``; it has no surface."""
    obj = kit.box(name, low, high, kit.material(name, 0.0))
    tree = obj.data.materials[0].node_tree
    tree.nodes.clear()
    output = tree.nodes.new("ShaderNodeOutputMaterial")
    medium = tree.nodes.new("ShaderNodeVolumeCoefficients")
    medium.inputs["Absorption Coefficients"].default_value = values.get("absorption", (0, 0, 0))
    medium.inputs["Scatter Coefficients"].default_value = values.get("scatter", (0, 0, 0))
    medium.inputs["Emission Coefficients"].default_value = values.get("emission", (0, 0, 0))
    medium.inputs["Anisotropy"].default_value = values.get("anisotropy", 0.0)
    tree.links.new(medium.outputs[0], output.inputs["Volume"])
    return obj


def media_box():
    """Boxes of what has a closed form before a wall that glows: e^(−σd) of coloured glass without a surface, ε·d of a glow, and
    the sun's light scattered once, (σ_s/σ_t)·p·E·(1 − e^(−σ_t·d)), in a box of albedo ½ that is thinner than it is wide."""
    wall = kit.material("Glowing Wall", 0.0, emission=(1.0, 1.0, 1.0), strength=0.5)
    kit.mesh_object("Wall", [(-8, 3, -2), (8, 3, -2), (8, 3, 6), (-8, 3, 6)], [(0, 1, 2, 3)], wall)
    kit.box("Floor", (-4.0, -2.0, -0.2), (4.0, 2.9, 0.0), kit.material("Floor", (0.5, 0.48, 0.45)))
    filled("Absorbs", (-2.8, -0.5, 0.5), (-1.2, 0.5, 2.1), absorption=(0.4, 0.8, 1.6))
    filled("Glows", (-0.8, -0.5, 0.5), (0.8, 0.5, 2.1), emission=(0.4, 0.2, 0.05))
    filled("Scatters", (1.2, -0.5, 0.5), (2.8, 0.5, 2.1), absorption=(0.25, 0.25, 0.25), scatter=(0.25, 0.25, 0.25))
    kit.lamp("Sun", "SUN", (0.0, -2.0, 5.0), 6.0, target=(0.0, 0.0, 0.0), angle=math.radians(0.5))
    kit.probe_volume("Probes", (-3.6, -1.6, 0.1), (3.6, 2.6, 3.0), (9, 5, 4))
    kit.camera((0.0, -6.0, 1.6), (0.0, 0.0, 1.2), lens=30.0)


def fog_hall():
    """Shafts of sun through an arcade into a hall of thin haze: what is bright is the air, and it lights the far wall."""
    length, width, height = HALL
    wall, floor = kit.material("Wall", (0.6, 0.57, 0.52)), kit.material("Floor", (0.35, 0.3, 0.26))
    kit.box("Floor", (-length - 0.4, -width - 0.4, -0.3), (length + 0.4, width + 0.4, 0.0), floor)
    kit.box("Ceiling", (-length - 0.4, -width - 0.4, height), (length + 0.4, width + 0.4, height + 0.3), wall)
    kit.box("Wall North", (-length - 0.35, width, -0.1), (length + 0.35, width + 0.35, height + 0.1), wall)
    for side, x in (("West", -length - 0.35), ("East", length)):
        kit.box(f"Wall {side}", (x, -width - 0.3, -0.1), (x + 0.35, width + 0.1, height + 0.1), wall)
    # The arcade: a sill, piers, and a lintel over openings of a metre and a half.
    kit.box("Sill", (-length - 0.3, -width - 0.35, -0.05), (length + 0.3, -width, 1.2), wall)
    kit.box("Lintel", (-length - 0.3, -width - 0.35, 3.8), (length + 0.3, -width, height + 0.05), wall)
    for i in range(7):
        x = -length + 2.0 * length * i / 6.0
        kit.box(f"Pier {i + 1}", (x - 0.75, -width - 0.33, 1.1), (x + 0.75, -width - 0.02, 3.9), wall)
    for i in range(3):
        x = -6.0 + 6.0 * i
        kit.box(f"Crate {i + 1}", (x - 0.6, 0.6, -0.05), (x + 0.6, 1.8, 1.2 + 0.4 * (i % 2)), floor, turn=0.4 * i)
    filled("Haze", (-length - 0.1, -width - 0.1, -0.1), (length + 0.1, width + 0.1, height + 0.1),
           absorption=(0.003, 0.003, 0.003), scatter=(0.027, 0.027, 0.027), anisotropy=0.4)
    kit.lamp("Sun", "SUN", (-2.0, -10.0, 8.0), 12.0, (1.0, 0.93, 0.8), (0.0, 0.0, 0.0), angle=math.radians(0.5))
    kit.world(bpy.context.scene, (0.35, 0.5, 0.8), 0.6)
    # As far as the openings' depth, whose sides the sky lights.
    kit.probe_volume("Probes", (-length, -width - 0.4, 0.0), (length, width, height), (18, 9, 5))
    kit.camera((-length + 0.6, 2.9, 1.9), (2.0, -1.2, 1.7), lens=22.0)


def smoke():
    """A plume that is dense below and frayed above, with a lamp inside: it shadows itself and the floor."""
    floor = kit.material("Floor", (0.5, 0.5, 0.48))
    kit.box("Floor", (-3.0, -3.0, -0.2), (3.0, 3.0, 0.0), floor)
    kit.box("Screen", (-3.0, 2.0, -0.1), (3.0, 2.2, 3.4), kit.material("Screen", (0.35, 0.42, 0.5)))
    plume = kit.box("Smoke", (-1.0, -1.0, 0.05), (1.0, 1.0, 3.05), kit.material("Smoke", 0.0))
    tree = plume.data.materials[0].node_tree
    tree.nodes.clear()
    node, link = tree.nodes.new, tree.links.new
    output, medium = node("ShaderNodeOutputMaterial"), node("ShaderNodeVolumePrincipled")
    medium.inputs["Color"].default_value = (0.8, 0.78, 0.75, 1.0)
    medium.inputs["Anisotropy"].default_value = 0.2
    link(medium.outputs[0], output.inputs["Volume"])
    place, noise = node("ShaderNodeTexCoord"), node("ShaderNodeTexNoise")
    noise.inputs["Scale"].default_value, noise.inputs["Detail"].default_value = 2.2, 2.0
    link(place.outputs["Object"], noise.inputs["Vector"])
    parts = node("ShaderNodeSeparateXYZ")
    link(place.outputs["Object"], parts.inputs[0])

    def math_node(operation, first, second=0.0, clamp=False):
        made = node("ShaderNodeMath")
        made.operation, made.use_clamp = operation, clamp
        for socket, value in zip(made.inputs, (first, second), strict=False):
            if isinstance(value, bpy.types.NodeSocket):
                link(value, socket)
            else:
                socket.default_value = value
        return made.outputs[0]

    x, y, z = parts.outputs
    # A column that widens upwards, in the object's space (the box is 3 m high about its middle).
    away = math_node("SQRT", math_node("ADD", math_node("MULTIPLY", x, x), math_node("MULTIPLY", y, y)))
    reach = math_node("ADD", math_node("MULTIPLY", z, 0.16), 0.62)
    body = math_node("SUBTRACT", 1.0, math_node("DIVIDE", away, reach), clamp=True)
    frayed = math_node("SUBTRACT", math_node("MULTIPLY", noise.outputs[0], 2.4), 0.55, clamp=True)
    ends = math_node("MULTIPLY", math_node("SUBTRACT", 1.5, z, clamp=True), math_node("ADD", z, 1.5, clamp=True), clamp=True)
    link(math_node("MULTIPLY", math_node("MULTIPLY", math_node("MULTIPLY", body, frayed), ends), 7.0), medium.inputs["Density"])
    kit.lamp("Ember", "POINT", (0.0, 0.0, 0.7), 30.0, (1.0, 0.5, 0.2), shadow_soft_size=0.1)
    kit.lamp("Key", "AREA", (-2.4, -2.2, 3.2), 120.0, (0.9, 0.95, 1.0), (0.0, 0.0, 1.4), shape="SQUARE", size=0.8)
    kit.world(bpy.context.scene, (0.05, 0.06, 0.08))
    kit.probe_volume("Probes", (-2.0, -2.0, 0.0), (2.0, 1.9, 3.2), (7, 7, 6))
    kit.camera((0.4, -5.4, 1.9), (0.0, 0.0, 1.45), lens=32.0)
