"""Closures boiled down to albedo, emission and coverage: against Cycles' bakes and its rules."""

import numpy as np
import pytest

bpy = pytest.importorskip("bpy", reason="needs Blender or its Python module")

from materials_testing import (  # noqa: E402
    at_corners,
    closures,
    cycles_bake,
    grid_object,
    new_material,
    new_principled,
    only,
    random_image,
    read_object,
    said_of,
)

pytestmark = pytest.mark.blender


def test_what_of_gloss_is_left_out_is_said(empty_blend):
    metal, _node = new_principled(Metallic=1.0, Anisotropic=0.8)
    film, _node = new_principled(Thin_Film_Thickness=400.0)
    glossy, (node,), output = closures(("ShaderNodeBsdfAnisotropic", {"Anisotropy": 0.5}))
    glossy.node_tree.links.new(node.outputs[0], output.inputs["Surface"])
    assert "its anisotropic reflection is taken as that of even roughness" in said_of(read_object(grid_object(metal))[2])
    assert "the colours of its thin film are left out" in said_of(read_object(grid_object(film))[2])
    assert "anisotropic" in said_of(read_object(grid_object(glossy))[2])


def test_without_a_specular_layer_the_albedo_is_the_base_colour(empty_blend):
    color = np.array((0.8, 0.5, 0.2), np.float32)
    material, _node = new_principled(Base_Color=(*color.tolist(), 1.0), Specular_IOR_Level=0.0)
    assert np.array_equal(only(material).albedo.constant, color)
    material, (node,), output = closures(("ShaderNodeBsdfDiffuse", {"Color": (*color.tolist(), 1.0)}))
    material.node_tree.links.new(node.outputs[0], output.inputs["Surface"])
    assert np.array_equal(only(material).albedo.constant, color)


def test_principled_emission_is_colour_times_strength(empty_blend):
    material, node = new_principled(Emission_Color=(0.9, 0.5, 0.1, 1.0), Emission_Strength=7.0)
    assert np.allclose(only(material).emission.constant, (6.3, 3.5, 0.7))
    image = material.node_tree.nodes.new("ShaderNodeTexImage")
    image.image = random_image()
    material.node_tree.links.new(image.outputs["Color"], node.inputs["Emission Color"])
    thing = grid_object(material)
    (read,), mesh, _reader, loops = read_object(thing)
    assert read.is_emissive
    assert np.abs(at_corners(read.emission, mesh) - cycles_bake(thing, "EMIT")[loops]).max() < 0.02


@pytest.mark.parametrize("coat, alpha", [(0.0, 0.4), (0.0, 1.0), (1.0, 1.0)])
def test_what_coat_and_alpha_leave_of_emission_is_what_cycles_bakes(empty_blend, coat, alpha):
    material, _node = new_principled(Emission_Color=(1.0, 1.0, 1.0, 1.0), Emission_Strength=5.0, Alpha=alpha, Coat_Weight=coat)
    thing = grid_object(material)
    (read,), *_ = read_object(thing)
    baked = cycles_bake(thing, "EMIT").mean()
    assert np.isclose(float((read.emission.constant * read.alpha.constant)[0]), baked, rtol=0.08 if coat else 1e-3)


