"""The smallest scene that every command of the documentation can be tried on."""

import pytest


@pytest.fixture(scope="session")
def tiny_scene(tmp_path_factory):
    """FILE.blend: a grey room of 4 m with a lamp, a camera, and a volume called Probes of 2 x 2 x 2."""
    bpy = pytest.importorskip("bpy", reason="needs Blender or its Python module")
    bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
    bpy.ops.mesh.primitive_cube_add(size=4.0)
    lamp = bpy.data.lights.new("Lamp", "POINT")
    lamp.energy = 100.0
    camera = bpy.data.cameras.new("Camera")
    probes = bpy.data.lightprobes.new("Probes", "VOLUME")
    probes.resolution_x = probes.resolution_y = probes.resolution_z = 2
    for data, place in ((lamp, (0.5, 0.3, 1.2)), (camera, (0.0, 0.0, 1.5)), (probes, (0.0, 0.0, 0.0))):
        obj = bpy.data.objects.new(data.name, data)
        obj.location = place
        bpy.context.collection.objects.link(obj)
    bpy.data.objects["Probes"].scale = (1.8, 1.8, 1.8)
    bpy.context.scene.camera = bpy.data.objects["Camera"]
    render = bpy.context.scene.render
    render.resolution_x, render.resolution_y = 64, 48
    path = tmp_path_factory.mktemp("scene") / "FILE.blend"
    bpy.ops.wm.save_as_mainfile(filepath=str(path), check_existing=False)
    bpy.ops.export_scene.gltf(filepath=str(path.with_suffix(".glb")), export_lights=True, export_cameras=True)
    bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
    return path
