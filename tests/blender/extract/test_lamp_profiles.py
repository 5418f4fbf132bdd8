"""Lamps whose nodes Cycles evaluates: what they send as extracted against Cycles' own render of them."""

import numpy as np
import pytest

bpy = pytest.importorskip("bpy", reason="needs Blender or its Python module")

from cycles_irradiance import cycles_irradiance, points_in_pixels  # noqa: E402
from mathutils import Euler, Matrix, Vector  # noqa: E402

from rtgi_addon.blender.extract import extract_scene  # noqa: E402
from rtgi_addon.blender.extract.refresh import refresh_scene  # noqa: E402
from rtgi_addon.blender.fingerprint import node_digest  # noqa: E402
from rtgi_addon.blender.remembered import forget  # noqa: E402
from rtgi_addon.transport.lights.lamps import LampTable  # noqa: E402

SIZE, PIXELS = 4.0, 12
SQUARE = np.array(Matrix.Translation((0.3, -0.2, 0.1)) @ Euler((0.25, -0.2, 0.4)).to_matrix().to_4x4())
IES = "IESNA:LM-63-1995\nTILT=NONE\n1 1000 1.0 5 1 1 2 0 0 0\n1 1 100\n0 20 45 60 90\n0\n{}\n"


@pytest.fixture
def lamp(empty_blend):
    """Link a lamp of 30 W with one Emission, and something far away to fit a volume to: (object, nodes, links, emission)."""
    def make(kind, location=(0.4, -0.3, 2.0), rotation=(0.2, -0.3, 0.5), scale=(1, 1, 1), **settings):
        data = bpy.data.lights.new("lamp", kind)
        data.energy, data.color = 30.0, (1.0, 0.5, 0.25)
        for name, value in settings.items():
            setattr(data, name, value)
        if bpy.app.version < (5, 1, 0):
            data.use_nodes = True
        nodes, links = data.node_tree.nodes, data.node_tree.links
        nodes.clear()
        emission, output = nodes.new("ShaderNodeEmission"), nodes.new("ShaderNodeOutputLight")
        emission.inputs["Color"].default_value, emission.inputs["Strength"].default_value = (1.0, 1.0, 1.0, 1.0), 1.0
        links.new(emission.outputs[0], output.inputs["Surface"])
        obj = bpy.data.objects.new("my lamp", data)
        obj.matrix_world = Matrix.LocRotScale(Vector(location), Euler(rotation), Vector(scale))
        obj.visible_camera = False
        mesh = bpy.data.meshes.new("far")
        mesh.from_pydata([(0, 0, -50), (1, 0, -50), (0, 1, -50)], [], [(0, 1, 2)])
        for entry in (obj, bpy.data.objects.new("far", mesh)):
            bpy.context.scene.collection.objects.link(entry)
        return obj, nodes, links, emission
    forget()
    yield make
    forget()


def ies(nodes, links, emission, candela="1000 900 300 0 0"):
    node, text = nodes.new("ShaderNodeTexIES"), bpy.data.texts.new("lamp.ies")
    text.write(IES.format(candela))
    node.mode, node.ies = "INTERNAL", text
    links.new(node.outputs[0], emission.inputs["Strength"])
    return node


def pattern(nodes, links, emission, kind="ShaderNodeTexChecker", output="Normal", **inputs):
    coordinates, texture = nodes.new("ShaderNodeTexCoord"), nodes.new(kind)
    for name, value in inputs.items():
        texture.inputs[name].default_value = value
    links.new(coordinates.outputs[output], texture.inputs["Vector"])
    links.new(texture.outputs["Color"], emission.inputs["Color"])


def checker(nodes, links, emission, output="Normal"):
    pattern(nodes, links, emission, output=output, Scale=3.0, Color1=(1.0, 0.0, 0.1, 1.0), Color2=(0.0, 0.2, 1.0, 1.0))


def noise(nodes, links, emission, output="Object"):
    pattern(nodes, links, emission, "ShaderNodeTexNoise", output, Scale=3.0)


def picture(nodes, links, emission):
    """Soft spots over the lamp's UV map."""
    noise(nodes, links, emission, "UV")


def one_way(nodes, links, emission):
    """Brightest along an axis of the world."""
    geometry, cosine, positive, power = (nodes.new(f"ShaderNode{name}") for name in ("NewGeometry", "VectorMath", "Math", "Math"))
    cosine.operation, positive.operation, power.operation = "DOT_PRODUCT", "MAXIMUM", "POWER"
    cosine.inputs[1].default_value, positive.inputs[1].default_value, power.inputs[1].default_value = (0.6, 0.0, -0.8), 0.0, 6.0
    links.new(geometry.outputs["Incoming"], cosine.inputs[0])
    links.new(cosine.outputs["Value"], positive.inputs[0])
    links.new(positive.outputs[0], power.inputs[0])
    links.new(power.outputs[0], emission.inputs["Strength"])


