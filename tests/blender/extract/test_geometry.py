"""Extracted geometry against Blender's own numbers: areas, positions, counts, materials, visibility."""

import numpy as np
import pytest

bpy = pytest.importorskip("bpy", reason="needs Blender or its Python module")

from blend_builders import cube_mesh, link, material  # noqa: E402
from mathutils import Euler, Matrix  # noqa: E402

from rtgi_addon.blender.extract import extract_scene  # noqa: E402
from rtgi_addon.blender.extract.meshes import MeshReader  # noqa: E402
from rtgi_addon.scene import baked_part  # noqa: E402
from rtgi_addon.transport.surfaces.geometry import flatten  # noqa: E402
from rtgi_addon.transport.surfaces.materials import Surfaces  # noqa: E402


def triangles_world(scene, instance):
    mesh = scene.meshes[instance.mesh]
    local = np.c_[mesh.vertices_local.astype(np.float64), np.ones(len(mesh.vertices_local))]
    return (local @ instance.world_from_local.T)[:, :3][mesh.triangles]


def area(scene, instance):
    corners = triangles_world(scene, instance)
    return 0.5 * np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1).sum()


def named(scene, name):
    return [instance for instance in scene.instances if instance.name == name]


def test_mirrored_and_sheared_instances_keep_their_matrix(empty_blend):
    mesh = cube_mesh()
    shear = Matrix.Identity(4)
    shear[0][1], shear[2][0] = 0.7, -0.4
    turned = Matrix.Translation((1, 2, 3)) @ Euler((0.3, 0.5, -1.0)).to_matrix().to_4x4()
    matrix = turned @ shear @ Matrix.Diagonal((-1.5, 0.5, 2, 1))
    child = link("child", mesh)
    child.parent, child.matrix_parent_inverse = link("parent", None), matrix
    scene = extract_scene()
    instance, = named(scene, "child")
    assert instance.world_from_local.dtype == np.float64
    np.testing.assert_allclose(instance.world_from_local, np.array(matrix), atol=1e-6)
    assert np.linalg.det(instance.world_from_local[:3, :3]) < 0
    expected = np.array([matrix @ vertex.co for vertex in mesh.vertices])
    found = triangles_world(scene, instance).reshape(-1, 3)
    assert np.abs(found[:, None] - expected).sum(axis=2).min(axis=1).max() < 1e-5


def test_render_levels_modifiers_and_visibility_count(empty_blend):
    subdivided = link("subdivided", cube_mesh())
    modifier = subdivided.modifiers.new("subdivision", "SUBSURF")
    modifier.levels, modifier.render_levels = 1, 3
    only_viewport = link("only viewport", cube_mesh())
    array = only_viewport.modifiers.new("array", "ARRAY")
    array.count, array.show_render = 4, False
    only_render = link("only render", cube_mesh())
    array = only_render.modifiers.new("array", "ARRAY")
    array.count, array.show_viewport = 3, False
    link("unseen in viewport", cube_mesh()).hide_viewport = False
    link("hidden", cube_mesh()).hide_render = True
    excluded = bpy.data.collections.new("excluded")
    bpy.context.scene.collection.children.link(excluded)
    link("in excluded", cube_mesh(), collection=excluded)
    bpy.context.view_layer.layer_collection.children["excluded"].exclude = True
    scene = extract_scene()
    counts = {instance.name: len(scene.meshes[instance.mesh].triangles) for instance in scene.instances}
    assert counts == {"subdivided": 2 * 6 * 4**3, "only viewport": 12, "only render": 36, "unseen in viewport": 12}


def test_evaluated_area_equals_blenders(empty_blend):
    obj = link("torus", cube_mesh(), Matrix.Rotation(0.4, 4, "X") @ Matrix.Diagonal((1, 2, 3, 1)))
    for kind in ("SUBSURF", "SOLIDIFY", "SIMPLE_DEFORM"):
        obj.modifiers.new(kind, kind)
    obj.modifiers["SUBSURF"].levels = obj.modifiers["SUBSURF"].render_levels = 2
    scene = extract_scene()
    evaluated = obj.evaluated_get(bpy.context.evaluated_depsgraph_get()).to_mesh()
    evaluated.transform(obj.matrix_world)
    evaluated.calc_loop_triangles()
    expected = sum(triangle.area for triangle in evaluated.loop_triangles)
    assert area(scene, *scene.instances) == pytest.approx(expected, rel=1e-5)


