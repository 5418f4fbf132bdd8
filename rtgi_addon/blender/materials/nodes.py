"""Follow links and evaluate colour and value nodes as far as a ``Value`` can hold them."""

import math
from itertools import pairwise

import bpy
import numpy as np
from mathutils import Euler

from .images import LINEAR_SPACES, ImageCache, is_missing
from .values import Mapping, Unreadable, Value, apply

# The name under which a mesh carries whichever colour attribute is active for render.
ACTIVE_COLOR = "_rtgi_active_color"
_MAXIMUM_DEPTH = 100


class NodeReader:
    """Evaluates the sockets of one material.

    A ``path`` is the tuple of group nodes one is inside of. ``images`` is shared by all materials; ``attributes`` collects the
    names of the mesh attributes that values refer to.
    """

    def __init__(self, images: ImageCache, attributes: set[str]):
        self._images = images
        self._attributes = attributes
        self._values: dict[tuple, Value] = {}
        self._depth = 0

    def value(self, socket, path: tuple) -> Value:
        """What an input socket receives: a number (three equal components) for value sockets, else a colour or vector."""
        (found, where), types = self.follow(socket, path)
        value = self._remembered(found, where) if found.is_output else default_value(found)
        for before, after in pairwise(types):
            value = converted(value, before, after)
        return value

    def _remembered(self, out, path: tuple) -> Value:
        """``output``, evaluated once however many sockets it feeds."""
        key = (out.node.as_pointer(), out.identifier, tuple(node.as_pointer() for node in path))
        if key not in self._values:
            if self._depth == _MAXIMUM_DEPTH:
                raise Unreadable(out.node.label or out.node.name, f"more than {_MAXIMUM_DEPTH} nodes in a row")
            self._depth += 1
            try:
                self._values[key] = self.output(out, path)
            finally:
                self._depth -= 1
        return self._values[key]

    def follow(self, socket, path: tuple):
        """((socket, path), types): the output that feeds an input, or the unlinked input whose default counts, seen through
        reroutes, muted nodes and groups. ``types`` are the socket types passed on the way, from the source to the input."""
        types = [socket.type]
        while True:
            link = next((link for link in socket.links if link.is_valid and not link.is_muted), None)
            if link is None:
                return (socket, path), types[::-1]
            out, node = link.from_socket, link.from_node
            types.append(out.type)
            if node.mute:
                inside = next((inner.from_socket for inner in node.internal_links if inner.to_socket == out), None)
                # From 5.0 a muted node that nothing enters counts as no link: the input keeps its own value.
                if inside is None or not (inside.is_linked or bpy.app.version < (5, 0)):
                    return (socket, path), types[-2::-1]
                socket = inside
            elif node.bl_idname == "NodeReroute":
                socket = node.inputs[0]
            elif node.bl_idname == "ShaderNodeGroup":
                end = _group_output(node.node_tree)
                socket = _Nothing(out.type) if end is None else _by_identifier(end.inputs, out.identifier)
                path = (*path, node)
            elif node.bl_idname == "NodeGroupInput" and path:
                socket, path = _by_identifier(path[-1].inputs, out.identifier), path[:-1]
            else:
                return (out, path), types[::-1]
            types.append(socket.type)

    def output(self, out, path: tuple) -> Value:
        """The value of a node's output. Raises Unreadable for nodes outside the supported set."""
        node = out.node
        reader = _READERS.get(node.bl_idname)
        if reader is None:
            raise Unreadable(node.label or node.name, f"{node.bl_label} node")
        return reader(self, node, out, path)

    def mapping(self, socket, path: tuple) -> Mapping:
        """Where a texture's Vector input reads: a UV map under an affine map."""
        uv_layer, matrix = self._coordinates(socket, path)
        if np.allclose(matrix[:2], np.eye(3)[:2], atol=1e-7):
            return Mapping(uv_layer)
        return Mapping(uv_layer, tuple(float(x) for x in matrix[:2].ravel()))

    def _coordinates(self, socket, path: tuple) -> tuple[str | None, np.ndarray]:
        """(uv map, (3, 3)): coordinates x, y, z as an affine function of (u, v, 1)."""
        (out, where), _types = self.follow(socket, path)
        identity = np.array([[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 0.0]])
        if not out.is_output:
            if getattr(out.node, "bl_idname", "") == "ShaderNodeTexImage":
                return None, identity
            raise Unreadable("texture coordinate", "not a UV map")
        node = out.node
        kind = node.bl_idname
        if kind == "ShaderNodeUVMap" and not node.from_instancer:
            return node.uv_map or None, identity
        if kind == "ShaderNodeTexCoord" and out.name == "UV" and not node.from_instancer:
            return None, identity
        if kind == "ShaderNodeMapping":
            uv_layer, before = self._coordinates(node.inputs["Vector"], where)
            location, rotation, scale = (self._mapping_input(node, name, where) for name in ("Location", "Rotation", "Scale"))
            return uv_layer, _mapping_matrix(location, rotation, scale, node.vector_type, before)
        raise Unreadable(node.label or node.name, f"{out.name} of a {node.bl_label} node as texture coordinate")

    def _mapping_input(self, node, name: str, path: tuple) -> np.ndarray:
        socket = node.inputs.get(name)
        if socket is None or not socket.enabled:
            return np.zeros(3)
        value = self.value(socket, path)
        if not value.is_constant:
            raise Unreadable(node.label or node.name, f"{name} that varies over the surface")
        return value.constant.astype(np.float64)

    def _image(self, node, out, path) -> Value:
        image = node.image
        if image is None:
            return Value.of((1.0, 0.0, 1.0) if out.name == "Color" else 1.0)
        name = node.label or node.name
        if image.source not in ("FILE", "GENERATED"):
            raise Unreadable(name, f"{image.source.lower()} image '{image.name}'")
        if node.projection != "FLAT":
            raise Unreadable(name, f"{node.projection.lower()} projection")
        space = image.colorspace_settings
        if not is_missing(image) and not (image.is_float or space.is_data or space.name == "sRGB" or space.name in LINEAR_SPACES):
            raise Unreadable(name, f"image '{image.name}' in colour space {space.name}")
        interpolation = "Closest" if node.interpolation == "Closest" else "Linear"
        texture = self._images.texture(image, node.extension, interpolation, node.outputs["Alpha"].is_linked)
        mapping = self.mapping(node.inputs["Vector"], path)
        if out.name == "Color":
            return Value(np.ones(3, np.float32), texture, mapping=mapping)
        if texture.pixels.shape[2] < 4 and texture.extension != "CLIP":
            return Value.of(1.0)
        if texture.pixels.shape[2] < 4:
            raise Unreadable(name, "alpha of an opaque image that is clipped")
        return Value(np.ones(3, np.float32), texture, "a", mapping)

    def _attribute(self, name: str) -> Value:
        self._attributes.add(name)
        return Value(np.ones(3, np.float32), attribute=name)

    def _color_attribute(self, node, out, _path) -> Value:
        if out.name != "Color":
            raise Unreadable(node.label or node.name, "alpha of a colour attribute")
        return self._attribute(node.layer_name or ACTIVE_COLOR)

    def _any_attribute(self, node, out, _path) -> Value:
        if node.attribute_type != "GEOMETRY" or out.name == "Alpha":
            raise Unreadable(node.label or node.name, f"{out.name} of a {node.attribute_type.lower()} attribute")
        value = self._attribute(node.attribute_name)
        return value if out.name != "Fac" else value.luminance()

    def _mix(self, node, _out, path) -> Value:
        suffix = {"FLOAT": "Float", "VECTOR": "Vector", "RGBA": "Color"}.get(node.data_type)
        if suffix is None or (node.data_type == "VECTOR" and node.factor_mode != "UNIFORM"):
            raise Unreadable(node.label or node.name, f"mix of {node.data_type.lower()}")
        factor, a, b = (self.value(_by_identifier(node.inputs, identifier), path)
                        for identifier in ("Factor_Float", f"A_{suffix}", f"B_{suffix}"))
        blend = node.blend_type if node.data_type == "RGBA" else "MIX"
        result = blended(node, blend, factor.clamped() if node.clamp_factor else factor, a, b)
        return result.clamped() if node.data_type == "RGBA" and node.clamp_result else result

    def _mix_rgb(self, node, _out, path) -> Value:
        factor, a, b = (self.value(node.inputs[name], path) for name in ("Fac", "Color1", "Color2"))
        result = blended(node, node.blend_type, factor.clamped(), a, b)
        return result.clamped() if node.use_clamp else result

    def _math(self, node, _out, path) -> Value:
        operands = [self.value(socket, path) for socket in node.inputs if socket.enabled]
        result = calculated(node, operands)
        return result.clamped() if node.use_clamp else result

    def _clamp(self, node, _out, path) -> Value:
        value, low, high = (self.value(node.inputs[name], path) for name in ("Value", "Min", "Max"))
        if node.clamp_type != "MINMAX" or not (low.is_constant and high.is_constant):
            raise Unreadable(node.label or node.name, "clamp to a range")
        return value.clamped(float(low.constant[0]), float(high.constant[0]))

    def _separate(self, node, out, path) -> Value:
        if getattr(node, "mode", "RGB") != "RGB":
            raise Unreadable(node.label or node.name, f"separate {node.mode}")
        return self.value(node.inputs[0], path).component([socket.name for socket in node.outputs].index(out.name))

    def _combine(self, node, _out, path) -> Value:
        if getattr(node, "mode", "RGB") != "RGB":
            raise Unreadable(node.label or node.name, f"combine {node.mode}")
        parts = [self.value(socket, path) for socket in node.inputs]
        return parts[0] * Value.of((1, 0, 0)) + parts[1] * Value.of((0, 1, 0)) + parts[2] * Value.of((0, 0, 1))

    def _gamma(self, node, _out, path) -> Value:
        color, exponent = (self.value(node.inputs[name], path) for name in ("Color", "Gamma"))
        if exponent.equals(1.0):
            return color
        return apply(lambda x, g: np.where(x > 0, np.maximum(x, 0) ** g, x), color, exponent)

    def _bright_contrast(self, node, _out, path) -> Value:
        color, bright, contrast = (self.value(node.inputs[name], path) for name in ("Color", "Bright", "Contrast"))
        if bright.equals(0.0) and contrast.equals(0.0):
            return color
        return apply(lambda x, b, c: np.maximum((1 + c) * x + b - 0.5 * c, 0), color, bright, contrast)

    def _invert(self, node, _out, path) -> Value:
        factor, color = (self.value(node.inputs[index], path) for index in (0, 1))
        return color + (1.0 - color * 2.0) * factor

    def _hue_saturation(self, node, _out, path) -> Value:
        hue, saturation, value, factor, color = (self.value(node.inputs[name], path)
                                                 for name in ("Hue", "Saturation", "Value", node.inputs[3].name, "Color"))
        if factor.equals(0.0) or (hue.equals(0.5) and saturation.equals(1.0) and value.equals(1.0)):
            return color
        if hue.equals(0.5) and saturation.equals(1.0):
            return blended(node, "MIX", factor, color, color * value)
        raise Unreadable(node.label or node.name, "change of hue or saturation")

    def _ramp(self, node, out, path) -> Value:
        factor = self.value(node.inputs[0], path)
        if not factor.is_constant:
            raise Unreadable(node.label or node.name, "colour ramp of something that varies")
        color = node.color_ramp.evaluate(float(factor.constant[0]))
        return Value.of(color[:3] if out.name == "Color" else color[3])

    def _blackbody(self, node, _out, path) -> Value:
        temperature = self.value(node.inputs[0], path)
        lamp = bpy.types.Light.bl_rna.properties["temperature"]
        kelvin = float(temperature.constant[0])
        if not temperature.is_constant or not lamp.hard_min <= kelvin <= lamp.hard_max:
            raise Unreadable(node.label or node.name, "blackbody that varies or lies outside the range of lamps")
        return Value.of(blackbody_color(kelvin))


