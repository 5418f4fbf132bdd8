"""Objects under edit are read as F12 shows them: Cycles was asked for each of these and renders the same."""

import numpy as np
import pytest

bpy = pytest.importorskip("bpy", reason="needs Blender or its Python module")

from blend_builders import cube_mesh, link, material  # noqa: E402
from mathutils import Matrix  # noqa: E402

from rtgi_addon.blender.extract import extract_scene  # noqa: E402
from rtgi_addon.blender.extract.refresh import refresh_scene  # noqa: E402


def surface(scene, name):
    """World-space corners of every triangle of the objects called ``name``, sorted."""
    corners = []
    for instance in scene.instances:
        if instance.name == name:
            mesh, matrix = scene.meshes[instance.mesh], instance.world_from_local
            corners.append((mesh.vertices_local @ matrix[:3, :3].T + matrix[:3, 3])[mesh.triangles].reshape(-1, 9))
    corners = np.round(np.concatenate(corners), 5)
    return corners[np.lexsort(corners.T)]


def edit(obj, mode="EDIT"):
    bpy.context.view_layer.objects.active = obj
    obj.select_set(True)
    bpy.ops.object.mode_set(mode=mode)


def plain(_obj):
    pass


def subdivided(obj):
    obj.modifiers.new("s", "SUBSURF").render_levels = 2


def mirrored(obj):
    obj.data.transform(Matrix.Translation((2, 0, 0)))
    obj.modifiers.new("m", "MIRROR")


def geometry_nodes(obj):
    tree = bpy.data.node_groups.new("lift", "GeometryNodeTree")
    for way in ("INPUT", "OUTPUT"):
        tree.interface.new_socket("Geometry", in_out=way, socket_type="NodeSocketGeometry")
    start, move, end = (tree.nodes.new(name) for name in ("NodeGroupInput", "GeometryNodeTransform", "NodeGroupOutput"))
    move.inputs["Translation"].default_value = (0, 0, 3)
    tree.links.new(start.outputs[0], move.inputs[0])
    tree.links.new(move.outputs[0], end.inputs[0])
    obj.modifiers.new("lift", "NODES").node_group = tree


def linked_duplicate(obj):
    link("lid twin", obj.data).location.x = 5


@pytest.mark.parametrize("change", [plain, subdivided, mirrored, geometry_nodes, linked_duplicate])
def test_a_mesh_in_edit_mode_is_read_whole(empty_blend, change):
    lid = link("lid", cube_mesh())
    change(lid)
    bpy.context.view_layer.update()
    at_rest = extract_scene()
    edit(lid)
    edited = extract_scene()
    for name in {instance.name for instance in at_rest.instances}:
        np.testing.assert_allclose(surface(edited, name), surface(at_rest, name), atol=1e-5)


def test_modifiers_not_shown_in_edit_mode_are_left_out_as_in_f12(empty_blend):
    lid = link("lid", cube_mesh())
    plain_surface = surface(extract_scene(), "lid")
    lid.modifiers.new("array", "ARRAY").show_in_editmode = False
    edit(lid)
    np.testing.assert_allclose(surface(extract_scene(), "lid"), plain_surface)


def test_shape_keys_show_the_one_under_edit_as_in_f12(empty_blend):
    lid = link("lid", cube_mesh())
    lid.shape_key_add(name="basis")
    raised = lid.shape_key_add(name="raised")
    for point in raised.data:
        point.co.z += 2
    raised.value, lid.active_shape_key_index = 1.0, 0
    assert surface(extract_scene(), "lid")[:, 2::3].min() > 0.5
    edit(lid)
    assert surface(extract_scene(), "lid")[:, 2::3].min() < -0.5


def test_materials_are_baked_on_a_mesh_under_edit(empty_blend):
    lid = link("lid", cube_mesh())
    checks = material("checks", (1, 1, 1))
    tree = checks.node_tree
    node = tree.nodes.new("ShaderNodeTexChecker")
    node.inputs["Color1"].default_value, node.inputs["Color2"].default_value = (0.9, 0, 0, 1), (0, 0, 0.9, 1)
    diffuse = next(found for found in tree.nodes if found.bl_idname == "ShaderNodeBsdfDiffuse")
    tree.links.new(node.outputs["Color"], diffuse.inputs["Color"])
    lid.data.materials.append(checks)
    at_rest = extract_scene()
    edit(lid)
    edited = extract_scene()
    assert bpy.context.mode == "EDIT_MESH" and lid.mode == "EDIT"
    for albedo in (at_rest.materials[0].albedo, edited.materials[0].albedo):
        mean = albedo.texture.pixels[..., :3].mean(axis=(0, 1))
        assert mean[0] > 0.3 and mean[2] > 0.3 and mean[1] < 0.01


@pytest.mark.parametrize("kind", ["FONT", "CURVE", "META"])
def test_what_evaluates_to_a_mesh_is_read_under_edit(empty_blend, kind):
    if kind == "META":
        data = bpy.data.metaballs.new("shape")
        data.elements.new()
        data.render_resolution = data.resolution = 0.2
    else:
        data = bpy.data.curves.new("shape", kind)
        data.extrude = 0.1
        if kind == "FONT":
            data.body = "o"
        else:
            data.splines.new("POLY").points.add(2)
            for index, point in enumerate(data.splines[0].points):
                point.co = (index, index % 2, 0, 1)
    shape = link("shape", data)
    bpy.context.view_layer.update()
    at_rest = extract_scene()
    edit(shape)
    np.testing.assert_allclose(surface(extract_scene(), "shape"), surface(at_rest, "shape"), atol=1e-5)


def test_sculpting_with_multires_shows_the_render_level(empty_blend):
    lid = link("lid", cube_mesh())
    edit(lid, "OBJECT")
    modifier = lid.modifiers.new("levels", "MULTIRES")
    for _ in range(2):
        bpy.ops.object.multires_subdivide(modifier=modifier.name, mode="SIMPLE")
    modifier.levels, modifier.sculpt_levels, modifier.render_levels = 0, 1, 2
    edit(lid, "SCULPT")
    assert len(surface(extract_scene(), "lid")) == 2 * 6 * 16


def test_the_viewport_follows_objects_under_edit(empty_blend):
    lid = link("lid", cube_mesh())
    edit(lid)
    read = extract_scene(bpy.context.evaluated_depsgraph_get())
    assert [instance.name for instance in read.instances] == ["lid"]
    assert refresh_scene(read, bpy.context.evaluated_depsgraph_get()) is read
