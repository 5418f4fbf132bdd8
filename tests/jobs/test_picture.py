"""A bake that ends with a picture writes the same bundle, and says where the picture is."""

import hashlib
from pathlib import Path

import pytest
from scene_builders import closed_box

from rtgi_addon.errors import BakeError
from rtgi_addon.jobs.bake import bake_scene


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


def test_a_picture_that_cannot_be_written_leaves_the_bundle(tmp_path):
    (tmp_path / "file").write_text("")
    with pytest.raises(BakeError, match="cannot write the picture"):
        bake_scene(closed_box(), overrides={"rays": 64}, out=tmp_path / "bundle", picture=tmp_path / "file" / "a.png")
    assert (tmp_path / "bundle" / "bake.json").exists()
