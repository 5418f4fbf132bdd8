"""Cycles as the judge of readings: its irradiance on patches against closed forms, and the scene put back as it was."""

import numpy as np
import pytest

bpy = pytest.importorskip("bpy", reason="needs Blender or its Python module")

from blend_builders import cube_mesh, link, material, point_cloud  # noqa: E402
from fog_renders import filled_cube  # noqa: E402
from mathutils import Matrix  # noqa: E402

from rtgi_addon import techniques  # noqa: E402
from rtgi_addon.blender.cycles.changes import changed  # noqa: E402
from rtgi_addon.blender.cycles.patches import CyclesPatches  # noqa: E402
from rtgi_addon.blender.extract import extract_scene  # noqa: E402
from rtgi_addon.errors import BakeError  # noqa: E402
from rtgi_addon.evaluate.verify import Places, Suspect  # noqa: E402
from rtgi_addon.evaluate.verify.places import NORMALS  # noqa: E402
from rtgi_addon.evaluate.verify.suspects import LAMP, MATERIAL, OBJECT, WORLD  # noqa: E402
from rtgi_addon.jobs.verify import verify  # noqa: E402
from rtgi_addon.progress import Progress  # noqa: E402
from rtgi_addon.scene import Scene  # noqa: E402


def world(radiance):
    made = bpy.data.worlds.new("world")
    made.use_nodes = True
    background = made.node_tree.nodes.get("Background") or made.node_tree.nodes.new("ShaderNodeBackground")
    background.inputs["Color"].default_value = (*radiance, 1.0)
    output = made.node_tree.get_output_node("CYCLES") or made.node_tree.nodes.new("ShaderNodeOutputWorld")
    made.node_tree.links.new(background.outputs[0], output.inputs["Surface"])
    bpy.context.scene.world = made


def lamp(name, kind, energy, location=(0, 0, 2)):
    data = bpy.data.lights.new(name, kind)
    data.energy = energy
    if kind == "SUN":
        data.angle = 0.0
    else:
        data.shadow_soft_size = 0.0
    obj = link(name, data)
    obj.location = location
    return obj


def places(points, normals):
    return Places(np.asarray(points, float), np.asarray(normals, float), 1e-3, np.zeros((0, 3)), np.zeros(0, int))


def irradiance(places, without=(), extracted=None, samples=16):
    bpy.context.view_layer.update()
    return CyclesPatches(extracted or Scene("s"), samples).irradiance(places, without, Progress())


def test_lamps_and_world_have_their_closed_forms(empty_blend):
    world((0.2, 0.4, 0.6))
    lamp("sun", "SUN", 3.0)
    found = irradiance(places([[0, 0, 0], [5, 0, 0], [0, 9, 1]], [[0, 0, 1], [0, 0, -1], [0.6, 0, 0.8]]))
    sky = np.pi * np.array([0.2, 0.4, 0.6])
    expected = np.array([sky + 3.0, sky, sky + 3.0 * 0.8])
    np.testing.assert_allclose(found.mean, expected, rtol=0.01)
    assert np.all(found.variance[1] < 1e-3 * expected[1] ** 2)


@pytest.mark.parametrize("albedo", [0.0, 1.0])
def test_patches_within_media_see_them(empty_blend, albedo):
    """Half a metre below the top of a cube of fog: a sun comes through e^(−σ_t·d), and under an even sky fog that only scatters
    changes nothing. A patch outside it has what it had."""
    if not bpy.app.build_options.cycles_osl:
        pytest.skip("this Blender's Cycles has no OSL")
    world((0.2, 0.4, 0.6) if albedo else (0, 0, 0))
    if not albedo:
        lamp("sun", "SUN", 3.0)
    filled_cube(lambda nodes: nodes("VolumeCoefficients", Absorption_Coefficients=[0.8 * (1 - albedo)] * 3,
                                    Scatter_Coefficients=[0.8 * albedo] * 3).outputs[0], Matrix())
    found = irradiance(places([[0, 0, 0.5], [3, 0, 0]], [[0, 0, 1], [0, 0, 1]]), extracted=extract_scene(), samples=64)
    sky = np.pi * np.array([0.2, 0.4, 0.6])
    expected = [sky, sky] if albedo else [np.full(3, 3.0 * np.exp(-0.4)), np.full(3, 3.0)]
    np.testing.assert_allclose(found.mean, expected, rtol=0.02)


