"""Follow links and evaluate colour and value nodes as far as a ``Value`` can hold them."""

from itertools import pairwise

import bpy
import numpy as np
from mathutils import Euler

from . import fresnel
from .attributes import ACTIVE_COLOR, number_of, part_of
from .circumstances import Ray
from .images import LINEAR_SPACES, ImageCache, is_missing
from .links import by_identifier, follow
from .operations import blended, calculated, converted
from .values import Mapping, Unreadable, Value, apply

# Attributes that meshes have in Cycles without carrying them.
_STANDARD_ATTRIBUTES = {"generated", "N", "Pn", "uv", "tangent", "pointiness", "random_per_island"}
_MAXIMUM_DEPTH = 100


class NodeReader:
    """Evaluates the sockets of one material, as they answer one ``ray`` on one object.

    A ``path`` is the tuple of group nodes one is inside of. ``images`` is shared by all materials; ``attributes`` collects the
    names of the mesh attributes that values refer to; ``placed`` are the object's answers (see ``Placements``).
    """

    def __init__(self, images: ImageCache, attributes: set[str], ray: Ray | None = None, placed: tuple = ()):
        self._images = images
        self._attributes = attributes
        self.ray, self._placed = ray or Ray(), dict(placed)
        self._values: dict[tuple, Value] = {}
        self._depth = 0

    def value(self, socket, path: tuple) -> Value:
        """What an input socket receives: a number (three equal components) for value sockets, else a colour or vector."""
        (found, where), types = follow(socket, path)
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
        (out, where), _types = follow(socket, path)
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
        if self._images.is_for_cycles(image):
            raise Unreadable(name, f"image '{image.name}', which Cycles reads otherwise than Blender")
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
        return self._attribute(part_of(node.layer_name or ACTIVE_COLOR, out.identifier))

    def _any_attribute(self, node, out, _path) -> Value:
        name = node.attribute_name
        if node.attribute_type != "GEOMETRY":
            rgba = np.array(self._placement(node, ("attribute", node.attribute_type, name)), np.float32)
            return Value.of(number_of(rgba, out.identifier)[:3])
        if name in _STANDARD_ATTRIBUTES:
            raise Unreadable(node.label or node.name, f"attribute '{name}'")
        return self._attribute(part_of(name, out.identifier))

    def _placement(self, node, question: tuple) -> tuple:
        """What the object answers. Raises Unreadable where no object is known."""
        if question not in self._placed:
            raise Unreadable(node.label or node.name, f"{node.bl_label} node")
        return self._placed[question]

    def _object_info(self, node, out, _path) -> Value:
        answer = self._placement(node, ("object", out.identifier))
        return Value.of(answer[0] if len(answer) == 1 else answer)

    def _particle_info(self, node, out, _path) -> Value:
        answer = self._placement(node, ("particle", out.identifier))
        return Value.of(answer[0] if len(answer) == 1 else answer[:3])

    def _geometry(self, node, out, _path) -> Value:
        if out.identifier == "Backfacing":
            return Value.of(float(self.ray.back))
        raise Unreadable(node.label or node.name, f"{out.identifier} of a {node.bl_label} node")

    def _layer_weight(self, node, out, path) -> Value:
        blend = self.value(node.inputs["Blend"], path)
        if out.identifier == "Facing":
            return apply(lambda b: fresnel.facing(b, self._cosine), blend)
        return apply(lambda b: fresnel.layer_weight(b, self._cosine, self.ray.back), blend)

    def _fresnel(self, node, _out, path) -> Value:
        return apply(lambda ior: fresnel.dielectric_seen(ior, self._cosine, self.ray.back), self.value(node.inputs["IOR"], path))

    @property
    def _cosine(self) -> float:
        return 1.0 if self.ray.cosine is None else self.ray.cosine

    def _mix(self, node, _out, path) -> Value:
        suffix = {"FLOAT": "Float", "VECTOR": "Vector", "RGBA": "Color"}.get(node.data_type)
        if suffix is None or (node.data_type == "VECTOR" and node.factor_mode != "UNIFORM"):
            raise Unreadable(node.label or node.name, f"mix of {node.data_type.lower()}")
        factor, a, b = (self.value(by_identifier(node.inputs, identifier), path)
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
    "ShaderNodeObjectInfo": NodeReader._object_info,
    "ShaderNodeParticleInfo": NodeReader._particle_info,
    "ShaderNodeLightPath": lambda self, node, out, path: Value.of(self.ray.light_path(out.identifier)),
    "ShaderNodeNewGeometry": NodeReader._geometry,
    "ShaderNodeLayerWeight": NodeReader._layer_weight,
    "ShaderNodeFresnel": NodeReader._fresnel,
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
