"""Write into a copy of a shader's nodes what one ray and one object answer them, for Cycles to evaluate.

Cycles' own bake asks every shader as a camera ray that meets its front straight on, on an object of its own: nodes that would
answer another ray or object differently are replaced by what they answer that one.
"""

import math

import bpy

from .circumstances import ANGLE, SIDE, Ray, asked_of

# Not parallel to anything that is modelled: what a tangent is made from.
_ASKEW = (0.3826834, 0.5213, 0.7627)


def answer(tree, ray: Ray, placed: tuple, made: list) -> None:
    """Replace, in ``tree`` and in copies of the groups that ask, what differs for ``ray`` and for an object with the answers
    ``placed`` (see ``Placements``). ``made`` receives (collection, datablock) of the copies, to be removed in reverse."""
    answers = dict(placed)
    for node in list(tree.nodes):
        if node.type == "GROUP" and node.node_tree is not None:
            if _asks(node.node_tree, ray, answers):
                node.node_tree = node.node_tree.copy()
                made.append((bpy.data.node_groups, node.node_tree))
                answer(node.node_tree, ray, placed, made)
            continue
        for out in node.outputs:
            targets = [link.to_socket for link in out.links]
            instead = answered(tree, out, ray, placed) if targets else out
            for target in targets if instead != out else ():
                tree.links.new(instead, target)


def answered(tree, out, ray: Ray, placed: tuple):
    """The socket, in a tree that ``answer`` has been through, that has what ``out`` answers ``ray``."""
    answers = dict(placed)
    return _Answer(tree, ray, answers).of(out.node, out) if _differs(out.node, out.identifier, ray, answers) else out


def _asks(tree, ray: Ray, answers: dict) -> bool:
    groups = [node.node_tree for node in tree.nodes if node.type == "GROUP" and node.node_tree is not None]
    return any(_asks(group, ray, answers) for group in groups) or any(
        _differs(node, out.identifier, ray, answers) for node in tree.nodes if node.type != "GROUP"
        for out in node.outputs if out.is_linked)


def _differs(node, output: str, ray: Ray, answers: dict) -> bool:
    """Whether the bake's own answer is not the one wanted."""
    if node.bl_idname == "ShaderNodeLightPath":
        return output != "Ray Length" or ray.length is not None
    asked = asked_of(node, output)
    return (any(question in answers and question[0] != "world" for question in asked) or (SIDE in asked and ray.back)
            or (ANGLE in asked and ray.cosine is not None))


class _Answer:
    """Nodes in one tree that give what a node would answer."""

    def __init__(self, tree, ray: Ray, answers: dict):
        self._tree, self._ray, self._answers = tree, ray, answers

    def of(self, node, out):
        """The socket to take instead of ``out``."""
        for question in asked_of(node, out.identifier):
            if question in self._answers and question[0] != "world":
                return self._placed(node, out.identifier, self._answers[question])
        if node.bl_idname == "ShaderNodeLightPath":
            return self._number(self._ray.light_path(out.identifier))
        if out.identifier == "Backfacing":
            return self._number(float(self._ray.back))
        if out.identifier == "Incoming":
            return self._incoming()
        if out.identifier == "Reflection":
            cosine = 1.0 if self._ray.cosine is None else self._ray.cosine
            return self._vector("SUBTRACT", self._scaled(self._normal(), 2.0 * cosine), self._incoming())
        if node.bl_idname in ("ShaderNodeLayerWeight", "ShaderNodeFresnel"):
            return self._fresnel(node, out)
        return self._scaled(out, -1.0) if out.type == "VECTOR" else out

    def _placed(self, node, output: str, values: tuple):
        if node.bl_idname == "ShaderNodeAttribute" and output in ("Fac", "Alpha"):
            return self._number(values[3] if output == "Alpha" else sum(values[:3]) / 3.0)
        if len(values) == 1:
            return self._number(values[0])
        vector = self._tree.nodes.new("ShaderNodeCombineXYZ")
        for into, value in zip(vector.inputs, values, strict=False):
            into.default_value = value
        return vector.outputs[0]

    def _number(self, value: float):
        node = self._tree.nodes.new("ShaderNodeValue")
        node.outputs[0].default_value = value
        return node.outputs[0]

    def _math(self, operation: str, first, second):
        """A Math node of two operands, each a number or a socket."""
        return self._operation("ShaderNodeMath", operation, first, second)

    def _vector(self, operation: str, first, second):
        """A Vector Math node of two operands, each a vector or a socket."""
        return self._operation("ShaderNodeVectorMath", operation, first, second)

    def _operation(self, kind: str, operation: str, *operands):
        node = self._tree.nodes.new(kind)
        node.operation = operation
        for into, operand in zip(node.inputs, operands, strict=False):
            self._feed(operand, into)
        return node.outputs[0]

    def _scaled(self, socket, factor: float):
        node = self._tree.nodes.new("ShaderNodeVectorMath")
        node.operation = "SCALE"
        self._tree.links.new(socket, node.inputs[0])
        node.inputs["Scale"].default_value = factor
        return node.outputs[0]

    def _feed(self, operand, into) -> None:
        if isinstance(operand, (float, tuple)):
            into.default_value = operand
        else:
            self._tree.links.new(operand, into)

    def _normal(self):
        """The shading normal on the side that the ray meets."""
        normal = self._tree.nodes.new("ShaderNodeNewGeometry").outputs["Normal"]
        return self._scaled(normal, -1.0) if self._ray.back else normal

    def _incoming(self):
        """The way back along the ray."""
        normal = self._normal()
        if self._ray.cosine is None:
            return normal
        tangent = self._vector("NORMALIZE", self._vector("CROSS_PRODUCT", normal, _ASKEW), (0.0, 0.0, 0.0))
        across = self._vector("CROSS_PRODUCT", normal, tangent)
        sine = math.sqrt(1.0 - self._ray.cosine**2)
        sideways = self._vector("ADD", self._scaled(tangent, sine * math.cos(self._ray.turn)),
                                self._scaled(across, sine * math.sin(self._ray.turn)))
        return self._vector("ADD", self._scaled(normal, self._ray.cosine), sideways)

    def _fresnel(self, node, out):
        """A Fresnel or Layer Weight node under another angle, or from behind, where its relative index turns round."""
        other = self._tree.nodes.new(node.bl_idname)
        source = next(into for into in node.inputs if into.name in ("IOR", "Blend"))
        into = other.inputs[source.name]
        link = next((link for link in source.links if link.is_valid and not link.is_muted), None)
        operand = source.default_value if link is None else link.from_socket
        if self._ray.back and out.identifier != "Facing":
            if source.name == "IOR":
                operand = self._math("DIVIDE", 1.0, operand)
            else:
                operand = self._math("SUBTRACT", 1.0, self._math("DIVIDE", 1.0, self._math("SUBTRACT", 1.0, operand)))
        self._feed(operand, into)
        # The bake looks along the normal: its cosine with a shortened one is what is asked for.
        normal = self._tree.nodes.new("ShaderNodeNewGeometry").outputs["Normal"]
        self._tree.links.new(self._scaled(normal, 1.0 if self._ray.cosine is None else self._ray.cosine), other.inputs["Normal"])
        return next(found for found in other.outputs if found.identifier == out.identifier)
