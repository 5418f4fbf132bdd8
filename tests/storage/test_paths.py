"""The one check of every path that a user gives to be written."""

import os
import subprocess
import sys

import pytest

from rtgi_addon.errors import BakeError, UsageError
from rtgi_addon.storage.paths import check_output
from rtgi_addon.storage.workplace import workplace


def bundle(folder):
    folder.mkdir(parents=True)
    (folder / "bake.json").write_text('{\n "schema": "rtgi-bundle/1"')
    return folder


def refused(words, path, **options):
    with pytest.raises(BakeError, match=words) as caught:
        check_output(path, **options)
    assert caught.value.remedy
    return caught.value


def test_what_will_do_comes_back_absolute_and_nothing_is_made(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert check_output("out", replaced=True) == tmp_path / "out"
    assert check_output("x.PNG", folder=False, suffixes=(".exr", ".png")) == tmp_path / "x.PNG"
    (tmp_path / "there").mkdir()
    assert check_output("there/../there/out") == tmp_path / "there/out"
    (tmp_path / "x.png").write_text("old")
    assert check_output(tmp_path / "x.png", folder=False) == tmp_path / "x.png"
    (tmp_path / "link").symlink_to(tmp_path / "there")
    assert check_output("link") == tmp_path / "there"
    assert sorted(os.listdir(tmp_path)) == ["link", "there", "x.png"] and not os.listdir(tmp_path / "there")


def test_a_wrong_suffix_is_wrong_usage(tmp_path):
    with pytest.raises(UsageError, match=r"x\.jpg does not end in \.exr or \.png"):
        check_output(tmp_path / "x.jpg", folder=False, suffixes=(".exr", ".png"))


@pytest.mark.parametrize(("path", "words"), [
    ("", "the name is empty"), ("  ", "the name is empty"), ("a\0b", "is no path, .*null"), ("/", "the top of a disk"),
    ("~nobody-of-that-name/x", "is no path"), ("file/out", "file is no folder, and"),
    ("file/none/out", "file is no folder, and"),
    ("none/" + "x" * 300 + "/out", "too long|file name"), ("file", "is a file: choose a folder"), ("x" * 300, "too long|file name"),
    ("x" * 250, "too long"), ("circle", "is no path|links"),
])
def test_paths_that_are_none(tmp_path, monkeypatch, path, words):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "file").write_text("")
    (tmp_path / "circle").symlink_to("circle")
    refused(words, path)
    assert sorted(os.listdir(tmp_path)) == ["circle", "file"]


def test_a_file_is_never_a_folder_or_a_pipe(tmp_path):
    (tmp_path / "x.png").mkdir()
    refused("is a folder: choose a file", tmp_path / "x.png", folder=False)
    if hasattr(os, "mkfifo"):
        os.mkfifo(tmp_path / "pipe.png")
        refused("is a device or a pipe", tmp_path / "pipe.png", folder=False)


def test_no_input_is_overwritten(tmp_path):
    blend = tmp_path / "room.blend"
    blend.write_text("scene")
    source = bundle(tmp_path / "baked")
    refused(r"room\.blend is what is read", blend, folder=False, inputs=[blend])
    os.link(blend, tmp_path / "other name.png")
    refused("is what is read", tmp_path / "other name.png", folder=False, inputs=[blend])
    refused("lies inside .*baked, which is read", source / "out", inputs=[source])
    refused("baked is what is read", source, inputs=[source])
    (tmp_path / "assets").mkdir()
    (tmp_path / "assets" / "wood.png").write_text("")
    wood = tmp_path / "assets" / "wood.png"
    refused(r"wood\.png, which is read, lies in .*assets", tmp_path / "assets", replaced=True, inputs=[wood])
    assert check_output(tmp_path / "assets", inputs=[wood])


def test_results_keep_out_of_each_others_way(tmp_path):
    out = tmp_path / "out"
    for folder in (out, tmp_path / "out.partial"):
        folder.mkdir()
        refused("both to be written", folder / "x.png", folder=False, others=[out], option="--picture")
        folder.rmdir()
    for other in (out, tmp_path / "out.partial"):
        refused("both to be written", other, folder=False, others=[out], option="--picture")
    assert check_output(tmp_path / "output", others=[out])


def test_nothing_goes_into_a_bundle_or_unfinished_work(tmp_path):
    source = bundle(tmp_path / "baked")
    (source / "Volume").mkdir()
    refused("lies inside .*baked, which is a bundle", source / "Volume" / "x.png", folder=False)
    refused("baked is a bundle", source)
    assert check_output(source, replaced=True) == source
    with workplace(tmp_path / "out", "test") as place:
        refused("lies inside .*partial, which is a bundle or unfinished work", place.folder / "out", replaced=True)
    (tmp_path / "mine").mkdir()
    (tmp_path / "mine" / "bake.json").write_text('{"recipe": "bread"}')
    assert check_output(tmp_path / "mine" / "out")


def test_a_write_protected_file_stays(tmp_path):
    if hasattr(os, "geteuid") and os.geteuid() == 0:
        pytest.skip("root may write everywhere")
    (tmp_path / "x.png").write_text("old")
    (tmp_path / "x.png").chmod(0o444)
    refused("is write-protected", tmp_path / "x.png", folder=False)


@pytest.mark.skipif(not os.path.isdir("/proc/self"), reason="needs Linux's /proc")
def test_a_place_that_takes_no_files_is_named():
    refused("cannot write /proc/rtgi", "/proc/rtgi")


def test_too_little_room_is_said(tmp_path):
    refused(r"has room for .* MiB, and out takes at least 1,073,741,824\.0 MiB", tmp_path / "out", size=1 << 50)
    assert check_output(tmp_path / "out", size=1)


def mount(*words):
    if not sys.platform.startswith("linux") or subprocess.run(["mount", *words], capture_output=True).returncode:
        pytest.skip("needs the right to mount a disk")


@pytest.mark.parametrize("kind", ["disk", "folder"])
def test_a_mount_point_cannot_be_replaced(tmp_path, kind):
    out, other = tmp_path / "o ut", tmp_path / "other"
    out.mkdir()
    other.mkdir()
    mount(*(("-t", "tmpfs", "tmpfs") if kind == "disk" else ("--bind", str(other))), str(out))
    try:
        refused("is a mount point", out, replaced=True)
        assert check_output(out) == out and check_output(out / "inner", replaced=True) == out / "inner"
    finally:
        subprocess.run(["umount", str(out)], check=True)
