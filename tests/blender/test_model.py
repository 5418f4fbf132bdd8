"""The exported model is the scene that was baked: each object's own materials, what geometry nodes instance; what glTF lacks is
named."""

import json
import struct
from math import tan

import numpy as np
import pytest

bpy = pytest.importorskip("bpy", reason="needs Blender or its Python module")

from rtgi_addon.blender.cli.open_file import known_properties  # noqa: E402
from rtgi_addon.blender.model import export_model  # noqa: E402


def coloured(name, colour, shader="ShaderNodeBsdfPrincipled", socket="Base Color"):
    material = bpy.data.materials.new(name)
    if material.node_tree is None:  # Blender 4.5
        material.use_nodes = True
    tree = material.node_tree
    tree.nodes.clear()
    node, output = tree.nodes.new(shader), tree.nodes.new("ShaderNodeOutputMaterial")
    tree.links.new(node.outputs[0], output.inputs["Surface"])
    node.inputs[socket].default_value = (*colour, 1.0)
    return material


def instanced_on_points(target, material):
    """A nodes modifier that stands ``target``, in a material of its own, on the points of its object."""
    tree = bpy.data.node_groups.new("On Points", "GeometryNodeTree")
    for kind in ("INPUT", "OUTPUT"):
        tree.interface.new_socket("Geometry", in_out=kind, socket_type="NodeSocketGeometry")
    names = "NodeGroupInput", "GeometryNodeInstanceOnPoints", "GeometryNodeObjectInfo", "GeometryNodeSetMaterial", "NodeGroupOutput"
    start, place, info, colour, end = (tree.nodes.new(name) for name in names)
    info.inputs["Object"].default_value = target
    colour.inputs["Material"].default_value = material
    for source, into in ((start.outputs[0], place.inputs["Points"]), (info.outputs["Geometry"], colour.inputs["Geometry"]),
                         (colour.outputs[0], place.inputs["Instance"]), (place.outputs[0], end.inputs[0])):
        tree.links.new(source, into)
    return tree


@pytest.fixture(scope="module")
def model(tmp_path_factory):
    """The .glb's JSON of a scene of everything that was once lost, what export_model said, and the counts of datablocks before and
    after."""
    bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
    scene, path = bpy.context.scene, tmp_path_factory.mktemp("model") / "model.glb"
    scene.render.resolution_x, scene.render.resolution_y = 300, 600
    bpy.ops.mesh.primitive_plane_add()
    first = bpy.context.object
    first.data.materials.append(coloured("Shared", (1, 1, 1)))
    for index, colour in enumerate(((1, 0, 0), (0, 1, 0))):
        banner = bpy.data.objects.new(f"Banner {index}", first.data)
        scene.collection.objects.link(banner)
        banner.material_slots[0].link = "OBJECT"
        banner.material_slots[0].material = coloured(f"Cloth {index}", colour)
    bpy.ops.mesh.primitive_ico_sphere_add(subdivisions=1, radius=0.1)
    stone = bpy.context.object
    stone.name, stone.hide_render = "Stone", True
    bpy.ops.mesh.primitive_plane_add()
    bed = bpy.context.object
    bed.name = "Bed"
    bed.modifiers.new("On Points", "NODES").node_group = instanced_on_points(stone, coloured("Pebble", (0, 0, 1)))
    for name, shader in (("Chalk", "ShaderNodeBsdfDiffuse"), ("Pane", "ShaderNodeBsdfGlass")):
        bpy.ops.mesh.primitive_cube_add(size=0.5)
        bpy.context.object.name = name
        bpy.context.object.data.materials.append(coloured(name, (0.25, 0.5, 0.75), shader, "Color"))
    bpy.ops.mesh.primitive_cube_add(size=3.0)
    bpy.context.object.name = "Fog"
    fog = coloured("Fog", (1, 1, 1))
    fog.node_tree.nodes.clear()
    absorbing, filled = (fog.node_tree.nodes.new(f"ShaderNode{kind}") for kind in ("VolumeAbsorption", "OutputMaterial"))
    fog.node_tree.links.new(absorbing.outputs[0], filled.inputs["Volume"])
    bpy.context.object.data.materials.append(fog)
    noisy = coloured("Noisy", (1, 1, 1))
    noise = noisy.node_tree.nodes.new("ShaderNodeTexNoise")
    noisy.node_tree.links.new(noise.outputs["Color"], noisy.node_tree.nodes["Principled BSDF"].inputs["Base Color"])
    bpy.ops.mesh.primitive_cube_add(size=0.5)
    bpy.context.object.name = "Walker"
    bpy.context.object.data.materials.append(noisy)
    bpy.context.object.keyframe_insert("location", frame=1)
    bpy.ops.object.camera_add()
    scene.camera = bpy.context.object
    scene.camera.data.angle = 1.0

    def counts():
        return [len(getattr(bpy.data, kind)) for kind in ("scenes", "objects", "meshes", "materials", "cameras")]

    before = counts()
    with known_properties():
        made = export_model(path)
    data = path.read_bytes()
    length, = struct.unpack_from("<I", data, 12)
    yield json.loads(data[20:20 + length]), made, before, counts()
    bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)


def colours(content, name):
    """Base colours of the materials on the nodes called ``name``, one list a node."""
    return [[content["materials"][part["material"]].get("pbrMetallicRoughness", {}).get("baseColorFactor", [1, 1, 1, 1])[:3]
             for part in content["meshes"][node["mesh"]]["primitives"]] for node in content["nodes"] if node["name"] == name]


def test_every_object_wears_its_own_material(model):
    content, *_ = model
    assert colours(content, "Plane") == [[[1, 1, 1]]]
    assert colours(content, "Banner 0") == [[[1, 0, 0]]] and colours(content, "Banner 1") == [[[0, 1, 0]]]


def test_what_geometry_nodes_instance_is_there(model):
    content, *_ = model
    pebbles = [node for node in content["nodes"] if "mesh" in node and colours(content, node["name"])[0] == [[0, 0, 1]]]
    assert len(pebbles) == 4 and len({node["mesh"] for node in pebbles}) == 1
    assert not [node for node in content["nodes"] if node["name"] == "Stone" and node not in pebbles]


def test_what_bounds_a_medium_alone_is_no_block_in_it(model):
    content, *_ = model
    assert not [node for node in content["nodes"] if node["name"] == "Fog"]


def test_a_plain_diffuse_keeps_its_colour(model):
    content, *_ = model
    (found,), = colours(content, "Chalk")
    np.testing.assert_allclose(found, [0.25, 0.5, 0.75], atol=1e-6)


def test_what_is_lost_is_named(model):
    lost = model[1].lost
    assert len(lost) == 3
    assert any("stands still as at frame 1: Walker" in line for line in lost)
    assert any(line.startswith("material Pane: glTF does not hold glass") for line in lost)
    assert any(line.startswith("material Noisy: glTF does not hold the nodes behind Base Color") for line in lost)


def test_the_camera_sees_what_it_sees_in_blender(model):
    content, *_ = model
    camera = content["cameras"][0]["perspective"]
    # A portrait: Blender's angle is across the longer side.
    assert camera["yfov"] == pytest.approx(1.0, abs=1e-5) and camera["aspectRatio"] == pytest.approx(0.5)
    assert tan(camera["yfov"] / 2) * camera["aspectRatio"] < tan(0.5)


def test_nothing_of_it_stays_in_the_file(model):
    assert model[2] == model[3]