def test_a_point_lamp_falls_with_the_square_of_its_distance(empty_blend):
    world((0, 0, 0))
    lamp("bulb", "POINT", 100.0)
    found = irradiance(places([[0, 0, 0], [2, 0, 2], [0, 0, 2.5]], [[0, 0, 1], [-1, 0, 0], [0, 0.6, -0.8]]))
    expected = 100.0 / (4 * np.pi) / np.array([4.0, 4.0, 0.25 / 0.8])
    np.testing.assert_allclose(found.mean[:, 0], expected, rtol=0.01)


def test_patches_around_a_probe_do_not_shade_each_other(empty_blend):
    world((1, 1, 1))
    stood = places(2.5e-3 * NORMALS, NORMALS)
    np.testing.assert_allclose(irradiance(stood).mean, np.pi, rtol=0.01)


def box_under_a_lamp():
    world((0.0, 0.0, 0.0))
    lamp("bulb", "POINT", 100.0, (0, 0, 3))
    shade = link("shade", cube_mesh(size=0.2))
    shade.location = (0, 0, 1)
    shade.data.materials.append(material("paint", (0.9, 0.0, 0.0)))
    return extract_scene()


def test_without_an_object_a_lamp_a_material_or_the_world(empty_blend):
    extracted = box_under_a_lamp()
    below, above = [0, 0, 0], [0, 0.3, 1.6]
    spot = places([below, above], [[0, 0, 1], [0, -0.6, -0.8]])
    direct = 100.0 / (4 * np.pi) / 9.0
    assert irradiance(spot, (), extracted).mean[0, 0] < 0.1 * direct
    np.testing.assert_allclose(irradiance(spot, (Suspect(OBJECT, "shade"),), extracted).mean[0], direct, rtol=0.01)
    red = irradiance(spot, (), extracted, 256).mean[1]
    grey = irradiance(spot, (Suspect(MATERIAL, "paint"),), extracted, 256).mean[1]
    assert red[0] > red[2] + 0.01 and grey[0] == pytest.approx(grey[2], rel=0.01)
    bpy.data.objects["bulb"].data.energy = 500.0
    plain = irradiance(spot, (Suspect(LAMP, "bulb"), Suspect(OBJECT, "shade")), extracted).mean[0]
    np.testing.assert_allclose(plain, direct, rtol=0.01)
    np.testing.assert_allclose(irradiance(spot, (Suspect(WORLD), Suspect(OBJECT, "bulb")), extracted).mean, 0.0, atol=1e-6)


@pytest.mark.parametrize("kind", [OBJECT, LAMP, MATERIAL, WORLD])
def test_everything_is_put_back(empty_blend, kind):
    extracted = box_under_a_lamp()
    name = {OBJECT: "shade", LAMP: "bulb", MATERIAL: "paint", WORLD: ""}[kind]

    def state():
        tree = bpy.data.materials["paint"].node_tree
        return (bpy.data.objects["shade"].hide_render, bpy.data.objects["bulb"].data.name, bpy.context.scene.world.name,
                [(link.from_node.name, link.to_node.name, link.to_socket.name) for link in tree.links],
                {part: len(getattr(bpy.data, part)) for part in ("lights", "worlds", "materials", "objects", "meshes")})

    before = state()
    with pytest.raises(ZeroDivisionError), changed(bpy.context.scene, extracted, (Suspect(kind, name),)):
        assert state() != before
        raise ZeroDivisionError
    assert state() == before


def test_selection_settings_and_data_are_as_before(empty_blend):
    extracted = box_under_a_lamp()
    shade, bulb = bpy.data.objects["shade"], bpy.data.objects["bulb"]
    shade.select_set(True)
    bpy.context.view_layer.objects.active = bulb
    scene = bpy.context.scene
    scene.render.engine, scene.cycles.samples = "BLENDER_WORKBENCH", 77
    parts = {name: len(getattr(bpy.data, name)) for name in ("meshes", "materials", "images", "objects", "cameras")}
    irradiance(places([[0, 0, 0]], [[0, 0, 1]]), (), extracted)
    assert {name: len(getattr(bpy.data, name)) for name in parts} == parts
    assert shade.select_get() and not bulb.select_get() and bpy.context.view_layer.objects.active == bulb
    assert (scene.render.engine, scene.cycles.samples) == ("BLENDER_WORKBENCH", 77)


