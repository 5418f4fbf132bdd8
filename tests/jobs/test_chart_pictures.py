"""Pictures of effects in a chart: what is drawn, written, kept and left out."""

import json
import sys
from dataclasses import replace

import numpy as np
import pytest
from dim_effect import LEVEL, Dim, furnace
from offset_technique import OffsetTechnique

from rtgi_addon import effects, techniques
from rtgi_addon.errors import BakeError, Cancelled, UsageError
from rtgi_addon.evaluate.pictures import picture_size
from rtgi_addon.jobs.chart import chart_scene
from rtgi_addon.progress import Progress
from rtgi_addon.storage.png import require_whole_png

ALONE = {"names": [], "threads": 1, "maps": False}


class Exact:
    """The furnace as it is; ``refuses`` says why not."""

    kind = "exact"

    def __init__(self, refuses=""):
        self.refuses, self.rendered = refuses, []

    def pictures(self, camera, size, progress):
        """See PictureReference."""
        if self.refuses:
            raise BakeError(self.refuses, "mend it")
        self.rendered.append((camera.name, size))
        return np.full((2, size[1], size[0], 3), LEVEL)


@pytest.fixture
def dim(monkeypatch):
    """The stand-in is the only effect, and probes know the furnace."""
    effect = Dim()
    registry = {"dim": effect}
    monkeypatch.setattr(effects, "registry", lambda: registry)
    monkeypatch.setattr("rtgi_addon.evaluate.pictures.registry", lambda: registry)
    monkeypatch.setattr("rtgi_addon.evaluate.pictures.LONGER_SIDE", 32)
    exact, bake = OffsetTechnique(), OffsetTechnique.bake
    exact.bake = lambda scene, settings, *rest, **options: bake(exact, scene, replace(settings, offset=0.0), *rest, **options)
    monkeypatch.setitem(techniques.registry(), "probes", exact)
    return effect


def test_pictures_alone_make_a_chart(dim, tmp_path):
    pytest.importorskip("matplotlib", reason="draws the pictures")
    reference, seen = Exact(), []
    report = chart_scene(furnace(), tmp_path / "chart", pictures=reference, on_point=seen.append, **ALONE)
    pictures = report.chart.pictures
    assert reference.rendered == [("Eye", (32, 20))] and [len(chart.pictures.points) for chart in seen] == [1, 2, 3, 4]
    assert [point.last.error for point in pictures.points] == pytest.approx([0.0, 0.5, 0.1, 0.05], abs=0.01)
    assert set(report.files) == {"chart.json", "chart.md", "effects.png", "effects.svg"}
    assert report.picture == tmp_path / "chart/effects.png" and report.chart.points == ()
    data = json.loads((tmp_path / "chart/chart.json").read_text())["pictures"]
    assert data["camera"] == "Eye" and data["size"] == [32, 20] and data["reference"]["kind"] == "exact"
    assert data["points"][1]["settings"] == {"share": 0.5, "noise": 0.0} and len(data["points"][1]["steps"]) == 3
    text = (tmp_path / "chart/chart.md").read_text()
    assert "## Effects" in text and "| dim | **defaults** |" in text and "## Every setting" not in text
    assert "dim, defaults" in report.to_text() and "4 pictures of 1 effect" in report.to_text()


def test_without_matplotlib_they_are_plain(dim, tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, "matplotlib", None)
    report = chart_scene(furnace(), tmp_path / "chart", pictures=Exact(), **ALONE)
    assert set(report.files) == {"chart.json", "chart.md", "effects.png"} and report.hint
    require_whole_png(report.picture, (800, 1280))


def test_an_interrupted_chart_draws_no_picture_twice(dim, tmp_path):
    progress, reference = Progress(), Exact()

    def stop(chart):
        if len(chart.pictures.points) == 2:
            progress.cancel()

    with pytest.raises(Cancelled, match="0 settings and 2 pictures that were measured are in"):
        chart_scene(furnace(), tmp_path / "chart", pictures=reference, progress=progress, on_point=stop, **ALONE)
    assert "Cancelled before the end" in (tmp_path / "chart/chart.md").read_text()
    drawn = len(dim.fields)
    report = chart_scene(furnace(), tmp_path / "chart", pictures=reference, resume=True, **ALONE)
    assert len(reference.rendered) == 1 and len(report.chart.pictures.points) == 4
    # One setting was drawn before; after it came two more, and one picture to warm up.
    assert len(dim.fields) - drawn == 2 * 16 + 1


def test_what_cannot_be_drawn_is_left_out_and_said(dim, tmp_path):
    scene = furnace()
    for number, (of, reference, said) in enumerate(((replace(scene, cameras=()), Exact(), "the scene has no camera"),
                                                    (scene, Exact("no Cycles here"), "no Cycles here"))):
        report = chart_scene(of, tmp_path / str(number), pictures=reference, **ALONE)
        assert report.chart.pictures is None and said in report.to_text() and said in (report.folder / "chart.md").read_text()
    dim.concerns = lambda scene: False
    report = chart_scene(scene, tmp_path / "idle", pictures=Exact(), effects=["dim"], **ALONE)
    assert report.chart.left_out == ("dim: there is nothing for it to do in this scene",)


def test_a_setting_that_takes_too_long_ends_its_sweep(dim, tmp_path):
    report = chart_scene(furnace(), tmp_path / "chart", pictures=Exact(), most_seconds=1e-9, **ALONE)
    assert len(report.chart.pictures.points) == 1 and len(report.chart.left_out) == 3


def test_wrong_names_are_usage_errors(dim, tmp_path):
    with pytest.raises(UsageError, match="unknown effect 'fog'"):
        chart_scene(furnace(), tmp_path / "chart", effects=["fog"], pictures=Exact(), **ALONE)
    dim.sweep = lambda pixels: ()
    with pytest.raises(UsageError, match="draws as nothing looks"):
        chart_scene(furnace(), tmp_path / "chart", effects=["dim"], pictures=Exact(), **ALONE)
    with pytest.raises(UsageError, match="nothing to measure"):
        chart_scene(furnace(), tmp_path / "chart", [])
    assert picture_size(furnace().cameras[0]) == (32, 20)
