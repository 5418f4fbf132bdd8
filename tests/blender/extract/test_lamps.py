"""Every lamp type and option: the irradiance of the extracted lamp against Cycles' own render of the same square."""

import math

import numpy as np
import pytest

bpy = pytest.importorskip("bpy", reason="needs Blender or its Python module")

from cycles_irradiance import cycles_irradiance, points_in_pixels  # noqa: E402
from mathutils import Euler, Matrix, Vector  # noqa: E402

from rtgi_addon.blender.extract import extract_scene  # noqa: E402
from rtgi_addon.numerics.sampling import sobol_owen  # noqa: E402
from rtgi_addon.scene import AreaLight, PointLight, SpotLight, SunLight  # noqa: E402
from rtgi_addon.transport.lights.lamps import LampTable  # noqa: E402

SIZE, PIXELS, SAMPLES = 4.0, 12, 512
SQUARE = np.array(Matrix.Translation((0.3, -0.2, 0.1)) @ Euler((0.25, -0.2, 0.4)).to_matrix().to_4x4())


def lamp(kind, location=(0.4, -0.3, 2.0), rotation=(0.2, -0.3, 0.5), scale=(1, 1, 1), matrix=None, **settings):
    """Link a lamp of 30 W (sun: 2 W/m²) with those settings to the scene."""
    data = bpy.data.lights.new("lamp", kind)
    data.energy = 2.0 if kind == "SUN" else 30.0
    data.color = (1.0, 0.5, 0.25)
    for name, value in settings.items():
        setattr(data, name, value)
    obj = bpy.data.objects.new(f"my {kind.lower()}", data)
    obj.matrix_world = matrix or Matrix.LocRotScale(Vector(location), Euler(rotation), Vector(scale))
    obj.visible_camera = False
    bpy.context.scene.collection.objects.link(obj)
    return obj


def floor():
    """Something to fit a volume to, far from every lamp's light."""
    mesh = bpy.data.meshes.new("far")
    mesh.from_pydata([(0, 0, -50), (1, 0, -50), (0, 1, -50)], [], [(0, 1, 2)])
    bpy.context.scene.collection.objects.link(bpy.data.objects.new("far", mesh))


def our_irradiance(lights, size=SIZE, pixels=PIXELS, count=1024):
    """The same map as ``cycles_irradiance`` from extracted lamps."""
    samples = sobol_owen(count, 4, 7).astype(np.float32)
    points = points_in_pixels(SQUARE, size, pixels, samples[:, 2:]).reshape(-1, 3).astype(np.float32)
    uv = np.tile(samples[:, :2], (pixels * pixels, 1))
    normal = SQUARE[:3, 2]
    table = LampTable(lights)
    total = np.zeros((len(points), 3))
    for index in range(table.count):
        sample = table.sample(index, points, uv)
        total += sample.irradiance * np.maximum(sample.direction @ normal, 0.0)[:, None]
    return total.reshape(pixels, pixels, count, 3).mean(axis=2)


def agree(samples=SAMPLES, size=SIZE, pixels=PIXELS):
    """Assert that the extracted lamps light the square as Cycles does, to 0.2 % of the energy and 0.4 %
    RMS over pixels, beyond Cycles' own noise (from two seeds)."""
    floor()
    lights = extract_scene().lights
    renders = [cycles_irradiance(SQUARE, size, pixels, samples, seed) for seed in (1, 2)]
    reference = np.mean(renders, axis=0)
    noise = np.sqrt(np.mean((renders[0] - renders[1]) ** 2)) / 2.0
    ours = our_irradiance(lights, size, pixels)
    scale = np.sqrt(np.mean(reference**2))
    assert scale > 0
    total = ours.sum() / reference.sum()
    error = np.sqrt(np.mean((ours - reference) ** 2))
    assert abs(total - 1.0) < 0.002 + 3.0 * noise / scale / pixels, f"energy {total:.5f}, noise {noise / scale:.5f}"
    assert error < 3.0 * noise + 0.004 * scale, f"error {error / scale:.5f}, noise {noise / scale:.5f}, energy {total:.5f}"
    return lights


