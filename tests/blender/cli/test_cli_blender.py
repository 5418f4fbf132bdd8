"""A real Blender's door: `blender -b FILE.blend --command rtgi …`. Runs where a `blender` is on the path (CONTRIBUTING.md says
how to make a tree with one); the subcommands themselves are tested through the module's door."""

import json
import os
import shutil
import signal
import subprocess
import time
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[3]
CORNELL = ROOT / "sample_blends/cornell_box.blend"
EXTENSION = "bl_ext.user_default.rtgi_addon"

pytestmark = [pytest.mark.skipif(shutil.which("blender") is None, reason="needs a real Blender on the path"), pytest.mark.slow]


def start(tmp_path, *words, file=None):
    """The command `rtgi` in a Blender that has nothing but this extension."""
    extension = tmp_path / "user/extensions/user_default/rtgi_addon"
    if not extension.exists():
        extension.parent.mkdir(parents=True)
        extension.symlink_to(ROOT, target_is_directory=True)
    command = ["blender", "-b", "--factory-startup", "--addons", EXTENSION, *([str(file)] if file else []),
               "--command", "rtgi", *map(str, words)]
    return subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
                            env={**os.environ, "BLENDER_USER_RESOURCES": str(tmp_path / "user")})


def blender(tmp_path, *words, file=None):
    """Exit code, stdout and the lines on stderr."""
    process = start(tmp_path, *words, file=file)
    out, err = process.communicate(timeout=300)
    return process.returncode, out, err.splitlines()


def bake(tmp_path, *words, file=CORNELL):
    return blender(tmp_path, "bake", "--rays", "16", "--out", tmp_path / "out", *words, file=file)


def test_bake_prints_one_json_object_and_info_reads_it(tmp_path):
    code, out, err = bake(tmp_path, "--json")
    assert code == 0, err
    assert json.loads(out[out.index("{"):])["volumes"][0]["probes"] == 64
    assert all(line.startswith("rtgi: ") for line in err), err
    code, out, err = blender(tmp_path, "info", tmp_path / "out")
    assert code == 0 and "is whole" in out and err == []


@pytest.mark.parametrize("make", [None, lambda path: path.write_bytes(b"hello" * 100),
                                  lambda path: path.write_bytes(CORNELL.read_bytes()[:9999])])
def test_blender_goes_on_without_its_file_and_we_do_not(tmp_path, make):
    file = tmp_path / "scene.blend"
    if make:
        make(file)
    code, _, err = bake(tmp_path, file=file)
    assert code == 1 and err[-1].startswith("rtgi: error: ") and str(file) in err[-1]
    assert not (tmp_path / "out").exists()


def test_no_file_and_wrong_usage_have_their_codes(tmp_path):
    code, _, err = bake(tmp_path, file=None)
    assert code == 1 and "no .blend is open" in err[-1]
    code, _, err = bake(tmp_path, "--order", "many")
    assert code == 2 and len(err) == 1
    assert not (tmp_path / "out").exists()


def test_ctrl_c_is_130(tmp_path):
    process = start(tmp_path, "bake", "--rays", "65536", "--out", tmp_path / "out", file=CORNELL)
    while process.poll() is None and not (tmp_path / "out.partial/checkpoint.json").exists():
        time.sleep(0.01)
    process.send_signal(signal.SIGINT)
    _, err = process.communicate(timeout=60)
    assert process.returncode == 130 and err.splitlines()[-1] == "rtgi: cancelled"
    assert not (tmp_path / "out").exists()


def test_import_replaces_the_startup_scene(tmp_path):
    exporting = f"""import bpy
bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
bpy.ops.mesh.primitive_cube_add(size=4.0)
bpy.context.collection.objects.link(bpy.data.objects.new("Lamp", bpy.data.lights.new("Lamp", "POINT")))
bpy.ops.export_scene.gltf(filepath={str(tmp_path / "box.glb")!r}, export_lights=True)"""
    subprocess.run(["blender", "-b", "--factory-startup", "--python-expr", exporting], capture_output=True, timeout=300)
    code, out, err = bake(tmp_path, "--import", tmp_path / "box.glb", "--json", file=None)
    assert code == 0, err
    assert json.loads(out[out.index("{"):])["volumes"][0]["fitted"]