def test_alpha_of_principled_and_of_mix_with_transparent(empty_blend):
    material, _node = new_principled(Base_Color=(0.5, 0.5, 0.5, 1.0), Alpha=0.25, Specular_IOR_Level=0.0)
    read = only(material)
    assert np.allclose(read.alpha.constant, 0.25) and np.allclose(read.albedo.constant, 0.5) and read.alpha_threshold is None
    for swapped in (False, True):
        material, (mix, clear, diffuse), output = closures(
            ("ShaderNodeMixShader", {}), ("ShaderNodeBsdfTransparent", {}),
            ("ShaderNodeBsdfDiffuse", {"Color": (0.6, 0.4, 0.2, 1.0)}))
        image = material.node_tree.nodes.new("ShaderNodeTexImage")
        image.image = random_image(alpha=True)
        links = material.node_tree.links
        links.new(image.outputs["Alpha"], mix.inputs[0])
        links.new(clear.outputs[0], mix.inputs[2 if swapped else 1])
        links.new(diffuse.outputs[0], mix.inputs[1 if swapped else 2])
        links.new(mix.outputs[0], output.inputs["Surface"])
        thing = grid_object(material)
        (read,), mesh, _reader, loops = read_object(thing)
        assert np.allclose(read.albedo.constant, (0.6, 0.4, 0.2)) and read.alpha.texture_channel == "a"
        premultiplied = at_corners(read.alpha, mesh) * read.albedo.constant
        assert np.abs(premultiplied - cycles_bake(thing, "DIFFUSE")[loops]).max() < 4e-3


def test_a_transparent_material_lets_everything_through(empty_blend):
    material, (clear,), output = closures(("ShaderNodeBsdfTransparent", {}))
    material.node_tree.links.new(clear.outputs[0], output.inputs["Surface"])
    assert float(only(material).alpha.constant[0]) == 0.0
    clear.inputs["Color"].default_value = (0.3, 0.2, 0.1, 1.0)
    read = only(material)
    assert np.all(read.alpha.constant == 0.0) and np.allclose(read.tint.constant, (0.3, 0.2, 0.1))


def test_light_added_to_a_transparent_surface_keeps_its_radiance(empty_blend):
    material, (add, clear, glow), output = closures(
        ("ShaderNodeAddShader", {}), ("ShaderNodeBsdfTransparent", {}), ("ShaderNodeEmission", {"Strength": 3.0}))
    links = material.node_tree.links
    links.new(clear.outputs[0], add.inputs[0])
    links.new(glow.outputs[0], add.inputs[1])
    links.new(add.outputs[0], output.inputs["Surface"])
    read = only(material)
    assert 0.0 < float(read.alpha.constant[0]) < 0.1
    assert np.allclose(read.emission.constant * read.alpha.constant, 3.0)


def test_mix_and_add_of_closures_equal_cycles(empty_blend):
    material, (mix, add, red, blue, glow), output = closures(
        ("ShaderNodeMixShader", {}), ("ShaderNodeAddShader", {}), ("ShaderNodeBsdfDiffuse", {"Color": (0.8, 0.1, 0.1, 1.0)}),
        ("ShaderNodeBsdfDiffuse", {"Color": (0.1, 0.2, 0.7, 1.0)}), ("ShaderNodeEmission", {"Strength": 2.0}))
    image = material.node_tree.nodes.new("ShaderNodeTexImage")
    image.image, image.interpolation = random_image(), "Closest"
    links = material.node_tree.links
    links.new(image.outputs["Color"], mix.inputs[0])
    links.new(image.outputs["Color"], glow.inputs["Color"])
    links.new(red.outputs[0], mix.inputs[1])
    links.new(blue.outputs[0], mix.inputs[2])
    links.new(mix.outputs[0], add.inputs[0])
    links.new(glow.outputs[0], add.inputs[1])
    links.new(add.outputs[0], output.inputs["Surface"])
    thing = grid_object(material)
    (read,), mesh, _reader, loops = read_object(thing)
    assert np.abs(at_corners(read.albedo, mesh) - cycles_bake(thing, "DIFFUSE")[loops]).max() < 4e-3
    assert np.abs(at_corners(read.emission, mesh) - cycles_bake(thing, "EMIT")[loops]).max() < 8e-3


@pytest.mark.parametrize("operations, above", [
    ((("SUBTRACT", 1.0, None), ("LESS_THAN", None, 0.3)), True), ((("GREATER_THAN", None, 0.3),), True),
    ((("LESS_THAN", None, 0.3),), False), ((("ROUND", None, None),), True)])
