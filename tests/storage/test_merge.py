"""Sets of files in a folder where users work: whoever reads one through its index gets all of one, whatever happens meanwhile."""

import os
import shutil

import pytest
from kills import needs_fork, run_killed

from rtgi_addon.errors import BakeError
from rtgi_addon.storage.merge import merge_into
from rtgi_addon.storage.reading import sha256_of_file
from rtgi_addon.storage.workplace import partial_of, settle, workplace
from rtgi_addon.storage.writing import write_text

OLD = {"data/one": "old", "data/two": "old", "index": "data", "more/index": "old", "note": "same"}
NEW = {"data/one": "new", "data/three": "new", "index": "data", "more/index": "new", "note": "same"}
INDICES = ("index", "more/index")


@pytest.fixture(autouse=True)
def quick(monkeypatch):
    """A kill loses nothing that the system holds."""
    monkeypatch.setattr(os, "fsync", lambda descriptor: None)


def contents(folder):
    return {path.relative_to(folder).as_posix(): path.read_text() for path in sorted(folder.rglob("*")) if path.is_file()}


def put(out, files, base):
    with workplace(out, "test") as place:
        for name, text in files.items():
            write_text(place.new / name, text)
        return merge_into(place, base, indices=INDICES)


@pytest.fixture
def written(tmp_path):
    """A folder with the old set and a file of a user's, and a function that makes it anew and gives its checksums."""
    out = tmp_path / "out"

    def write():
        shutil.rmtree(out, ignore_errors=True)
        put(out, OLD, {})
        (out / "mine").write_text("mine")
        return {name: sha256_of_file(out / name) for name in OLD}

    return out, write


@needs_fork
def test_an_index_is_only_there_when_all_that_it_leads_to_is_of_one_set(tmp_path, written):
    (out, write), at, seen = written, 0, set()
    while True:
        at += 1
        base = write()
        ended = run_killed(lambda base=base: put(out, NEW, base) and None, at, tmp_path)[0] is not None
        found = contents(out)
        assert found.pop("mine") == "mine"
        there = set(INDICES) & found.keys()
        if there:
            assert any(found == {name: whole[name] for name in whole if name not in INDICES or name in there}
                       for whole in (OLD, NEW)), (at, found)
        seen.add("old" if found == OLD else "new" if found == NEW else "some" if there else "none")
        with workplace(out, "test"):
            pass
        assert contents(out) in ({**OLD, "mine": "mine"}, {**NEW, "mine": "mine"}) and os.listdir(tmp_path) == ["out"]
        if ended:
            break
    assert seen >= {"old", "none", "new"}


def test_an_index_that_nothing_changes_behind_stays_as_it_is(written):
    out, write = written
    base = write()
    before = os.stat(out / "index")
    assert not put(out, OLD, base).replaced
    assert os.path.samestat(before, os.stat(out / "index"))
    assert {"index", "more/index"} < put(out, NEW, base).replaced.keys()
    assert contents(out) == {**NEW, "mine": "mine"}


def test_an_index_of_a_users_own_stays(written):
    out, write = written
    base = write()
    (out / "index").write_text("my own")
    assert put(out, NEW, base).kept == ["index"]
    assert contents(out) == {**NEW, "index": "my own", "mine": "mine"}


@needs_fork
def test_the_index_does_not_come_while_a_file_stands_in_the_way(tmp_path, written):
    out, write = written
    base, at = write(), 0
    while not (partial_of(out) / "commit.json").exists():
        at += 1
        run_killed(lambda: put(out, NEW, base) and None, at, tmp_path)
    (out / "data/one").write_text("edited meanwhile")
    with pytest.raises(BakeError, match=r"data/one was changed while it was being replaced"):
        settle(out)
    assert contents(out)["data/one"] == "edited meanwhile" and not set(INDICES) & contents(out).keys()
