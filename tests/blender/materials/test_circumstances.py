"""What a shader asks about its ray and its object: answered as Cycles answers diffuse and shadow rays, object by object."""

import numpy as np
import pytest

bpy = pytest.importorskip("bpy", reason="needs Blender or its Python module")

from materials_testing import enable_cycles, grid_object, new_material, read_object, read_scene, said_of  # noqa: E402

from rtgi_addon.blender.materials import fresnel  # noqa: E402
from rtgi_addon.blender.materials.circumstances import ANGLE, KIND, SIDE, WORLD, Ray, asks_of_material  # noqa: E402

pytestmark = pytest.mark.blender


def emitting(build, name="material"):
    """A material that emits the colour socket that ``build(tree)`` returns."""
    material, output = new_material(name)
    tree = material.node_tree
    emission = tree.nodes.new("ShaderNodeEmission")
    tree.links.new(build(tree), emission.inputs["Color"])
    tree.links.new(emission.outputs[0], output.inputs["Surface"])
    return material


def output_of(kind, output, **properties):
    """A builder for ``emitting``: one output of a new node."""
    def build(tree):
        node = tree.nodes.new(kind)
        for name, value in properties.items():
            setattr(node, name, value)
        return node.outputs[output]
    return build


def mixed_by(factor, first, second):
    """A material that mixes two new closures, each a (kind, inputs) pair, by the socket that ``factor(tree)`` returns."""
    material, output = new_material()
    tree = material.node_tree
    mix = tree.nodes.new("ShaderNodeMixShader")
    tree.links.new(factor(tree), mix.inputs[0])
    for index, (kind, inputs) in enumerate((first, second), 1):
        node = tree.nodes.new(kind)
        for name, value in inputs.items():
            node.inputs[name].default_value = value
        tree.links.new(node.outputs[0], mix.inputs[index])
    tree.links.new(mix.outputs[0], output.inputs["Surface"])
    return material


def cube(material, name, location, collection=None, size=0.6):
    """A cube of its own mesh around ``location``."""
    mesh = bpy.data.meshes.new(name)
    corners = [(x, y, z) for z in (-1, 1) for y in (-1, 1) for x in (-1, 1)]
    faces = [(0, 2, 3, 1), (4, 5, 7, 6), (0, 1, 5, 4), (2, 6, 7, 3), (0, 4, 6, 2), (1, 3, 7, 5)]
    mesh.from_pydata(np.array(corners) * size / 2, [], faces)
    if material is not None:
        mesh.materials.append(material)
    thing = bpy.data.objects.new(name, mesh)
    thing.location = location
    (collection or bpy.context.scene.collection).objects.link(thing)
    return thing


def seen_from_above(points, tmp_path):
    """What an orthographic Cycles camera far above sees at each of ``points`` (n, 2), no larger than 32 across: (n, 3)."""
    enable_cycles()
    scene = bpy.context.scene
    camera = bpy.data.objects.new("above", bpy.data.cameras.new("above"))
    camera.data.type, camera.data.ortho_scale = "ORTHO", 32.0
    camera.location = 0.0, 0.0, 50.0
    scene.collection.objects.link(camera)
    scene.camera, render = camera, scene.render
    render.engine, scene.cycles.samples, scene.cycles.pixel_filter_type, scene.cycles.max_bounces = "CYCLES", 1, "BOX", 0
    scene.cycles.use_denoising = scene.cycles.use_adaptive_sampling = False
    render.resolution_x = render.resolution_y = 128
    render.resolution_percentage = 100
    settings = render.image_settings
    if hasattr(settings, "media_type"):
        settings.media_type = "IMAGE"
    settings.file_format, settings.color_mode, settings.color_depth = "OPEN_EXR", "RGB", "32"
    render.filepath = str(tmp_path / "above.exr")
    bpy.ops.render.render(write_still=True)
    image = bpy.data.images.load(render.filepath)
    pixels = np.empty(128 * 128 * image.channels, np.float32)
    image.pixels.foreach_get(pixels)
    column, row = ((np.asarray(points) + 16.0) * 4.0).astype(int).T
    return pixels.reshape(128, 128, -1)[row, column, :3]


def expect_what_cycles_shows(tmp_path):
    """Read the whole scene; every surface must emit what Cycles shows of it from above. Returns the number of surfaces."""
    read = read_scene()
    points = [matrix[:2, 3] for _name, _materials, matrix in read]
    expected = seen_from_above(points, tmp_path)
    for (name, (material,), _matrix), pixel in zip(read, expected, strict=True):
        assert material.emission.is_constant
        np.testing.assert_allclose(material.emission.constant, pixel, rtol=1e-3, atol=1e-5, err_msg=name)
    return len(read)


