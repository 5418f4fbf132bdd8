"""True displacement and adaptive subdivision: where Cycles puts the vertices. Its renders of such scenes agree within 1 %."""

import numpy as np
import pytest

bpy = pytest.importorskip("bpy", reason="needs Blender or its Python module")

from blend_builders import cube_mesh, link, material  # noqa: E402
from mathutils import Euler, Matrix  # noqa: E402

from rtgi_addon.blender.extract import extract_scene, shape  # noqa: E402


def displacing(height=None, scale=1.0, method="DISPLACEMENT", node="ShaderNodeDisplacement", space="OBJECT"):
    """A material displaced by ``scale`` times a height: 1, or the output of a node made by ``height(tree)``."""
    made = material("displacing", (0.5, 0.5, 0.5))
    tree = made.node_tree
    output = next(found for found in tree.nodes if found.bl_idname == "ShaderNodeOutputMaterial")
    shift = tree.nodes.new(node)
    shift.space = space
    shift.inputs["Midlevel"].default_value, shift.inputs["Scale"].default_value = 0.0, scale
    if node == "ShaderNodeDisplacement":
        shift.inputs["Height"].default_value = 1.0
        if height is not None:
            tree.links.new(height(tree), shift.inputs["Height"])
    tree.links.new(shift.outputs[0], output.inputs["Displacement"])
    made.displacement_method = method
    return made


def quad(made, subdivision=None):
    mesh = bpy.data.meshes.new("quad")
    mesh.from_pydata([(-1, -1, 0), (1, -1, 0), (1, 1, 0), (-1, 1, 0)], [], [(0, 1, 2, 3)])
    mesh.materials.append(made)
    obj = link("quad", mesh)
    if subdivision is not None:
        modifier = obj.modifiers.new("subdivision", "SUBSURF")
        modifier.subdivision_type, modifier.render_levels = "SIMPLE", 1
        modifier.use_adaptive_subdivision = True
        for name, value in subdivision.items():
            setattr(modifier, name, value)
    return obj


def vertices(name="quad"):
    scene = extract_scene()
    instance = next(instance for instance in scene.instances if instance.name == name)
    matrix = instance.world_from_local
    return scene.meshes[instance.mesh].vertices_local @ matrix[:3, :3].T + matrix[:3, 3], scene.meshes[instance.mesh]


@pytest.mark.parametrize("method", ["DISPLACEMENT", "BOTH"])
@pytest.mark.parametrize("space", ["OBJECT", "WORLD"])
def test_vertices_move_along_their_normal_in_the_space_that_is_asked_for(empty_blend, method, space):
    obj = quad(displacing(scale=0.4, method=method, space=space))
    obj.matrix_world = Matrix.Translation((1, 2, 3)) @ Euler((0.3, 0.5, -1.0)).to_matrix().to_4x4() @ Matrix.Diagonal((2, 1, 3, 1))
    normal = np.array(obj.matrix_world.to_3x3().normalized())[:, 2]
    height = 0.4 * (3 if space == "OBJECT" else 1)
    found, _ = vertices()
    expected = np.array([obj.matrix_world @ vertex.co for vertex in obj.data.vertices]) + height * normal
    np.testing.assert_allclose(found, expected, atol=2e-5)


def test_bump_moves_nothing(empty_blend):
    quad(displacing(method="BUMP"))
    assert np.all(vertices()[0][:, 2] == 0.0)


def test_a_vector_moves_as_it_points(empty_blend):
    made = displacing(node="ShaderNodeVectorDisplacement", scale=0.5, space="WORLD")
    next(node for node in made.node_tree.nodes if "Displacement" in node.bl_idname).inputs["Vector"].default_value = (1, 2, 4, 1)
    obj = quad(made)
    found, _ = vertices()
    np.testing.assert_allclose(found, [np.add(vertex.co, (0.5, 1, 2)) for vertex in obj.data.vertices], atol=1e-5)


def test_only_faces_of_the_material_move(empty_blend):
    obj = link("box", cube_mesh())
    obj.data.materials.append(material("still", (0.5, 0.5, 0.5)))
    obj.data.materials.append(displacing(scale=0.5))
    obj.data.polygons[4].material_index = 1
    moved = {tuple(vertex) for vertex in np.round(vertices("box")[0], 4)} - {tuple(vertex.co) for vertex in obj.data.vertices}
    assert {vertex[1:] for vertex in moved} == {(y, -1.5) for y in (-1, 1)} and len(moved) == 4


def test_smooth_normals_are_those_of_the_moved_surface(empty_blend):
    bpy.ops.mesh.primitive_uv_sphere_add(segments=32, ring_count=16)
    ball = bpy.context.object
    ball.name = "ball"
    ball.data.materials.append(displacing(scale=1.0))
    for polygon in ball.data.polygons:
        polygon.use_smooth = True
    found, mesh = vertices("ball")
    np.testing.assert_allclose(np.linalg.norm(found, axis=1), 2.0, rtol=2e-3)
    outward = found[mesh.triangles] / np.linalg.norm(found[mesh.triangles], axis=2, keepdims=True)
    assert np.sum(outward * mesh.corner_normals_local, axis=2).min() > 0.99


