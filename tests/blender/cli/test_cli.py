"""The module's door, as a user meets it: a process, its streams and its exit code.

A technique that bakes numbers stands in for the real ones (tests/support/tiny_technique.py), so that only the command line is
under test; test_cli_probes.py goes the same way with the real one.
"""

import json
import os
import signal
import subprocess
import sys
from pathlib import Path

import pytest
from command_line import CORNELL, ROOT, SLOW, TINY, assert_failed, bake, begin, contents, run

from rtgi_addon.exchange.bundle import read_bundle

pytest.importorskip("bpy", reason="needs Blender's Python module")


@pytest.fixture(scope="module")
def old_bundle(tmp_path_factory):
    """A bundle of cornell_box that is there already."""
    out = tmp_path_factory.mktemp("old") / "out"
    code, _, err = bake("--out", out)
    assert code == 0, err
    return out


@pytest.fixture
def blends(tmp_path):
    """A place for .blend files and a way to make them from a bpy script."""
    import bpy

    def save(name, build, **options):
        bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
        build(bpy)
        path = tmp_path / name
        bpy.ops.wm.save_as_mainfile(filepath=str(path), check_existing=False, **options)
        bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
        return path

    return save


def test_bake_then_info(tmp_path):
    out = tmp_path / "out"
    code, text, err = bake("--out", out, "--order", "2", "--seed", "5", "--direct", "--set", "error=0.02")
    assert code == 0 and text.startswith(f"Baked {out} with tiny, seed 5")
    assert err[0].startswith("rtgi:   0 % Reading the scene") and err[-1].startswith("rtgi: 100 % Done")
    manifest = read_bundle(out).manifest
    assert manifest["settings"]["order"] == 2 and manifest["settings"]["error"] == 0.02 and manifest["settings"]["direct"]
    assert manifest["scene"] and manifest["blender"].split(".")[0].isdigit()
    code, text, err = run("info", out)
    assert (code, err) == (0, []) and f"{out} is whole" in text and "Probes: 4 × 4 × 4 probes" in text


def test_json_is_the_only_thing_on_stdout(tmp_path):
    code, text, _ = bake("--out", tmp_path / "out", "--json")
    values = json.loads(text)
    assert code == 0 and values["out"] == str(tmp_path / "out") and values["volumes"][0]["probes"] == 64
    assert "extract" in values["seconds"]
    code, text, _ = run("info", tmp_path / "out", "--json")
    values = json.loads(text)
    assert code == 0 and values["manifest"]["schema"] == "rtgi-bundle/1" and values["volumes"][0]["usable"] == 64


def test_info_needs_no_blender(old_bundle):
    code = """import sys
sys.modules["bpy"] = None
from rtgi_addon.blender.cli import main_module
sys.exit(main_module(sys.argv[1:]))"""
    done = subprocess.run([sys.executable, "-c", code, "info", old_bundle], capture_output=True, text=True, cwd=ROOT, timeout=60)
    assert done.returncode == 0 and "is whole" in done.stdout and done.stderr == ""


def test_threads_do_not_change_the_bytes(tmp_path, old_bundle):
    for threads in (1, 2):
        assert bake("--out", tmp_path / "out", "--threads", threads)[0] == 0
        assert contents(tmp_path / "out") == contents(old_bundle)


def test_no_temporary_folder_is_left(tmp_path):
    environment = {**os.environ, "PYTHONPATH": str(ROOT), "TMPDIR": str(tmp_path / "temporary")}
    (tmp_path / "temporary").mkdir()
    done = subprocess.run([sys.executable, TINY, CORNELL, "bake", "--technique", "tiny", "--out", tmp_path / "out"],
                          env=environment, capture_output=True, timeout=120)
    assert done.returncode == 0 and not any((tmp_path / "temporary").iterdir())


