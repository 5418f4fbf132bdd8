"""The checkpoint: whole parts only, continued only for the same bake."""

import json
import os

import numpy as np
import pytest
from kills import needs_fork, run_killed

from rtgi_addon.errors import BakeError
from rtgi_addon.jobs.checkpoint import FileCheckpoint
from rtgi_addon.storage.parts import Parts
from rtgi_addon.storage.workplace import partial_of, workplace

RUN = {"seed": "0", "setting order": "2", "lights of the scene": "abc"}


@pytest.fixture
def place(tmp_path):
    with workplace(tmp_path / "out", "test") as held:
        yield held


def opened(place, run=RUN, **options):
    return FileCheckpoint(place, run, **{"resume": False, **options})


def test_parts_come_back_as_they_were(place):
    checkpoint = opened(place)
    arrays = {"file": np.arange(6, dtype=np.float32).reshape(2, 3)[:, ::-1], "a/b": np.array([True, False]), "n": np.int64(3)}
    checkpoint.save("Volume.001/cache", arrays)
    checkpoint.save("other", {"x": np.zeros(2)})
    found = opened(place, resume=True).load("Volume.001/cache")
    assert found.keys() == arrays.keys()
    for name, value in arrays.items():
        assert np.array_equal(found[name], value) and found[name].dtype == np.asarray(value).dtype
    assert checkpoint.load("never saved") is None


def test_a_document_goes_with_the_arrays(place):
    parts = Parts(place, RUN, resume=False)
    parts.save("run 1", {}, {"seconds": 0.1, "errors": {"surface": None, "probes": [1, 2.5]}, "name": "Bühne\n"})
    arrays, document = Parts(place, RUN, resume=True).load("run 1")
    assert arrays == {} and document == {"seconds": 0.1, "errors": {"surface": None, "probes": [1, 2.5]}, "name": "Bühne\n"}
    with pytest.raises(ValueError, match="not JSON compliant"):
        parts.save("run 2", {}, {"seconds": float("nan")})


def test_it_is_due_by_the_clock(place):
    assert opened(place, interval=0.0).due
    assert not opened(place, interval=3600.0).due


def test_a_new_bake_discards_an_old_checkpoint(place):
    opened(place).save("part", {"x": np.ones(1)})
    fresh = opened(place)
    assert fresh.load("part") is None and not fresh.resumed
    assert not opened(place, resume=True).resumed


def test_nothing_to_resume_begins_anew(place):
    checkpoint = opened(place, resume=True)
    assert not checkpoint.resumed
    checkpoint.save("part", {"x": np.ones(1)})
    assert opened(place, resume=True).resumed


def test_it_outlives_the_run_and_goes_with_the_result(tmp_path):
    with workplace(tmp_path / "out", "test") as place:
        opened(place)
    assert not os.listdir(tmp_path), "a header without parts is of no use"
    with workplace(tmp_path / "out", "test") as place:
        opened(place).save("part", {"x": np.ones(1)})
    assert os.listdir(tmp_path) == ["out.partial"]
    with workplace(tmp_path / "out", "test") as place:
        checkpoint = opened(place, resume=True)
        assert checkpoint.load("part")["x"] == 1.0
        checkpoint.parts.remove()
    assert not os.listdir(tmp_path)


@pytest.mark.parametrize(("changed", "words"), [
    ({"setting order": "3"}, r"setting order \(2 before, 3 now\)"),
    ({"seed": "1"}, r"seed \(0 before, 1 now\)"),
    ({"lights of the scene": "xyz"}, "lights of the scene"),
])
def test_another_bake_is_refused_by_what_changed(place, changed, words):
    opened(place).save("part", {"x": np.ones(1)})
    with pytest.raises(BakeError, match=words) as caught:
        opened(place, {**RUN, **changed}, resume=True)
    assert "without --resume" in caught.value.remedy
    assert opened(place, resume=True).load("part") is not None


def refused(place, words):
    with pytest.raises(BakeError, match=words) as caught:
        opened(place, resume=True).load("part")
    assert "without --resume" in caught.value.remedy


def test_a_part_of_another_run_or_name_is_refused(place, tmp_path):
    opened(place).save("part", {"x": np.ones(1)})
    (path,) = place.folder.glob("*.part")
    with workplace(tmp_path / "other", "test") as other:
        opened(other, {**RUN, "seed": "1"}).save("part", {"x": np.ones(1)})
        (foreign,) = other.folder.glob("*.part")
        own = path.read_bytes()
        path.write_bytes(foreign.read_bytes())
        refused(place, f"the checkpoint {path} belongs to another run")
        opened(other).save("another part", {"x": np.ones(1)})
        (foreign,) = other.folder.glob("*.part")
        path.write_bytes(foreign.read_bytes())
        refused(place, "belongs to another run")
    path.write_bytes(own)
    assert opened(place, resume=True).load("part")["x"] == 1.0


def test_any_change_of_a_part_is_noticed(place):
    opened(place).save("part", {"x": np.arange(3.0), "y": np.zeros((2, 0))})
    (path,) = place.folder.glob("*.part")
    whole = path.read_bytes()
    rng = np.random.default_rng(0)
    for data in (b"", b"PK\x03\x04 cut", b"not a part at all" * 10, whole[:-1], whole + b"\0", whole[:90]):
        path.write_bytes(data)
        refused(place, f"the checkpoint {path} is damaged")
    for index in [*range(100), *rng.integers(0, len(whole), 400)]:
        changed = bytearray(whole)
        changed[index] ^= 1 << rng.integers(8)
        path.write_bytes(changed)
        refused(place, "is damaged")


@pytest.mark.parametrize("text", ["", "[]", "{}", json.dumps({"schema": "x", "run": {}}),
                                  json.dumps({"schema": "rtgi-checkpoint/2", "run": {"seed": 0}})])
def test_a_damaged_header_is_named(place, text):
    opened(place).save("part", {"x": np.ones(1)})
    (place.folder / "checkpoint.json").write_text(text)
    refused(place, r"checkpoint\.json is damaged")


@needs_fork
def test_a_kill_before_any_operation_leaves_the_part_before_or_after(tmp_path, monkeypatch):
    monkeypatch.setattr(os, "fsync", lambda descriptor: None)
    seen, at = set(), 0

    def save(value):
        with workplace(tmp_path / "out", "test") as place:
            opened(place, resume=value > 0).save("part", {"x": np.full(4, value)})

    while True:
        at += 1
        save(0)
        ended = run_killed(lambda: save(1), at, tmp_path)[0] is not None
        with workplace(tmp_path / "out", "test") as place:
            seen.add(int(opened(place, resume=True).load("part")["x"][0]))
        if ended:
            break
    assert seen == {0, 1} and at > 5


def test_a_folder_of_something_else_is_left_alone(tmp_path):
    with workplace(tmp_path / "out", "test") as place:
        opened(place).save("part", {"x": np.ones(1)})
    (partial_of(tmp_path / "out") / "thesis.txt").write_text("mine")
    with pytest.raises(BakeError, match=r"holds thesis\.txt, which rtgi did not write"), workplace(tmp_path / "out", "test"):
        pass
    assert (partial_of(tmp_path / "out") / "thesis.txt").exists() and len(list(partial_of(tmp_path / "out").glob("*.part"))) == 1
