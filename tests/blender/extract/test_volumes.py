"""Probe volumes: Blender's own, chosen by name, or fitted to the scene."""

import numpy as np
import pytest

bpy = pytest.importorskip("bpy", reason="needs Blender or its Python module")

from mathutils import Euler, Matrix  # noqa: E402

from rtgi_addon.blender.extract import extract_scene  # noqa: E402
from rtgi_addon.errors import BakeError, UsageError  # noqa: E402
from rtgi_addon.numerics.grid import lattice_points  # noqa: E402
from rtgi_addon.techniques.lattice.fit import fit_bounds, fit_resolution  # noqa: E402


def box(name, size, location=(0, 0, 0)):
    mesh = bpy.data.meshes.new(name)
    corners = [(x, y, z) for x in (-0.5, 0.5) for y in (-0.5, 0.5) for z in (-0.5, 0.5)]
    mesh.from_pydata(corners, [], [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)])
    obj = bpy.data.objects.new(name, mesh)
    obj.scale, obj.location = size, location
    bpy.context.scene.collection.objects.link(obj)
    return obj


def volume(name, resolution=(4, 5, 6), matrix=None):
    probe = bpy.data.lightprobes.new(name, "VOLUME")
    probe.resolution_x, probe.resolution_y, probe.resolution_z = resolution
    obj = bpy.data.objects.new(name, probe)
    obj.matrix_world = matrix or Matrix.Identity(4)
    bpy.context.scene.collection.objects.link(obj)
    return obj


def test_volume_objects_are_read(empty_blend):
    matrix = Matrix.LocRotScale((1, 2, 3), Euler((0.1, 0.2, 0.3)), (4, 5, 6))
    volume("hall", (7, 3, 2), matrix)
    sphere = bpy.data.objects.new("mirror", bpy.data.lightprobes.new("mirror", "SPHERE"))
    bpy.context.scene.collection.objects.link(sphere)
    volume("hidden").hide_render = True
    scene = extract_scene()
    found, = scene.volumes
    assert (found.name, found.resolution, found.fitted) == ("hall", (7, 3, 2), False)
    np.testing.assert_allclose(found.world_from_local, np.array(matrix), atol=1e-6)
    assert not any("fitted" in note for note in scene.notes)


def test_volumes_by_name(empty_blend):
    for name in ("a", "b", "c"):
        volume(name)
    assert [found.name for found in extract_scene(volumes=["c", "a"]).volumes] == ["c", "a"]
    with pytest.raises(UsageError, match=r"unknown probe volume 'd'.*a, b, c"):
        extract_scene(volumes=["a", "d"])


@pytest.mark.parametrize("thickness", [0.0, 0.9], ids=["plane", "slab"])
def test_fitted_to_bare_ground_it_reaches_into_the_air(empty_blend, thickness):
    """Inside a slab, or under a plane, there is nothing to light."""
    box("ground", (40, 30, thickness), (0, 0, -thickness / 2))
    found, = extract_scene().volumes
    top = found.world_from_local @ [0, 0, 1, 1]
    assert top[2] == pytest.approx(4.0, rel=1e-5)
    heights = lattice_points(found.world_from_local, found.resolution)[:, 0, 0, 2]
    assert np.mean(heights > 0) >= 0.5


def test_fitted_to_a_room_and_said_so(empty_blend):
    box("room", (6, 4, 3), (1, 0, 1.5))
    box("chair", (0.5, 0.5, 1), (1, 0, 0.5))
    lamp = bpy.data.objects.new("lamp", bpy.data.lights.new("lamp", "POINT"))
    lamp.location = (0, 0, 2)
    bpy.context.scene.collection.objects.link(lamp)
    scene = extract_scene()
    found, = scene.volumes
    assert found.fitted
    np.testing.assert_allclose(np.diag(found.world_from_local)[:3], (3, 2, 1.5), atol=1e-5)
    np.testing.assert_allclose(found.world_from_local[:3, 3], (1, 0, 1.5), atol=1e-5)
    count = int(np.prod(found.resolution))
    note, = [note for note in scene.notes if "fitted" in note]
    assert str(count) in note and "6 × 4 × 3" in note


def test_no_geometry_to_fit_to_is_an_error(empty_blend):
    with pytest.raises(BakeError, match="no visible geometry"):
        extract_scene()


def test_a_ground_plane_is_not_followed_to_the_horizon(empty_blend):
    box("house", (8, 6, 5), (20, 0, 2.5))
    box("shed", (3, 3, 3), (30, 0, 1.5))
    box("ground", (1000, 1000, 0.001))
    found, = extract_scene().volumes
    low = found.world_from_local[:3, 3] - np.diag(found.world_from_local)[:3]
    high = found.world_from_local[:3, 3] + np.diag(found.world_from_local)[:3]
    assert np.all(low <= (16, -3, 0.001)) and np.all(high >= (31.5, 3, 5))
    assert np.all(high - low < 60)


def test_rooms_domes_and_lone_planes():
    chair = [(0, 0, 0), (0.5, 0.5, 1)]
    room = np.array([[(-5, -5, 0), (5, 5, 0)], [(-5, -5, 0), (-5, 5, 3)], [(5, -5, 0), (5, 5, 3)], chair], float)
    low, high = fit_bounds(room)
    np.testing.assert_array_equal([low, high], [(-5, -5, 0), (5, 5, 3)])
    one_mesh = np.array([[(-5, -5, 0), (5, 5, 3)], chair], float)
    np.testing.assert_array_equal(fit_bounds(one_mesh), [(-5, -5, 0), (5, 5, 3)])
    dome = np.concatenate([one_mesh, [[(-900, -900, -900), (900, 900, 900)]]])
    low, high = fit_bounds(dome)
    assert np.all(low > -11) and np.all(high < 11) and np.all(low <= -5) and np.all(high >= (5, 5, 3))
    plane = np.array([[(-5, -5, 0), (5, 5, 0)]], float)
    np.testing.assert_array_equal(fit_bounds(plane), plane[0])


@pytest.mark.parametrize("size", [(1, 1, 1), (10, 8, 3), (100, 1, 1), (100, 100, 1), (0.01, 0.02, 0.015), (300, 200, 12)])
def test_fitted_resolution_keeps_to_its_bounds(size):
    resolution = np.array(fit_resolution(size))
    assert 64 <= np.prod(resolution) <= 4096 and np.all(resolution >= 2)
    cells = np.array(size) / resolution
    free = resolution > 2
    if free.sum() > 1:
        assert cells[free].max() / cells[free].min() < 1.5


def test_instances_far_off_and_not_finite_vertices_do_not_spoil_the_fit(empty_blend):
    obj = box("room", (6, 4, 3))
    obj.data.vertices[0].co = (float("nan"), 0, 0)
    found, = extract_scene().volumes
    assert np.isfinite(found.world_from_local).all()
    np.testing.assert_allclose(np.diag(found.world_from_local)[:3], (3, 2, 1.5), atol=1e-5)


def test_blenders_own_bake_settings_are_read(empty_blend):
    """Capture World is off for a new volume; that takes no light from it."""
    volume("plain")
    odd = volume("odd").data
    odd.capture_indirect, odd.capture_emission, odd.capture_world, odd.intensity = False, False, True, 2.0
    plain, other = extract_scene().volumes
    assert (plain.capture_bounces, plain.capture_emission, plain.capture_world, plain.intensity) == (True, True, False, 1.0)
    assert plain.captures_all
    assert (other.capture_bounces, other.capture_emission, other.capture_world, other.intensity) == (False, False, True, 2.0)
    assert not extract_scene().omissions