def blackbody_color(kelvin: float) -> np.ndarray:
    """(3,) scene-linear colour of a temperature, by Blender's own table (the one behind a lamp's temperature)."""
    lamp = bpy.data.lights.new("rtgi blackbody", "POINT")
    try:
        lamp.use_temperature, lamp.temperature = True, kelvin
        return np.array(lamp.temperature_color, np.float32)
    finally:
        bpy.data.lights.remove(lamp)


def default_value(socket) -> Value:
    """The value of a socket that nothing feeds."""
    value = getattr(socket, "default_value", 0.0)
    return Value.of(value if isinstance(value, (int, float)) else tuple(value)[:3])


def converted(value: Value, before: str, after: str) -> Value:
    """Blender's implicit conversion between socket types."""
    scalar = ("VALUE", "INT", "BOOLEAN")
    if after in scalar and before == "RGBA":
        return value.luminance()
    if after in scalar and before == "VECTOR":
        return apply(lambda x: np.broadcast_to(x.mean(axis=-1, keepdims=True), x.shape), value)
    return value


def blended(node, blend: str, factor: Value, a: Value, b: Value) -> Value:
    """Mix by a factor; MIX, MULTIPLY, ADD and SUBTRACT."""
    if factor.equals(0.0):
        return a
    if blend == "MIX":
        if a.is_constant and b.is_constant:
            return a + (b - a) * factor
        return a * (1.0 - factor) + b * factor
    if blend == "MULTIPLY":
        return a * b if factor.equals(1.0) else a * (1.0 - factor + b * factor)
    if blend == "ADD":
        return a + b * factor
    if blend == "SUBTRACT":
        return a - b * factor
    raise Unreadable(node.label or node.name, f"blend mode {blend.lower()}")


