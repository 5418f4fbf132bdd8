"""Every node set-up that is read by its sockets equals Cycles' own bake of the same material."""

import numpy as np
import pytest

bpy = pytest.importorskip("bpy", reason="needs Blender or its Python module")

from materials_testing import at_corners, cycles_bake, glowing_material, grid_object, new_principled, random_image, read_object  # noqa: E402

pytestmark = pytest.mark.blender


CLOSEST = {"interpolation": "Closest"}  # where texels are computed from texels, and agree with Cycles at texels only


def image_node(tree, image=None, **settings):
    node = tree.nodes.new("ShaderNodeTexImage")
    node.image = random_image() if image is None else image
    for name, value in settings.items():
        setattr(node, name, value)
    return node


def mapped(tree, kind, location=(0.2, -0.3, 0.1), rotation=(0.0, 0.0, 0.7), scale=(1.5, 0.6, 2.0), source=None):
    node = tree.nodes.new("ShaderNodeMapping")
    node.vector_type = kind
    for name, value in (("Location", location), ("Rotation", rotation), ("Scale", scale)):
        if node.inputs.get(name) is not None:
            node.inputs[name].default_value = value
    tree.links.new(uv_socket(tree) if source is None else source, node.inputs["Vector"])
    return node.outputs[0]


def uv_socket(tree, layer=None):
    if layer is None:
        return tree.nodes.new("ShaderNodeTexCoord").outputs["UV"]
    node = tree.nodes.new("ShaderNodeUVMap")
    node.uv_map = layer
    return node.outputs[0]


def placed_image(tree, vector, **settings):
    node = image_node(tree, **settings)
    tree.links.new(vector, node.inputs["Vector"])
    return node.outputs["Color"]


def rgb(tree, color=(0.7, 0.4, 0.2, 1.0)):
    node = tree.nodes.new("ShaderNodeRGB")
    node.outputs[0].default_value = color
    return node.outputs[0]


def mix(tree, blend, factor, a, b, data_type="RGBA", **settings):
    node = tree.nodes.new("ShaderNodeMix")
    node.data_type, node.blend_type = data_type, blend
    for name, value in settings.items():
        setattr(node, name, value)
    suffix = "Color" if data_type == "RGBA" else "Float"
    for identifier, value in (("Factor_Float", factor), (f"A_{suffix}", a), (f"B_{suffix}", b)):
        socket = next(socket for socket in node.inputs if socket.identifier == identifier)
        if isinstance(value, bpy.types.NodeSocket):
            tree.links.new(value, socket)
        else:
            socket.default_value = value
    return next(socket for socket in node.outputs if socket.identifier == f"Result_{suffix}")


def math(tree, operation, *operands, clamp=False):
    node = tree.nodes.new("ShaderNodeMath")
    node.operation, node.use_clamp = operation, clamp
    for socket, value in zip(node.inputs, operands, strict=False):
        if isinstance(value, bpy.types.NodeSocket):
            tree.links.new(value, socket)
        else:
            socket.default_value = value
    return node.outputs[0]


def unary(tree, kind, source, **inputs):
    node = tree.nodes.new(kind)
    if source is not None:
        names = [socket.name for socket in node.inputs]
        tree.links.new(source, node.inputs["Color" if "Color" in names else names[0]])
    for name, value in inputs.items():
        node.inputs[name].default_value = value
    return node


def grouped(tree):
    """A colour that comes out of two nested groups: texture × (tint of the outer group's input)."""
    inner = bpy.data.node_groups.new("inner", "ShaderNodeTree")
    inner.interface.new_socket("Tint", in_out="INPUT", socket_type="NodeSocketColor")
    inner.interface.new_socket("Result", in_out="OUTPUT", socket_type="NodeSocketColor")
    begin, end = inner.nodes.new("NodeGroupInput"), inner.nodes.new("NodeGroupOutput")
    inner.links.new(mix(inner, "MULTIPLY", 1.0, image_node(inner).outputs["Color"], begin.outputs[0]), end.inputs[0])
    outer = bpy.data.node_groups.new("outer", "ShaderNodeTree")
    outer.interface.new_socket("Tint", in_out="INPUT", socket_type="NodeSocketColor")
    outer.interface.new_socket("Result", in_out="OUTPUT", socket_type="NodeSocketColor")
    begin, end, use = outer.nodes.new("NodeGroupInput"), outer.nodes.new("NodeGroupOutput"), outer.nodes.new("ShaderNodeGroup")
    use.node_tree = inner
    outer.links.new(begin.outputs[0], use.inputs[0])
    outer.links.new(use.outputs[0], end.inputs[0])
    top = tree.nodes.new("ShaderNodeGroup")
    top.node_tree = outer
    top.inputs[0].default_value = (0.9, 0.5, 0.3, 1.0)
    return top.outputs[0]


