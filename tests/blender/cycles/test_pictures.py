"""Cycles' pictures for charts: through the scene's own camera, of what the bake sees, and the scene left as it was."""

import numpy as np
import pytest

bpy = pytest.importorskip("bpy", reason="needs Blender's Python module")

from cycles_scenes import everything, grade_world, lamp_in_a_box, state  # noqa: E402

from rtgi_addon.blender.cycles.pictures import CyclesPictures  # noqa: E402
from rtgi_addon.blender.extract import extract_scene  # noqa: E402
from rtgi_addon.errors import BakeError  # noqa: E402
from rtgi_addon.evaluate.pictures import picture_noise  # noqa: E402
from rtgi_addon.progress import Progress  # noqa: E402
from rtgi_addon.scene import Camera  # noqa: E402
from rtgi_addon.transport.lights.environment import Environment  # noqa: E402
from rtgi_addon.transport.views.camera import CameraView  # noqa: E402


def looking(scene):
    """A turned camera with a shifted, shallow focus in ``scene``."""
    data = bpy.data.cameras.new("Eye")
    data.shift_x, data.dof.use_dof, data.dof.focus_distance, data.dof.aperture_fstop = 0.1, True, 0.1, 0.1
    camera = bpy.data.objects.new("Eye", data)
    camera.rotation_euler = (1.2, 0.1, 0.5)
    scene.collection.objects.link(camera)
    scene.camera = camera
    scene.render.resolution_x, scene.render.resolution_y = 320, 200
    # A file without geometry has nothing to fit one to.
    scene.collection.objects.link(bpy.data.objects.new("Probes", bpy.data.lightprobes.new("Probes", "VOLUME")))
    return camera


def test_pixels_are_those_of_our_own_camera(empty_blend):
    graded_world = grade_world(bpy.context.scene)
    looking(graded_world)
    before = everything(graded_world), state(graded_world.camera.data.dof)
    scene, size = extract_scene(), (32, 20)
    found = CyclesPictures(threads=1).pictures(scene.cameras[0], size, Progress())
    base, across, up = CameraView.of(scene.cameras[0]).rays(size)
    x, y = np.meshgrid((np.arange(32) + 0.5) / 32, (np.arange(20) + 0.5) / 20)
    rays = (base + x[..., None] * across + y[..., None] * up).reshape(-1, 3)
    exact = Environment(scene.world).radiance((rays / np.linalg.norm(rays, axis=1, keepdims=True)).astype(np.float32))
    assert found.shape == (2, 20, 32, 3) and np.allclose(found, exact.reshape(20, 32, 3), atol=0.02)
    assert (everything(graded_world), state(graded_world.camera.data.dof)) == before


def test_it_renders_until_it_is_quiet_and_hides_lamps(empty_blend):
    scene = bpy.context.scene
    lamp_in_a_box(scene)
    looking(scene)
    read = extract_scene()
    found = [CyclesPictures(noise, threads=1).pictures(read.cameras[0], (16, 10), Progress()) for noise in (0.5, 0.02)]
    assert picture_noise(found[1]) <= 0.02 < picture_noise(found[0]) and not np.array_equal(found[1][0], found[1][1])
    assert found[1].mean() == pytest.approx(found[0].mean(), rel=0.1)
    with pytest.raises(BakeError, match="'Nobody' is no object"):
        CyclesPictures().pictures(Camera("Nobody", np.eye(4), np.eye(4), (16, 10)), (16, 10), Progress())
