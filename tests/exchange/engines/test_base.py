"""The frame of every export: the registry, files that are replaced all together or not at all, and those that are not ours."""

import json
import os

import pytest
from kills import needs_fork, run_killed

from rtgi_addon.errors import BakeError, Cancelled, UsageError
from rtgi_addon.exchange import engines
from rtgi_addon.exchange.engines import Engine, ExportSettings
from rtgi_addon.exchange.engines.axes import Y_UP
from rtgi_addon.exchange.engines.base import MARKER, write_text
from rtgi_addon.progress import Progress
from rtgi_addon.storage.reading import sha256_of_file
from rtgi_addon.storage.workplace import workplace


class Paper(Engine):
    """An engine that reads one file."""

    name, title, description, axes = "paper", "Paper", "For tests", Y_UP
    parts, scattered = ("a",), True
    text, failure, more = "first", None, ()

    def write(self, bundle, folder, settings, progress):
        write_text(folder / "a" / "probes.txt", self.text)
        progress.step(0.5, "Writing")
        if self.failure is not None:
            raise self.failure
        write_text(folder / "README.md", "read me")
        for name in self.more:
            write_text(folder / name, name)
        return ["a note"]

    def blend(self, name, theirs, ours):
        return ours + b"+" + theirs.partition(b"+")[2] if name == "a/record" and b"+" in theirs else None


@pytest.fixture
def paper():
    return Paper()


def contents(folder):
    return {path.relative_to(folder).as_posix(): path.read_bytes() for path in folder.rglob("*") if path.is_file()}


def test_engines_are_found_by_name_and_alias():
    assert {"godot", "threejs"} <= set(engines.names()) and engines.names() == sorted(engines.names())
    assert engines.get("three") is engines.get("threejs")
    with pytest.raises(UsageError, match=r"unknown engine 'quake': choose one of .*godot"):
        engines.get("quake")


def test_the_report_names_everything(paper, kit_bundle, tmp_path):
    report = paper.export(kit_bundle, tmp_path / "out")
    assert report.files == ("LICENSE.txt", "README.md", "a/LICENSE.txt", "a/probes.txt")
    assert report.volumes == ("Known", "Hard", "Inset", "Weights", "Scattered") and report.notes == ("a note",)
    assert report.size == sum(len(content) for name, content in contents(report.out).items() if not name.endswith(MARKER))
    whole, part = (json.loads((tmp_path / "out" / place / MARKER).read_text())["files"] for place in ("", "a"))
    assert whole == {name: sha256_of_file(report.out / name) for name in ("LICENSE.txt", "README.md")}
    assert part == {name: sha256_of_file(report.out / "a" / name) for name in ("LICENSE.txt", "probes.txt")}
    assert json.loads(json.dumps(report.to_json()))["bytes"] == report.size and "a note" in report.to_text()
    assert list(tmp_path.iterdir()) == [tmp_path / "out"]


def test_what_games_take_is_not_under_the_add_ons_own_license(paper, kit_bundle, tmp_path):
    out = contents(paper.export(kit_bundle, tmp_path / "out").out)
    assert out["a/LICENSE.txt"] == out["LICENSE.txt"] and out["LICENSE.txt"].startswith(b"MIT License")


def test_an_export_replaces_an_earlier_one_and_nothing_else(paper, kit_bundle, tmp_path):
    paper.more = ("a/gone.txt", "old/gone.txt")
    out = paper.export(kit_bundle, tmp_path / "out").out
    for name in ("cache/deep/x", "a/probes.txt.uid", ".gitignore", "a/mine", "old/mine"):
        (out / name).parent.mkdir(parents=True, exist_ok=True)
        (out / name).write_text("mine")
    before = {name: content for name, content in contents(out).items() if content == b"mine"}
    paper.text, paper.more = "second", ("new/file",)
    report = paper.export(kit_bundle, out)
    found = contents(out)
    assert found["a/probes.txt"] == b"second" and found["new/file"] == b"new/file" and report.kept == ()
    assert {name: found.get(name) for name in before} == before and not {"a/gone.txt", "old/gone.txt"} & found.keys()
    assert os.listdir(tmp_path) == ["out"]


