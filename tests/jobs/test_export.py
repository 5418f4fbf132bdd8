"""The export as a job: what it refuses, and that it is the same from the module's command line."""

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest
from scene_builders import closed_box

from rtgi_addon.errors import BakeError, Cancelled, UsageError
from rtgi_addon.exchange.bundle import write_bundle
from rtgi_addon.exchange.engines.kit import kit_field
from rtgi_addon.jobs.export import export_bundle
from rtgi_addon.progress import Progress

ROOT = Path(__file__).resolve().parents[2]


@pytest.fixture(scope="module")
def bundle(tmp_path_factory):
    return write_bundle(tmp_path_factory.mktemp("bundle") / "kit", kit_field(), closed_box(), settings={}, seed=0,
                        stats=lambda: {"rays": 0})


def rtgi(*words):
    return subprocess.run([sys.executable, "-m", "rtgi_addon", "export", *map(str, words)], cwd=ROOT, capture_output=True,
                          text=True, timeout=120, check=False)


@pytest.mark.parametrize(("engine", "name"), [("godot", "godot"), ("threejs", "threejs"), ("three", "threejs")])
def test_a_bundle_on_disk_becomes_an_export(bundle, tmp_path, engine, name):
    report = export_bundle(bundle, engine, tmp_path / "out", missing_lamps=["Window"], even_lamps=["Beamer"])
    assert report.out == tmp_path / "out" and report.engine == name
    assert all((report.out / name).is_file() for name in report.files)
    assert report.notes == ("glTF has no area lamps, the model lacks Window: bake with direct light (--direct, Include Lamps) to "
                            "have theirs in the probes",
                            "glTF has no lamps with a profile: the model has Beamer as bright as on average everywhere")


def test_what_will_not_do_is_said_before_anything_is_written(bundle, tmp_path):
    model = tmp_path / "model.glb"
    model.write_bytes(b"not one")
    (tmp_path / "model.obj").write_text("")
    (tmp_path / "folder.glb").mkdir()
    for error, match, arguments, options in (
            (UsageError, "unknown engine 'doom'", (bundle, "doom", tmp_path / "out"), {}),
            (BakeError, "not glTF Binary", (bundle, "godot", tmp_path / "out"), {"model": model}),
            (UsageError, "not a .glb", (bundle, "godot", tmp_path / "out"), {"model": tmp_path / "model.obj"}),
            (BakeError, r"cannot read .*none\.glb, no such file", (bundle, "godot", tmp_path / "out"),
             {"model": tmp_path / "none.glb"}),
            (BakeError, "is a folder where a file should be", (bundle, "godot", tmp_path / "out"),
             {"model": tmp_path / "folder.glb"}),
            (BakeError, "there is no bundle", (tmp_path / "none", "godot", tmp_path / "out"), {}),
            (BakeError, "is no folder", (bundle, "godot", tmp_path / "model.glb/out"), {})):
        with pytest.raises(error, match=match):
            export_bundle(*arguments, **options)
    assert not (tmp_path / "out").exists()


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="this system has no named pipes")
def test_a_pipe_in_the_place_of_a_model_is_not_waited_for(bundle, tmp_path):
    os.mkfifo(tmp_path / "pipe.glb")
    with pytest.raises(BakeError, match=r"pipe\.glb is a pipe"):
        export_bundle(bundle, "godot", tmp_path / "out", model=tmp_path / "pipe.glb")
    assert not (tmp_path / "out").exists()


def test_a_damaged_bundle_leaves_the_earlier_export(bundle, tmp_path):
    out = export_bundle(bundle, "godot", tmp_path / "out").out
    before = (out / "rtgi_export.json").read_bytes()
    damaged = write_bundle(tmp_path / "damaged", kit_field(), closed_box(), settings={}, seed=0, stats=lambda: {"rays": 0})
    (damaged / "Hard/sh3.exr").write_bytes(b"")
    with pytest.raises(BakeError, match=r"sh3\.exr"):
        export_bundle(damaged, "godot", out)
    assert (out / "rtgi_export.json").read_bytes() == before


def test_cancelling_stops_it(bundle, tmp_path):
    progress = Progress()
    progress.cancel()
    with pytest.raises(Cancelled):
        export_bundle(bundle, "godot", tmp_path / "out", progress=progress)
    assert not (tmp_path / "out").exists()


def test_progress_reaches_the_end(bundle, tmp_path):
    seen = []
    export_bundle(bundle, "godot", tmp_path / "out", progress=Progress(lambda fraction, label, left: seen.append(fraction), 0.0))
    assert seen == sorted(seen) and seen[0] == 0.0 and seen[-1] == 1.0


def test_the_command_line(bundle, tmp_path):
    done = rtgi(bundle, "--engine", "godot", "--out", tmp_path / "out", "--no-conformance", "--json")
    assert done.returncode == 0, done.stderr
    report = json.loads(done.stdout)
    assert report["volumes"] == ["Known", "Hard", "Inset", "Weights", "Scattered"]
    assert report["engine"] == "godot" and report["bytes"] > 10000
    assert not [name for name in report["files"] if name.startswith("conformance/")]
    unknown = rtgi(bundle, "--engine", "doom", "--out", tmp_path / "out")
    assert unknown.returncode == 2 and "choose one of godot" in unknown.stderr and len(unknown.stderr.splitlines()) == 1
    missing = rtgi(tmp_path / "none", "--engine", "godot", "--out", tmp_path / "out")
    assert missing.returncode == 1 and "there is no bundle" in missing.stderr
