"""Answers are remembered before a render starts: which scenes have to ask Cycles at all."""

import bpy
import pytest

from rtgi_addon.blender.engine import warm_up


@pytest.fixture
def cube():
    bpy.ops.wm.read_factory_settings(use_empty=True)
    bpy.ops.mesh.primitive_cube_add()
    obj = bpy.context.object
    obj.data.materials.append(bpy.data.materials.new("Paint"))
    if bpy.app.version < (5, 0):
        obj.active_material.use_nodes = True
    return obj


def test_a_plain_material_needs_no_cycles(cube):
    assert not warm_up._needs_cycles(bpy.context.scene)


def test_a_texture_of_blenders_own_needs_cycles(cube):
    tree = cube.active_material.node_tree
    noise = tree.nodes.new("ShaderNodeTexNoise")
    tree.links.new(noise.outputs["Color"], tree.nodes["Principled BSDF"].inputs["Base Color"])
    assert warm_up._needs_cycles(bpy.context.scene)
