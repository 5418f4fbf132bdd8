"""What smooth metals show of lamps by rays, held to Cycles."""

import numpy as np
import pytest

bpy = pytest.importorskip("bpy", reason="needs Blender's Python module")

from rtgi_addon.blender.cycles.pictures import CyclesPictures  # noqa: E402
from rtgi_addon.blender.extract import extract_scene  # noqa: E402
from rtgi_addon.effects import Chosen, get  # noqa: E402
from rtgi_addon.effects.picture import draw_pictures  # noqa: E402
from rtgi_addon.progress import Progress  # noqa: E402
from rtgi_addon.transport.views.camera import CameraView  # noqa: E402

SIZE = 24, 24


def ball_and_lamp(scene):
    """A smooth ball of steel without roughness, an area lamp that it shows, and nothing else."""
    bpy.ops.mesh.primitive_ico_sphere_add(subdivisions=4, radius=0.5)
    ball = bpy.context.object
    bpy.ops.object.shade_smooth()
    material = bpy.data.materials.new("Steel")
    if material.node_tree is None:
        material.use_nodes = True
    shader = next(node for node in material.node_tree.nodes if node.type == "BSDF_PRINCIPLED")
    shader.inputs["Base Color"].default_value = (0.8, 0.6, 0.4, 1.0)
    shader.inputs["Metallic"].default_value, shader.inputs["Roughness"].default_value = 1.0, 0.0
    ball.data.materials.append(material)
    lamp = bpy.data.objects.new("Lamp", bpy.data.lights.new("Lamp", "AREA"))
    lamp.data.shape, lamp.data.size, lamp.data.size_y, lamp.data.energy = "RECTANGLE", 2.4, 0.8, 60.0
    lamp.location, lamp.rotation_euler = (0.3, -0.4, 2.0), (0.0, 0.0, 0.3)
    camera = bpy.data.objects.new("Eye", bpy.data.cameras.new("Eye"))
    camera.location, camera.rotation_euler, camera.data.lens = (0.0, -2.5, 0.6), (1.335, 0.0, 0.0), 70.0
    for thing in (lamp, camera):
        scene.collection.objects.link(thing)
    scene.camera = camera
    scene.render.resolution_x, scene.render.resolution_y = SIZE
    scene.world = None


def test_a_lamp_in_smooth_metal_is_as_in_cycles(empty_blend):
    """As bright, as large, and without a halo: where Cycles' ball shows none of the lamp, ours shows none."""
    ball_and_lamp(bpy.context.scene)
    scene = extract_scene()
    cycles = CyclesPictures(0.1, threads=1).pictures(scene.cameras[0], SIZE, Progress())
    effect = get("ray_traced")
    found = draw_pictures(scene, None, CameraView.of(scene.cameras[0]), SIZE, samples=128, threads=1,
                          effects=[Chosen(effect, effect.Settings(diffuse_rays=0))]).pictures["combined"][..., :3]
    mean = cycles.mean(axis=0)
    dark = cycles.max(axis=(0, -1)) < 1e-3 * mean.max()
    assert 20 < np.count_nonzero(~dark) < 0.2 * dark.size
    assert found.sum(axis=(0, 1)) == pytest.approx(mean.sum(axis=(0, 1)), rel=0.01)
    assert found[dark].max() < 2e-3 * mean.max() and found[dark].sum() < 2e-3 * mean.sum()
    assert np.abs(found - mean).max() < 0.1 * mean.max()
