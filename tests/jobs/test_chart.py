"""The chart's job: what is measured, what is written, and what stays when it is cancelled. A technique that is wrong by a known
amount in a furnace of a known answer stands in for the real ones."""

import json
import os
import sys
from functools import partial

import numpy as np
import pytest
import scene_builders as build
from atlas_scenes import cube_map, in_atlas
from offset_technique import OffsetTechnique

from rtgi_addon import techniques
from rtgi_addon.errors import BakeError, Cancelled, UsageError
from rtgi_addon.evaluate import chart_picture
from rtgi_addon.evaluate.error_map import ErrorMap
from rtgi_addon.jobs import chart as chart_job
from rtgi_addon.jobs.chart import chart_scene
from rtgi_addon.progress import Progress
from rtgi_addon.storage.png import require_whole_png

QUICK = {"points": 8, "normals_per_point": 2, "probes": 4, "noise": 0.04, "threads": 1}


@pytest.fixture(autouse=True)
def small_maps(monkeypatch):
    """Error maps of a few pixels: most of a chart's time would be their reference."""
    monkeypatch.setattr(chart_job, "ErrorMap", partial(ErrorMap, size=(16, 9)))


@pytest.fixture
def furnace():
    """Radiance 2 everywhere and in every direction."""
    return build.cube_furnace(albedo=0.5, emission=1.0, resolution=(2, 2, 2))


@pytest.fixture
def offset(monkeypatch):
    """The stand-in, known under its name."""
    technique = OffsetTechnique()
    monkeypatch.setitem(techniques.registry(), "offset", technique)
    return technique


def test_errors_bias_and_noise_are_those_of_the_technique(furnace, offset, tmp_path):
    report = chart_scene(furnace, tmp_path / "chart", ["offset"], seeds=3, maps=False, **QUICK)
    chart = report.chart
    # One bake to warm up, then each of three settings with three seeds, all settings before any has its second seed.
    assert offset.bakes[1:4] == list(offset.sweep()) and len(offset.bakes) == 10
    assert [point.label for point in chart.points] == ["offset 0.5", "defaults", "offset 0.02, noise 0.01"]
    assert [point.default for point in chart.points] == [False, True, False]
    for point, expected in zip(chart.points[:2], (0.5, 0.1), strict=True):
        for place in ("surface", "own_normals", "shipped", "probes"):
            assert point.error(place) == pytest.approx(expected, abs=0.025), place
            assert point.accuracy[place].bias.mean == pytest.approx(expected, abs=0.025)
            assert point.accuracy[place].energy == pytest.approx(1 + expected, abs=0.025)
        assert point.accuracy["surface"].spread.random == pytest.approx(0.0, abs=1e-6)
    noisy = chart.points[2].accuracy["surface"].spread
    drawn = [0.02 + 0.01 * np.random.default_rng(seed).standard_normal() for seed in range(3)]
    assert noisy.random == pytest.approx(np.std(drawn, ddof=1), rel=0.1)
    assert set(chart.front()) >= {2} and chart.complete and chart.left_out == ()


def test_the_files_hold_what_was_measured(furnace, offset, tmp_path):
    pytest.importorskip("matplotlib", reason="draws the pictures")
    seen = []
    report = chart_scene(furnace, tmp_path / "chart", ["offset"], seeds=2, on_point=lambda chart: seen.append(chart), **QUICK)
    assert set(report.files) == {"chart.json", "chart.md", "chart.png", "chart.svg", "error_offset.png", "errors.png",
                                 "reference.png"} == {path.name for path in (tmp_path / "chart").iterdir()}
    assert len(seen) == 6 and [len(chart.points) for chart in seen[:3]] == [1, 2, 3] and not seen[-1].complete
    data = json.loads((tmp_path / "chart/chart.json").read_text())
    assert data["schema"] == "rtgi-chart/1" and data["complete"] and data["seeds"] == 2 and data["reference"]["kind"] == "path"
    assert [len(point["runs"]) for point in data["points"]] == [2, 2, 2]
    run = data["points"][0]["runs"][1]
    assert run["seed"] == 1 and run["errors"]["surface"]["error"] == pytest.approx(0.5, abs=0.025) and run["seconds"] > 0
    assert data["points"][0]["settings"] == {"offset": 0.5, "noise": 0.0}
    text = (tmp_path / "chart/chart.md").read_text()
    for heading in ("## Every setting", "## At equal time", "## At equal error"):
        assert heading in text
    assert "![chart.png](chart.png)" in text and "Known Offset" in (tmp_path / "chart/chart.svg").read_text()
    assert "offset, offset 0.02, noise 0.01" in report.to_text() and report.to_json()["out"] == str(tmp_path / "chart")