def test_a_mesh_used_a_thousand_times_is_read_once(empty_blend, monkeypatch):
    mesh = cube_mesh()
    for x in range(1000):
        link(f"cube {x}", mesh, Matrix.Translation((x, 0, 0)))
    reads = []
    read = MeshReader.read
    monkeypatch.setattr(MeshReader, "read", lambda self, *rest: reads.append(1) or read(self, *rest))
    scene = extract_scene()
    assert len(reads) == 1 and len(scene.meshes) == 1 and len(scene.instances) == 1000
    assert sorted(instance.world_from_local[0, 3] for instance in scene.instances) == list(range(1000))


def test_collection_instances_nest(empty_blend):
    inner, outer = bpy.data.collections.new("inner"), bpy.data.collections.new("outer")
    link("leaf", cube_mesh(), Matrix.Translation((1, 0, 0)), inner)
    nested = link("nested", None, Matrix.Translation((0, 10, 0)), outer)
    nested.instance_type, nested.instance_collection = "COLLECTION", inner
    for z in (0, 100):
        top = link(f"top {z}", None, Matrix.Translation((0, 0, z)))
        top.instance_type, top.instance_collection = "COLLECTION", outer
    scene = extract_scene()
    assert len(scene.meshes) == 1
    assert sorted(tuple(i.world_from_local[:3, 3]) for i in named(scene, "leaf")) == [(1, 10, 0), (1, 10, 100)]


def test_geometry_node_instances_and_their_materials(empty_blend):
    red = material("red", (0.7, 0.1, 0.1))
    tree = bpy.data.node_groups.new("scatter", "GeometryNodeTree")
    tree.interface.new_socket("Geometry", in_out="INPUT", socket_type="NodeSocketGeometry")
    tree.interface.new_socket("Geometry", in_out="OUTPUT", socket_type="NodeSocketGeometry")
    names = ("InstanceOnPoints", "MeshUVSphere", "SetMaterial")
    instance, sphere, paint = (tree.nodes.new(f"GeometryNode{name}") for name in names)
    group_input, group_output = tree.nodes.new("NodeGroupInput"), tree.nodes.new("NodeGroupOutput")
    instance.inputs["Scale"].default_value = (0.1, 0.1, 0.2)
    paint.inputs["Material"].default_value = red
    tree.links.new(group_input.outputs[0], instance.inputs["Points"])
    tree.links.new(sphere.outputs["Mesh"], paint.inputs["Geometry"])
    tree.links.new(paint.outputs[0], instance.inputs["Instance"])
    tree.links.new(instance.outputs[0], group_output.inputs[0])
    obj = link("scatter", cube_mesh(), Matrix.Translation((5, 0, 0)))
    obj.modifiers.new("nodes", "NODES").node_group = tree
    scene = extract_scene()
    assert len(scene.instances) == 8 and len(scene.meshes) == 1
    corners = sorted(tuple(np.round(i.world_from_local[:3, 3], 5)) for i in scene.instances)
    assert corners == sorted((5.0 + x, y, z) for x in (-1.0, 1.0) for y in (-1.0, 1.0) for z in (-1.0, 1.0))
    np.testing.assert_allclose(scene.instances[0].world_from_local[2, 2], 0.2, atol=1e-6)
    used = {scene.materials[index].name for index in scene.meshes[0].triangle_material}
    assert used == {"red"}


