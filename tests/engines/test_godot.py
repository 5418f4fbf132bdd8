"""The export to Godot in a real Godot: imported without a word, equal to our own lookup at every point, beside our own picture.

RTGI_GODOT holds the command that starts a Godot 4.6, with a display for the tests that draw, for example
`python tools/debian_tree.py run TREE --bind /tmp -- xvfb-run -a godot`.
"""

import os
import re
import shlex
import shutil
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from rtgi_addon.exchange import engines
from rtgi_addon.exchange.engines import ExportSettings

ROOT = Path(__file__).resolve().parents[2]
CORNELL = ROOT / "sample_blends/cornell_box.blend"
SIZE = 240

pytestmark = [pytest.mark.slow, pytest.mark.skipif(
    "RTGI_GODOT" not in os.environ, reason="needs a real Godot: RTGI_GODOT is the command that starts it")]


def godot(project, *words):
    """Exit code and everything that Godot says about ``project``."""
    command = [*shlex.split(os.environ["RTGI_GODOT"]), "--audio-driver", "Dummy", "--path", str(project), *map(str, words)]
    ran = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, timeout=300, check=False)
    return ran.returncode, ran.stdout + ran.stderr


def complaints(said):
    """What Godot complains of in what it ``said``, but for what a machine without a sound card or a display does."""
    lines = [line for line in said.splitlines() if re.search(r"\b(ERROR|WARNING)\b", line)]
    return [line for line in lines if not re.search(r"V-Sync|vsync|ALSA|audio|dbus|libdecor|RADV|MESA", line, re.IGNORECASE)]


def imported(folder):
    """``folder`` after Godot has imported it."""
    code, said = godot(folder, "--headless", "--import")
    assert code == 0 and not complaints(said), said
    return folder


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


def rtgi(*words):
    """Run a subcommand on the Cornell box."""
    ran = subprocess.run([sys.executable, "-m", "rtgi_addon", CORNELL, *map(str, words)], cwd=ROOT, capture_output=True,
                         text=True, timeout=300, check=False)
    assert ran.returncode == 0, ran.stderr


def conformance(project, *words):
    return godot(project, *words, "--script", "conformance/conformance.gd")


def drawing(said):
    """Skip where Godot found no driver to draw with."""
    if "Using Device" not in said:
        pytest.skip(f"this Godot cannot draw here: {(complaints(said) or said.splitlines())[-1:]}")


def test_scripts_agree_without_a_display(project):
    code, said = conformance(project, "--headless")
    assert code == 0 and said.count("PASS ") == 8 and "FAIL" not in said, said
    assert "SKIP the shader" in said and not complaints(said), said


@pytest.mark.parametrize("options", [("--rendering-driver", "vulkan"), ("--rendering-method", "mobile"),
                                     ("--rendering-driver", "opengl3")], ids=["forward+", "mobile", "compatibility"])
def test_shaders_and_dynamic_objects_agree(project, options):
    code, said = conformance(project, *options)
    drawing(said)
    assert code == 0 and said.count("PASS ") == 18 and "FAIL" not in said, said
    assert "PASS dynamic objects:" in said and "PASS visibility, shader, moved:" in said and not complaints(said), said


def replacing(text, wrong):
    """The damage that puts ``wrong`` in the place of ``text``."""
    def damage(whole):
        assert text in whole
        return whole.replace(text, wrong)

    return damage


def turned_light_data(whole):
    """Every coefficient one place on."""
    return re.sub(r'("sh": PackedColorArray\()(.*)((?:, [^,)]+){4})\)',
                  lambda found: f"{found[1]}{found[3][2:]}, {found[2]})", whole)


@pytest.mark.parametrize(("file", "damage", "failing"), [
    ("irradiance.gdshaderinc", replacing("behind > 0.0 ? bound * bound * bound : 1.0", "1.0"), "visibility, shader"),
    ("irradiance.gdshaderinc", replacing("direction.x, -direction.z", "direction.x, direction.z"), "visibility, shader"),
    ("irradiance.gdshaderinc", replacing("0.42904276", "-0.42904276"), "known content, shader"),
    ("light_data.tres", turned_light_data, "dynamic objects"),
], ids=["chebyshev", "tiles", "last band", "light data"])
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
    rtgi("render", "--bundle", bundle, "--pass", "indirect", "--samples", 8, "--scale", SIZE / 480, "--out", tmp_path / "ours.exr")
    planes, _ = read_exr(tmp_path / "ours.exr")
    ours = np.stack([planes[name] for name in "RGB"], axis=-1)
    difference = np.abs(theirs - ours)
    assert difference.mean() < 0.01 * ours.mean()
    # Away from the edges of things nothing but the halves is left.
    assert np.median(difference[ours > 0]) < 1e-3 * ours.mean()
    assert abs(theirs.mean() / ours.mean() - 1.0) < 2e-3


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
    assert export_model(tmp_path / "model.glb") == ()
    dark = replace(kit_bundle, grids=tuple(replace(grid, sh=0.0 * grid.sh) for grid in kit_bundle.grids[:1]))
    settings = ExportSettings(model=str(tmp_path / "model.glb"), conformance=False)
    project = imported(engines.get("godot").export(dark, tmp_path / "project", settings).out)
    found, said = picture(project, tmp_path / "floor.raw", size=64)
    assert "lamps 1" in said
    # Godot adds a dielectric's gloss, one or two hundredths at this roughness.
    assert found[32, 32] == pytest.approx(np.full(3, 0.5 / np.pi * irradiance), rel=0.04)


def test_the_ball_is_lit_and_follows(cornell, tmp_path):
    """A dynamic object in the sample: there, not black, and no brighter than the room's light."""
    _, project = cornell
    without, _ = picture(project, tmp_path / "without.raw")
    found, _ = picture(project, tmp_path / "with.raw", "ball")
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
