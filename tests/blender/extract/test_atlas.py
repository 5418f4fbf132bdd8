"""Objects in the light atlas as they are read, the operator that unwraps them, and the whole way from a file to a bundle."""

import subprocess
import sys
from pathlib import Path

import bpy
import numpy as np
import pytest

import rtgi_addon
from rtgi_addon.blender.extract import extract_scene
from rtgi_addon.blender.fingerprint import fingerprint
from rtgi_addon.effects.atlas.bake import require_atlas
from rtgi_addon.effects.atlas.islands import islands_of
from rtgi_addon.effects.atlas.settings import AtlasSettings
from rtgi_addon.effects.atlas.unwrapped import lay_out, places_of
from rtgi_addon.transport.surfaces.geometry import flatten

ROOT = Path(__file__).resolve().parents[3]


@pytest.fixture
def cubes(empty_blend):
    rtgi_addon.register()
    found = []
    for number in range(2):
        bpy.ops.mesh.primitive_cube_add(location=(4.0 * number, 0.0, 0.0))
        found.append(bpy.context.object)
        found[-1].data.uv_layers.new(name="Extra")
    yield found
    rtgi_addon.unregister()


def read():
    bpy.context.view_layer.update()
    return extract_scene()


def test_what_is_in_the_atlas_keeps_its_maps(cubes):
    cubes[1].rtgi.atlas, cubes[1].rtgi.atlas_uv = True, "Extra"
    scene = read()
    by_name = {item.name: item for item in scene.instances}
    assert [by_name[obj.name].atlas for obj in cubes] == [None, "Extra"]
    maps = [list(scene.meshes[by_name[obj.name].mesh].uv_layers) for obj in cubes]
    assert maps == [[], ["UVMap", "Extra"]]


def test_unwrapping_gives_a_map_that_can_be_baked(cubes):
    cubes[0].scale = (2.0, 1.0, 0.5)
    bpy.context.view_layer.update()
    for obj in cubes:
        obj.select_set(True)
    shown = cubes[0].data.uv_layers[0].name
    assert bpy.ops.rtgi.unwrap_atlas() == {"FINISHED"}
    scene = read()
    require_atlas(scene, AtlasSettings())
    geometry = flatten(scene)
    sheet = lay_out(scene, geometry, AtlasSettings())
    assert [part.uv_map for part in sheet.parts] == ["Lightmap", "Lightmap"] and {part.texcoord for part in sheet.parts} == {2}
    for part in sheet.parts:
        places = places_of(part, sheet, scene, geometry)
        area = geometry.areas[geometry.instance == part.instance].sum()
        assert abs(len(places.texel) / 16 / 64 / area - 1.0) < 0.05
        assert len(np.unique(places.triangle)) == 12
    assert next(layer.name for layer in cubes[0].data.uv_layers if layer.active_render) == shown
    assert all(obj.select_get() for obj in cubes) and bpy.context.mode == "OBJECT"


def test_faces_about_an_edge_are_islands_apart(cubes):
    """Smart UV Project laid two sides of this one edge to edge, and each read the other's light."""
    corners = [(x, y, z) for z in (-0.7, 0.7) for y in (-0.45, 0.45) for x in (-0.099, 0.099)]
    cubes[0].data = bpy.data.meshes.new("jamb")
    cubes[0].data.from_pydata(corners, [], [(0, 4, 6, 2), (1, 3, 7, 5), (0, 1, 5, 4), (2, 6, 7, 3), (0, 2, 3, 1), (4, 5, 7, 6)])
    bpy.ops.object.select_all(action="DESELECT")
    cubes[0].select_set(True)
    bpy.ops.rtgi.unwrap_atlas()
    built = read()
    mesh = built.meshes[next(item for item in built.instances if item.name == cubes[0].name).mesh]
    assert islands_of(mesh.vertices_local[mesh.triangles], 100.0 * mesh.uv_layers["Lightmap"]).max() == 5


