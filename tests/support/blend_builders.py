"""Small things to put into an open .blend. Needs the bpy module."""

import bpy
import numpy as np


def link(name, data, matrix=None, collection=None):
    """A new object in the scene (or ``collection``)."""
    obj = bpy.data.objects.new(name, data)
    if matrix is not None:
        obj.matrix_world = matrix
    (collection or bpy.context.scene.collection).objects.link(obj)
    return obj


def cube_mesh(name="cube", size=1.0):
    """Six quads about the origin, ``size`` half a side."""
    mesh = bpy.data.meshes.new(name)
    corners = [(x, y, z) for x in (-size, size) for y in (-size, size) for z in (-size, size)]
    mesh.from_pydata(corners, [], [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)])
    return mesh


def material(name, color):
    """A material of one Diffuse BSDF."""
    made = bpy.data.materials.new(name)
    if made.node_tree is None:
        made.use_nodes = True
    tree = made.node_tree
    tree.nodes.clear()
    diffuse, output = tree.nodes.new("ShaderNodeBsdfDiffuse"), tree.nodes.new("ShaderNodeOutputMaterial")
    diffuse.inputs["Color"].default_value = (*color, 1.0)
    tree.links.new(diffuse.outputs[0], output.inputs["Surface"])
    return made


def point_cloud(name, points, radius, made_of):
    """A cloud of balls, which a bake does not follow, linked to the scene."""
    cloud = bpy.data.pointclouds.new(name)
    cloud.resize(len(points))
    cloud.attributes["position"].data.foreach_set("vector", np.asarray(points, np.float32).ravel())
    sizes = cloud.attributes.get("radius") or cloud.attributes.new("radius", "FLOAT", "POINT")
    sizes.data.foreach_set("value", np.full(len(points), radius, np.float32))
    cloud.materials.append(made_of)
    return link(name, cloud)
