"""The export to Godot in a real Godot: imported without a word, equal to our own lookup at every point, beside our own picture.

RTGI_GODOT holds the command that starts a Godot 4.6, with a display for the tests that draw, for example
`python tools/debian_tree.py run TREE --bind /tmp -- xvfb-run -a godot`. Pictures are kept in RTGI_SCREENSHOTS, if that names a
folder: tools/readme_pictures.py makes the README's of them.
"""

import re
import shutil
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from engine_pictures import atrium, keep, through_our_filter
from real_godot import complaints, drawing, godot, imported, needs_godot, replacing

from rtgi_addon.exchange import engines
from rtgi_addon.exchange.engines import ExportSettings

ROOT = Path(__file__).resolve().parents[2]
CORNELL = ROOT / "sample_blends/cornell_box.blend"
SIZE = 240

pytestmark = [pytest.mark.slow, needs_godot]


@pytest.fixture(scope="module")
def project(kit_bundle, tmp_path_factory):
    """The kit exported and imported."""
    return imported(engines.get("godot").export(kit_bundle, tmp_path_factory.mktemp("godot") / "kit").out)


@pytest.fixture(scope="module")
def cornell(tmp_path_factory):
    """The Cornell box baked with direct light and exported with its model, imported: the bundle and the project."""
    bpy = pytest.importorskip("bpy", reason="needs Blender or its Python module")
    if not bpy.app.module:
        pytest.skip("the module's door needs the module: this is a real Blender")
    folder = tmp_path_factory.mktemp("cornell")
    rtgi("bake", "--direct", "--rays", 256, "--out", folder / "bundle")
    rtgi("export", folder / "bundle", "--engine", "godot", "--out", folder / "project")
    return folder / "bundle", imported(folder / "project")


def rtgi(*words, file=CORNELL):
    """Run a subcommand on a file."""
    ran = subprocess.run([sys.executable, "-m", "rtgi_addon", file, *map(str, words)], cwd=ROOT, capture_output=True,
                         text=True, timeout=300, check=False)
    assert ran.returncode == 0, ran.stderr


def conformance(project, *words):
    return godot(project, *words, "--script", "conformance/conformance.gd")


def test_scripts_agree_without_a_display(project):
    code, said = conformance(project, "--headless")
    assert code == 0 and said.count("PASS ") == 12 and "FAIL" not in said, said
    assert "SKIP the shader" in said and not complaints(said), said


def test_probes_that_were_fitted_are_read_as_we_read_them(tmp_path):
    """Coefficients and distances that a fit moved, in the 16 bits in which Godot holds them: scripts and shaders."""
    pytest.importorskip("bpy", reason="needs Blender or its Python module")
    rtgi("bake", "--fit", "--error", 0.1, "--out", tmp_path / "bundle")
    rtgi("export", tmp_path / "bundle", "--engine", "godot", "--out", tmp_path / "project")
    code, said = conformance(imported(tmp_path / "project"), "--rendering-driver", "opengl3")
    drawing(said)
    assert code == 0 and "FAIL" not in said and "PASS weights, shader" in said and not complaints(said), said


@pytest.mark.parametrize("options", [("--rendering-driver", "vulkan"), ("--rendering-method", "mobile"),
                                     ("--rendering-driver", "opengl3")], ids=["forward+", "mobile", "compatibility"])
def test_shaders_and_dynamic_objects_agree(project, options):
    code, said = conformance(project, *options)
    drawing(said)
    assert code == 0 and said.count("PASS ") == 26 and "FAIL" not in said, said
    assert "PASS dynamic objects:" in said and "PASS scattered, shader, moved:" in said and not complaints(said), said


def turned_light_data(whole):
    """Every coefficient one place on."""
    return re.sub(r'("sh": PackedColorArray\()(.*)((?:, [^,)]+){4})\)',
                  lambda found: f"{found[1]}{found[3][2:]}, {found[2]})", whole)