def test_alpha_clip_is_a_threshold_on_the_texture(empty_blend, operations, above):
    material, node = new_principled()
    tree = material.node_tree
    image = tree.nodes.new("ShaderNodeTexImage")
    image.image = random_image(alpha=True)
    into = node.inputs["Alpha"]
    for operation, *operands in operations:
        math = tree.nodes.new("ShaderNodeMath")
        math.operation = operation
        for socket, value in zip(math.inputs, operands, strict=False):
            if value is not None:
                socket.default_value = value
        tree.links.new(math.outputs[0], into)
        into = math.inputs[operands.index(None)]
    tree.links.new(image.outputs["Alpha"], into)
    (read,), mesh, _reader, _loops = read_object(grid_object(material))
    expected = 0.5 if operations[0][0] == "ROUND" else 0.3
    assert read.alpha.texture is not None and np.isclose(read.alpha_threshold, expected if above else 1.0 - expected)
    values = at_corners(read.alpha, mesh)[..., 0]
    texture_alpha = values if above else 1.0 - values
    assert np.array_equal(values > read.alpha_threshold, texture_alpha > expected if above else texture_alpha < expected)


def test_a_metallic_texture_needs_no_bake(empty_blend):
    material, node = new_principled(Roughness=0.5)
    tree = material.node_tree
    base, packed = tree.nodes.new("ShaderNodeTexImage"), tree.nodes.new("ShaderNodeTexImage")
    base.image, packed.image = random_image(), random_image("packed", seed=4)
    packed.image.colorspace_settings.name = "Non-Color"
    base.interpolation = packed.interpolation = "Closest"
    split = tree.nodes.new("ShaderNodeSeparateColor")
    tree.links.new(base.outputs["Color"], node.inputs["Base Color"])
    tree.links.new(packed.outputs["Color"], split.inputs[0])
    tree.links.new(split.outputs[2], node.inputs["Metallic"])
    tree.links.new(split.outputs[1], node.inputs["Roughness"])
    read = only(material)
    mesh = read_object(bpy.data.objects["grid"])[1]
    color, metallic = at_corners(read.base_color, mesh), at_corners(read.metallic, mesh)
    rough = float(np.mean(at_corners(read.roughness, mesh)))
    from rtgi_addon.blender.materials import albedo

    mean_roughness = float(read.roughness.texture.pixels[..., 1].mean()) / 255.0
    assert abs(rough - mean_roughness) < 0.1
    specular = albedo.dielectric_specular(mean_roughness, 0.04)
    expected = (1 - metallic) * (specular + (1 - specular) * color) + metallic * albedo.metal(color, mean_roughness)
    assert np.abs(at_corners(read.albedo, mesh) - expected).max() < 4e-3


def shares(read):
    """What a side reflects, passes straight on and passes diffusely (3,) each, of all that arrives from all around."""
    covered = float(read.alpha.constant[0])
    return covered * read.albedo.constant, (1.0 - covered) * read.tint.constant, covered * read.translucency.constant


# Measured in Cycles 5.2 at a huge plane under a sky of which half is bright, a side: reflected, passed straight on, diffusely.
SEEN_IN_CYCLES = {
    "glass": (("ShaderNodeBsdfGlass", {"Roughness": 0.0, "IOR": 1.5}),
              ((0.083, 0.018, 0.018), (0.815, 0.181, 0.181), (0.0,) * 3),
              ((0.537, 0.119, 0.119), (0.363, 0.081, 0.081), (0.0,) * 3)),
    "principled": (("ShaderNodeBsdfPrincipled", {"Transmission Weight": 1.0, "Roughness": 0.0}),
                   ((0.093,) * 3, (0.860, 0.405, 0.405), (0.0,) * 3), ((0.597,) * 3, (0.382, 0.180, 0.180), (0.0,) * 3)),
    "translucent": (("ShaderNodeBsdfTranslucent", {}), ((0.0,) * 3, (0.0,) * 3, (0.9, 0.2, 0.2)), None),
    "thin wall": (("ShaderNodeBsdfPrincipled", {"Thin Wall": True, "Transmission Weight": 1.0, "Roughness": 0.0}),
                  ((0.141, 0.094, 0.094), (0.746, 0.136, 0.136), (0.0,) * 3), None),
    "thin leaf": (("ShaderNodeBsdfPrincipled", {"Thin Wall": True, "Subsurface Weight": 1.0}),
                  ((0.483, 0.154, 0.154), (0.0,) * 3, (0.422, 0.094, 0.094)), None),
    "thin leaf that scatters forwards": (
        ("ShaderNodeBsdfPrincipled", {"Thin Wall": True, "Subsurface Weight": 1.0, "Subsurface Anisotropy": 0.5}),
        ((0.272, 0.107, 0.107), (0.0,) * 3, (0.633, 0.141, 0.141)), None)}