def checks(tree):
    """1 where x·y > 0 and 0 elsewhere, by object coordinates."""
    coordinates, apart, product, above = (tree.nodes.new(f"ShaderNode{name}") for name in
                                          ("TexCoord", "SeparateXYZ", "Math", "Math"))
    product.operation, above.operation = "MULTIPLY", "GREATER_THAN"
    above.inputs[1].default_value = 0.0
    tree.links.new(coordinates.outputs["Object"], apart.inputs[0])
    tree.links.new(apart.outputs["X"], product.inputs[0])
    tree.links.new(apart.outputs["Y"], product.inputs[1])
    tree.links.new(product.outputs[0], above.inputs[0])
    return above.outputs[0]


@pytest.fixture
def coarse(monkeypatch):
    """Fewer faces than a user gets, for speed."""
    monkeypatch.setattr(shape, "_MOST_FACES", 1 << 12)


def test_adaptive_subdivision_goes_on_to_the_most_faces(empty_blend, coarse):
    quad(displacing(checks, 0.5), {})
    found, mesh = vertices()
    assert len(mesh.triangles) == 2 << 12
    x, y, z = found.T
    clear = (np.abs(x) > 1e-3) & (np.abs(y) > 1e-3)
    np.testing.assert_allclose(z[clear], 0.5 * (x * y > 0)[clear], atol=1e-5)


@pytest.mark.skipif(bpy.app.version < (5, 0), reason="its adaptive subdivision knows pixels only")
def test_an_edge_length_ends_the_subdivision(empty_blend):
    quad(displacing(checks, 0.5), {"adaptive_space": "OBJECT", "adaptive_object_edge_length": 0.13})
    _, mesh = vertices()
    assert len(mesh.triangles) == 2 * 16 * 16


def test_smoothed_without_displacement_it_comes_near_the_limit(empty_blend):
    obj = link("box", cube_mesh())
    modifier = obj.modifiers.new("subdivision", "SUBSURF")
    modifier.render_levels, modifier.use_adaptive_subdivision = 0, True
    found, mesh = vertices("box")
    assert 4000 < len(mesh.triangles) < 30000
    modifier.use_adaptive_subdivision, modifier.render_levels = False, 5
    limit, _ = vertices("box")
    np.testing.assert_allclose(np.ptp(found, axis=0), np.ptp(limit, axis=0), rtol=5e-3)


def test_colours_follow_where_the_surface_was_moved_to(empty_blend):
    """A bake of Position sees the moved surface, Generated coordinates the one before, as in Cycles."""
    made = displacing(checks, 0.5)
    tree = made.node_tree
    coordinates, position, mix = (tree.nodes.new(f"ShaderNode{name}") for name in ("TexCoord", "NewGeometry", "CombineXYZ"))
    generated, placed = (tree.nodes.new("ShaderNodeSeparateXYZ") for _ in range(2))
    tree.links.new(coordinates.outputs["Generated"], generated.inputs[0])
    tree.links.new(position.outputs["Position"], placed.inputs[0])
    tree.links.new(generated.outputs["X"], mix.inputs["X"])
    tree.links.new(placed.outputs["Z"], mix.inputs["Y"])
    diffuse = next(node for node in tree.nodes if node.bl_idname == "ShaderNodeBsdfDiffuse")
    tree.links.new(mix.outputs[0], diffuse.inputs["Color"])
    obj = quad(made, {"use_adaptive_subdivision": False, "render_levels": 5})
    scene = extract_scene()
    mesh, albedo = scene.meshes[0], scene.materials[0].albedo
    corners = mesh.vertices_local[mesh.triangles]
    if albedo.attribute is not None:
        seen = mesh.attributes[albedo.attribute][..., :3] * albedo.constant
    else:
        uv, pixels = mesh.uv_layers[albedo.uv_layer], albedo.texture.pixels
        at = np.clip((uv * pixels.shape[1::-1]).astype(int), 0, np.array(pixels.shape[1::-1]) - 1)
        seen = pixels[at[..., 1], at[..., 0], :3] * albedo.constant
    flat = np.ptp(corners[..., 2], axis=1) < 1e-4
    assert flat.sum() > 1000 and obj.name == "quad"
    middle = seen[flat].mean(axis=1)
    np.testing.assert_allclose(middle[:, 1], corners[flat][..., 2].mean(axis=1), atol=0.05)
    np.testing.assert_allclose(middle[:, 0], (corners[flat][..., 0].mean(axis=1) + 1) / 2, atol=0.05)


def test_what_was_made_for_it_is_gone(empty_blend, coarse):
    obj = quad(displacing(checks, 0.5), {})
    extract_scene()  # Blender keeps a Render Result from the first on
    before = {name: len(getattr(bpy.data, name)) for name in ("meshes", "objects", "scenes", "materials", "images", "node_groups")}
    extract_scene()
    assert {name: len(getattr(bpy.data, name)) for name in before} == before
    assert len(obj.data.polygons) == 1 and len(obj.data.color_attributes) == 0