def test_curves_text_surfaces_and_metaballs_are_meshes(empty_blend):
    bpy.ops.curve.primitive_bezier_circle_add()
    bpy.context.object.data.bevel_depth, bpy.context.object.name = 0.1, "tube"
    bpy.ops.object.text_add()
    bpy.context.object.name = "words"
    bpy.ops.surface.primitive_nurbs_surface_sphere_add()
    bpy.context.object.name = "patch"
    bpy.ops.object.metaball_add()
    bpy.context.object.name = "blob"
    scene = extract_scene()
    assert sorted(instance.name for instance in scene.instances) == ["blob", "patch", "tube", "words"]
    ring, = named(scene, "tube")
    assert area(scene, ring) == pytest.approx(4 * np.pi**2 * 1.0 * 0.1, rel=0.05)


def test_flat_smooth_and_custom_normals(empty_blend):
    link("flat", cube_mesh("flat"))
    smooth = cube_mesh("smooth")
    smooth.shade_smooth()
    link("smooth", smooth)
    scene = extract_scene()
    flat, = named(scene, "flat")
    assert scene.meshes[flat.mesh].corner_normals_local is None
    round_, = named(scene, "smooth")
    mesh = scene.meshes[round_.mesh]
    expected = mesh.vertices_local / np.linalg.norm(mesh.vertices_local, axis=1, keepdims=True)
    np.testing.assert_allclose(mesh.corner_normals_local, expected[mesh.triangles], atol=1e-3)


def test_slots_by_object_and_by_mesh(empty_blend):
    red, green, blue = (material(name, color) for name, color in
                        (("red", (0.7, 0.1, 0.1)), ("green", (0.1, 0.7, 0.1)), ("blue", (0.1, 0.1, 0.7))))
    mesh = cube_mesh()
    mesh.materials.append(red)
    mesh.materials.append(green)
    mesh.polygons.foreach_set("material_index", [0, 0, 0, 1, 1, 7])
    link("plain", mesh)
    other = link("other", mesh)
    other.material_slots[1].link = "OBJECT"
    other.material_slots[1].material = blue
    bare = link("bare", cube_mesh("bare"))
    assert not bare.material_slots
    empty = cube_mesh("empty slot")
    empty.materials.append(None)
    link("empty", empty)
    scene = extract_scene()

    def faces(name):
        instance, = named(scene, name)
        override = instance.material_override or {}
        return [scene.materials[override.get(int(i), int(i))].name for i in scene.meshes[instance.mesh].triangle_material]

    assert sorted(faces("plain")) == ["green"] * 6 + ["red"] * 6
    assert sorted(faces("other")) == ["blue"] * 6 + ["red"] * 6
    assert named(scene, "plain")[0].mesh == named(scene, "other")[0].mesh
    for name in ("bare", "empty"):
        index, = {int(i) for i in scene.meshes[named(scene, name)[0].mesh].triangle_material}
        np.testing.assert_allclose(scene.materials[index].base_color.constant, 0.8, atol=1e-6)
    assert sorted(entry.name for entry in scene.materials) == sorted({entry.name for entry in scene.materials})


@pytest.mark.parametrize("same_first", [True, False])
def test_two_slots_of_one_material_overridden_apart(empty_blend, same_first):
    red, blue = material("red", (0.7, 0.1, 0.1)), material("blue", (0.1, 0.1, 0.7))
    mesh = cube_mesh()
    mesh.materials.append(red)
    mesh.materials.append(red)
    mesh.polygons.foreach_set("material_index", [0, 0, 0, 0, 1, 1])
    objects = [link("same", mesh), link("apart", mesh)]
    apart = objects[1] if same_first else objects[0]
    apart.material_slots[1].link, apart.material_slots[1].material = "OBJECT", blue
    scene = extract_scene()
    instance, = named(scene, apart.name)
    override = instance.material_override or {}
    names = [scene.materials[override.get(int(i), int(i))].name for i in scene.meshes[instance.mesh].triangle_material]
    assert names.count("blue") == 4 and names.count("red") == 8


