"""What a lamp's shader nodes multiply its power by, where that is a constant: read without Cycles.

Maths, colours, groups, mixed and added shaders are read as those of materials are (`materials`). What differs over directions,
places or distances, and nodes that are not known here, `lamp_tables` has Cycles evaluate.
"""

import numpy as np

from ..materials.circumstances import Ray
from ..materials.images import ImageCache
from ..materials.links import by_identifier, follow, nodes_of
from ..materials.nodes import NodeReader
from ..materials.shaders import ShaderReader, Surface
from ..materials.values import Unreadable, Value

# Who asks a lamp: a surface that a probe sees.
ASKING = Ray("light")


def node_factor(lamp) -> np.ndarray | None:
    """Factor (3,) on the lamp's power from its node tree; None where that is no constant as far as it can be told here."""
    tree = nodes_of(lamp)
    if tree is None:
        return np.ones(3)
    output = tree.get_output_node("CYCLES")
    if output is None:
        return np.zeros(3)
    try:
        surface = _LampShader(_LampNodes(ImageCache([], lambda image: None), set(), ASKING)).shader(output.inputs["Surface"], ())
        emission = surface.emission * surface.alpha
    except Unreadable:
        return None
    return emission.constant.astype(np.float64) if emission.is_constant else None


class _LampShader(ShaderReader):
    """The closures of a lamp, of which only emission counts."""

    def shader(self, socket, path: tuple) -> Surface:
        """See ShaderReader."""
        (out, where), _types = follow(socket, path)
        if out.is_output and out.node.bl_idname not in _CLOSURES:
            self.unknown(out, where)
        return super().shader(socket, path)


class _LampNodes(NodeReader):
    """The nodes of a lamp, which has no surface."""

    def output(self, out, path: tuple) -> Value:
        """See NodeReader."""
        node = out.node
        if node.bl_idname == "ShaderNodeLightFalloff" and out.identifier == "Quadratic":
            if self.value(by_identifier(node.inputs, "Smooth"), path).equals(0.0):
                return self.value(by_identifier(node.inputs, "Strength"), path)
        elif node.bl_idname in _DIFFERS or (node.bl_idname == "ShaderNodeLightPath" and out.identifier == "Ray Length"):
            raise Unreadable(node.label or node.name, f"{node.bl_label} node")
        return super().output(out, path)


_CLOSURES = {"ShaderNodeEmission", "ShaderNodeMixShader", "ShaderNodeAddShader", "ShaderNodeBsdfTransparent"}
# What has another meaning on a lamp than on a surface.
_DIFFERS = {"ShaderNodeNewGeometry", "ShaderNodeLayerWeight", "ShaderNodeFresnel", "ShaderNodeVertexColor", "ShaderNodeAttribute",
            "ShaderNodeTexImage"}