def calculated(node, operands: list[Value]) -> Value:
    """A Math node."""
    operation = node.operation
    a, b = operands[0], operands[1] if len(operands) > 1 else Value.of(0.0)
    if operation == "ADD":
        return a + b
    if operation == "SUBTRACT":
        return a - b
    if operation == "MULTIPLY":
        return a * b
    if operation == "MULTIPLY_ADD":
        return a * b + operands[2]
    if operation == "DIVIDE" and b.is_constant:
        return a * (1.0 / float(b.constant[0]) if b.constant[0] else 0.0)
    if operation in ("GREATER_THAN", "LESS_THAN") and (a.is_constant or b.is_constant):
        above = (operation == "GREATER_THAN") == b.is_constant
        value, threshold = (a, b) if b.is_constant else (b, a)
        return value.greater_than(float(threshold.constant[0]), above)
    if operation == "ROUND" and a.texture is not None and a.texture.pixels.dtype == np.uint8 and a.clamped() is a:
        return a.greater_than(math.nextafter(0.5, 0.0))
    function = _MATH.get(operation)
    if function is None:
        raise Unreadable(node.label or node.name, f"{operation.lower().replace('_', ' ')} of values")
    return apply(function, *operands)


def quotient(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """a / b, 0 where b is 0, as the Divide node."""
    a, b = np.broadcast_arrays(a, b)
    return np.divide(a, b, out=np.zeros(a.shape, np.float32), where=b != 0)


_MATH = {
    "DIVIDE": quotient,
    "GREATER_THAN": lambda a, b: (a > b).astype(np.float32),
    "LESS_THAN": lambda a, b: (a < b).astype(np.float32),
    "POWER": lambda a, b: np.where((a >= 0) | (b == np.rint(b)), np.power(np.maximum(a, 0), b), 0),
    "SQRT": lambda a: np.sqrt(np.maximum(a, 0)),
    "ABSOLUTE": np.abs,
    "MINIMUM": np.minimum,
    "MAXIMUM": np.maximum,
    "ROUND": lambda a: np.floor(a + 0.5),
    "FLOOR": np.floor,
    "CEIL": np.ceil,
}


class _Nothing:
    """Stands for the input of a muted or empty node that lets nothing through."""

    is_output = False
    default_value = 0.0
    links = ()
    node = None

    def __init__(self, kind: str):
        self.type = kind


def _group_output(tree):
    """The active output node of a group's tree, or None."""
    nodes = () if tree is None else tree.nodes
    return next((node for node in nodes if node.bl_idname == "NodeGroupOutput" and node.is_active_output), None)


def _by_identifier(sockets, identifier: str):
    return next(socket for socket in sockets if socket.identifier == identifier)


def _mapping_matrix(location, rotation, scale, kind: str, before: np.ndarray) -> np.ndarray:
    """(3, 3): a Mapping node after the coordinates ``before``."""
    turn = np.array(Euler(rotation, "XYZ").to_matrix())
    shift = np.zeros((3, 3))
    shift[:, 2] = location
    if kind == "POINT":
        return turn @ np.diag(scale) @ before + shift
    if kind == "TEXTURE":
        inverse = np.divide(1.0, scale, out=np.zeros(3), where=scale != 0)
        return np.diag(inverse) @ turn.T @ (before - shift)
    if kind == "VECTOR":
        return turn @ np.diag(scale) @ before
    raise Unreadable("Mapping", f"{kind.lower()} mapping of texture coordinates")


_READERS = {
    "ShaderNodeTexImage": NodeReader._image,
    "ShaderNodeVertexColor": NodeReader._color_attribute,
    "ShaderNodeAttribute": NodeReader._any_attribute,
    "ShaderNodeRGB": lambda self, node, out, path: default_value(out),
    "ShaderNodeValue": lambda self, node, out, path: default_value(out),
    "ShaderNodeMix": NodeReader._mix,
    "ShaderNodeMixRGB": NodeReader._mix_rgb,
    "ShaderNodeMath": NodeReader._math,
    "ShaderNodeClamp": NodeReader._clamp,
    "ShaderNodeSeparateColor": NodeReader._separate,
    "ShaderNodeSeparateRGB": NodeReader._separate,
    "ShaderNodeSeparateXYZ": NodeReader._separate,
    "ShaderNodeCombineColor": NodeReader._combine,
    "ShaderNodeCombineRGB": NodeReader._combine,
    "ShaderNodeCombineXYZ": NodeReader._combine,
    "ShaderNodeRGBToBW": lambda self, node, out, path: self.value(node.inputs[0], path).luminance(),
    "ShaderNodeGamma": NodeReader._gamma,
    "ShaderNodeBrightContrast": NodeReader._bright_contrast,
    "ShaderNodeInvert": NodeReader._invert,
    "ShaderNodeHueSaturation": NodeReader._hue_saturation,
    "ShaderNodeValToRGB": NodeReader._ramp,
    "ShaderNodeBlackbody": NodeReader._blackbody,
}
