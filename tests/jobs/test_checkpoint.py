"""The checkpoint: whole parts only, continued only for the same bake."""

import json
import os

import numpy as np
import pytest

from rtgi_addon.errors import BakeError
from rtgi_addon.jobs.checkpoint import FileCheckpoint

PARTS = {"seed": "0", "setting order": "2", "lights of the scene": "abc"}


def opened(tmp_path, parts=PARTS, **options):
    return FileCheckpoint(tmp_path / "out", parts, **{"resume": False, **options})


def test_parts_come_back_as_they_were(tmp_path):
    checkpoint = opened(tmp_path)
    arrays = {"file": np.arange(6, dtype=np.float32).reshape(2, 3)[:, ::-1], "a/b": np.array([True, False]), "n": np.int64(3)}
    checkpoint.save("Volume.001/cache", arrays)
    checkpoint.save("other", {"x": np.zeros(2)})
    found = opened(tmp_path, resume=True).load("Volume.001/cache")
    assert found.keys() == arrays.keys()
    for name, value in arrays.items():
        assert np.array_equal(found[name], value) and found[name].dtype == np.asarray(value).dtype
    assert checkpoint.load("never saved") is None


def test_it_is_due_by_the_clock(tmp_path):
    assert opened(tmp_path, interval=0.0).due
    assert not opened(tmp_path, interval=3600.0).due


def test_a_new_bake_discards_an_old_checkpoint(tmp_path):
    opened(tmp_path).save("part", {"x": np.ones(1)})
    fresh = opened(tmp_path)
    assert fresh.load("part") is None and not fresh.resumed
    resumed = opened(tmp_path, resume=True)
    assert not resumed.resumed


def test_nothing_to_resume_begins_anew(tmp_path):
    checkpoint = opened(tmp_path, resume=True)
    assert not checkpoint.resumed
    checkpoint.save("part", {"x": np.ones(1)})
    assert opened(tmp_path, resume=True).resumed


@pytest.mark.parametrize(("changed", "words"), [
    ({"setting order": "3"}, r"setting order \(2 before, 3 now\)"),
    ({"seed": "1"}, r"seed \(0 before, 1 now\)"),
    ({"lights of the scene": "xyz"}, "lights of the scene"),
])
def test_another_bake_is_refused_by_what_changed(tmp_path, changed, words):
    opened(tmp_path).save("part", {"x": np.ones(1)})
    with pytest.raises(BakeError, match=words) as caught:
        opened(tmp_path, {**PARTS, **changed}, resume=True)
    assert "without --resume" in caught.value.remedy
    assert opened(tmp_path, resume=True).load("part") is not None


@pytest.mark.parametrize("data", [b"", b"PK\x03\x04 cut", b"not a zip at all" * 10])
def test_a_damaged_part_is_named(tmp_path, data):
    checkpoint = opened(tmp_path)
    checkpoint.save("part", {"x": np.ones(1)})
    (path,) = checkpoint.folder.glob("*.npz")
    path.write_bytes(data)
    with pytest.raises(BakeError, match="is damaged") as caught:
        checkpoint.load("part")
    assert str(path) in caught.value.cause


@pytest.mark.parametrize("text", ["", "[]", "{}", json.dumps({"schema": "x", "parts": {}})])
def test_a_damaged_header_is_named(tmp_path, text):
    checkpoint = opened(tmp_path)
    (checkpoint.folder / "checkpoint.json").write_text(text)
    with pytest.raises(BakeError, match="is damaged"):
        opened(tmp_path, resume=True)


def test_a_kill_between_write_and_rename_leaves_the_part_before(tmp_path, monkeypatch):
    checkpoint = opened(tmp_path)
    checkpoint.save("part", {"x": np.ones(1)})

    class Killed(BaseException):
        pass

    def kill(*_):
        raise Killed

    monkeypatch.setattr(os, "replace", kill)
    with pytest.raises(Killed):
        checkpoint.save("part", {"x": np.zeros(1)})
    monkeypatch.undo()
    assert opened(tmp_path, resume=True).load("part")["x"] == 1.0


def test_a_folder_of_something_else_is_left_alone(tmp_path):
    (tmp_path / "out.partial").mkdir()
    (tmp_path / "out.partial" / "thesis.txt").write_text("mine")
    with pytest.raises(BakeError, match="is in the way"):
        opened(tmp_path)
    assert (tmp_path / "out.partial" / "thesis.txt").exists()


def test_leftovers_of_a_kill_at_the_start_are_no_obstacle(tmp_path):
    (tmp_path / "out.partial").mkdir()
    (tmp_path / "out.partial" / "checkpoint.json.new").write_text("{")
    assert opened(tmp_path, resume=True).load("part") is None


def test_a_place_that_cannot_be_written_is_named(tmp_path):
    with pytest.raises(BakeError, match=r"cannot write .*out\.partial, no such file"):
        opened(tmp_path / "none")
