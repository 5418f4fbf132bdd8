"""What a lamp's shader nodes multiply its power by."""

import bpy
import numpy as np

from .sockets import source_of

NOT_READ = "its nodes are not a plain Emission, so they are not read and it shines with its colour and power alone"


def node_factor(lamp) -> tuple[np.ndarray, str | None]:
    """Factor (3,) on the lamp's power from its node tree, and a note where the nodes cannot be read (factor 1 then).

    Read exactly: no nodes, or an Emission with a constant or Blackbody colour and a constant strength (also through Light
    Falloff's quadratic output, reroutes, Value and RGB nodes).
    """
    one = np.ones(3)
    # From 5.1 lamps always have nodes and asking for the flag warns that it will go.
    if lamp.node_tree is None or (bpy.app.version < (5, 1, 0) and not lamp.use_nodes):
        return one, None
    output = lamp.node_tree.get_output_node("CYCLES")
    if output is None:
        return np.zeros(3), None
    source = source_of(output.inputs["Surface"])
    if source is None:
        return np.zeros(3), None
    node = source.node
    if node.type != "EMISSION" or node.mute:
        return one, NOT_READ
    color, strength = _color(node.inputs["Color"]), _strength(node.inputs["Strength"])
    if color is None or strength is None:
        return one, NOT_READ
    return color * strength, None


def _color(socket):
    source = source_of(socket)
    if source is None:
        return np.array(socket.default_value[:3])
    if source.node.type == "RGB":
        return np.array(source.default_value[:3])
    if source.node.type == "VALUE":
        return np.full(3, source.default_value)
    if source.node.type == "BLACKBODY" and not source.node.inputs["Temperature"].is_linked:
        return blackbody(source.node.inputs["Temperature"].default_value)
    return None


def _strength(socket):
    source = source_of(socket)
    if source is None:
        return float(socket.default_value)
    if source.node.type == "VALUE":
        return float(source.default_value)
    if source.node.type == "LIGHT_FALLOFF" and source.name == "Quadratic":
        inputs = source.node.inputs
        if not inputs["Strength"].is_linked and not inputs["Smooth"].is_linked and inputs["Smooth"].default_value == 0.0:
            return float(inputs["Strength"].default_value)
    return None


def blackbody(kelvin: float) -> np.ndarray:
    """Scene-linear colour (3,) of Blender's Blackbody node, which is also that of a lamp's own temperature."""
    probe = bpy.data.lights.new("rtgi blackbody", "POINT")
    try:
        probe.use_temperature = True
        probe.temperature = kelvin
        return np.array(probe.temperature_color)
    finally:
        bpy.data.lights.remove(probe)
