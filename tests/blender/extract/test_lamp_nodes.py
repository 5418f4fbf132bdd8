"""Nodes of lamps that are a constant are read without Cycles, as Cycles has them."""

import numpy as np
import pytest

bpy = pytest.importorskip("bpy", reason="needs Blender or its Python module")

from rtgi_addon.blender.extract.lamp_nodes import node_factor  # noqa: E402


@pytest.fixture
def tree(empty_blend):
    """(data, nodes, links, emission) of a point lamp whose Emission is all there is."""
    data = bpy.data.lights.new("lamp", "POINT")
    if bpy.app.version < (5, 1, 0):
        data.use_nodes = True
    nodes, links = data.node_tree.nodes, data.node_tree.links
    nodes.clear()
    emission, output = nodes.new("ShaderNodeEmission"), nodes.new("ShaderNodeOutputLight")
    emission.inputs["Color"].default_value, emission.inputs["Strength"].default_value = (1.0, 1.0, 1.0, 1.0), 1.0
    links.new(emission.outputs[0], output.inputs["Surface"])
    return data, nodes, links, emission


def test_maths(tree):
    data, nodes, links, emission = tree
    maths = nodes.new("ShaderNodeMath")
    maths.operation = "MULTIPLY"
    maths.inputs[0].default_value, maths.inputs[1].default_value = 0.25, 2.0
    links.new(maths.outputs[0], emission.inputs["Strength"])
    np.testing.assert_allclose(node_factor(data), 0.5)


def test_a_colour_from_a_group(tree):
    data, nodes, links, emission = tree
    group = bpy.data.node_groups.new("group", "ShaderNodeTree")
    group.interface.new_socket("colour", in_out="OUTPUT", socket_type="NodeSocketColor")
    rgb, end = group.nodes.new("ShaderNodeRGB"), group.nodes.new("NodeGroupOutput")
    rgb.outputs[0].default_value = (1.0, 0.2, 0.05, 1.0)
    group.links.new(rgb.outputs[0], end.inputs[0])
    node = nodes.new("ShaderNodeGroup")
    node.node_tree = group
    links.new(node.outputs[0], emission.inputs["Color"])
    np.testing.assert_allclose(node_factor(data), [1.0, 0.2, 0.05], rtol=1e-6)


def test_mixed_and_added_shaders(tree):
    data, nodes, links, emission = tree
    emission.inputs["Strength"].default_value = 3.0
    mix, add, red = (nodes.new(name) for name in ("ShaderNodeMixShader", "ShaderNodeAddShader", "ShaderNodeEmission"))
    red.inputs["Color"].default_value, red.inputs["Strength"].default_value = (1.0, 0.0, 0.0, 1.0), 2.0
    mix.inputs[0].default_value = 0.25
    links.new(emission.outputs[0], mix.inputs[1])
    links.new(red.outputs[0], mix.inputs[2])
    links.new(mix.outputs[0], add.inputs[0])
    links.new(red.outputs[0], add.inputs[1])
    links.new(add.outputs[0], next(node for node in nodes if node.type == "OUTPUT_LIGHT").inputs["Surface"])
    np.testing.assert_allclose(node_factor(data), [0.75 * 3.0 + 0.25 * 2.0 + 2.0, 2.25, 2.25])


def test_light_falloff_is_plain_only_where_it_is(tree):
    data, nodes, links, emission = tree
    falloff = nodes.new("ShaderNodeLightFalloff")
    falloff.inputs["Strength"].default_value = 0.5
    links.new(falloff.outputs["Quadratic"], emission.inputs["Strength"])
    np.testing.assert_allclose(node_factor(data), 0.5)
    falloff.inputs["Smooth"].default_value = 1.0
    assert node_factor(data) is None
    falloff.inputs["Smooth"].default_value = 0.0
    links.new(falloff.outputs["Constant"], emission.inputs["Strength"])
    assert node_factor(data) is None


def test_light_path_answers_as_a_lamp_is_asked(tree):
    data, nodes, links, emission = tree
    path = nodes.new("ShaderNodeLightPath")
    links.new(path.outputs["Is Camera Ray"], emission.inputs["Strength"])
    np.testing.assert_allclose(node_factor(data), 0.0)
    links.new(path.outputs["Ray Length"], emission.inputs["Strength"])
    assert node_factor(data) is None


@pytest.mark.parametrize("kind", ["ShaderNodeTexNoise", "ShaderNodeTexIES", "ShaderNodeTexImage", "ShaderNodeNewGeometry",
                                  "ShaderNodeObjectInfo", "ShaderNodeVertexColor"])
def test_what_varies_is_no_constant(tree, kind):
    data, nodes, links, emission = tree
    links.new(nodes.new(kind).outputs[0], emission.inputs["Color"])
    assert node_factor(data) is None


def test_no_output_no_shader_and_closures_that_do_not_emit(tree):
    data, nodes, links, emission = tree
    links.new(nodes.new("ShaderNodeBsdfDiffuse").outputs[0], emission.outputs[0].links[0].to_socket)
    assert node_factor(data) is None
    links.clear()
    np.testing.assert_array_equal(node_factor(data), np.zeros(3))
    nodes.clear()
    np.testing.assert_array_equal(node_factor(data), np.zeros(3))
