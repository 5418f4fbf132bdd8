"""Reports as sets of files: a kill between two of them stands in nobody's way."""

import json
import os

import pytest
from kills import needs_fork, run_killed

from rtgi_addon.errors import BakeError
from rtgi_addon.jobs.report_files import check_report, put_report
from rtgi_addon.storage.workplace import workplace
from rtgi_addon.storage.writing import write_text

SCHEMA = "made-up/1"


def put(out, word):
    with workplace(check_report(out, "data.json", SCHEMA, ["data.txt"]), "test") as place:
        write_text(place.new / "data.txt", word)
        write_text(place.new / "worst.txt", word)
        put_report(place, "data.json", {"schema": SCHEMA, "word": word})


def words(out):
    """What each file of the report says."""
    return {path.name: json.loads(path.read_text())["word"] if path.suffix == ".json" else path.read_text()
            for path in out.iterdir()}


@needs_fork
def test_the_next_run_completes_what_a_kill_left_half_replaced(tmp_path, monkeypatch):
    monkeypatch.setattr(os, "fsync", lambda descriptor: None)
    out, at, halves = tmp_path / "out", 0, 0
    while True:
        at += 1
        put(out, "old")
        ended = run_killed(lambda: put(out, "new"), at, tmp_path)[0] is not None
        halves += len(set(words(out).values())) > 1
        if "data.json" in words(out):
            assert len(set(words(out).values())) == 1, at
        put(out, "newer")
        assert set(words(out).values()) == {"newer"} and os.listdir(tmp_path) == ["out"]
        if ended:
            break
    assert halves


def test_a_file_that_somebody_changed_is_refused_before_anything_is_measured(tmp_path):
    out = tmp_path / "out"
    put(out, "old")
    (out / "worst.txt").write_text("mine")
    with pytest.raises(BakeError, match=r"worst.txt was changed since it was written"):
        check_report(out, "data.json", SCHEMA, ["data.txt"])
    assert (out / "worst.txt").read_text() == "mine"