SUNS = {
    "point-like": {"angle": 0.0},
    "disc": {"angle": 0.6},
    "very wide": {"angle": 2.5},
    "not normalized": {"angle": 0.6, "normalize": False},
    "not normalized, no angle": {"angle": 0.0, "normalize": False},
    "exposure": {"exposure": 1.5},
    "temperature": {"use_temperature": True, "temperature": 3200.0},
}
POINTS = {
    "no radius": {"shadow_soft_size": 0.0},
    "sphere": {"shadow_soft_size": 0.6, "use_soft_falloff": False},
    "disk": {"shadow_soft_size": 0.6, "use_soft_falloff": True},
    "not normalized": {"shadow_soft_size": 0.4, "use_soft_falloff": False, "normalize": False},
    "not normalized, no radius": {"shadow_soft_size": 0.0, "normalize": False},
    "exposure": {"shadow_soft_size": 0.1, "exposure": -1.25},
    "temperature": {"shadow_soft_size": 0.0, "use_temperature": True, "temperature": 9000.0},
}
SPOTS = {
    "hard": {"spot_size": 1.0, "spot_blend": 0.0, "shadow_soft_size": 0.0},
    "soft edge": {"spot_size": 1.2, "spot_blend": 0.5, "shadow_soft_size": 0.0},
    "all edge": {"spot_size": 1.5, "spot_blend": 1.0, "shadow_soft_size": 0.0},
    "wide": {"spot_size": math.pi, "spot_blend": 0.3, "shadow_soft_size": 0.0},
    "disk": {"spot_size": 1.2, "spot_blend": 0.4, "shadow_soft_size": 0.3, "use_soft_falloff": True},
    "sphere": {"spot_size": 1.2, "spot_blend": 0.4, "shadow_soft_size": 0.3, "use_soft_falloff": False},
    "not normalized": {"spot_size": 1.2, "shadow_soft_size": 0.3, "normalize": False, "exposure": 0.5},
}
AREAS = {
    "square": {"shape": "SQUARE", "size": 1.0},
    "rectangle": {"shape": "RECTANGLE", "size": 1.5, "size_y": 0.4},
    "disk": {"shape": "DISK", "size": 1.2},
    "ellipse": {"shape": "ELLIPSE", "size": 1.5, "size_y": 0.5},
    "wide spread": {"shape": "SQUARE", "size": 1.0, "spread": 2.4},
    "narrow spread": {"shape": "RECTANGLE", "size": 1.0, "size_y": 0.7, "spread": 0.5},
    "disk with spread": {"shape": "DISK", "size": 1.2, "spread": 1.0},
    "ellipse with spread": {"shape": "ELLIPSE", "size": 1.2, "size_y": 0.6, "spread": 1.0},
    "not normalized": {"shape": "ELLIPSE", "size": 1.5, "size_y": 0.5, "normalize": False},
    "exposure and temperature": {"shape": "SQUARE", "size": 1.0, "exposure": 2.0, "use_temperature": True, "temperature": 5000.0},
}


@pytest.mark.parametrize("settings", SUNS.values(), ids=SUNS.keys())
def test_sun(empty_blend, settings):
    lamp("SUN", **settings)
    light, = agree()
    assert isinstance(light, SunLight) and light.name == "my sun"


@pytest.mark.parametrize("settings", POINTS.values(), ids=POINTS.keys())
def test_point(empty_blend, settings):
    lamp("POINT", **settings)
    light, = agree()
    assert isinstance(light, PointLight) and light.name == "my point"


@pytest.mark.parametrize("settings", SPOTS.values(), ids=SPOTS.keys())
def test_spot(empty_blend, settings):
    lamp("SPOT", **settings)
    light, = agree()
    assert isinstance(light, SpotLight) and light.world_from_local is None


@pytest.mark.parametrize("settings", AREAS.values(), ids=AREAS.keys())
def test_area(empty_blend, settings):
    lamp("AREA", **settings)
    light, = agree()
    assert isinstance(light, AreaLight)


@pytest.mark.parametrize("distance", [0.5, 1.0, 6.0])
def test_area_at_distances(empty_blend, distance):
    lamp("AREA", location=(0.3, -0.2, 0.1 + distance), rotation=(0, 0, 0.3), shape="RECTANGLE", size=2.0, size_y=0.6)
    agree()


SCALES = {"uniform": (2.0, 2.0, 2.0), "stretched": (2.0, 0.7, 1.3), "mirrored": (-1.5, 0.8, 1.0), "upside down": (1.0, 1.0, -1.0)}