@pytest.mark.parametrize("words", [
    [], ["bake"], ["bake", "--out", "x"], [CORNELL], [CORNELL, "frobnicate"], [CORNELL, "bake"], [CORNELL, "info", "x"],
    ["info"], ["info", "x", "y"], ["", "check"], [" ", "stability", "--out", "x"],
    *([CORNELL, *words, "99999999999999999999"] for words in (
        ("verify", "--threads"), ("bake", "--out", "x", "--seed"), ("chart", "--out", "x", "--seeds"), ("verify", "--samples"))),
    [CORNELL, "bake", "--out", "x", "--rays", "9", "--error", "0.1"],
    [CORNELL, "bake", "--out", "x", "--rays", "many"],
    [CORNELL, "bake", "--out", "x", "--technique", "tiny", "--rays", "0"],
    [CORNELL, "bake", "--out", "x", "--technique", "tiny", "--order", "99"],
    [CORNELL, "bake", "--out", "x", "--technique", "tiny", "--set", "shine=1"],
    [CORNELL, "bake", "--out", "x", "--set", "shine"],
    [CORNELL, "bake", "--out", "x", "--threads", "0"],
    [CORNELL, "bake", "--out", "x", "--seed", "-1"],
    [CORNELL, "bake", "--out", "x", "--device", "abacus"],
    [CORNELL, "bake", "--out", "x", "--checkpoint-seconds", "nan"],
    [CORNELL, "bake", "--out", "x", "--import", "y.glb"],
    *([CORNELL, "render", "--out", "x.png", *words] for words in (
        ("--picture-error", "0.1"), ("--gather", "rays", "--picture-error", "1.5"), ("--gather", "rays", "--device", "gpu"),
        ("--gather", "rays", "--pass", "normal"), ("--gather", "guesses"))),
])
def test_wrong_usage_is_one_line_and_2(tmp_path, words):
    assert_failed(run(*words, cwd=tmp_path), code=2)
    assert not any(tmp_path.iterdir())


def test_help_is_0():
    code, text, err = run("--help")
    assert code == 0 and err == [] and "bake" in text and "info" in text
    code, text, _ = run("bake", "--help")
    assert code == 0 and "--resume" in text


def assert_untouched(old_bundle, before):
    assert contents(old_bundle) == before
    assert sorted(path.name for path in old_bundle.parent.iterdir()) == ["out"]


def damaged(path, change):
    path.write_bytes(change(CORNELL.read_bytes()))
    return path