def test_without_matplotlib_the_chart_is_plain_and_one_line_says_so(furnace, offset, tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, "matplotlib", None)
    assert not chart_picture.can_draw()
    report = chart_scene(furnace, tmp_path / "chart", ["offset"], seeds=1, **QUICK)
    assert set(report.files) == {"chart.json", "chart.md", "chart.png", "error_offset.png", "reference.png"}
    require_whole_png(report.picture, (800, 1280))
    assert [line for line in report.to_text().splitlines() if "pip install matplotlib" in line] == [f"  note     {report.hint}"]
    assert "error_offset.png" in (tmp_path / "chart/chart.md").read_text()


def test_a_cancelled_chart_keeps_what_was_measured(furnace, offset, tmp_path):
    progress = Progress()
    offset.on_bake = lambda number: number == 3 and progress.cancel()
    with pytest.raises(Cancelled, match="1 settings that were measured are in"):
        chart_scene(furnace, tmp_path / "chart", ["offset"], seeds=2, progress=progress, **QUICK)
    data = json.loads((tmp_path / "chart/chart.json").read_text())
    assert not data["complete"] and [point["label"] for point in data["points"]] == ["offset 0.5"]
    assert "Cancelled before the end" in (tmp_path / "chart/chart.md").read_text()
    if chart_picture.can_draw():
        assert (tmp_path / "chart/chart.png").exists()


def assert_same_figures(found, expected):
    """All but what the clock decides."""
    def figures(chart):
        return [(point.label, point.lattice, point.settings, point.rays, point.accuracy, point.field_bytes,
                 [run["errors"] for run in point.runs]) for point in chart.points]

    assert figures(found) == figures(expected) and (found.reference, found.receivers) == (expected.reference, expected.receivers)


def test_an_interrupted_chart_goes_on_where_it_stopped(furnace, offset, tmp_path):
    whole = chart_scene(furnace, tmp_path / "whole", ["offset"], seeds=2, **QUICK)
    bakes = len(offset.bakes)
    for stop in (3, 6):
        offset.bakes.clear()
        progress = Progress()
        offset.on_bake = lambda number, stop=stop, progress=progress: number == stop and progress.cancel()
        with pytest.raises(Cancelled, match="--resume goes on from there"):
            chart_scene(furnace, tmp_path / "chart", ["offset"], seeds=2, resume=True, progress=progress, **QUICK)
    offset.bakes.clear()
    offset.on_bake = lambda number: None
    with pytest.raises(BakeError, match=r"belongs to another run, changed since: seeds \(2 before, 3 now\)"):
        chart_scene(furnace, tmp_path / "chart", ["offset"], seeds=3, resume=True, **QUICK)
    report = chart_scene(furnace, tmp_path / "chart", ["offset"], seeds=2, resume=True, **QUICK)
    # One to warm up, and the defaults once more for their map; what was measured is not baked again.
    assert 0 < len(offset.bakes) < bakes and report.chart.complete and report.files == whole.files
    assert_same_figures(report.chart, whole.chart)
    assert (tmp_path / "chart/error_offset.png").read_bytes() == (tmp_path / "whole/error_offset.png").read_bytes()
    assert sorted(os.listdir(tmp_path)) == ["chart", "whole"]