@pytest.mark.parametrize("scale", SCALES.values(), ids=SCALES.keys())
@pytest.mark.parametrize("kind", ["SUN", "POINT", "SPOT", "AREA"])
def test_scaled(empty_blend, kind, scale):
    settings = {"SUN": {"angle": 0.3}, "POINT": {"shadow_soft_size": 0.3},
                "SPOT": {"spot_size": 1.2, "spot_blend": 0.5, "shadow_soft_size": 0.1},
                "AREA": {"shape": "ELLIPSE", "size": 1.0, "size_y": 0.5}}[kind]
    turned = (math.pi + 0.2, -0.3, 0.5) if scale[2] < 0 else (0.2, -0.3, 0.5)
    lamp(kind, rotation=turned, scale=scale, **settings)
    agree()


@pytest.mark.parametrize("kind", ["SUN", "POINT", "SPOT", "AREA"])
def test_sheared(empty_blend, kind):
    shear = Matrix.Identity(4)
    shear[0][1], shear[2][0] = 0.5, 0.3
    settings = {"SPOT": {"spot_size": 1.2, "spot_blend": 0.5, "shadow_soft_size": 0.0}}.get(kind, {})
    lamp(kind, matrix=Matrix.Translation((0.4, -0.3, 2.0)) @ shear @ Euler((0.2, -0.3, 0.5)).to_matrix().to_4x4(), **settings)
    agree()


def nodes_of(data):
    """The lamp's node tree, switched on, with an Emission into the output: (nodes, links, emission)."""
    if bpy.app.version < (5, 1, 0):
        data.use_nodes = True
    tree = data.node_tree
    tree.nodes.clear()
    emission, output = tree.nodes.new("ShaderNodeEmission"), tree.nodes.new("ShaderNodeOutputLight")
    tree.links.new(emission.outputs[0], output.inputs["Surface"])
    return tree.nodes, tree.links, emission


def test_emission_node(empty_blend):
    obj = lamp("POINT", shadow_soft_size=0.0)
    _nodes, _links, emission = nodes_of(obj.data)
    emission.inputs["Color"].default_value = (0.2, 0.7, 0.9, 1.0)
    emission.inputs["Strength"].default_value = 2.5
    agree()


def test_blackbody_and_falloff_nodes(empty_blend):
    obj = lamp("AREA", shape="SQUARE", size=1.0)
    nodes, links, emission = nodes_of(obj.data)
    blackbody, falloff = nodes.new("ShaderNodeBlackbody"), nodes.new("ShaderNodeLightFalloff")
    blackbody.inputs["Temperature"].default_value = 2700.0
    falloff.inputs["Strength"].default_value = 0.5
    links.new(blackbody.outputs[0], emission.inputs["Color"])
    links.new(falloff.outputs["Quadratic"], emission.inputs["Strength"])
    agree()


def test_hidden_dark_and_portal_lamps_are_left_out(empty_blend):
    lamp("POINT").hide_render = True
    lamp("SPOT", energy=0.0)
    lamp("SUN", color=(0, 0, 0))
    portal = lamp("AREA")
    portal.data.cycles.is_portal = True
    floor()
    scene = extract_scene()
    assert scene.lights == ()
    assert not any("my " in note for note in scene.notes)


def test_shadow_flag_and_diffuse_visibility(empty_blend):
    lamp("POINT", use_shadow=False)
    lamp("SUN").visible_diffuse = False
    floor()
    scene = extract_scene()
    light, = scene.lights
    assert isinstance(light, PointLight) and not light.casts_shadow
    assert any("my sun" in note for note in scene.notes)


def test_lamps_instanced_by_a_collection(empty_blend):
    collection = bpy.data.collections.new("lamps")
    obj = lamp("POINT", location=(0, 0, 1))
    bpy.context.scene.collection.objects.unlink(obj)
    collection.objects.link(obj)
    for x in (-2.0, 3.0):
        instancer = bpy.data.objects.new("instancer", None)
        instancer.instance_type, instancer.instance_collection = "COLLECTION", collection
        instancer.location = (x, 0, 0)
        bpy.context.scene.collection.objects.link(instancer)
    floor()
    positions = sorted(tuple(np.round(light.position_world, 5)) for light in extract_scene().lights)
    assert positions == [(-2.0, 0.0, 1.0), (3.0, 0.0, 1.0)]