@pytest.mark.parametrize(("name", "change", "word"), [
    ("empty.blend", lambda data: b"", "not a .blend"),
    ("garbage.blend", lambda data: b"hello" * 500, "not a .blend"),
    ("cut.blend", lambda data: data[:len(data) // 2], "not a .blend"),
    ("holed.blend", lambda data: data[:len(data) // 2] + bytes(4000) + data[len(data) // 2 + 4000:], "not a .blend"),
    ("cut.glb", lambda data: b"glTF\x02\0\0\0\xff\0\0\0", "not glTF"),
    ("notes.txt", lambda data: b"hello", "neither a .blend nor a .glb"),
])
def test_a_damaged_file_is_named(tmp_path, old_bundle, name, change, word):
    before = contents(old_bundle)
    path = damaged(tmp_path / name, change)
    assert_failed(bake("--out", old_bundle, file=path), str(path), word)
    assert_untouched(old_bundle, before)


def test_a_missing_file_is_named(tmp_path, old_bundle):
    before = contents(old_bundle)
    assert_failed(bake("--out", old_bundle, file=tmp_path / "none.blend"), f"there is no file {tmp_path / 'none.blend'}")
    assert_failed(bake("--out", old_bundle, file=tmp_path), f"{tmp_path} is not a file")
    assert_untouched(old_bundle, before)


def test_a_file_of_a_newer_blender_is_refused(tmp_path, old_bundle, blends):
    import bpy
    before = contents(old_bundle)
    path = blends("newer.blend", lambda bpy: None, compress=False)
    data, (major, minor) = path.read_bytes(), bpy.app.version[:2]
    # The header's version: BLENDER-v405 up to 4.5, BLENDER17-01v0502 since.
    form = b"v%d%02d" if major < 5 else b"v%02d%02d"
    old, new = form % (major, minor), form % (major, 99)
    assert data[:32].count(old) == 1
    path.write_bytes(data[:32].replace(old, new) + data[32:])
    assert_failed(bake("--out", old_bundle, file=path), str(path), f"saved by Blender {major}.99", f"Blender {major}.{minor}")
    assert_untouched(old_bundle, before)


def add_room(bpy):
    bpy.ops.mesh.primitive_cube_add(size=4.0)


def add_lamp(bpy):
    bpy.context.collection.objects.link(bpy.data.objects.new("Lamp", bpy.data.lights.new("Lamp", "POINT")))


def add_volume(bpy):
    bpy.context.collection.objects.link(bpy.data.objects.new("Probes", bpy.data.lightprobes.new("Probes", "VOLUME")))


@pytest.mark.parametrize(("parts", "word"), [((add_room, add_volume), "light"), ((add_lamp, add_volume), "geometry"),
                                             ((add_lamp,), "geometry")])
def test_a_scene_without_light_or_geometry_is_refused(old_bundle, blends, parts, word):
    before = contents(old_bundle)
    path = blends("poor.blend", lambda bpy: [part(bpy) for part in parts])
    assert_failed(bake("--out", old_bundle, file=path), word)
    assert_untouched(old_bundle, before)


def test_an_unknown_technique_or_volume_lists_the_known(old_bundle):
    before = contents(old_bundle)
    assert_failed(run(CORNELL, "bake", "--out", old_bundle, "--technique", "magic"), "unknown technique 'magic'", "tiny", code=2)
    assert_failed(bake("--out", old_bundle, "--volume", "Attic"), "unknown volume 'Attic'", "Probes", code=2)
    assert_failed(bake("--out", old_bundle, "--device", "gpu"), "--device cpu")
    assert_untouched(old_bundle, before)


def test_a_place_that_cannot_be_written_is_named(tmp_path, old_bundle):
    (tmp_path / "file").write_text("")
    (tmp_path / "thesis").mkdir()
    (tmp_path / "thesis" / "chapter.txt").write_text("mine")
    for out, word in ((tmp_path / "file" / "out", "is no folder"), (tmp_path / "file", "is a file"),
                      (tmp_path / "thesis", "holds chapter.txt")):
        assert_failed(bake("--out", out), str(out.parent), word)
    assert (tmp_path / "thesis" / "chapter.txt").read_text() == "mine"
    if Path("/proc").is_dir():
        assert_failed(bake("--out", "/proc/rtgi"), "cannot write /proc/rtgi")


@pytest.fixture
def mounted(tmp_path):
    """Mounts a small file system of its own with the given options; skips without the right to."""
    disk = tmp_path / "disk"
    disk.mkdir()

    def mount(options):
        command = ["mount", "-t", "tmpfs", "-o", options, "tmpfs", str(disk)]
        if not sys.platform.startswith("linux") or subprocess.run(command, capture_output=True).returncode:
            pytest.skip("needs the right to mount a disk")
        return disk

    yield mount
    if os.path.ismount(disk):
        subprocess.run(["umount", str(disk)], check=True)


def test_a_full_disk_leaves_the_old_bundle(mounted):
    disk = mounted("size=160k")
    assert bake("--out", disk / "out")[0] == 0
    before = contents(disk / "out")
    assert_failed(bake("--out", disk / "out", "--order", "4", "--seed", "1"), "no space left on device", "free some space")
    assert contents(disk / "out") == before and [path.name for path in disk.iterdir()] == ["out"]


@pytest.mark.slow
@pytest.mark.parametrize("name", ["x.png", "x.exr"])
def test_a_picture_on_a_full_disk_is_an_error_and_leaves_the_old_one(mounted, name):
    disk = mounted("size=28k")
    (disk / name).write_text("old")
    words = ("render", "--technique", "tiny", "--device", "cpu", "--samples", "1", "--scale", "0.3", "--out", disk / name)
    assert_failed(run(CORNELL, *words), "space")
    assert (disk / name).read_text() == "old" and os.listdir(disk) == [name]


def test_no_input_is_overwritten(tmp_path):
    file = tmp_path / "room.blend"
    file.write_bytes(CORNELL.read_bytes())
    (tmp_path / "link.png").symlink_to(file)
    for words in (("bake", "--technique", "tiny", "--out", tmp_path / "out", "--picture", tmp_path / "link.png"),
                  ("render", "--technique", "tiny", "--out", tmp_path / "link.png"),
                  ("bake", "--technique", "tiny", "--out", file), ("chart", "--out", file), ("stability", "--out", file)):
        assert_failed(run(file, *words), str(file))
    assert file.read_bytes() == CORNELL.read_bytes() and sorted(os.listdir(tmp_path)) == ["link.png", "room.blend"]


def test_a_read_only_disk_is_named(mounted):
    assert_failed(bake("--out", mounted("size=64k,ro") / "out"), "read-only file system", "not read-only")


@pytest.mark.skipif(not hasattr(os, "geteuid") or os.geteuid() == 0, reason="root may write everywhere")
def test_a_read_only_folder_is_named(tmp_path):
    (tmp_path / "locked").mkdir(mode=0o500)
    assert_failed(bake("--out", tmp_path / "locked" / "out"), "permission denied", "you may write to")


def test_a_workers_exception_is_no_silent_half_bake(old_bundle):
    before = contents(old_bundle)
    assert_failed(bake("--out", old_bundle, "--set", "fail_at=2"), "ZeroDivisionError: the worker divided by zero", "--traceback")
    assert_untouched(old_bundle, before)
    code, _, err = bake("--out", old_bundle, "--set", "fail_at=2", "--traceback")
    assert code == 1 and any("Traceback" in line for line in err)


def test_a_damaged_bundle_is_named(tmp_path):
    assert bake("--out", tmp_path / "out")[0] == 0
    image = tmp_path / "out" / "Probes" / "sh2.exr"
    image.write_bytes(image.read_bytes()[:300])
    assert_failed(run("info", tmp_path / "out"), str(image), "cut short or damaged")
    assert_failed(run("info", tmp_path / "none"), "there is no bundle")


def test_a_killed_bake_resumes_to_the_same_bytes(tmp_path):
    assert bake("--out", tmp_path / "whole", *SLOW)[0] == 0
    process = begin(tmp_path / "out")
    process.kill()
    process.communicate()
    assert not (tmp_path / "out").exists() and (tmp_path / "out.partial").is_dir()
    code, text, err = bake("--out", tmp_path / "out", "--resume", "--json", *SLOW)
    assert code == 0, err
    assert json.loads(text)["resumed"] and json.loads(text)["stats"]["loaded"] > 0
    assert contents(tmp_path / "out") == contents(tmp_path / "whole")
    assert sorted(path.name for path in tmp_path.iterdir()) == ["out", "whole"]


def test_resume_with_other_options_says_what_changed(tmp_path):
    process = begin(tmp_path / "out")
    process.kill()
    process.communicate()
    assert_failed(bake("--out", tmp_path / "out", "--resume", "--order", "2", *SLOW), "setting order (1 before, 2 now)")


@pytest.mark.skipif(os.name == "nt", reason="Windows has no SIGINT to send to one process")
def test_ctrl_c_is_130_and_leaves_the_old_bundle(old_bundle):
    before = contents(old_bundle)
    process = begin(old_bundle)
    process.send_signal(signal.SIGINT)
    out, err = process.communicate(timeout=60)
    assert process.returncode == 130 and out == "" and err.splitlines()[-1] == "rtgi: cancelled"
    assert contents(old_bundle) == before
    assert bake("--out", old_bundle, "--resume", *SLOW)[0] == 0
    assert contents(old_bundle)[0] == before[0]


def test_gltf_is_read_through_blenders_importer(tmp_path, blends):
    def export(bpy):
        add_room(bpy)
        add_lamp(bpy)
        bpy.ops.export_scene.gltf(filepath=str(tmp_path / "room.glb"), export_lights=True)

    blends("room.blend", export)
    code, _, err = bake("--out", tmp_path / "out", file=tmp_path / "room.glb")
    assert code == 0, err
    assert any("fitted" in note for note in read_bundle(tmp_path / "out").manifest["notes"])
    code, _, err = run("bake", "--technique", "tiny", "--out", tmp_path / "out2", "--import", tmp_path / "room.glb")
    assert code == 0 and contents(tmp_path / "out2") == contents(tmp_path / "out")