def test_a_refusal_is_remembered(furnace, offset, tmp_path, monkeypatch):
    refuses = type("Refuses", (OffsetTechnique,), {"name": "refuses"})(refuses=True)
    monkeypatch.setitem(techniques.registry(), "refuses", refuses)
    progress = Progress()
    offset.on_bake = lambda number: number == 3 and progress.cancel()
    with pytest.raises(Cancelled):
        chart_scene(furnace, tmp_path / "chart", ["refuses", "offset"], seeds=1, maps=False, progress=progress, **QUICK)
    refuses.refuses, offset.on_bake = False, lambda number: None
    report = chart_scene(furnace, tmp_path / "chart", ["refuses", "offset"], seeds=1, maps=False, resume=True, **QUICK)
    assert len(report.chart.left_out) == 3 and report.chart.techniques() == ["offset"]


def test_a_cancelled_chart_leaves_an_earlier_whole_one(furnace, offset, tmp_path):
    chart_scene(furnace, tmp_path / "chart", ["offset"], seeds=1, maps=False, **QUICK)
    before = {path.name: path.read_bytes() for path in (tmp_path / "chart").iterdir()}
    progress = Progress()
    offset.on_bake = lambda number: number == len(offset.bakes) > 6 and progress.cancel()
    with pytest.raises(Cancelled, match=r"are in .*chart\.partial, the chart in .*chart is the earlier one"):
        chart_scene(furnace, tmp_path / "chart", ["offset"], seeds=2, maps=False, progress=progress, **QUICK)
    assert {path.name: path.read_bytes() for path in (tmp_path / "chart").iterdir()} == before
    offset.on_bake = lambda number: None
    chart_scene(furnace, tmp_path / "chart", ["offset"], seeds=2, maps=False, resume=True, **QUICK)
    assert json.loads((tmp_path / "chart/chart.json").read_text())["seeds"] == 2 and os.listdir(tmp_path) == ["chart"]


def test_what_a_user_put_or_changed_there_is_never_lost(furnace, offset, tmp_path):
    out = tmp_path / "chart"
    out.mkdir()
    (out / "chart.md").write_text("my notes")
    with pytest.raises(BakeError, match=r"chart\.md is not of rtgi"):
        chart_scene(furnace, out, ["offset"], seeds=1, maps=False, **QUICK)
    assert not offset.bakes and (out / "chart.md").read_text() == "my notes"
    (out / "chart.md").rename(out / "notes.txt")
    chart_scene(furnace, out, ["offset"], seeds=1, maps=False, **QUICK)
    (out / "chart.md").write_text("edited")
    bakes = len(offset.bakes)
    with pytest.raises(BakeError, match=r"chart\.md was changed since it was written"):
        chart_scene(furnace, out, ["offset"], seeds=1, maps=False, **QUICK)
    assert len(offset.bakes) == bakes and (out / "chart.md").read_text() == "edited"
    (out / "chart.md").unlink()
    chart_scene(furnace, out, ["offset"], seeds=1, maps=True, **QUICK)
    chart_scene(furnace, out, ["offset"], seeds=1, maps=False, **QUICK)
    assert (out / "notes.txt").read_text() == "my notes" and not (out / "error_offset.png").exists()


def test_cancelled_before_the_first_bake_nothing_is_there(furnace, offset, tmp_path):
    progress = Progress()
    progress.cancel()
    with pytest.raises(Cancelled):
        chart_scene(furnace, tmp_path / "chart", ["offset"], progress=progress, **QUICK)
    assert not (tmp_path / "chart/chart.json").exists()


def test_a_technique_that_cannot_is_left_out_with_the_reason(furnace, offset, tmp_path, monkeypatch):
    monkeypatch.setitem(techniques.registry(), "refuses", type("Refuses", (OffsetTechnique,), {"name": "refuses"})(refuses=True))
    report = chart_scene(furnace, tmp_path / "chart", ["refuses", "offset"], seeds=1, maps=False, **QUICK)
    assert report.chart.techniques() == ["offset"] and len(report.chart.left_out) == 3
    assert report.chart.left_out[0] == "refuses, setting 1: the ceiling is too low: raise it"
    assert "the ceiling is too low" in (tmp_path / "chart/chart.md").read_text()
    with pytest.raises(BakeError, match=r"no technique could be measured.*the ceiling is too low"):
        chart_scene(furnace, tmp_path / "other", ["refuses"], seeds=1, maps=False, **QUICK)