OBJECT_OUTPUTS = ("Location", "Color", "Alpha", "Object Index", "Material Index", "Random")
ATTRIBUTES = [("OBJECT", name) for name in ("number", "whole", "switch", "two", "three", "four", "color", "pass_index", "scale",
                                            "location[0]", "text", "of_data", "nothing")]
ATTRIBUTES += [("VIEW_LAYER", name) for name in ("of_scene", "of_layer", "of_world", "frame_current")] + [("INSTANCER", "number")]


def test_objects_answer_as_in_cycles(empty_blend, tmp_path):
    """Object Info and Attribute nodes on objects that share nothing but their kind of material."""
    scene = bpy.context.scene
    scene.world = scene.world or bpy.data.worlds.new("world")
    scene["of_scene"], scene.view_layers[0]["of_layer"], scene.world["of_world"] = 2.5, 0.4, 0.9
    wanted = [output_of("ShaderNodeObjectInfo", output) for output in OBJECT_OUTPUTS]
    wanted += [output_of("ShaderNodeAttribute", output, attribute_type=kind, attribute_name=name)
               for kind, name in ATTRIBUTES for output in ("Color", "Fac", "Alpha")]
    for index, build in enumerate(wanted):
        thing = cube(emitting(build), f"thing {index}", (index % 16 * 2 - 15, index // 16 * 2, 1.0))
        thing.active_material.pass_index = 5
        thing.color, thing.pass_index, thing.scale = (0.2, 0.4, 0.8, 0.6), 7, (1.0, 1.2, 1.5)
        thing["number"], thing["whole"], thing["switch"], thing["text"] = 0.7, 3, True, "words"
        thing["two"], thing["three"], thing["four"] = (0.3, 0.4), (0.1, 0.2, 0.6), (0.1, 0.2, 0.6, 0.5)
        thing.data["of_data"] = 0.33
    assert expect_what_cycles_shows(tmp_path) == len(wanted)


def test_instances_answer_as_in_cycles(empty_blend, tmp_path):
    """Random, location and colour of objects that share a mesh, of collections placed twice, and of particles."""
    scene = bpy.context.scene
    shared = cube(emitting(output_of("ShaderNodeObjectInfo", "Random")), "shared", (-15, 0, 0))
    other = bpy.data.objects.new("other", shared.data)
    other.location = -13, 0, 0
    scene.collection.objects.link(other)
    collection = bpy.data.collections.new("placed")
    for x, output in enumerate(("Random", "Location", "Color")):
        thing = cube(emitting(output_of("ShaderNodeObjectInfo", output)), f"in {output}", (2 * x, 0, 0), collection)
        thing.color = 0.3, x / 3, 1, 1
    for place in range(2):
        empty = bpy.data.objects.new(f"placement {place}", None)
        empty.instance_type, empty.instance_collection, empty.location = "COLLECTION", collection, (-10 + 8 * place, 4, 0)
        scene.collection.objects.link(empty)
    for row, output in enumerate(("Index", "Random", "Size", "Lifetime", "Age")):
        thing = cube(emitting(output_of("ShaderNodeParticleInfo", output)), f"particle {output}", (0, 0, -100), size=8)
        ground = cube(None, f"emitter {output}", (-8 + 5 * row, -10, 0), size=4)
        bpy.context.view_layer.objects.active = ground
        ground.modifiers.new("particles", "PARTICLE_SYSTEM")
        ground.show_instancer_for_render = ground.show_instancer_for_viewport = False
        settings = ground.particle_systems[0].settings
        settings.count, settings.frame_start, settings.frame_end, settings.lifetime = 3, 1, 1, 80
        settings.physics_type, settings.render_type, settings.instance_object = "NO", "OBJECT", thing
        settings.particle_size, settings.size_random, settings.emit_from = 0.1, 0.5, "VERT"
        settings.use_emit_random = False
    bpy.context.view_layer.update()
    read = read_scene()
    above = [entry for entry in read if entry[2][2, 3] > -50.0]
    assert len({tuple(materials[0].emission.constant) for name, materials, _ in above if "shared" in name or "other" in name}) == 2
    points = np.array([matrix[:2, 3] for _name, _materials, matrix in above])
    top = [np.argmax([m[2, 3] if np.allclose(m[:2, 3], p, atol=0.3) else -np.inf for *_, m in above]) for p in points]
    expected = seen_from_above(points, tmp_path)
    compared = 0
    for index, (name, (material,), _matrix) in enumerate(above):
        if top[index] == index:
            np.testing.assert_allclose(material.emission.constant, expected[index], rtol=1e-3, atol=1e-5, err_msg=name)
            compared += 1
    assert compared >= 12


def test_attributes_of_instances_from_geometry_nodes(empty_blend, tmp_path):
    """The innermost instance that has the attribute answers, then the instancing object itself."""
    materials = [emitting(output_of("ShaderNodeAttribute", "Color", attribute_type="INSTANCER", attribute_name=name))
                 for name in ("inner", "outer", "of_object")]
    for row, material in enumerate(materials):
        tree = bpy.data.node_groups.new("instances", "GeometryNodeTree")
        tree.interface.new_socket("Geometry", in_out="OUTPUT", socket_type="NodeSocketGeometry")
        box, dress = tree.nodes.new("GeometryNodeMeshCube"), tree.nodes.new("GeometryNodeSetMaterial")
        box.inputs["Size"].default_value, dress.inputs["Material"].default_value = (0.5, 0.5, 0.5), material
        tree.links.new(box.outputs[0], dress.inputs["Geometry"])
        source, position = dress.outputs[0], tree.nodes.new("GeometryNodeInputPosition").outputs[0]
        for name, offset, count in (("inner", (1, 0, 0), 3), ("outer", (0, 1, 0), 2)):
            line, place, store = (tree.nodes.new(f"GeometryNode{kind}") for kind in (
                "MeshLine", "InstanceOnPoints", "StoreNamedAttribute"))
            line.inputs["Count"].default_value, line.inputs["Offset"].default_value = count, offset
            store.data_type, store.domain, store.inputs["Name"].default_value = "FLOAT_COLOR", "INSTANCE", name
            tree.links.new(line.outputs[0], place.inputs["Points"])
            tree.links.new(source, place.inputs["Instance"])
            tree.links.new(place.outputs[0], store.inputs["Geometry"])
            tree.links.new(position, store.inputs["Value"])
            source = store.outputs[0]
        tree.links.new(source, tree.nodes.new("NodeGroupOutput").inputs[0])
        thing = cube(None, f"row {row}", (-8, row * 3 - 4, 0))
        thing["of_object"] = (0.2, 0.5, 0.9)
        thing.modifiers.new("nodes", "NODES").node_group = tree
    assert expect_what_cycles_shows(tmp_path) == 18


def test_numbers_of_mesh_attributes_and_vertex_groups(empty_blend, tmp_path):
    layers = {"grey": ("FLOAT", "value", 0.6), "vector": ("FLOAT_VECTOR", "vector", (0.2, 0.5, 0.9)),
              "pair": ("FLOAT2", "vector", (0.2, 0.5)), "colour": ("FLOAT_COLOR", "color", (0.2, 0.5, 0.9, 0.3)), "group": None}
    for x, name in enumerate(layers):
        for y, output in enumerate(("Color", "Fac", "Alpha")):
            build = output_of("ShaderNodeAttribute", output, attribute_name=name)
            thing = cube(emitting(build), f"{name} {output}", (3 * x - 6, 3 * y - 3, 0))
            thing.vertex_groups.new(name="group").add(range(8), 0.35, "REPLACE")
            for layer, entry in layers.items():
                if entry is not None:
                    for element in thing.data.attributes.new(layer, entry[0], "POINT").data:
                        setattr(element, entry[1], entry[2])
    read = read_scene()
    expected = seen_from_above([matrix[:2, 3] for *_, matrix in read], tmp_path)
    for (name, (material,), _matrix, mesh), pixel in zip(read_scene(with_mesh=True), expected, strict=True):
        corners = mesh.attributes[material.emission.attribute][..., :3] * material.emission.constant
        np.testing.assert_allclose(corners, np.broadcast_to(pixel, corners.shape), rtol=1e-3, atol=1e-5, err_msg=name)


@pytest.mark.parametrize("output, seen", [("Is Camera Ray", (0, 1)), ("Is Diffuse Ray", (1, 0)), ("Is Reflection Ray", (1, 0)),
                                          ("Is Shadow Ray", (0, 0)), ("Ray Depth", (1, 0)), ("Is Glossy Ray", (0, 0))])
def test_light_path_is_answered_as_to_a_diffuse_ray(empty_blend, output, seen):
    (material,), _mesh, reader, _loops = read_object(grid_object(emitting(output_of("ShaderNodeLightPath", output))))
    assert material.extraction == "nodes" and not any("Cycles bake" in note for note in reader.notes)
    shown = material if material.camera is None else material.camera
    assert (material.emission.constant[0], shown.emission.constant[0]) == seen
    assert (material.camera is None) == (seen[0] == seen[1])


def test_light_that_cycles_shows_in_part_is_said(empty_blend):
    for output, said in (("Is Diffuse Ray", True), ("Is Camera Ray", False), ("Ray Depth", False)):
        *_rest, reader, _loops = read_object(grid_object(emitting(output_of("ShaderNodeLightPath", output))))
        assert ("samples it as a lamp" in said_of(reader)) == said


def test_shadow_rays_have_a_coverage_of_their_own(empty_blend):
    """Architectural glass: clear to light, glass to everything else."""
    clear, white = ("ShaderNodeBsdfTransparent", {}), ("ShaderNodeBsdfDiffuse", {"Color": (0.7, 0.7, 0.7, 1.0)})
    for output, alpha, shadow in (("Is Shadow Ray", 1.0, 0.0), ("Is Diffuse Ray", 0.0, 1.0)):
        thing = grid_object(mixed_by(output_of("ShaderNodeLightPath", output), white, clear))
        (material,), *_rest = read_object(thing)
        assert material.alpha.constant[0] == alpha and material.shadow_alpha.constant[0] == shadow and not material.is_opaque


def test_a_ray_depth_that_matters_further_on_is_said(empty_blend):
    def deep(tree):
        above = tree.nodes.new("ShaderNodeMath")
        above.operation, above.inputs[1].default_value = "GREATER_THAN", 1.5
        tree.links.new(tree.nodes.new("ShaderNodeLightPath").outputs["Ray Depth"], above.inputs[0])
        return above.outputs[0]

    (material,), _mesh, reader, _loops = read_object(grid_object(emitting(deep, "deep")))
    assert not material.is_emissive and "material 'deep': its answer differs with the number of reflections" in said_of(reader)
    *_rest, reader, _loops = read_object(grid_object(emitting(output_of("ShaderNodeLightPath", "Ray Length"), "far")))
    assert "material 'far': it asks for the length of each ray" in said_of(reader)


def test_the_back_has_its_own_colour_light_and_coverage(empty_blend):
    backfacing = output_of("ShaderNodeNewGeometry", "Backfacing")
    red, lamp = ("ShaderNodeBsdfDiffuse", {"Color": (0.8, 0.1, 0.1, 1.0)}), ("ShaderNodeEmission", {"Strength": 5.0})
    (material,), *_rest = read_object(grid_object(mixed_by(backfacing, red, lamp)))
    assert np.allclose(material.albedo.constant, (0.8, 0.1, 0.1)) and not np.any(material.emission.constant)
    assert np.allclose(material.back.emission.constant, 5.0) and not np.any(material.back.albedo.constant) and material.is_emissive
    (material,), *_rest = read_object(grid_object(mixed_by(backfacing, red, ("ShaderNodeBsdfTransparent", {}))))
    assert material.alpha.constant[0] == 1.0 and material.back.alpha.constant[0] == 0.0 and not material.is_opaque
    (material,), *_rest = read_object(grid_object(mixed_by(output_of("ShaderNodeValue", 0), red, lamp)))
    assert material.back is None


def test_what_varies_with_the_angle_is_averaged_over_the_hemisphere(empty_blend):
    """Facing is 1 − cosθ at a blend of ½: its cosine-weighted mean is 1/3."""
    facing = output_of("ShaderNodeLayerWeight", "Facing")
    (material,), *_rest = read_object(grid_object(emitting(facing)))
    np.testing.assert_allclose(material.emission.constant, 1 / 3, rtol=2e-3)
    squared = (np.arange(len(material.emission_by_angle)) + 0.5) / len(material.emission_by_angle)
    np.testing.assert_allclose(material.emission_by_angle[:, 0], 3.0 * (1.0 - np.sqrt(squared)), rtol=5e-3)
    assert material.back is None
    dark, light = (("ShaderNodeBsdfDiffuse", {"Color": (grey, grey, grey, 1.0)}) for grey in (0.05, 0.95))
    (material,), *_rest = read_object(grid_object(mixed_by(facing, dark, light)))
    np.testing.assert_allclose(material.albedo.constant, 0.05 * 2 / 3 + 0.95 / 3, rtol=2e-3)
    assert material.emission_by_angle is None and material.camera is None


@pytest.mark.parametrize("kind, output", [("ShaderNodeFresnel", "Fac"), ("ShaderNodeLayerWeight", "Fresnel"),
                                          ("ShaderNodeLayerWeight", "Facing")])
def test_fresnel_terms_equal_cycles(empty_blend, tmp_path, kind, output):
    """A camera straight above looks at quads turned about Y, from the front and from behind."""
    angles = np.radians(np.setdiff1d(np.arange(0, 360, 15), (90, 270)) + 3.0)
    for index, angle in enumerate(angles):
        material = emitting(output_of(kind, output), f"m{index}")
        node = next(node for node in material.node_tree.nodes if node.bl_idname == kind)
        node.inputs[0].default_value = 1.45 if kind == "ShaderNodeFresnel" else 0.3
        mesh = bpy.data.meshes.new("quad")
        mesh.from_pydata([(-2, -1, 0), (2, -1, 0), (2, 1, 0), (-2, 1, 0)], [], [(0, 1, 2, 3)])
        mesh.materials.append(material)
        thing = bpy.data.objects.new("quad", mesh)
        thing.location, thing.rotation_euler = (index % 6 * 4 - 10, index // 6 * 4 - 8, 0), (0, angle, 0)
        bpy.context.scene.collection.objects.link(thing)
    pixels = seen_from_above([(index % 6 * 4 - 10, index // 6 * 4 - 8) for index in range(len(angles))], tmp_path)[:, 0]
    cosine = np.abs(np.cos(angles))
    function = {"Fac": fresnel.dielectric_seen, "Fresnel": fresnel.layer_weight,
                "Facing": lambda blend, c, back: fresnel.facing(blend, c)}[output]
    parameter = 1.45 if output == "Fac" else 0.3
    expected = np.where(np.cos(angles) < 0, function(parameter, cosine, True), function(parameter, cosine, False))
    np.testing.assert_allclose(pixels, expected, atol=2e-4)


def place_noise(tree):
    """A pattern in the world, which meets every object elsewhere."""
    noise = tree.nodes.new("ShaderNodeTexNoise")
    noise.inputs["Scale"].default_value = 0.07
    tree.links.new(tree.nodes.new("ShaderNodeNewGeometry").outputs["Position"], noise.inputs["Vector"])
    return noise.outputs["Color"]


def noise_of_location(tree):
    noise = tree.nodes.new("ShaderNodeTexNoise")
    noise.inputs["Scale"].default_value = 0.07
    tree.links.new(tree.nodes.new("ShaderNodeObjectInfo").outputs["Location"], noise.inputs["Vector"])
    return noise.outputs["Color"]


@pytest.mark.parametrize("build", [place_noise, noise_of_location])
def test_cycles_is_asked_once_for_each_object_that_answers_differently(empty_blend, tmp_path, build):
    first = cube(emitting(build), "first", (-3.3, 0.4, 0), size=0.3)
    for index in range(3):
        thing = bpy.data.objects.new(f"copy {index}", first.data)
        thing.location = 5.3 * index, 6 * index - 5, 0.3 * index
        bpy.context.scene.collection.objects.link(thing)
    bpy.context.view_layer.update()
    read = read_scene()
    expected = seen_from_above([matrix[:2, 3] for *_, matrix in read], tmp_path)
    means = np.array([material.emission.constant if material.emission.is_constant else
                      material.emission.texture.pixels.reshape(-1, 3).mean(axis=0) for _, (material,), _ in read])
    assert len(read) == 4 and np.ptp(expected[:, 0]) > 0.05
    np.testing.assert_allclose(means, expected, atol=0.02)


def test_what_a_shader_asks_is_found_through_groups_and_not_beyond_closures(empty_blend):
    group = bpy.data.node_groups.new("asks", "ShaderNodeTree")
    group.interface.new_socket("Result", in_out="OUTPUT", socket_type="NodeSocketColor")
    end = group.nodes.new("NodeGroupOutput")
    group.links.new(group.nodes.new("ShaderNodeLightPath").outputs["Is Shadow Ray"], end.inputs[0])

    def through_group(tree):
        node = tree.nodes.new("ShaderNodeGroup")
        node.node_tree = group
        return node.outputs[0]

    assert asks_of_material(emitting(through_group)) == {KIND}
    assert asks_of_material(emitting(output_of("ShaderNodeNewGeometry", "Normal"))) == {WORLD, SIDE}
    assert asks_of_material(emitting(output_of("ShaderNodeLayerWeight", "Facing"))) == {ANGLE}
    material, output = new_material()
    tree = material.node_tree
    diffuse, bumps = tree.nodes.new("ShaderNodeBsdfDiffuse"), tree.nodes.new("ShaderNodeBump")
    tree.links.new(bumps.outputs[0], diffuse.inputs["Normal"])
    tree.links.new(diffuse.outputs[0], output.inputs["Surface"])
    assert asks_of_material(material) == frozenset()
    assert Ray("shadow", 1, True, 0.5, 1.0).seen_by(frozenset()) == Ray() and Ray("shadow").seen_by({KIND}) == Ray("shadow")
