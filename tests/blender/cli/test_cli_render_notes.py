"""What `render` says of places that little can be seen from: a camera and a sphere probe in a block of stone."""

import json

import pytest
from command_line import run

bpy = pytest.importorskip("bpy", reason="needs Blender or its Python module")


@pytest.fixture
def buried(tmp_path):
    """A .blend with a room, a lamp in it, and a block in it that holds the camera and a sphere probe."""
    bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
    for name, size in (("Room", 4.0), ("Block", 1.0)):
        bpy.ops.mesh.primitive_cube_add(size=size)
        bpy.context.object.name = name
    lamp, camera = bpy.data.lights.new("Lamp", "POINT"), bpy.data.cameras.new("Camera")
    volume, sphere = bpy.data.lightprobes.new("Probes", "VOLUME"), bpy.data.lightprobes.new("Ball", "SPHERE")
    volume.resolution_x = volume.resolution_y = volume.resolution_z = 2
    for data, place in ((lamp, (0.5, 0.3, 1.2)), (volume, (0.0, 0.0, 0.0)), (camera, (0.1, 0.2, 0.0)), (sphere, (0.2, 0.1, 0.1))):
        obj = bpy.data.objects.new(data.name, data)
        obj.location = place
        bpy.context.collection.objects.link(obj)
    scene = bpy.context.scene
    scene.camera, scene.render.resolution_x, scene.render.resolution_y = bpy.data.objects["Camera"], 12, 8
    path = tmp_path / "buried.blend"
    bpy.ops.wm.save_as_mainfile(filepath=str(path), check_existing=False)
    yield path
    bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)


def test_a_picture_says_what_its_camera_lies_in_and_what_its_own_bake_found(buried, tmp_path):
    small = ("--set", "spheres.rays=1", "--set", "spheres.resolution=32", "--samples", 1)
    code, text, err = run(buried, "render", "--technique", "tiny", "--device", "cpu", "--effect", "screen_reflections", *small,
                          "--out", tmp_path / "x.exr", "--json")
    assert code == 0, err
    notes = json.loads(text)["notes"]
    assert "camera Camera lies inside Block, which no light gets into: move it into the open" in notes
    assert any(note.startswith("sphere probe Ball does not see Block") for note in notes), notes
