"""The command line with the real technique: from a .blend to a bundle, the same bytes whatever happens on the way."""

import json
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest
from command_line import hear

from rtgi_addon.exchange.bundle import read_bundle

ROOT = Path(__file__).resolve().parents[3]
CORNELL = ROOT / "sample_blends/cornell_box.blend"

pytest.importorskip("bpy", reason="needs Blender's Python module")


def start(*words):
    return subprocess.Popen([sys.executable, "-m", "rtgi_addon", *map(str, words)], cwd=ROOT, text=True, encoding="utf-8",
                            stdout=subprocess.PIPE, stderr=subprocess.PIPE, preexec_fn=None if os.name == "nt" else hear)


def bake(out, *words, file=CORNELL):
    """Bake ``file`` to ``out``; the summary."""
    process = start(file, "bake", "--out", out, "--json", *words)
    text, err = process.communicate(timeout=300)
    assert process.returncode == 0, err
    return json.loads(text)


def contents(folder):
    files = {path.relative_to(folder).as_posix(): path.read_bytes() for path in folder.rglob("*") if path.is_file()}
    manifest = json.loads(files.pop("bake.json"))
    manifest.pop("stats")
    return files, manifest


def test_a_blend_becomes_a_bundle_with_light_in_it(tmp_path):
    summary = bake(tmp_path / "out", "--rays", "64")
    bundle = read_bundle(tmp_path / "out")
    (grid,) = bundle.grids
    assert summary["technique"] == bundle.manifest["technique"] == "probes"
    assert summary["rays"] == bundle.manifest["stats"]["rays"] >= 64 * grid.usable.sum()
    assert grid.order == 2 and grid.usable.mean() > 0.9
    assert (grid.sh[grid.usable][:, 0] > 0).all()
    assert np.isfinite(grid.standard_error[grid.usable]).all()


def test_overrides_saved_on_a_volume_are_kept_unless_the_command_line_says_otherwise(tmp_path):
    program = """
import sys
sys.path.insert(0, sys.argv[1])
import bpy, rtgi_addon
rtgi_addon.register()
bpy.ops.wm.open_mainfile(filepath=sys.argv[2])
(volume,) = (probe for probe in bpy.data.lightprobes if probe.type == "VOLUME")
volume.rtgi.technique_probes.override_order = True
volume.rtgi.technique_probes.order = 1
bpy.ops.wm.save_as_mainfile(filepath=sys.argv[3])
rtgi_addon.unregister()
"""
    file = tmp_path / "overridden.blend"
    subprocess.run([sys.executable, "-c", program, str(ROOT), str(CORNELL), str(file)], check=True, capture_output=True)
    bake(tmp_path / "overridden", "--rays", "32", file=file)
    bake(tmp_path / "first", "--rays", "32", "--order", "1")
    (own,), (first,) = read_bundle(tmp_path / "overridden").grids, read_bundle(tmp_path / "first").grids
    assert len(list((tmp_path / "overridden").rglob("sh*.exr"))) == 4
    assert own.order == 1 and np.array_equal(own.sh, first.sh)
    bake(tmp_path / "stronger", "--rays", "32", "--order", "3", file=file)
    assert read_bundle(tmp_path / "stronger").grids[0].order == 3


def test_a_file_without_a_volume_is_planned_unless_an_option_says_how_to_bake(tmp_path):
    program = """
import sys
import bpy
bpy.ops.wm.open_mainfile(filepath=sys.argv[1])
for volume in [obj for obj in bpy.data.objects if obj.type == "LIGHT_PROBE"]:
    bpy.data.objects.remove(volume)
bpy.ops.wm.save_as_mainfile(filepath=sys.argv[2])
"""
    file = tmp_path / "bare.blend"
    subprocess.run([sys.executable, "-c", program, str(CORNELL), str(file)], check=True, capture_output=True)
    left_open, said = bake(tmp_path / "open", file=file), bake(tmp_path / "said", "--rays", "32", file=file)
    baked, planned = left_open["volumes"][0], left_open["plan"]["volumes"][0]
    assert left_open["plan"]["met"] and left_open["check"] is None
    assert baked["fitted"] and baked["resolution"] == planned["resolution"] and planned["kept"] is None
    assert "plan" not in said and said["volumes"][0]["fitted"]


def test_the_seed_decides_the_bytes_and_the_threads_do_not(tmp_path):
    for threads in (1, 2, 5):
        bake(tmp_path / f"{threads}", "--rays", "32", "--threads", threads, "--seed", "7")
    bake(tmp_path / "other", "--rays", "32", "--seed", "8")
    assert contents(tmp_path / "1") == contents(tmp_path / "2") == contents(tmp_path / "5")
    assert contents(tmp_path / "1")[0] != contents(tmp_path / "other")[0]


LONG = ("--rays", "4096", "--checkpoint-seconds", "0")


def begin(out, pattern, words=LONG):
    """A long bake to ``out`` whose checkpoint folder holds a file called like ``pattern``."""
    process = start(CORNELL, "bake", "--out", out, *words)
    partial = out.with_name(out.name + ".partial")
    while process.poll() is None and not list(partial.glob(pattern)):
        time.sleep(0.005)
    assert process.poll() is None, process.communicate()
    return process


@pytest.mark.slow
def test_a_killed_bake_resumes_to_the_same_bytes(tmp_path):
    bake(tmp_path / "whole", *LONG)
    process = begin(tmp_path / "out", "*.part")
    process.kill()
    process.communicate()
    assert not (tmp_path / "out").exists()
    assert bake(tmp_path / "out", "--resume", *LONG)["resumed"]
    assert contents(tmp_path / "out") == contents(tmp_path / "whole")
    assert not (tmp_path / "out.partial").exists()


@pytest.mark.slow
@pytest.mark.skipif(os.name == "nt", reason="Windows has no SIGINT to send to one process")
def test_ctrl_c_is_130_and_leaves_the_old_bundle(tmp_path):
    bake(tmp_path / "out", "--rays", "16")
    before = contents(tmp_path / "out")
    process = begin(tmp_path / "out", "checkpoint.json", ("--rays", "65536", "--checkpoint-seconds", "0"))
    process.send_signal(signal.SIGINT)
    out, err = process.communicate(timeout=60)
    assert process.returncode == 130 and out == "" and err.splitlines()[-1] == "rtgi: cancelled"
    assert contents(tmp_path / "out") == before
