"""The extraction as a whole: cameras, what it leaves behind, what it is given, how it fails."""

import numpy as np
import pytest

bpy = pytest.importorskip("bpy", reason="needs Blender or its Python module")

from blend_builders import cube_mesh, link  # noqa: E402
from mathutils import Matrix  # noqa: E402

from rtgi_addon.blender.extract import extract_scene  # noqa: E402
from rtgi_addon.errors import UsageError  # noqa: E402


def test_cameras_come_active_first_at_render_resolution(empty_blend):
    link("cube", cube_mesh())
    first = link("first", bpy.data.cameras.new("first"), Matrix.Translation((0, 0, 5)))
    second = link("second", bpy.data.cameras.new("second"), Matrix.Diagonal((2, 2, 2, 1)))
    second.data.type, second.data.shift_x, second.data.ortho_scale = "ORTHO", 0.25, 3.0
    link("hidden", bpy.data.cameras.new("hidden")).hide_render = True
    link("dome", bpy.data.cameras.new("dome")).data.type = "PANO"
    scene = bpy.context.scene
    scene.camera = second
    scene.render.resolution_x, scene.render.resolution_y, scene.render.resolution_percentage = 400, 300, 50
    extracted = extract_scene()
    assert [camera.name for camera in extracted.cameras] == ["second", "first"]
    assert all(camera.resolution == (200, 150) for camera in extracted.cameras)
    assert any("dome" in note for note in extracted.notes)
    for camera, obj in zip(extracted.cameras, (second, first), strict=True):
        expected = obj.calc_matrix_camera(bpy.context.evaluated_depsgraph_get(), x=200, y=150)
        np.testing.assert_allclose(camera.clip_from_camera, np.array(expected), atol=1e-6)
        np.testing.assert_allclose(camera.world_from_camera[:3, :3], np.eye(3), atol=1e-6)
    assert scene.camera == second


def test_extraction_leaves_no_trace_and_needs_no_camera(empty_blend):
    link("cube", cube_mesh())
    scene = bpy.context.scene
    kinds = ("scenes", "objects", "meshes", "cameras", "collections", "materials", "lights", "worlds")

    def state():
        names = {kind: sorted(item.name for item in getattr(bpy.data, kind)) for kind in kinds}
        return names, scene.camera, scene.render.engine, scene.render.resolution_x, bpy.context.scene, bpy.context.view_layer.name

    before = state()
    extracted = extract_scene()
    assert state() == before and extracted.cameras == ()
    with pytest.raises(TypeError):  # the throw-away engine is gone
        scene.render.engine = "RTGI_EXTRACT"


def test_what_goes_wrong_inside_reaches_the_caller(empty_blend):
    link("cube", cube_mesh())
    with pytest.raises(UsageError, match="nowhere"):
        extract_scene(volumes=["nowhere"])
    assert [scene.name for scene in bpy.data.scenes] == [bpy.context.scene.name]


def test_a_given_depsgraph_is_read_as_it_is(empty_blend):
    obj = link("cube", cube_mesh())
    modifier = obj.modifiers.new("subdivision", "SUBSURF")
    modifier.levels, modifier.render_levels = 1, 3
    link("hidden", cube_mesh()).hide_render = True
    scene = extract_scene(bpy.context.evaluated_depsgraph_get())
    assert [(i.name, len(scene.meshes[i.mesh].triangles)) for i in scene.instances] == [("cube", 48)]


def test_arrays_outlive_the_file(empty_blend):
    link("cube", cube_mesh())
    scene = extract_scene()
    bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
    mesh, = scene.meshes
    assert len(mesh.triangles) == 12 and np.abs(mesh.vertices_local).max() == 1.0 and np.isfinite(mesh.vertices_local).all()