@pytest.mark.parametrize("name", SEEN_IN_CYCLES)
def test_what_passes_a_surface_is_what_passes_it_in_cycles(empty_blend, name):
    (kind, inputs), front, back = SEEN_IN_CYCLES[name]
    if "Thin Wall" in inputs and bpy.app.version < (5, 2):
        pytest.skip("this Blender's Principled has no thin wall")
    color = {"Base Color" if kind == "ShaderNodeBsdfPrincipled" else "Color": (0.9, 0.2, 0.2, 1.0)}
    material, (node,), output = closures((kind, {**color, **inputs}))
    material.node_tree.links.new(node.outputs[0], output.inputs["Surface"])
    (read,), _mesh, reader, _loops = read_object(grid_object(material))
    np.testing.assert_allclose(shares(read), front, atol=0.004)
    assert (read.back is None) == (back is None)
    if back is not None:
        np.testing.assert_allclose(shares(read.back), back, atol=0.004)
        assert read.glass and read.back.glass and np.all(read.point_alpha.constant == 1.0)
    said = "refraction and caustics are not followed" in said_of(reader)
    assert said == (name in ("glass", "principled", "thin wall"))


def test_what_passes_keeps_its_colour_in_mixtures(empty_blend):
    """Mix and Add: shares of what is reflected and passed add up, whatever the coverage is called."""
    for mixing, weights in (("ShaderNodeMixShader", (0.75, 0.25)), ("ShaderNodeAddShader", (1.0, 1.0))):
        material, (mix, clear, leaf), output = closures(
            (mixing, {}), ("ShaderNodeBsdfTransparent", {"Color": (0.2, 0.4, 0.3, 1.0)}),
            ("ShaderNodeBsdfTranslucent", {"Color": (0.5, 0.1, 0.3, 1.0)}))
        links = material.node_tree.links
        first = 1 if mixing == "ShaderNodeMixShader" else 0
        if first:
            mix.inputs[0].default_value = weights[1]
        links.new(clear.outputs[0], mix.inputs[first])
        links.new(leaf.outputs[0], mix.inputs[first + 1])
        links.new(mix.outputs[0], output.inputs["Surface"])
        reflected, straight, diffuse = shares(only(material))
        assert not reflected.any()
        np.testing.assert_allclose(straight, weights[0] * np.array([0.2, 0.4, 0.3]), atol=1e-6)
        np.testing.assert_allclose(diffuse, weights[1] * np.array([0.5, 0.1, 0.3]), atol=1e-6)


def test_lamps_without_a_size_shine_through_what_is_transparent_beside_glass(empty_blend):
    material, (mix, clear, glass), output = closures(
        ("ShaderNodeMixShader", {}), ("ShaderNodeBsdfTransparent", {}), ("ShaderNodeBsdfGlass", {}))
    mix.inputs[0].default_value = 0.25
    links = material.node_tree.links
    links.new(clear.outputs[0], mix.inputs[1])
    links.new(glass.outputs[0], mix.inputs[2])
    links.new(mix.outputs[0], output.inputs["Surface"])
    read = only(material)
    np.testing.assert_allclose(read.point_alpha.constant, 0.25)
    assert float(read.alpha.constant[0]) < 0.05 < float(read.back.alpha.constant[0]) < 0.2