@pytest.mark.parametrize("domain", ["POINT", "CORNER", "FACE"])
@pytest.mark.parametrize("data_type", ["FLOAT_COLOR", "BYTE_COLOR", "FLOAT", "FLOAT_VECTOR"])
def test_attributes_spread_to_corners(empty_blend, domain, data_type):
    mesh = cube_mesh()
    attribute = mesh.attributes.new("paint", data_type, domain)
    count = len(attribute.data)
    width, member = {"FLOAT": (1, "value"), "FLOAT_VECTOR": (3, "vector")}.get(data_type, (4, "color"))
    values = np.random.default_rng(2).uniform(0.05, 0.95, (count, width)).astype(np.float32)
    attribute.data.foreach_set(member, values.ravel())
    reader = MeshReader(mesh)
    found = reader.attributes(["paint", "absent"])
    assert list(found) == ["paint"] and found["paint"].shape == (12, 3, 4)
    polygons = np.repeat(np.arange(6), 2)[:, None].repeat(3, axis=1)
    elements = {"POINT": reader.triangles, "CORNER": reader.corner_loops, "FACE": polygons}[domain]
    expected = np.ones((12, 3, 4), np.float32)
    expected[..., :3 if width == 1 else width] = values[elements]
    np.testing.assert_allclose(found["paint"], expected, atol=0.01 if data_type == "BYTE_COLOR" else 1e-6)


def test_uv_maps_follow_their_corners(empty_blend):
    mesh = cube_mesh()
    for name in ("first", "second"):
        mesh.uv_layers.new(name=name)
    mesh.uv_layers["second"].active_render = True
    uv = np.random.default_rng(3).random((len(mesh.loops), 2)).astype(np.float32)
    mesh.uv_layers["second"].uv.foreach_set("vector", uv.ravel())
    reader = MeshReader(mesh)
    read = reader.read("cube", ())
    assert set(read.uv_layers) == {"first", "second"} and read.active_uv == "second"
    np.testing.assert_array_equal(read.uv_layers["second"], uv[reader.corner_loops])
    loop_vertices = np.array([loop.vertex_index for loop in mesh.loops])
    np.testing.assert_array_equal(loop_vertices[reader.corner_loops], reader.triangles)


def test_ray_visibility_is_read_and_what_has_no_surface_is_said_by_object(empty_blend):
    link("ghost", cube_mesh()).visible_diffuse = False
    link("shadowless", cube_mesh()).visible_shadow = False
    unseen = link("unseen", cube_mesh())
    unseen.visible_diffuse = unseen.visible_shadow = unseen.visible_camera = False
    link("actor", cube_mesh()).hide_probe_volume = True
    link("fog", bpy.data.volumes.new("fog data"))
    link("wires", bpy.data.meshes.new("no faces"))
    scene = extract_scene()
    roles = {i.name: (i.visible_camera, i.visible_diffuse, i.visible_shadow, i.bake) for i in scene.instances}
    assert roles == {"ghost": (True, False, True, "STATIC"), "shadowless": (True, True, False, "STATIC"),
                     "actor": (True, True, True, "DYNAMIC")}
    assert [instance.name for instance in baked_part(scene).instances] == ["ghost", "shadowless"]
    found = {omission.objects: omission for omission in scene.omissions}
    assert set(found) == {("ghost",), ("fog",)}
    assert all(str(omission).startswith(name) for (name,), omission in found.items())
    np.testing.assert_allclose(found["ghost",].boxes_world, [[[-1, -1, -1], [1, 1, 1]]])


def test_particle_hair_is_where_its_strands_are(empty_blend):
    ground = bpy.data.meshes.new("ground")
    ground.from_pydata([(-1, -1, 0), (1, -1, 0), (1, 1, 0), (-1, 1, 0)], [], [(0, 1, 2, 3)])
    meadow = link("meadow", ground, Matrix.Diagonal((1, 1, 2, 1)))
    meadow.modifiers.new("grass", "PARTICLE_SYSTEM")
    settings = meadow.particle_systems[0].settings
    settings.type, settings.count, settings.hair_length = "HAIR", 3, 0.5
    omission, = extract_scene().omissions
    assert str(omission) == "meadow has particle hair: it has no surface to bake and is left out"
    np.testing.assert_allclose(omission.boxes_world, [[[-1.5, -1.5, -1], [1.5, 1.5, 1]]])


