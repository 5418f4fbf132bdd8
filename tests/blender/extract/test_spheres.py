"""Light Probe Spheres as they are read, in every version of Blender that we support."""

import bpy
import numpy as np
import pytest

import rtgi_addon
from rtgi_addon.blender.extract import extract_scene
from rtgi_addon.blender.fingerprint import fingerprint


@pytest.fixture
def ball(empty_blend):
    bpy.ops.mesh.primitive_cube_add()
    probe = bpy.data.objects.new("ball", bpy.data.lightprobes.new("ball", "SPHERE"))
    bpy.context.collection.objects.link(probe)
    probe.location, probe.scale, probe.rotation_euler = (1.0, 2.0, 3.0), (1.0, 2.0, 0.5), (0.1, 0.2, 0.3)
    return probe


@pytest.fixture
def registered():
    rtgi_addon.register()
    yield
    rtgi_addon.unregister()


def read():
    bpy.context.view_layer.update()
    return extract_scene().spheres


def test_blender_s_settings_are_read(ball):
    data = ball.data
    data.influence_type, data.influence_distance, data.falloff = "BOX", 3.0, 0.25
    data.clip_start, data.clip_end = 0.125, 50.0
    data.parallax_type, data.parallax_distance = "ELIPSOID", 7.0
    found, = read()
    assert (found.name, found.influence_shape, found.influence_distance, found.falloff) == ("ball", "box", 3.0, 0.25)
    assert (found.clip_start, found.clip_end) == (0.125, 50.0)
    assert (found.parallax_shape, found.parallax_distance) == ("box", 3.0)
    assert np.allclose(found.world_from_local, np.array(ball.matrix_world)) and np.allclose(found.centre_world, (1, 2, 3))
    data.use_custom_parallax = True
    found, = read()
    assert (found.parallax_shape, found.parallax_distance) == ("sphere", 7.0)


def test_one_hidden_from_renders_is_not_there(ball):
    ball.hide_render = True
    assert read() == ()


def test_moving_one_puts_the_bake_out_of_date(registered, ball):
    def digest():
        bpy.context.view_layer.update()
        return fingerprint(bpy.context.scene, bpy.context.evaluated_depsgraph_get())

    digests = [digest()]
    ball.location.x += 1.0
    digests.append(digest())
    ball.data.falloff = 0.5
    digests.append(digest())
    bpy.context.scene.rtgi.spheres.rays = 3
    digests.append(digest())
    assert len(set(digests)) == 4
