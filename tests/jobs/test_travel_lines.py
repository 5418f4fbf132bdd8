"""What the command line says of prepared bakes and parts that will not do: one line that says it all, and nothing is written."""

import json
import shutil

import pytest
import room_scenes as rooms

from rtgi_addon.blender.cli.doors import main_module
from rtgi_addon.jobs.prepare import prepare_scene
from rtgi_addon.jobs.prepared_bake import bake_prepared


@pytest.fixture(scope="module")
def work(tmp_path_factory):
    """Parts of two bakes that differ in their seed alone."""
    folder = tmp_path_factory.mktemp("lines")
    for seed in (0, 1):
        prepare_scene(rooms.two_rooms(), "probes", {"error": 0.3}, folder / f"prep{seed}", seed=seed)
        bake_prepared(folder / f"prep{seed}", folder / f"part{seed}", part=(1, 1))
    bake_prepared(folder / "prep0", folder / "half", part=(1, 2))
    return folder


def damaged(work, target, name, change):
    """A copy of `part0` whose file ``name`` is what ``change`` makes of its bytes."""
    shutil.copytree(work / "part0", target / "bad")
    file = target / "bad" / name
    file.write_bytes(change(file.read_bytes()))
    return "bad"


def of_version(data, **changed):
    return json.dumps({**json.loads(data), **changed}).encode()


BAD = {
    "cut short": (lambda work, at: damaged(work, at, "blocks.bin", lambda data: data[:-9]), "blocks.bin is damaged"),
    "no JSON": (lambda work, at: damaged(work, at, "part.json", lambda data: data[:40]), "part.json is"),
    "another version": (lambda work, at: damaged(work, at, "part.json", lambda data: of_version(data, rtgi="9.9.9")),
                        "was made with rtgi 9.9.9"),
    "another numpy": (lambda work, at: damaged(work, at, "part.json", lambda data: of_version(data, numpy="1.0")),
                      "was made with numpy 1.0"),
    "other kernels": (lambda work, at: damaged(work, at, "part.json", lambda data: of_version(data, kernels="77", part=2, parts=1)),
                      "kernels"),
    "another seed": (lambda work, at: work / "part1", "is of another prepared bake"),
    "another cut": (lambda work, at: work / "half", "is one of 2 parts"),
    "twice": (lambda work, at: work / "part0", "are both part 1"),
    "a prepared bake": (lambda work, at: work / "prep0", "is not a part of a bake"),
    "nothing": (lambda work, at: at / "none", "there is no folder"),
}


def said(capfd, *words):
    """Exit code and the one line on stderr but for progress."""
    code = main_module(list(map(str, words)))
    lines = [line for line in capfd.readouterr().err.splitlines() if line.startswith("rtgi: error")]
    assert len(lines) == 1, lines
    return code, lines[0]


@pytest.mark.parametrize("name", BAD)
def test_a_part_that_will_not_do_is_said_in_one_line(work, tmp_path, capfd, name):
    make, expected = BAD[name]
    code, line = said(capfd, "merge", work / "part0", tmp_path / make(work, tmp_path), "--out", tmp_path / "out")
    assert code == 1 and expected in line and ": " in line.removeprefix("rtgi: error: ")
    assert not list(tmp_path.glob("out*"))


@pytest.mark.parametrize(("words", "expected"), [
    (["bake", "{work}/prep0", "--part", "3/2"], "3/2"), (["bake", "{work}/prep0", "--part", "0/2"], "0/2"),
    (["bake", "{work}/prep0", "--part", "two"], "two"), (["bake", "{work}/prep0", "--error", "0.1"], "--error"),
    (["bake", "{work}/part0"], "is not a prepared bake"), (["bake", "{work}/prep0", "--seed", "3"], "--seed")])
def test_a_bake_that_cannot_be_is_said_in_one_line(work, tmp_path, capfd, words, expected):
    code, line = said(capfd, *(word.format(work=work) for word in words), "--out", tmp_path / "out")
    assert code in (1, 2) and expected in line
    assert not list(tmp_path.iterdir())