def rerouted(tree):
    source = image_node(tree).outputs["Color"]
    for _ in range(3):
        node = tree.nodes.new("NodeReroute")
        tree.links.new(source, node.inputs[0])
        source = node.outputs[0]
    return source


def muted(tree, source=True):
    node = unary(tree, "ShaderNodeInvert", image_node(tree).outputs["Color"] if source else None)
    node.mute = True
    return node.outputs[0]


def clipped_alpha(tree):
    image = random_image(alpha=True, low=0.0, high=1.0)
    return math(tree, "SUBTRACT", 1.0, math(tree, "LESS_THAN", image_node(tree, image, **CLOSEST).outputs["Alpha"], 0.5))


def straight_alpha(tree):
    """Colour of an image whose alpha is used too (so Cycles un-premultiplies it)."""
    node = image_node(tree, random_image(alpha=True, low=0.5, high=1.0), **CLOSEST)
    return mix(tree, "ADD", math(tree, "MULTIPLY", node.outputs["Alpha"], 1e-6), node.outputs["Color"], (1.0, 1.0, 1.0, 1.0))


def separated(tree, index):
    return unary(tree, "ShaderNodeSeparateColor", image_node(tree).outputs["Color"]).outputs[index]


def blackbody(tree, kelvin):
    node = tree.nodes.new("ShaderNodeBlackbody")
    node.inputs[0].default_value = kelvin
    return node.outputs[0]


