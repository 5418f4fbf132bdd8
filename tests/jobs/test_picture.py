"""A bake that ends with a picture writes the same bundle, and says where the picture is."""

import errno
import hashlib
import os
from pathlib import Path

import pytest
from scene_builders import closed_box

from rtgi_addon.errors import BakeError
from rtgi_addon.jobs.bake import bake_scene
from rtgi_addon.storage import png


def files_of(folder: Path):
    """Checksums of a bundle's EXR files by name: bake.json holds timings."""
    return {path.name: hashlib.sha256(path.read_bytes()).hexdigest() for path in sorted(folder.rglob("*.exr"))}


def test_the_picture_stands_beside_an_unchanged_bundle(tmp_path):
    scene = closed_box(light_position=(0.3, 0.2, 0.5))
    plain = bake_scene(scene, overrides={"rays": 64}, out=tmp_path / "plain")
    drawn = bake_scene(scene, overrides={"rays": 64}, out=tmp_path / "drawn", picture=tmp_path / "drawn.png")
    assert plain.picture is None and drawn.picture == tmp_path / "drawn.png"
    assert drawn.picture.read_bytes()[:8] == b"\x89PNG\r\n\x1a\n" and str(drawn.picture) in drawn.to_text()
    assert files_of(tmp_path / "plain") == files_of(tmp_path / "drawn") != {}


def test_a_picture_that_cannot_be_written_is_told_before_the_work(tmp_path):
    (tmp_path / "file").write_text("")
    with pytest.raises(BakeError, match=r"file is no folder, and .* choose another --picture"):
        bake_scene(closed_box(), overrides={"rays": 64}, out=tmp_path / "bundle", picture=tmp_path / "file" / "a.png")
    assert not (tmp_path / "bundle").exists()


def test_a_picture_that_the_disk_refuses_leaves_the_bundle(tmp_path, monkeypatch):
    def refuse(path, data):
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    monkeypatch.setattr(png, "write_file", refuse)
    with pytest.raises(BakeError, match=r"cannot write .*a\.png, no space left on device"):
        bake_scene(closed_box(), overrides={"rays": 64}, out=tmp_path / "bundle", picture=tmp_path / "a.png")
    assert (tmp_path / "bundle" / "bake.json").exists() and not (tmp_path / "a.png").exists()