def test_an_override_of_all_materials_is_refused(empty_blend):
    bpy.context.view_layer.material_override = material("clay", (0.5, 0.5, 0.5))
    with pytest.raises(BakeError, match="overrides all materials"):
        CyclesPatches(Scene("s"))


def test_a_scene_is_verified_and_what_differs_is_named(empty_blend):
    """A room that agrees; then with a cloud of balls in it, which is not followed and takes much of the light."""
    lit_room((2, 2, 2))
    options = {"points": 12, "probes": 2, "paths": 256, "most_suspects": 4}
    scene = extract_scene()
    assert verify(scene, CyclesPatches(scene, 32), **options).agrees
    soot = point_cloud("soot", [(x, y, 1.0) for x in range(-1, 2) for y in range(-1, 2)], 0.6, material("black", (0, 0, 0)))
    assert soot.type == "POINTCLOUD"
    scene = extract_scene()
    report = verify(scene, CyclesPatches(scene, 32), **options)
    assert not report.agrees and report.as_read.figure.value > 0.2
    assert str(report.culprits[0].suspect) == "object soot" and len(report.alone) == 1
    assert report.not_followed[0].how == "measured" and report.not_followed[0].share > 0.2


def test_places_within_media_are_compared_where_a_camera_can(empty_blend, monkeypatch):
    """Cycles' bake of a patch does not see the medium that it lies in: without a camera such places are left out."""
    lit_room((2, 1, 1))
    fog = link("fog", cube_mesh(size=0.45))
    fog.data.materials.append(absorbing("smoke"))
    fog.location.x = 0.5
    scene = extract_scene()
    options = {"points": 12, "probes": 2, "paths": 256, "most_suspects": 0}
    if bpy.app.build_options.cycles_osl:
        report = verify(scene, CyclesPatches(scene, 32), **options)
        assert report.probes == 2 and report.agrees
    with monkeypatch.context() as patched:
        patched.setattr(CyclesPatches, "sees_media", False)
        report = verify(scene, CyclesPatches(scene, 32), **options)
        assert report.probes == 1 and report.agrees
    fog.location.x, fog.scale = 0.0, (3.0, 3.0, 3.0)
    bpy.context.view_layer.update()
    scene = extract_scene()
    if bpy.app.build_options.cycles_osl:
        field = techniques.get("probes")
        field = field.bake(scene, field.Settings(rays=256), np.random.default_rng(0), Progress())
        report = verify(scene, CyclesPatches(scene, 32), field, **options)
        assert report.probes == 2 and report.agrees and report.baked.figure.value < 0.05
    monkeypatch.setattr(CyclesPatches, "sees_media", False)
    with pytest.raises(BakeError, match="within a medium"):
        verify(scene, CyclesPatches(scene, 32), **options)


def absorbing(name):
    """A material that is nothing but a medium."""
    smoke = material(name, (0, 0, 0))
    tree = smoke.node_tree
    tree.nodes.remove(next(node for node in tree.nodes if node.bl_idname == "ShaderNodeBsdfDiffuse"))
    absorption = tree.nodes.new("ShaderNodeVolumeAbsorption")
    tree.links.new(absorption.outputs[0], tree.get_output_node("CYCLES").inputs["Volume"])
    return smoke


def lit_room(resolution):
    """A grey room with a lamp and a volume of so many probes, and no light from outside."""
    room = link("room", cube_mesh(size=2.0))
    room.data.flip_normals()
    room.data.materials.append(material("wall", (0.5, 0.5, 0.5)))
    world((0, 0, 0))
    lamp("bulb", "POINT", 100.0, (0, 0, 1.5))
    probe = bpy.data.lightprobes.new("probes", "VOLUME")
    probe.resolution_x, probe.resolution_y, probe.resolution_z = resolution
    link("probes", probe)
