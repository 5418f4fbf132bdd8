"""The frame of every export: the registry, and folders that are replaced whole or not at all."""

import json
import os

import pytest

from rtgi_addon.errors import BakeError, Cancelled, UsageError
from rtgi_addon.exchange import engines
from rtgi_addon.exchange.engines import Engine, ExportSettings
from rtgi_addon.exchange.engines.axes import Y_UP
from rtgi_addon.exchange.engines.base import MARKER, write_text
from rtgi_addon.progress import Progress


class Paper(Engine):
    """An engine that reads one file."""

    name, title, description, axes, leftovers = "paper", "Paper", "For tests", Y_UP, ("cache/*", "*.uid")
    parts = ("a",)
    text, failure = "first", None

    def write(self, bundle, folder, settings, progress):
        write_text(folder / "a" / "probes.txt", self.text)
        progress.step(0.5, "Writing")
        if self.failure is not None:
            raise self.failure
        write_text(folder / "README.md", "read me")
        return ["a note"]


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
    assert report.volumes == ("Known", "Hard", "Inset") and report.notes == ("a note",)
    assert report.size == sum(len(content) for name, content in contents(report.out).items() if name != MARKER)
    assert json.loads((tmp_path / "out" / MARKER).read_text())["files"] == list(report.files)
    assert json.loads(json.dumps(report.to_json()))["bytes"] == report.size and "a note" in report.to_text()
    assert list(tmp_path.iterdir()) == [tmp_path / "out"]


def test_what_games_take_is_not_under_the_add_ons_own_license(paper, kit_bundle, tmp_path):
    out = contents(paper.export(kit_bundle, tmp_path / "out").out)
    assert out["a/LICENSE.txt"] == out["LICENSE.txt"] and out["LICENSE.txt"].startswith(b"MIT License")


def test_an_export_replaces_an_earlier_one_with_what_the_engine_left(paper, kit_bundle, tmp_path):
    out = paper.export(kit_bundle, tmp_path / "out").out
    (out / "cache/deep").mkdir(parents=True)
    (out / "cache/deep/x").write_text("")
    (out / "a/probes.uid").write_text("")
    paper.text = "second"
    paper.export(kit_bundle, out)
    assert contents(out)["a/probes.txt"] == b"second" and not (out / "cache").exists()


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


def test_the_users_own_files_are_never_replaced(paper, kit_bundle, tmp_path):
    out = paper.export(kit_bundle, tmp_path / "out").out
    (out / "a/mine.txt").write_text("mine")
    with pytest.raises(BakeError, match=r"a/mine\.txt"):
        paper.export(kit_bundle, out)
    assert (out / "a/mine.txt").read_text() == "mine"


def test_another_engines_export_is_not_ours(paper, kit_bundle, tmp_path):
    class Other(Paper):
        name = "other"

    out = paper.export(kit_bundle, tmp_path / "out").out
    with pytest.raises(BakeError, match="not part of an export"):
        Other().export(kit_bundle, out)


def test_targets_that_will_not_do(paper, kit_bundle, tmp_path):
    with pytest.raises(BakeError, match="does not exist"):
        paper.export(kit_bundle, tmp_path / "no/where")
    (tmp_path / "file").write_text("")
    with pytest.raises(BakeError, match="is a file"):
        paper.export(kit_bundle, tmp_path / "file")


def test_an_export_that_was_killed_while_it_was_put_in_place_comes_back(paper, kit_bundle, tmp_path):
    out = paper.export(kit_bundle, tmp_path / "out").out
    before = contents(out)
    os.rename(out, tmp_path / "out.rtgi-old")
    assert paper.check_target(out) == out and contents(out) == before