def test_islands_are_fitted_to_light(cubes):
    """A cube whose top is lit from near by: its island becomes the largest, and texels stay as many."""
    light = bpy.data.lights.new("lamp", "POINT")
    light.energy, light.rtgi.bake = 200.0, "ALL"
    lamp = bpy.data.objects.new("lamp", light)
    lamp.location = (0.4, 0.3, 1.3)
    bpy.context.collection.objects.link(lamp)
    bpy.data.objects.remove(cubes[1])
    with pytest.raises(RuntimeError, match="no object has a map of Unwrap for Light Atlas"):
        bpy.ops.rtgi.fit_atlas()
    bpy.ops.object.select_all(action="DESELECT")
    cubes[0].select_set(True)
    bpy.context.view_layer.objects.active = cubes[0]
    bpy.ops.rtgi.unwrap_atlas()
    known = []
    for fit in (False, True):
        if fit:
            assert bpy.ops.rtgi.fit_atlas() == {"FINISHED"}
        built = read()
        require_atlas(built, AtlasSettings())
        geometry = flatten(built)
        sheet = lay_out(built, geometry, AtlasSettings())
        places = places_of(sheet.parts[0], sheet, built, geometry)
        share = np.bincount(geometry.local_triangle[places.triangle], minlength=12)
        known.append((len(places.texel), share, geometry.normals_world[:, 2] > 0.5))
    (before, even, _), (after, fitted, top) = known
    assert abs(after / before - 1.0) < 0.05 and np.ptp(even) < 0.1 * even.max()
    assert fitted[top].min() > 2.0 * fitted[~top].max()
    assert cubes[0].select_get() and bpy.context.mode == "OBJECT"


def test_the_atlas_puts_a_bake_out_of_date(cubes):
    def digest():
        bpy.context.view_layer.update()
        return fingerprint(bpy.context.scene, bpy.context.evaluated_depsgraph_get())

    digests = [digest()]
    cubes[0].rtgi.atlas = True
    digests.append(digest())
    bpy.context.scene.rtgi.atlas.density = 20.0
    digests.append(digest())
    assert len(set(digests)) == 3


def test_from_a_file_to_a_bundle(cubes, tmp_path):
    for obj in cubes:
        obj.select_set(obj is cubes[0])
    bpy.ops.rtgi.unwrap_atlas()
    cubes[0].rtgi.atlas = False
    bpy.ops.object.light_add(type="SUN")
    file = tmp_path / "cubes.blend"
    bpy.ops.wm.save_as_mainfile(filepath=str(file))
    out, few = str(tmp_path / "out"), ["--rays", "64", "--set", "atlas.rays=16", "--set", "atlas.density=2"]
    assert rtgi(file, "bake", "--out", out, *few, "--atlas", cubes[0].name)[0] == 0
    assert {path.name for path in (tmp_path / "out/atlas").iterdir()} >= {"atlas.json", "sh0.exr", "lightmap.png"}
    code, said = rtgi(file, "bake", "--out", out, *few, "--atlas", f"{cubes[0].name}=Missing")
    assert code == 1 and "has no UV map 'Missing': choose one of UVMap, Extra, Lightmap" in said


def rtgi(*words):
    ran = subprocess.run([sys.executable, "-m", "rtgi_addon", *map(str, words)], cwd=ROOT, capture_output=True, text=True,
                         timeout=300, check=False)
    return ran.returncode, ran.stderr


def test_unwrapping_ends_at_low_densities(cubes):
    """Blender's packing did not, of a thin box that few texels cover."""
    bpy.context.scene.rtgi.atlas.density = 1.0
    cubes[0].scale, cubes[1].scale = (2.2, 1.7, 0.1), (0.1, 0.45, 0.7)
    bpy.context.view_layer.update()
    for obj in cubes:
        obj.select_set(True)
    assert bpy.ops.rtgi.unwrap_atlas() == {"FINISHED"}
    require_atlas(read(), AtlasSettings(density=1.0))