def test_what_bends_diffuse_reflection_is_said(empty_blend):
    material, node = new_principled(Base_Color=(0.5, 0.5, 0.5, 1.0), Diffuse_Roughness=0.7)
    bump = material.node_tree.nodes.new("ShaderNodeBump")
    material.node_tree.links.new(bump.outputs["Normal"], node.inputs["Normal"])
    (read,), _mesh, reader, _loops = read_object(grid_object(material))
    assert read.extraction == "nodes" and "bumps are left out" in said_of(reader)
    assert "Oren-Nayar" in said_of(reader)
    plain, _node = new_principled(Base_Color=(0.5, 0.5, 0.5, 1.0))
    assert not said_of(read_object(grid_object(plain))[2])


def test_how_far_light_goes_beneath_a_surface_is_said(empty_blend):
    material, _node = new_principled(Subsurface_Weight=0.5, Subsurface_Radius=(1.0, 0.2, 0.1), Subsurface_Scale=0.6)
    other, output = new_material("wax")
    node = other.node_tree.nodes.new("ShaderNodeSubsurfaceScattering")
    node.inputs["Radius"].default_value, node.inputs["Scale"].default_value = (0.5, 1.0, 0.2), 0.03
    other.node_tree.links.new(node.outputs[0], output.inputs["Surface"])
    assert "some 0.6 m beneath its surface" in said_of(read_object(grid_object(material))[2])
    assert "some 0.03 m beneath its surface" in said_of(read_object(grid_object(other))[2])
    # What lies on both sides of a thin wall is followed, and without a weight nothing goes beneath.
    thin, node = new_principled(Subsurface_Weight=0.5)
    node.inputs["Thin Wall"].default_value = True
    none, _node = new_principled(Subsurface_Weight=0.0, Subsurface_Scale=0.6)
    assert not said_of(read_object(grid_object(thin))[2]) + said_of(read_object(grid_object(none))[2])


def test_hair_without_a_formula_is_named(empty_blend):
    """Principled Hair has no diffuse colour to bake: what is black then is said, by the material."""
    material, output = new_material()
    hair = material.node_tree.nodes.new("ShaderNodeBsdfHairPrincipled")
    material.node_tree.links.new(hair.outputs[0], output.inputs["Surface"])
    (read,), _mesh, reader, _loops = read_object(grid_object(material))
    assert not np.any(read.albedo.constant)
    said, = reader.omissions.all()
    assert said.materials == (material.name,) and "has no formula here" in said.text and "Hair" in said.text


def test_toon_and_sheen_reflect_what_was_measured(empty_blend):
    """At nodes of the tables, which a command measured with Cycles: 0.651 of even light, and 0.1219."""
    for kind, settings, share in (("Toon", {"Size": 0.4, "Smooth": 0.75}, 0.651), ("Sheen", {"Roughness": 0.5}, 0.1219)):
        material, output = new_material()
        node = material.node_tree.nodes.new(f"ShaderNodeBsdf{kind}")
        for name, value in {"Color": (0.8, 0.6, 0.3, 1.0), **settings}.items():
            node.inputs[name].default_value = value
        material.node_tree.links.new(node.outputs[0], output.inputs["Surface"])
        (read,), *_rest = read_object(grid_object(material))
        assert read.extraction == "nodes"
        np.testing.assert_allclose(read.albedo.constant, share * np.array([0.8, 0.6, 0.3]), rtol=1e-3)
    plain, covered = (new_principled(Base_Color=(0.4, 0.4, 0.4, 1.0), Sheen_Weight=weight, Sheen_Roughness=0.5)[0]
                      for weight in (0.0, 1.0))
    (bare,), (soft,) = (read_object(grid_object(material))[0] for material in (plain, covered))
    np.testing.assert_allclose(soft.albedo.constant, bare.albedo.constant * (1 - 0.1219) + 0.1219, rtol=1e-3)