SET_UPS = {
    "rgb": rgb,
    "value": lambda tree: tree.nodes.new("ShaderNodeValue").outputs[0],
    "image": lambda tree: image_node(tree).outputs["Color"],
    "image none": lambda tree: tree.nodes.new("ShaderNodeTexImage").outputs["Color"],
    "image non-color": lambda tree: image_node(tree, non_color()).outputs["Color"],
    "image float": lambda tree: image_node(tree, random_image(float_buffer=True, high=3.0)).outputs["Color"],
    "image premultiplied": lambda tree: image_node(tree, random_image(alpha=True, low=0.5), **CLOSEST).outputs["Color"],
    "image straight": straight_alpha,
    "image alpha": lambda tree: image_node(tree, random_image(alpha=True)).outputs["Alpha"],
    "image alpha of opaque": lambda tree: image_node(tree).outputs["Alpha"],
    "image closest": lambda tree: image_node(tree, **CLOSEST).outputs["Color"],
    "uv map": lambda tree: placed_image(tree, uv_socket(tree, "Other")),
    "mapping point": lambda tree: placed_image(tree, mapped(tree, "POINT")),
    "mapping texture": lambda tree: placed_image(tree, mapped(tree, "TEXTURE")),
    "mapping vector": lambda tree: placed_image(tree, mapped(tree, "VECTOR")),
    "mapping tilted": lambda tree: placed_image(tree, mapped(tree, "POINT", rotation=(0.5, 0.3, 0.7))),
    "mapping twice": lambda tree: placed_image(
        tree, mapped(tree, "POINT", source=mapped(tree, "TEXTURE", rotation=(0.4, 0.2, 0.1)))),
    "extension extend": lambda tree: placed_image(tree, mapped(tree, "POINT"), extension="EXTEND"),
    "extension clip": lambda tree: placed_image(tree, mapped(tree, "POINT"), extension="CLIP"),
    "extension mirror": lambda tree: placed_image(tree, mapped(tree, "POINT", scale=(3, 3, 3)), extension="MIRROR"),
    "group": grouped,
    "reroute": rerouted,
    "mute": muted,
    "mute of nothing": lambda tree: mix(tree, "MULTIPLY", 1.0, muted(tree, source=False), rgb(tree)),
    "mix": lambda tree: mix(tree, "MIX", 0.3, image_node(tree).outputs["Color"], rgb(tree)),
    "mix by image": lambda tree: mix(tree, "MIX", image_node(tree, **CLOSEST).outputs["Color"],
                                     (0.9, 0.1, 0.2, 1), (0.1, 0.3, 0.8, 1)),
    "mix two images": lambda tree: mix(tree, "MIX", 0.4, image_node(tree, **CLOSEST).outputs["Color"],
                                       image_node(tree, random_image(seed=3), **CLOSEST).outputs["Color"]),
    "multiply": lambda tree: mix(tree, "MULTIPLY", 1.0, image_node(tree).outputs["Color"], rgb(tree)),
    "multiply partly": lambda tree: mix(tree, "MULTIPLY", 0.6, image_node(tree).outputs["Color"], rgb(tree)),
    "add clamped": lambda tree: mix(tree, "ADD", 0.9, image_node(tree, **CLOSEST).outputs["Color"], rgb(tree), clamp_result=True),
    "subtract": lambda tree: mix(tree, "SUBTRACT", 0.2, rgb(tree, (0.9, 0.95, 0.9, 1)), image_node(tree).outputs["Color"]),
    "mix float": lambda tree: mix(tree, "MIX", 0.3, separated(tree, 0), 0.8, data_type="FLOAT"),
    "separate green": lambda tree: separated(tree, 1),
    "luminance": lambda tree: unary(tree, "ShaderNodeRGBToBW", image_node(tree, **CLOSEST).outputs["Color"]).outputs[0],
    "to a number": lambda tree: math(tree, "MULTIPLY", image_node(tree, **CLOSEST).outputs["Color"], 0.5),
    "vector to a number": lambda tree: math(tree, "ADD", image_node(tree, extension="EXTEND").outputs["Alpha"], 0.25),
    "math affine": lambda tree: math(tree, "MULTIPLY_ADD", separated(tree, 2), 0.5, 0.3),
    "math power": lambda tree: math(tree, "POWER", 0.5, 1.7),
    "math divide": lambda tree: math(tree, "DIVIDE", separated(tree, 0), 1.6),
    "alpha clip": clipped_alpha,
    "gamma": lambda tree: unary(tree, "ShaderNodeGamma", image_node(tree, **CLOSEST).outputs["Color"], Gamma=1.8).outputs[0],
    "brightness": lambda tree: unary(tree, "ShaderNodeBrightContrast", image_node(tree, **CLOSEST).outputs["Color"],
                                     Contrast=0.3).outputs[0],
    "invert": lambda tree: unary(tree, "ShaderNodeInvert", image_node(tree).outputs["Color"]).outputs[0],
    "value of a colour": lambda tree: unary(tree, "ShaderNodeHueSaturation", image_node(tree).outputs["Color"],
                                            Value=0.6).outputs[0],
    "ramp of a constant": lambda tree: unary(tree, "ShaderNodeValToRGB", math(tree, "ADD", 0.3, 0.1)).outputs[0],
    "blackbody 1000": lambda tree: blackbody(tree, 1000.0),
    "blackbody 4000": lambda tree: blackbody(tree, 4000.0),
    "blackbody 11000": lambda tree: blackbody(tree, 11000.0),
}


def non_color():
    image = random_image()
    image.colorspace_settings.name = "Non-Color"
    return image


@pytest.mark.parametrize("name", SET_UPS)
def test_set_up_equals_cycles(empty_blend, name):
    thing = grid_object(glowing_material(SET_UPS[name]))
    (material,), mesh, _reader, loops = read_object(thing)
    assert material.extraction == "nodes"
    for channel, kind in ((material.albedo, "DIFFUSE"), (material.emission, "EMIT")):
        expected = cycles_bake(thing, kind)[loops]
        # Cycles stores premultiplied colour in bytes, rounded down; texels computed here are stored in bytes too.
        tolerance = 2e-2 if name in ("image premultiplied", "image straight") else 4e-3
        assert np.abs(at_corners(channel, mesh) - expected).max() < tolerance * max(1.0, expected.max())


