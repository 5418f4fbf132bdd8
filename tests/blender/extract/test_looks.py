"""What styles read of a file: marked edges, pass indices, collections and line colours; and that no bake depends on them."""

from dataclasses import replace

import numpy as np
import pytest

bpy = pytest.importorskip("bpy", reason="needs Blender or its Python module")

from blend_builders import cube_mesh, link, material  # noqa: E402

from rtgi_addon.blender.extract import extract_scene  # noqa: E402
from rtgi_addon.blender.extract.refresh import refresh_scene  # noqa: E402
from rtgi_addon.jobs.fingerprint import content_hash  # noqa: E402
from rtgi_addon.transport.context import changed_surfaces  # noqa: E402


def mark(mesh, chosen):
    """Mark the edges of a bpy mesh whose index is ``chosen``, as this Blender keeps them."""
    if "use_freestyle_mark" in bpy.types.MeshEdge.bl_rna.properties:
        for edge in mesh.edges:
            edge.use_freestyle_mark = chosen(edge)
        return
    marks = mesh.attributes.new("freestyle_edge", "BOOLEAN", "EDGE")
    marks.data.foreach_set("value", [chosen(edge) for edge in mesh.edges])


def scene_with_looks():
    painted = material("painted", (0.5, 0.5, 0.5))
    painted.line_color, painted.pass_index = (0.25, 0.5, 0.75, 0.5), 4
    cube, plain = link("cube", cube_mesh()), link("plain", cube_mesh())
    cube.data.materials.append(painted)
    cube.pass_index = 9
    mark(cube.data, lambda edge: edge.index < 3)
    outer, inner = bpy.data.collections.new("outer"), bpy.data.collections.new("inner")
    bpy.context.scene.collection.children.link(outer)
    outer.children.link(inner)
    inner.objects.link(plain)
    return cube


def test_looks_are_read(empty_blend):
    cube = scene_with_looks()
    expected = {tuple(sorted(edge.vertices)) for edge in cube.data.edges if edge.index < 3}
    scene = extract_scene()
    by_name = {item.name: item for item in scene.instances}
    found = scene.meshes[by_name["cube"].mesh].marked_edges
    assert {tuple(sorted(pair)) for pair in found.tolist()} == expected
    assert scene.meshes[by_name["plain"].mesh].marked_edges is None
    assert by_name["cube"].pass_index == 9 and by_name["plain"].pass_index == 0
    assert by_name["plain"].collections == ("inner", "outer") and by_name["cube"].collections == ()
    painted = next(item for item in scene.materials if item.name == "painted")
    assert np.allclose(painted.line_color, (0.25, 0.5, 0.75, 0.5)) and painted.pass_index == 4


def test_marks_survive_a_modifier(empty_blend):
    cube = link("cube", cube_mesh())
    mark(cube.data, lambda edge: edge.index == 0)
    cube.modifiers.new("subdivision", "SUBSURF").render_levels = 2
    scene = extract_scene()
    assert len(scene.meshes[0].marked_edges) == 4


def test_a_change_of_looks_is_followed_without_a_bake(empty_blend):
    cube = scene_with_looks()
    before = extract_scene()
    cube.pass_index = 2
    bpy.context.view_layer.update()
    after = refresh_scene(before, bpy.context.evaluated_depsgraph_get())
    by_name = {item.name: item for item in after.instances}
    assert by_name["cube"].pass_index == 2
    assert by_name["plain"] is next(item for item in before.instances if item.name == "plain")
    assert changed_surfaces(before, after) == "" and content_hash(before.instances) == content_hash(after.instances)
    moved = replace(by_name["cube"], visible_shadow=False)
    assert content_hash(moved) != content_hash(by_name["cube"])