def falloff(nodes, links, emission, output="Linear", smooth=0.0):
    node = nodes.new("ShaderNodeLightFalloff")
    node.inputs["Strength"].default_value, node.inputs["Smooth"].default_value = 1.5, smooth
    links.new(node.outputs[output], emission.inputs["Strength"])


def smooth_falloff(nodes, links, emission):
    falloff(nodes, links, emission, "Quadratic", 2.0)


def constant_falloff(nodes, links, emission):
    falloff(nodes, links, emission, "Constant")


def checker_and_falloff(nodes, links, emission):
    checker(nodes, links, emission)
    falloff(nodes, links, emission, smooth=0.5)


def irradiance(lights, count=1024):
    """The map of ``cycles_irradiance`` from extracted lamps, every point with samples of its own."""
    rng = np.random.default_rng(2)
    points = points_in_pixels(SQUARE, SIZE, PIXELS, rng.random((count, 2))).reshape(-1, 3).astype(np.float32)
    table, total = LampTable(lights), 0.0
    for index in range(table.count):
        sample = table.sample(index, points, rng.random((len(points), 2)).astype(np.float32))
        total = total + sample.irradiance * np.maximum(sample.direction @ SQUARE[:3, 2], 0.0)[:, None]
    return total.reshape(PIXELS, PIXELS, count, 3).mean(axis=2)


def agree(scene, within=0.01, samples=512):
    """Assert that the energy of every colour on the square is Cycles' ``within`` a share, and the map beyond noise."""
    renders = [cycles_irradiance(SQUARE, SIZE, PIXELS, samples, seed) for seed in (1, 2)]
    reference, ours = np.mean(renders, axis=0), irradiance(scene.lights)
    noise_level = np.abs(renders[0] - renders[1]).sum() / 2.0
    assert reference.sum() > 0
    np.testing.assert_allclose(ours.sum(axis=(0, 1)), reference.sum(axis=(0, 1)), rtol=within)
    assert np.abs(ours - reference).sum() < 3.0 * noise_level + 0.025 * reference.sum()
    assert scene.omissions == ()


SOFT, HARD, POINT = ({"shadow_soft_size": 0.3}, {"shadow_soft_size": 0.3, "use_soft_falloff": False}, {"shadow_soft_size": 0.0})
CASES = {
    "ies on a soft point": ("POINT", ies, SOFT),
    "ies on a sphere": ("POINT", ies, HARD),
    "ies on a spot": ("SPOT", ies, {**POINT, "spot_size": 1.6, "spot_blend": 0.3}),
    "gobo on a point": ("POINT", checker, POINT),
    "gobo on a soft spot": ("SPOT", checker, {"shadow_soft_size": 0.1, "spot_size": 1.4, "spot_blend": 0.2}),
    "gobo on a stretched spot": ("SPOT", checker, {**POINT, "spot_size": 1.0, "scale": (2, 0.7, 1.3)}),
    "noise over a spot's picture": ("SPOT", picture, {**POINT, "spot_size": 1.2}),
    "a point brightest one way": ("POINT", one_way, SOFT),
    "a sphere brightest one way": ("POINT", one_way, HARD),
    "an area brightest one way": ("AREA", one_way, {"size": 0.5}),
    "linear falloff": ("POINT", falloff, SOFT),
    "smooth falloff": ("SPOT", smooth_falloff, {"spot_size": 1.4}),
    "constant falloff of an area": ("AREA", constant_falloff, {"size": 0.5}),
    "gobo and falloff": ("SPOT", checker_and_falloff, {**POINT, "spot_size": 1.4}),
    "textured square": ("AREA", picture, {"size": 1.2}),
    "textured rectangle": ("AREA", noise, {"shape": "RECTANGLE", "size": 1.6, "size_y": 0.5}),
    "textured disk": ("AREA", picture, {"shape": "DISK", "size": 1.2}),
    "textured beam": ("AREA", noise, {"size": 1.2, "spread": 1.2}),
    "a sun of noise": ("SUN", lambda *parts: noise(*parts, "Normal"), {"angle": 0.2, "energy": 2.0}),
}


@pytest.mark.slow
@pytest.mark.parametrize("name", CASES)
def test_light_is_that_of_cycles(lamp, name):
    kind, build, settings = CASES[name]
    build(*lamp(kind, **settings)[1:])
    agree(extract_scene())