@pytest.mark.parametrize("kind", ["FLOAT_COLOR", "BYTE_COLOR"])
@pytest.mark.parametrize("domain", ["POINT", "CORNER"])
@pytest.mark.parametrize("node_kind", ["ShaderNodeVertexColor", "ShaderNodeAttribute"])
def test_colour_attribute_times_texture_equals_cycles(empty_blend, kind, domain, node_kind):
    def build(tree):
        node = tree.nodes.new(node_kind)
        setattr(node, "layer_name" if node_kind == "ShaderNodeVertexColor" else "attribute_name", "paint")
        return mix(tree, "MULTIPLY", 1.0, image_node(tree).outputs["Color"], node.outputs["Color"])

    thing = grid_object(glowing_material(build))
    layer = thing.data.color_attributes.new("paint", kind, domain)
    layer.data.foreach_set("color", np.random.default_rng(5).uniform(0.0, 1.0, len(layer.data) * 4).astype(np.float32))
    (material,), mesh, reader, loops = read_object(thing)
    assert reader.attributes == {"paint"} and material.extraction == "nodes"
    assert np.abs(at_corners(material.albedo, mesh) - cycles_bake(thing, "DIFFUSE")[loops]).max() < 4e-3


def test_the_active_colour_attribute_stands_in_for_an_empty_name(empty_blend):
    thing = grid_object(glowing_material(lambda tree: tree.nodes.new("ShaderNodeVertexColor").outputs["Color"]))
    for name, color in (("first", 0.2), ("second", 0.6)):
        layer = thing.data.color_attributes.new(name, "FLOAT_COLOR", "CORNER")
        layer.data.foreach_set("color", np.full(len(layer.data) * 4, color, np.float32))
    thing.data.color_attributes.render_color_index = 1
    (material,), mesh, _reader, loops = read_object(thing)
    assert np.allclose(at_corners(material.albedo, mesh), 0.6, atol=1e-6)
    assert np.allclose(cycles_bake(thing, "DIFFUSE")[loops], 0.6, atol=1e-3)


def test_an_attribute_that_the_mesh_lacks_is_black_as_in_cycles(empty_blend):
    def build(tree):
        node = tree.nodes.new("ShaderNodeAttribute")
        node.attribute_name = "nowhere"
        return node.outputs["Color"]

    thing = grid_object(glowing_material(build))
    (material,), mesh, _reader, _loops = read_object(thing)
    assert np.all(at_corners(material.emission, mesh) == 0.0) and np.all(cycles_bake(thing, "EMIT") == 0.0)


def test_a_material_without_a_surface_is_black_and_with_only_a_volume_is_nothing(empty_blend):
    material, node = new_principled()
    material.node_tree.nodes.remove(node)
    (read,), *_ = read_object(grid_object(material))
    assert read.is_opaque and np.all(read.albedo.constant == 0.0)
    volume = material.node_tree.nodes.new("ShaderNodeVolumePrincipled")
    output = material.node_tree.get_output_node("CYCLES")
    material.node_tree.links.new(volume.outputs[0], output.inputs["Volume"])
    (read,), *_ = read_object(grid_object(material))
    assert float(read.alpha.constant[0]) == 0.0


def test_no_material_and_a_material_without_nodes(empty_blend):
    (read,), *_ = read_object(grid_object(None))
    assert np.allclose(read.base_color.constant, 0.8)
    material = bpy.data.materials.new("plain")
    if material.node_tree is not None:
        pytest.skip("materials always have nodes in this Blender")
    material.diffuse_color = (0.1, 0.5, 0.9, 1.0)
    (read,), *_ = read_object(grid_object(material))
    assert np.allclose(read.albedo.constant, (0.1, 0.5, 0.9))


def test_each_material_is_read_once_and_culling_is_carried(empty_blend):
    material, _node = new_principled()
    material.use_backface_culling = True
    thing = grid_object(material)
    thing.data.materials.append(material)
    (first, second), *_ = read_object(thing)
    assert first is second and first.backface_culling