def test_what_takes_too_long_is_not_repeated_and_dearer_settings_are_left_out(furnace, offset, tmp_path):
    report = chart_scene(furnace, tmp_path / "chart", ["offset"], seeds=3, maps=False, most_seconds=1e-9, **QUICK)
    assert [len(point.runs) for point in report.chart.points] == [1]
    assert report.chart.left_out == tuple(f"offset, setting {n}: a cheaper one took more than 1e-09 s" for n in (2, 3))


def test_wrong_wishes(furnace, tmp_path):
    with pytest.raises(UsageError, match="unknown technique 'magic'"):
        chart_scene(furnace, tmp_path / "chart", ["magic"])
    with pytest.raises(UsageError, match="above 0"):
        chart_scene(furnace, tmp_path / "chart", ["probes"], seeds=0)
    with pytest.raises(UsageError, match="unknown volume"):
        chart_scene(furnace, tmp_path / "chart", ["probes"], volume="nowhere", **QUICK)
    (tmp_path / "file").write_text("")
    with pytest.raises(BakeError, match="is a file"):
        chart_scene(furnace, tmp_path / "file", ["probes"], **QUICK)


@pytest.mark.slow
def test_every_technique_in_a_box(tmp_path):
    scene = build.closed_box(albedo=0.6, light_position=(0.2, 0.1, 0.4), resolution=(2, 2, 2), half_size=0.9)
    report = chart_scene(scene, tmp_path / "chart", seeds=1, maps=False, **QUICK)
    chart = report.chart
    assert chart.techniques() == techniques.names() and chart.left_out == ()
    best = {name: min(point.error("probes") for point in chart.points if point.technique == name and point.lattice == 1)
            for name in chart.techniques()}
    assert [point.lattice for point in chart.points if point.technique == "probes"] == [0.5, 1, 1, 1, 1, 1, 1, 2]
    assert best["probes"] < 0.02 and best["vpl"] < 0.1 < best["rsm"]
    assert all(point.cost("peak_bytes") is None or point.cost("peak_bytes") > 0 for point in chart.points)
    assert {point.technique: point.default for point in chart.points if point.stored} == {"transfer": True}
    assert "suns by 64 vectors" in (tmp_path / "chart" / "chart.md").read_text()


def test_the_light_atlas_is_charted_on_its_surfaces(furnace, offset, tmp_path):
    charted = in_atlas(furnace, 0, cube_map(furnace))
    report = chart_scene(charted, tmp_path / "chart", ["offset", "atlas"], seeds=1, maps=False, **QUICK)
    points = {(point.technique, point.label): point for point in report.chart.points}
    assert report.chart.receivers["atlas"] == 8 and report.chart.techniques("surface") == ["offset"]
    assert points["offset", "defaults"].error("atlas") == points["offset", "defaults"].error("own_normals")
    # The furnace's light is the same everywhere: pi times its radiance, at any density.
    atlas = [point for point in report.chart.points if point.technique == "atlas"]
    assert sum(point.default for point in atlas) == 1 and len(atlas) == 5
    for point in atlas:
        assert set(point.accuracy) == {"atlas"} and abs(point.accuracy["atlas"].bias.mean) < 0.05
    assert atlas[0].field_bytes < atlas[-2].field_bytes and "## Light atlas" in (tmp_path / "chart" / "chart.md").read_text()
    assert "on surfaces in the light atlas" in report.to_text()


def test_an_atlas_that_no_object_is_in_is_refused(furnace, tmp_path):
    with pytest.raises(BakeError, match="no object is in the light atlas"):
        chart_scene(furnace, tmp_path / "chart", ["atlas"], seeds=1, maps=False, **QUICK)