def test_an_even_ies_profile_fills_the_half_that_it_covers(lamp):
    """Its angles end at 90°: all of its light goes into one half, so the mean is half of what goes there."""
    ies(*lamp("POINT", **POINT)[1:], "1000 1000 1000 1000 1000")
    profile = extract_scene().lights[0].profile
    rows = len(profile.by_direction)
    assert profile.by_place is None and profile.by_distance is None and profile.reach == pytest.approx(np.pi)
    np.testing.assert_allclose(profile.by_direction[:rows // 2 - 2], 2.0, rtol=0.01)
    np.testing.assert_allclose(profile.by_direction[rows // 2 + 2:], 0.0, atol=1e-6)


def test_a_linear_falloff_is_the_distance(lamp):
    falloff(*lamp("POINT", **POINT)[1:])
    light = extract_scene().lights[0]
    points = np.asarray(light.position_world) + np.float32([[0.02, 0, 0], [0, 1, 0], [0, 0, -30]])
    found = LampTable((light,)).sample(0, points.astype(np.float32), np.zeros((3, 2), np.float32))
    np.testing.assert_allclose(found.irradiance, 30.0 / (4.0 * np.pi) * 1.5 * np.array([1.0, 0.5, 0.25])
                               / np.array([[0.02], [1.0], [30.0]]), rtol=2e-3)


def test_turned_and_moved_lamps_ask_once_and_changed_nodes_again(lamp, monkeypatch):
    from rtgi_addon.blender.extract import lamp_profiles
    asked = []
    measured = lamp_profiles._measured
    monkeypatch.setattr(lamp_profiles, "_measured", lambda request: asked.append(request) or measured(request))
    obj, *parts = lamp("POINT", **POINT)
    node = ies(*parts)
    scene = extract_scene(bpy.context.evaluated_depsgraph_get())
    assert len(asked) == 1
    obj.matrix_world = Matrix.LocRotScale(Vector((0, 1, 2)), Euler((1.0, 0.4, 0.0)), None)
    bpy.context.view_layer.update()
    moved = refresh_scene(scene, bpy.context.evaluated_depsgraph_get())
    assert len(asked) == 1
    before, after = scene.lights[0], moved.lights[0]
    assert after.profile.by_direction is before.profile.by_direction
    np.testing.assert_allclose(after.profile.world_from_profile, np.array(obj.matrix_world.to_3x3()), atol=1e-6)
    digest = node_digest(obj.data)
    node.ies.clear()
    node.ies.write(IES.format("100 900 300 0 0"))
    assert node_digest(obj.data) != digest
    obj.data.update_tag()
    bpy.context.view_layer.update()
    assert refresh_scene(scene, bpy.context.evaluated_depsgraph_get()) is None
    extract_scene(bpy.context.evaluated_depsgraph_get(), reuse=True)
    assert len(asked) == 2


def test_what_is_no_product_is_said_with_the_lamps_name(lamp):
    _, nodes, links, emission = lamp("POINT", **POINT)
    coordinates, path, grown, texture = (nodes.new(f"ShaderNode{name}")
                                         for name in ("TexCoord", "LightPath", "VectorMath", "TexChecker"))
    grown.operation, texture.inputs["Scale"].default_value = "SCALE", 1.0
    texture.inputs["Color2"].default_value = (0.0, 0.0, 0.0, 1.0)
    links.new(coordinates.outputs["Normal"], grown.inputs[0])
    links.new(path.outputs["Ray Length"], grown.inputs["Scale"])
    links.new(grown.outputs[0], texture.inputs["Vector"])
    links.new(texture.outputs["Color"], emission.inputs["Color"])
    omission, = extract_scene().omissions
    assert omission.objects == ("my lamp",) and "my lamp" in omission.text and "product" in omission.text


@pytest.mark.slow
def test_places_on_a_point_lamp_are_said_not_to_be_followed(lamp):
    """Its middle says nothing of what its surface shows: dark at the origin of its own space, bright on one side."""
    _, nodes, links, emission = lamp("POINT", shadow_soft_size=0.5, use_soft_falloff=False)
    pattern(nodes, links, emission, "ShaderNodeTexGradient", "Object")
    scene = extract_scene()
    omission, = scene.omissions
    assert "my lamp" in omission.text and np.all(scene.lights[0].strength > 0)


def test_nodes_that_send_nothing_leave_no_lamp(lamp):
    _, nodes, links, emission = lamp("SPOT")
    links.new(nodes.new("ShaderNodeTexNoise").outputs[0], emission.inputs["Strength"])
    emission.inputs["Color"].default_value = (0.0, 0.0, 0.0, 1.0)
    assert extract_scene().lights == ()