def test_a_changed_file_stays_where_nothing_new_is_due_in_it(paper, kit_bundle, tmp_path):
    paper.more = ("a/gone.txt",)
    out = paper.export(kit_bundle, tmp_path / "out").out
    (out / "README.md").write_text("my own notes")
    (out / "a/gone.txt").write_text("mine now")
    (out / "LICENSE.txt").unlink()
    paper.text, paper.more = "second", ()
    report = paper.export(kit_bundle, out)
    assert report.kept == ("README.md", "a/gone.txt") and "kept     README.md, which was changed" in report.to_text()
    assert (out / "README.md").read_text() == "my own notes" and (out / "a/gone.txt").read_text() == "mine now"
    assert (out / "a/probes.txt").read_text() == "second" and (out / "LICENSE.txt").exists()
    assert paper.export(kit_bundle, out).kept == ("README.md",)


@pytest.mark.parametrize("change", [
    lambda out: (out / "a/probes.txt").write_text("edited"),
    lambda out: ((out / "a/probes.txt").unlink(), (out / "a/probes.txt").symlink_to(out / "README.md")),
    lambda out: ((out / "a/probes.txt").unlink(), (out / "a/probes.txt").mkdir()),
])
def test_a_changed_file_in_the_way_is_refused_before_anything_is_touched(paper, kit_bundle, tmp_path, change):
    out = paper.export(kit_bundle, tmp_path / "out").out
    change(out)
    before = contents(out)
    paper.text = "second"
    with pytest.raises(BakeError, match=r"a/probes\.txt was changed since it was written, and is due with other content"):
        paper.export(kit_bundle, out)
    assert contents(out) == before and os.listdir(tmp_path) == ["out"]


def test_a_file_of_the_users_in_the_way_is_refused(paper, kit_bundle, tmp_path):
    out = paper.export(kit_bundle, tmp_path / "out").out
    before = {**contents(out), "b": b"mine"}
    (out / "b").write_text("mine")
    for more, words in (("b", r"b is not of rtgi"), ("b/c", r"b is a file where a folder is due")):
        paper.more = (more,)
        with pytest.raises(BakeError, match=words):
            paper.export(kit_bundle, out)
        assert contents(out) == before


def test_what_can_be_brought_together_is(paper, kit_bundle, tmp_path):
    paper.more = ("a/record",)
    out = paper.export(kit_bundle, tmp_path / "out").out
    (out / "a/record").write_text("old+theirs")
    assert paper.export(kit_bundle, out).kept == () and (out / "a/record").read_text() == "a/record+theirs"
    assert paper.export(kit_bundle, out).kept == () and (out / "a/record").read_text() == "a/record+theirs"


def test_only_the_part_for_projects_goes_into_one(paper, kit_bundle, tmp_path):
    project, files = tmp_path / "game", ExportSettings(part="files")
    project.mkdir()
    (project / "README.md").write_text("my game")
    (project / "a").mkdir()
    (project / "a/mine").write_text("mine")
    report = paper.export(kit_bundle, project, files)
    assert report.files == ("a/LICENSE.txt", "a/probes.txt") and "README" not in report.to_text()
    assert set(contents(project)) == {"README.md", "a/mine", f"a/{MARKER}", *report.files}
    paper.text = "second"
    paper.export(kit_bundle, project, files)
    assert (project / "a/probes.txt").read_text() == "second" and (project / "README.md").read_text() == "my game"
    with pytest.raises(BakeError, match=r"holds README\.md.*--part files"):
        paper.export(kit_bundle, project)
    with pytest.raises(UsageError, match="unknown part 'some'"):
        paper.export(kit_bundle, project, ExportSettings(part="some"))


