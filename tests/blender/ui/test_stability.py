"""The stability suite from Blender and from the command line."""

import json
import re
from types import SimpleNamespace

import pytest

from rtgi_addon.blender.cli.base import Session
from rtgi_addon.blender.cli.parser import SUBCOMMANDS, build_parser
from rtgi_addon.errors import BakeError, UsageError
from rtgi_addon.evaluate.stability import CASES, Case, Limit, Sample, limits
from rtgi_addon.progress import Progress

bpy = pytest.importorskip("bpy", reason="needs Blender's Python module")


@pytest.fixture
def registered(empty_blend, tmp_path):
    import rtgi_addon
    rtgi_addon.register()
    bpy.context.scene.rtgi.output = str(tmp_path / "bake")
    yield tmp_path / "bake_stability"
    rtgi_addon.unregister()


@pytest.fixture
def made_up(monkeypatch):
    """A case that finds 0.5 and bakes nothing."""
    monkeypatch.setitem(limits.LIMITS, "made-up", {"rsm": Limit(0.6, "so it is")})
    case = Case("made-up", "nothing", "none", "a number", "one", 0.2, lambda bench: [Sample("it", 0.5)])
    monkeypatch.setitem(CASES, "made-up", case)


def test_the_operator_leaves_a_report_in_blender_and_on_disk(registered, made_up):
    assert bpy.ops.rtgi.stability(technique="rsm", case="made-up", own=False) == {"FINISHED"}
    assert "made-up" in bpy.data.texts["RTGI Stability"].as_string()
    assert json.loads((registered / "stability.json").read_text())["cases"][0]["verdict"] == "known weakness"


def test_the_panel_ends_in_verdicts_and_opens_the_report(registered, monkeypatch):
    """Not the built-in scenes: those are for a shell."""
    from panel_layout import Layout
    result = Case("made-up", "nothing", "none", "a number", "one", 0.2, lambda bench: [Sample("it", 0.5)],
                  remedies={"rsm": "lower it"})
    monkeypatch.setitem(CASES, "made-up", result)

    def drawn():
        layout = Layout()
        bpy.types.RTGI_PT_stability.draw(SimpleNamespace(layout=layout), SimpleNamespace(
            scene=bpy.context.scene, region=SimpleNamespace(width=900)))
        return " ".join(layout.texts), layout.shown

    assert "Built-in" not in drawn()[0] and not bpy.ops.rtgi.open_report.poll()
    assert bpy.ops.rtgi.stability(technique="rsm", case="made-up", own=False) == {"FINISHED"}
    said, shown = drawn()
    assert "made-up" in said and "0.5 of 0.2" in said and "ower it" in said and shown[-1] == "rtgi.open_report"
    assert bpy.ops.rtgi.open_report() == {"FINISHED"}


def test_the_operator_reports_an_unknown_case(registered):
    with pytest.raises(RuntimeError, match="no-such"):
        bpy.ops.rtgi.stability(technique="rsm", case="no-such", own=False)


def test_the_operator_tests_this_scene(registered):
    bpy.ops.mesh.primitive_plane_add(size=4.0)
    bpy.ops.object.light_add(type="POINT", location=(0.5, 0.0, 1.0))
    bpy.ops.object.lightprobe_add(type="VOLUME", location=(0.0, 0.0, 1.0))
    probe = bpy.context.object.data
    probe.resolution_x = probe.resolution_y = probe.resolution_z = 2
    assert bpy.ops.rtgi.stability(technique="lpv", case="size") == {"FINISHED"}
    (entry,) = json.loads((registered / "stability.json").read_text())["cases"]
    assert (entry["case"], entry["technique"], entry["bound"]) == ("size", "lpv", None)
    assert entry["figure"] < 0.02 and entry["verdict"] == "holds"


def test_the_shell_takes_a_file_or_none(tmp_path):
    """Which scenes are tested follows from whether there is a FILE, and --built-in."""
    from rtgi_addon.evaluate.stability import parts
    read = []

    def read_scene():
        read.append(True)
        return parts.room_with_block(2)

    def run(*words, has_file):
        arguments = build_parser("rtgi").parse_args(["stability", "--no-pictures", "--technique", "rsm", *words])
        return SUBCOMMANDS["stability"].run(arguments, Session(Progress(), read_scene, has_file))

    own = run("--case", "size", has_file=True)
    assert read and own.results[0].case.scene == "the scene room with a block"
    assert '"room with a block.blend" stability --case size' in own.results[0].command
    assert run("--case", "scale", "--built-in", has_file=True).results[0].case is CASES["scale"] and len(read) == 1
    with pytest.raises(UsageError, match="phase"):
        run("--case", "phase", has_file=False)


def test_the_shell_fails_where_a_bound_is_passed(made_up, monkeypatch):
    def run(*words):
        arguments = build_parser("rtgi").parse_args(["stability", *words])
        SUBCOMMANDS["stability"].check(arguments)
        return SUBCOMMANDS["stability"].run(arguments, Session(Progress(), lambda: None, has_file=False))

    assert run("--case", "made-up").to_json()["cases"][0]["figure"] == 0.5
    monkeypatch.setitem(limits.LIMITS, "made-up", {"rsm": Limit(0.4, "so it is")})
    # The report is printed, and the command has failed.
    report = run("--case", "made-up")
    assert report.to_json()["cases"][0]["verdict"].startswith("worse") and isinstance(report.refusal, BakeError)
    assert re.search(r"made-up of rsm \(0.5, bound 0.4\).*--case made-up --technique rsm", str(report.refusal))
    with pytest.raises(UsageError, match="no-such"):
        run("--technique", "no-such")