@pytest.mark.parametrize(("file", "damage", "failing"), [
    ("irradiance.gdshaderinc", replacing("return share * share;", "return 1.0;"), "visibility, shader"),
    ("irradiance.gdshaderinc", replacing("offset.x, -offset.z", "offset.x, offset.z"), "visibility, shader"),
    ("irradiance.gdshaderinc", replacing("ninth = 0.5", "ninth = -0.5"), "known content, shader"),
    ("irradiance.gdshaderinc", replacing("RTGI_SIDE_FLOOR 0.2", "RTGI_SIDE_FLOOR 0.21"), "weights, shader"),
    ("irradiance.gdshaderinc", replacing("bias * surface_normal", "bias * normal"), "weights, shader"),
    ("irradiance.gdshaderinc", replacing("word > 0.0, offset", "true, offset"), "scattered, shader"),
    ("light_data.tres", turned_light_data, "dynamic objects"),
], ids=["seen share", "tiles", "last band", "a number", "normals", "words", "light data"])
def test_the_kit_finds_damage(project, file, damage, failing):
    path = project / "conformance/kit" / file
    whole = path.read_text()
    try:
        path.write_text(damage(whole))
        code, said = conformance(project, "--rendering-driver", "vulkan")
    finally:
        path.write_text(whole)
    drawing(said)
    assert code == 1 and f"FAIL {failing}" in said and "PASS bundle, script" in said, said


def test_the_editor_opens_the_sample(cornell):
    code, said = godot(cornell[1], "--headless", "--editor", "sample.tscn", "--quit-after", 30)
    assert code == 0 and not complaints(said), said


def picture(project, path, *words, size=SIZE):
    """The sample scene (size, size, 3) float32 as Godot draws it, scene-linear."""
    code, said = godot(project, "--rendering-driver", "vulkan", "--script", Path(__file__).parent / "godot_sample.gd", "--", path,
                       size, *words)
    drawing(said)
    assert code == 0 and not complaints(said), said
    return np.fromfile(path, "<f4").reshape(size, size, 3), said


def test_the_sample_beside_our_picture(gpu_device, cornell, tmp_path):
    """Mean relative difference in linear light of the Cornell box in its probes' light, from its camera: edges included."""
    from rtgi_addon.exchange.exr import read_exr
    bundle, project = cornell
    theirs, said = picture(project, tmp_path / "godot.raw")
    assert "lamps 0, camera Camera" in said, said
    # Of 8 samples a pixel the noise of silhouettes alone is 0.2 % of the mean.
    rtgi("render", "--bundle", bundle, "--pass", "indirect", "--samples", 32, "--scale", SIZE / 480, "--out", tmp_path / "ours.exr")
    planes, _ = read_exr(tmp_path / "ours.exr")
    ours = np.stack([planes[name] for name in "RGB"], axis=-1)
    keep("godot beside our own", np.concatenate([theirs, np.zeros_like(ours[:, :4]), ours], axis=1))
    difference = np.abs(theirs - ours)
    assert difference.mean() < 0.01 * ours.mean()
    # Away from the edges of things nothing but the halves is left.
    assert np.median(difference[ours > 0]) < 1e-3 * ours.mean()
    assert abs(theirs.mean() / ours.mean() - 1.0) < 2e-3


def test_the_atrium_is_the_baked_scene(empty_blend, tmp_path):
    """Banners that share a mesh and link their own cloth, pebbles that geometry nodes instance, and the sky: as in our picture, all
    light from the probes."""
    from rtgi_addon.exchange.exr import read_exr
    file = atrium(tmp_path, SIZE)
    rtgi("bake", "--direct", "--rays", 64, "--order", 1, "--bounces", 1, "--out", tmp_path / "bundle", file=file)
    rtgi("export", tmp_path / "bundle", "--engine", "godot", "--no-conformance", "--out", tmp_path / "project", file=file)
    drawn, said = picture(imported(tmp_path / "project"), tmp_path / "godot.raw", size=4 * SIZE)
    rtgi("render", "--bundle", tmp_path / "bundle", "--device", "cpu", "--samples", 96, "--out", tmp_path / "ours.exr", file=file)
    planes, _ = read_exr(tmp_path / "ours.exr")
    ours, theirs = np.stack([planes[name] for name in "RGB"], axis=-1), through_our_filter(drawn, 4)
    keep("atrium in godot beside our own", np.concatenate([theirs, np.zeros_like(ours[:, :4]), ours], axis=1))
    assert said.count("mesh Pebbles") > 100 and abs(theirs.mean() / ours.mean() - 1.0) < 0.01
    # Every pixel, edges and textures too: Godot's own samples a pixel once, which alone makes 3 % here.
    assert np.abs(theirs - ours).mean() < 0.01 * ours.mean()


@pytest.mark.parametrize(("kind", "power", "irradiance"), [
    ("POINT", 100.0, 100.0 / (4 * np.pi * 2.0**2)), ("SPOT", 100.0, 100.0 / (4 * np.pi * 2.0**2)), ("SUN", 2.0, 2.0)])