def test_linked_and_overridden_objects(empty_blend, tmp_path):
    library = tmp_path / "library.blend"
    collection = bpy.data.collections.new("props")
    link("prop", cube_mesh(), Matrix.Translation((1, 0, 0)), collection)
    bpy.data.libraries.write(str(library), {collection})
    bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
    with bpy.data.libraries.load(str(library), link=True) as (_available, wanted):
        wanted.collections, wanted.objects = ["props"], ["prop"]
    linked = bpy.data.collections["props"]
    instancer = link("instancer", None, Matrix.Translation((0, 7, 0)))
    instancer.instance_type, instancer.instance_collection = "COLLECTION", linked
    override = linked.objects["prop"].override_create()
    bpy.context.scene.collection.objects.link(override)
    override.location = (0, 0, 9)
    scene = extract_scene()
    places = sorted(tuple(np.round(i.world_from_local[:3, 3], 5)) for i in scene.instances)
    assert places == [(0.0, 0.0, 9.0), (1.0, 7.0, 0.0)]
    assert len(scene.meshes) == 1


def test_view_layer_overrides(empty_blend):
    mesh = cube_mesh()
    mesh.materials.append(material("red", (0.7, 0.1, 0.1)))
    link("cube", mesh)
    world = bpy.data.worlds.new("studio")
    if world.node_tree is None:
        world.use_nodes = True
    world.node_tree.nodes["Background"].inputs["Color"].default_value = (0.25, 0.5, 0.75, 1)
    bpy.context.view_layer.material_override = material("clay", (0.5, 0.5, 0.5))
    bpy.context.view_layer.world_override = world
    scene = extract_scene()
    assert [entry.name for entry in scene.materials] == ["clay"]
    np.testing.assert_allclose(scene.world.equirect, [[[0.25, 0.5, 0.75]]])


def test_a_material_that_takes_cycles_is_baked_once_for_all_instances(empty_blend):
    checker = material("checker", (1, 1, 1))
    tree = checker.node_tree
    coordinate, texture, gamma = (tree.nodes.new(f"ShaderNode{name}") for name in ("TexCoord", "TexChecker", "Gamma"))
    texture.inputs["Color1"].default_value, texture.inputs["Color2"].default_value = (0.4, 0.1, 0.2, 1), (0.1, 0.6, 0.2, 1)
    texture.inputs["Scale"].default_value = 0.01
    tree.links.new(coordinate.outputs["Object"], texture.inputs["Vector"])
    tree.links.new(texture.outputs["Color"], gamma.inputs["Color"])
    tree.links.new(gamma.outputs[0], next(node for node in tree.nodes if node.type == "BSDF_DIFFUSE").inputs["Color"])
    red, mesh = material("red", (0.7, 0.1, 0.1)), cube_mesh()
    for entry in (checker, red):
        mesh.materials.append(entry)
    mesh.polygons.foreach_set("material_index", [0, 0, 0, 1, 1, 1])
    for x in (0, 5):
        link(f"cube {x}", mesh, Matrix.Translation((x, 0, 0)))
    scene = extract_scene()
    assert len(scene.meshes) == 1 and len(scene.instances) == 2
    by_name = {entry.name: (index, entry) for index, entry in enumerate(scene.materials)}
    assert by_name["checker"][1].extraction == "cycles-bake" and by_name["red"][1].extraction == "nodes"
    assert any("checker" in note for note in scene.notes)
    geometry = flatten(scene)
    primitives = np.flatnonzero(geometry.material == by_name["checker"][0]).astype(np.int32)
    assert len(primitives) == 12
    centre = np.full(len(primitives), 1 / 3, np.float32)
    albedo = Surfaces(scene, geometry).albedo(primitives, centre, centre, np.ones(len(centre), np.float32))
    distance = np.abs(albedo[:, None] - np.array([(0.4, 0.1, 0.2), (0.1, 0.6, 0.2)])).max(axis=2).min(axis=1)
    assert distance.max() < 0.01
    assert len(bpy.data.meshes) == 1 and len(bpy.data.objects) == 2
