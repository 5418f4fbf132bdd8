"""Groups of lights as they are read from a file, sliders for light, and transfer from a bundle on disk."""

import math

import bpy
import numpy as np
import pytest

import rtgi_addon
from rtgi_addon.blender.engine import shown
from rtgi_addon.blender.extract import extract_scene
from rtgi_addon.blender.ui import light_panels, light_settings
from rtgi_addon.jobs.bake import bake_scene
from rtgi_addon.progress import Progress


@pytest.fixture
def scene(empty_blend):
    """Blender's startup scene with a sun, a glowing cube in Blender's own light group, a lamp in one by its collection."""
    rtgi_addon.register()
    made = bpy.context.scene
    bpy.ops.mesh.primitive_plane_add(size=6.0)
    bpy.ops.mesh.primitive_cube_add(size=0.6, location=(1, 0, 0.4))
    cube, glow = bpy.context.object, bpy.data.materials.new("Glow")
    shader = glow.node_tree.nodes["Principled BSDF"] if glow.node_tree else None
    if shader is None:
        glow.use_nodes = True
        shader = glow.node_tree.nodes["Principled BSDF"]
    shader.inputs["Emission Color"].default_value = (1.0, 0.5, 0.2, 1.0)
    shader.inputs["Emission Strength"].default_value = 2.0
    cube.data.materials.append(glow)
    made.view_layers[0].lightgroups.add(name="Neon")
    cube.lightgroup = "Neon"
    street = bpy.data.collections.new("Street")
    street["rtgi_light_group"] = "Lanterns"
    made.collection.children.link(street)
    for name, kind, owner in (("Sun", "SUN", made.collection), ("Lantern", "POINT", street)):
        lamp = bpy.data.objects.new(name, bpy.data.lights.new(name, kind))
        lamp.location, lamp.data.energy = (-1.0, 0.5, 1.5), 3.0
        owner.objects.link(lamp)
    bpy.ops.object.lightprobe_add(type="VOLUME", location=(0, 0, 1))
    volume = bpy.context.object
    volume.scale = (1.5, 1.5, 0.8)
    volume.data.resolution_x = volume.data.resolution_y = volume.data.resolution_z = 2
    yield made
    rtgi_addon.unregister()


def read(scene):
    return extract_scene(bpy.context.evaluated_depsgraph_get())


def test_groups_are_read_from_properties_collections_and_blenders_own(scene):
    found = read(scene)
    assert {light.name: light.light_group for light in found.lights} == {"Sun": "", "Lantern": "Lanterns"}
    assert {item.name: item.light_group for item in found.instances} == {"Plane": "", "Cube": "Neon"}
    bpy.data.objects["Cube"]["rtgi_light_group"] = "Signs"
    bpy.data.materials["Glow"]["rtgi_light_group"] = "Shop"
    assert {item.name: item.light_group for item in read(scene).instances}["Cube"] == "Signs"
    del bpy.data.objects["Cube"]["rtgi_light_group"]
    assert {item.name: item.light_group for item in read(scene).instances}["Cube"] == "Shop"


def test_sliders_list_the_groups_and_change_the_light(scene):
    bpy.ops.rtgi.find_light_groups()
    light = scene.rtgi_light
    assert [group.name for group in light.groups] == ["Lanterns", "Neon", "other"]
    found = read(scene)
    assert light_settings.in_its_light(found, scene) is found
    light.groups["Lanterns"].strength, light.groups["Lanterns"].color = 2.0, (1.0, 0.5, 0.0)
    light.use_sun_path, light.hour, light.latitude, light.day = True, 12.0, math.radians(0.0), 80
    light.sky_turn = math.radians(90.0)
    lit = light_settings.in_its_light(found, scene)
    before, after = ({lamp.name: lamp for lamp in each.lights} for each in (found, lit))
    assert np.allclose(after["Lantern"].intensity, before["Lantern"].intensity * [2.0, 1.0, 0.0])
    assert np.allclose(after["Sun"].direction_world, [0, 0, -1], atol=1e-6)
    bpy.ops.rtgi.find_light_groups()
    assert light.groups["Lanterns"].strength == 2.0


def test_sliders_can_be_animated(scene):
    bpy.ops.rtgi.find_light_groups()
    light = scene.rtgi_light
    light.use_sun_path = True
    for frame, hour, strength in ((1, 6.0, 0.0), (11, 16.0, 1.0)):
        light.hour, light.groups[0].strength = hour, strength
        light.keyframe_insert("hour", frame=frame)
        light.groups[0].keyframe_insert("strength", frame=frame)
    scene.frame_set(6)
    controls = light_settings.controls_of(scene)
    assert 6.0 < controls.hour < 16.0 and 0.0 < controls.groups[0][1][0] < 1.0


def test_a_bundle_on_disk_follows_the_light(scene, tmp_path):
    found = read(scene)
    bake_scene(found, "transfer", {"rays": 256, "sun_side": 4, "sites": 2}, tmp_path / "bake", threads=1)
    scene.rtgi.technique, scene.rtgi.output = "transfer", str(tmp_path / "bake")
    shown.forget()
    on_disk = shown.shown_for(scene)
    assert on_disk.baked is None and on_disk.field.transfer is not None and not on_disk.note
    bpy.ops.rtgi.find_light_groups()
    for group in scene.rtgi_light.groups:
        group.strength = 0.5
    lit = light_settings.in_its_light(read(scene), scene)
    field = shown.lit_for(on_disk, lit, Progress())
    groups = {name: index for index, (name, kind) in enumerate(on_disk.field.transfer.lights) if kind == "group"}
    grid = on_disk.field.transfer.grids[0]
    off = sum(0.5 * np.moveaxis(grid.lights[..., index], 0, -1) for index in groups.values())
    assert np.allclose(field.grids()[0].sh, on_disk.field.grids()[0].sh - off, atol=1e-5) and off.any()
    assert light_panels.RTGI_PT_light_controls.is_registered