def test_the_models_lamps_give_what_they_give_in_blender(empty_blend, kit_bundle, tmp_path, kind, power, irradiance):
    """A grey floor two metres below a lamp, and probes without light, which say that lamps are not in them."""
    bpy = empty_blend
    from rtgi_addon.blender.model import export_model
    bpy.ops.mesh.primitive_plane_add(size=8)
    material = bpy.data.materials.new("Grey")
    if material.node_tree is None:  # Blender 4.5
        material.use_nodes = True
    material.node_tree.nodes["Principled BSDF"].inputs["Base Color"].default_value = (0.5, 0.5, 0.5, 1.0)
    material.node_tree.nodes["Principled BSDF"].inputs["Roughness"].default_value = 1.0
    bpy.context.object.data.materials.append(material)
    bpy.ops.object.light_add(type=kind, location=(0, 0, 2))
    bpy.context.object.data.energy = power
    if kind == "SPOT":
        bpy.context.object.data.spot_size = np.radians(90.0)
    bpy.ops.object.camera_add(location=(0, 0, 1.8), rotation=(0, 0, 0))
    bpy.context.scene.camera = bpy.context.object
    made = export_model(tmp_path / "model.glb")
    assert made[:3] == ((), (), ())
    dark = replace(kit_bundle, grids=tuple(replace(grid, sh=0.0 * grid.sh) for grid in kit_bundle.grids[:1]))
    settings = ExportSettings(model=str(tmp_path / "model.glb"), conformance=False)
    project = imported(engines.get("godot").export(dark, tmp_path / "project", settings).out)
    found, said = picture(project, tmp_path / "floor.raw", size=64)
    assert "lamps 1" in said
    # Godot adds a dielectric's gloss, one or two hundredths at this roughness.
    assert found[32, 32] == pytest.approx(np.full(3, 0.5 / np.pi * irradiance), rel=0.04)


def test_lamps_and_objects_are_what_they_are_to_the_bake(empty_blend, kit_bundle, tmp_path):
    """By their names in Blender, which Godot changes: a lamp in the probes is gone, others and a dynamic mesh are told to bakes."""
    bpy = empty_blend
    from rtgi_addon.blender.model import export_model
    for name in ("Wall", "Door.001"):
        bpy.ops.mesh.primitive_plane_add()
        bpy.context.object.name = name
    for name in ("Key.001", "Fill", "Torch"):
        bpy.ops.object.light_add(type="POINT", location=(0, 0, 2))
        bpy.context.object.name = name
    export_model(tmp_path / "model.glb")
    manifest = {**kit_bundle.manifest, "includes_direct": True, "lamps": {"Key.001": "all", "Fill": "bounces", "Torch": "none"},
                "objects": {"Door.001": "dynamic"}}
    settings = ExportSettings(model=str(tmp_path / "model.glb"), conformance=False)
    told = replace(kit_bundle, manifest=manifest)
    project = imported(engines.get("godot").export(told, tmp_path / "project", settings).out)
    _, said = picture(project, tmp_path / "roles.raw", size=16)
    # Light3D: BAKE_DISABLED 0, BAKE_DYNAMIC 2; GeometryInstance3D: GI_MODE_STATIC 1, GI_MODE_DYNAMIC 2.
    assert "lamps 2" in said and "lamp Fill bakes 2" in said and "lamp Torch bakes 0" in said and "Key" not in said
    assert "mesh Door_001 mode 2" in said and "mesh Wall mode 1" in said


def test_the_ball_is_lit_and_follows(cornell, tmp_path):
    """A dynamic object in the sample: there, not black, and no brighter than the room's light."""
    _, project = cornell
    without, _ = picture(project, tmp_path / "without.raw")
    found, _ = picture(project, tmp_path / "with.raw", "ball")
    keep("godot with its ball", found)
    changed = np.abs(found - without).max(axis=-1) > 0.02
    assert 0.002 < changed.mean() < 0.1
    assert 0.05 < np.median(found[changed]) < 3.0 * without.max()
    # All of it turned and moved, the camera too: every route has to follow.
    turned, _ = picture(project, tmp_path / "turned.raw", "ball", "turned")
    assert np.abs(turned - found).mean() < 5e-3 * found.mean()
    assert np.abs(turned - found)[changed].mean() < 0.02 * found[changed].mean()


def test_without_a_model_there_are_balls(cornell, tmp_path):
    project = tmp_path / "project"
    shutil.copytree(cornell[1], project, ignore=shutil.ignore_patterns("model*"))
    found, said = picture(project, tmp_path / "balls.raw")
    assert "camera Camera" in said and np.isfinite(found).all() and (found > 0.01).mean() > 0.05
