"""What a viewport reads again when something has changed, told by Blender's own updates."""

import numpy as np
import pytest

bpy = pytest.importorskip("bpy", reason="needs Blender or its Python module")

import rtgi_addon  # noqa: E402


@pytest.fixture
def live(empty_blend):
    """A scene with a cube, a plane, a lamp and a world, as a viewport has read it; it hears of every change from now on."""
    rtgi_addon.register()
    from rtgi_addon.blender.engine.live import live_scene
    bpy.context.scene.world = bpy.data.worlds.new("World")
    bpy.ops.mesh.primitive_cube_add()
    bpy.ops.mesh.primitive_plane_add(size=8)
    bpy.ops.object.light_add(type="POINT", location=(0, 0, 3))
    depsgraph = bpy.context.evaluated_depsgraph_get()
    live = live_scene(depsgraph)
    live.read(depsgraph)

    def listen(_scene, depsgraph):
        live.take_updates(depsgraph)

    bpy.app.handlers.depsgraph_update_post.append(listen)
    yield live
    bpy.app.handlers.depsgraph_update_post.remove(listen)
    rtgi_addon.unregister()


def change():
    """Let Blender evaluate what was changed, and tell."""
    bpy.context.view_layer.update()


def test_a_lamp_that_moves_is_the_only_thing_read_again(live):
    before = live.scene
    bpy.data.objects["Point"].location = (1, 2, 3)
    change()
    assert not live.pending
    np.testing.assert_allclose(live.scene.lights[0].position_world, (1, 2, 3))
    assert live.scene.instances is before.instances and live.scene.meshes is before.meshes
    assert live.scene.world is before.world


def test_a_lamps_power_is_read_at_once(live):
    before = live.scene.lights[0].intensity
    bpy.data.lights["Point"].energy *= 2
    change()
    assert not live.pending
    np.testing.assert_allclose(live.scene.lights[0].intensity, 2 * before)


def test_an_object_that_moves_leaves_the_others_as_they_are(live):
    before = {instance.name: instance for instance in live.scene.instances}
    bpy.data.objects["Cube"].location.x = 2
    change()
    assert not live.pending
    after = {instance.name: instance for instance in live.scene.instances}
    assert after["Plane"] is before["Plane"] and after["Cube"] is not before["Cube"]
    assert after["Cube"].world_from_local[0, 3] == 2 and after["Cube"].mesh == before["Cube"].mesh


def test_what_does_not_change_is_the_same_object(live):
    before = live.scene
    bpy.data.objects["Point"].location.x += 0.0
    bpy.data.objects["Cube"].select_set(not bpy.data.objects["Cube"].select_get())
    change()
    assert live.scene is before and not live.pending


@pytest.mark.parametrize("edit", ["mesh", "material", "new object", "hidden object", "removed lamp and mesh"])
def test_what_takes_a_whole_reading_waits_for_it(live, edit):
    before = live.scene
    cube = bpy.data.objects["Cube"]
    if edit == "mesh":
        cube.data.vertices[0].co.x += 0.5
        cube.data.update()
    elif edit == "material":
        cube.data.materials.append(bpy.data.materials.new("Paint"))
    elif edit == "new object":
        bpy.context.collection.objects.link(bpy.data.objects.new("Second", cube.data))
    elif edit == "hidden object":
        cube.hide_viewport = True
    else:
        bpy.data.objects.remove(cube)
    change()
    assert live.wants_all and live.scene.meshes is before.meshes
    live.read(bpy.context.evaluated_depsgraph_get())
    assert not live.pending and live.scene is not before


def test_a_world_is_read_without_the_rest(live):
    before = live.scene
    bpy.data.worlds["World"].color = (0.2, 0.4, 0.6)
    if bpy.data.worlds["World"].node_tree is not None:
        background = next(node for node in bpy.data.worlds["World"].node_tree.nodes if node.type == "BACKGROUND")
        background.inputs["Color"].default_value = (0.2, 0.4, 0.6, 1)
        background.inputs["Strength"].default_value = 1
    change()
    assert live.wants_world and not live.wants_all
    live.read(bpy.context.evaluated_depsgraph_get())
    np.testing.assert_allclose(live.scene.world.equirect[0, 0], (0.2, 0.4, 0.6), rtol=1e-6)
    assert live.scene.meshes is before.meshes and live.scene.lights is before.lights


def test_a_scene_without_anything_says_so_and_recovers(live):
    for obj in [obj for obj in bpy.data.objects if obj.type == "MESH"]:
        bpy.data.objects.remove(obj)
    change()
    live.read(bpy.context.evaluated_depsgraph_get())
    assert "no visible geometry" in live.error and live.scene is not None
    bpy.ops.mesh.primitive_cube_add()
    change()
    live.read(bpy.context.evaluated_depsgraph_get())
    assert not live.error and len(live.scene.instances) == 1


def test_the_viewport_reads_what_the_whole_reading_reads(live):
    from rtgi_addon.blender.extract import extract_scene
    from rtgi_addon.jobs.fingerprint import content_hash
    bpy.data.objects["Cube"].location = (1, 2, 0.5)
    bpy.data.objects["Point"].rotation_euler.x = 1
    bpy.data.lights["Point"].color = (1, 0.5, 0.2)
    change()
    whole = extract_scene(bpy.context.evaluated_depsgraph_get())
    for part in ("meshes", "instances", "lights"):
        assert content_hash(getattr(live.scene, part)) == content_hash(getattr(whole, part)), part