def test_a_part_that_was_copied_into_a_project_is_known_there(paper, kit_bundle, tmp_path):
    out = paper.export(kit_bundle, tmp_path / "out").out
    (tmp_path / "game").mkdir()
    os.rename(out / "a", tmp_path / "game/a")
    paper.text = "second"
    paper.export(kit_bundle, tmp_path / "game", ExportSettings(part="files"))
    assert (tmp_path / "game/a/probes.txt").read_text() == "second"
    # And a whole export knows a part that was written alone.
    paper.export(kit_bundle, out, ExportSettings(part="files"))
    paper.text = "third"
    paper.export(kit_bundle, out)
    assert (out / "a/probes.txt").read_text() == "third"


@pytest.mark.parametrize(("text", "words"), [
    ("", "is damaged"), ("[]", "is damaged"), ('{"schema": "rtgi-export/1"}', "has schema 'rtgi-export/1'"),
    ('{"schema": "rtgi-export/2", "engine": "other", "rtgi": "", "files": {}}', "holds an export to 'other'"),
    ('{"schema": "rtgi-export/2", "engine": "paper", "rtgi": ""}', "files is missing"),
    ('{"schema": "rtgi-export/2", "engine": "paper", "rtgi": "", "files": {"../mine": "%s"}}' % (64 * "0"), "names no file inside"),
    ('{"schema": "rtgi-export/2", "engine": "paper", "rtgi": "", "files": {"mine": "0"}}', "instead of a SHA-256"),
])
def test_a_marker_that_will_not_do_is_named_and_nothing_is_touched(paper, kit_bundle, tmp_path, text, words):
    out = paper.export(kit_bundle, tmp_path / "out").out
    (out / MARKER).write_text(text)
    before = contents(out)
    with pytest.raises(BakeError, match=words):
        paper.export(kit_bundle, out)
    assert contents(out) == before


@needs_fork
def test_a_kill_before_any_operation_costs_neither_the_export_nor_the_users_files(paper, kit_bundle, tmp_path, monkeypatch):
    monkeypatch.setattr(os, "fsync", lambda descriptor: None)
    whole = ExportSettings(conformance=False)
    old, new = ({"README.md": b"read me", "a/probes.txt": text} for text in (b"first", b"second"))
    out, at = tmp_path / "out", 0
    while True:
        at += 1
        paper.text = "first"
        paper.export(kit_bundle, out, whole)
        (out / "mine").write_text("mine")
        paper.text = "second"
        ended = run_killed(lambda: paper.export(kit_bundle, out, whole) and None, at, tmp_path)[0] is not None
        with workplace(out, "test"):
            pass
        found = contents(out)
        assert found["mine"] == b"mine" and {name: found[name] for name in old} in (old, new), at
        assert os.listdir(tmp_path) == ["out"]
        if ended:
            break
    assert at > 30


@pytest.mark.parametrize("failure", [OSError(28, "No space left"), BakeError("no", "other"), Cancelled(), KeyError("bug")])
def test_what_fails_leaves_the_earlier_one(paper, kit_bundle, tmp_path, failure):
    out = paper.export(kit_bundle, tmp_path / "out").out
    before = contents(out)
    paper.text, paper.failure = "second", failure
    with pytest.raises(BakeError if isinstance(failure, OSError) else type(failure)):
        paper.export(kit_bundle, out)
    assert contents(out) == before and list(tmp_path.iterdir()) == [out]


def test_cancelling_leaves_nothing(paper, kit_bundle, tmp_path):
    progress = Progress()
    progress.cancel()
    with pytest.raises(Cancelled):
        paper.export(kit_bundle, tmp_path / "out", ExportSettings(), progress)
    assert not list(tmp_path.iterdir())


def test_another_engines_export_is_not_ours(paper, kit_bundle, tmp_path):
    class Other(Paper):
        name = "other"

    out = paper.export(kit_bundle, tmp_path / "out").out
    with pytest.raises(BakeError, match="holds an export to 'paper'"):
        Other().export(kit_bundle, out)


def test_targets_that_will_not_do(paper, kit_bundle, tmp_path):
    (tmp_path / "file").write_text("")
    with pytest.raises(BakeError, match="is no folder"):
        paper.export(kit_bundle, tmp_path / "file/where")
    with pytest.raises(BakeError, match="is a file"):
        paper.export(kit_bundle, tmp_path / "file")
