"""Planned bakes: the bundle is what was planned, and the report says how good the plan was."""

import json
from dataclasses import replace

import numpy as np
import pytest
import scene_builders as build

from rtgi_addon.errors import Cancelled, UsageError
from rtgi_addon.evaluate.metrics import Figure
from rtgi_addon.evaluate.plan import Target, choice
from rtgi_addon.evaluate.plan.look import Motion
from rtgi_addon.evaluate.plan.sample import NothingToSee
from rtgi_addon.exchange.bundle import read_bundle
from rtgi_addon.jobs import plan as job
from rtgi_addon.jobs.plan import Check, bake_fitted, bake_planned, plan_scene
from rtgi_addon.storage.parts import Parts


def room(**volume_options):
    """A closed room with a lamp in its middle."""
    volume = build.volume(**{"resolution": (6, 6, 6), "half_size": 0.95, **volume_options})
    return replace(build.closed_box(), volumes=(volume,))


def test_a_plan_is_told_to_people_and_programs():
    report = plan_scene(room(), Target(0.15), others=True, threads=1)
    text, data = report.to_text(), json.loads(json.dumps(report.to_json()))
    first, error, cost, *_ = text.splitlines()
    assert first.startswith("Planned: probes with order") and first.endswith("probes") and "The plan took" in text
    assert "light on surfaces off by" in error and "within the 15 % asked for" in error and "confidence" in error
    assert "MiB of memory" in cost and "MiB on disk" in cost and " s on this machine" in cost
    for technique in ("probes", "vpl", "lpv", "rsm"):
        assert technique in text.split("technique", 1)[1]
    assert data["met"] and data["confidence"] == 0.9 and data["options"][0]["label"] == "planned"
    assert data["volumes"][0]["resolution"] == list(report.plan.volumes[0].resolution) and data["target"]["error"] == 0.15
    assert {"error", "rays", "seconds", "bytes"} <= set(data["options"][0])


def test_a_planned_bake_ships_what_was_planned_and_is_checked(tmp_path, monkeypatch):
    monkeypatch.setattr(job, "CHECK_POINTS", 64)
    done = bake_planned(room(), Target(0.15), tmp_path / "bundle", threads=1)
    field = read_bundle(tmp_path / "bundle").field
    grid, = field.grids()
    planned, = done.plan.volumes
    assert tuple(grid.volume.resolution) == planned.resolution and grid.order == done.plan.settings["order"]
    assert done.bake.settings["error"] == done.plan.settings["error"]
    if planned.wanted is not None:
        assert not np.any(grid.validity[~planned.wanted])
    assert any("planned: " in note for note in json.loads((tmp_path / "bundle/bake.json").read_text())["notes"])
    check = done.check
    assert check.points == 64 and check.rays > 0 and check.seconds > 0 and check.within
    spread = np.hypot(*(max(figure.standard_error, 0.005) for figure in (check.error, check.predicted)))
    assert check.error.value == pytest.approx(check.predicted.value, abs=4 * spread)
    text, data = done.to_text(), json.loads(json.dumps(done.to_json()))
    assert "found at 64 surface points" in text and "planned: " not in text and "s predicted" in text
    assert data["check"]["within"] is True and data["plan"]["met"] and data["technique"] == "probes"


def test_a_planned_bake_that_was_interrupted_is_planned_again_in_the_same_way(tmp_path, monkeypatch):
    def bake(out, **options):
        return bake_planned(room(resolution=(3, 3, 3)), Target(0.1), tmp_path / out, check=False, checkpoint_seconds=0.0, **options)

    save, saved = Parts.save, []

    def until_the_first(self, *part):
        save(self, *part)
        saved.append(part)
        if len(saved) == 1:
            raise Cancelled("enough")

    with monkeypatch.context() as patch:
        patch.setattr(Parts, "save", until_the_first)
        with pytest.raises(Cancelled, match="enough"):
            bake("out", threads=1)
    resumed, whole = bake("out", threads=2, resume=True), bake("whole", threads=1)
    assert resumed.bake.resumed and resumed.plan.settings == whole.plan.settings
    assert read_bundle(tmp_path / "out").manifest["sha256"] == read_bundle(tmp_path / "whole").manifest["sha256"]


def test_a_check_tells_what_it_can_and_no_more():
    def check(error, low):
        return Check(Figure(0.04, 0.002), Figure(error, 0.004), low, 2 * error - low, 0.03, 256, 1.0, 1.1, 1e6, 1_100_000, 0.05)

    good, near, bad = check(0.045, 0.04), check(0.053, 0.046), check(0.07, 0.055)
    assert good.within and near.within and not bad.within
    assert "(4.6 % to 6 % at as many others)" in near.to_text()
    assert "above" not in good.to_text() and "by less than the check can tell" in near.to_text()
    assert "above 5 %" in bad.to_text() and "by less" not in bad.to_text()


def test_direct_light_cannot_be_checked(tmp_path):
    with pytest.raises(UsageError, match="no-check"):
        bake_planned(room(), Target(0.15), tmp_path / "bundle", direct=True, threads=1)
    done = bake_planned(room(resolution=(3, 3, 3)), Target(0.3), tmp_path / "bundle", direct=True, check=False, threads=1)
    assert done.check is None and done.bake.includes_direct and done.to_json()["check"] is None


def test_a_planned_bake_can_be_fitted(tmp_path):
    done = bake_planned(room(resolution=(3, 3, 3)), Target(0.3, fit=True), tmp_path / "bundle", check=False, threads=1)
    assert done.plan.settings["fit"] and done.bake.settings["fit"] and len(done.bake.stats["fits"]) == 1
    assert any(reason.startswith("Fitted to surfaces") for reason in done.plan.reasons) and ", fit on " in done.to_text()


def test_what_is_beside_a_plan_is_told():
    from atlas_scenes import cut_floor

    from rtgi_addon.jobs.plan_beside import beside
    atlas, transfer = beside(cut_floor(), 1000)
    assert atlas.startswith("The light atlas is baked beside it, at its defaults 40 x 40 texels by at most ")
    assert "would store 35.0 kB a probe at its defaults, at most 33.3 MiB for these (7.3 kB with --set sun_vectors=64)" in transfer


def test_a_fitted_volume_is_planned_and_keeps_the_probes_in_its_air(tmp_path):
    scene, kept = room(), []
    scene = replace(scene, volumes=(replace(scene.volumes[0], fitted=True),))
    done = bake_fitted(scene, tmp_path / "planned", keep=kept.append, threads=1)
    grid, = read_bundle(tmp_path / "planned").field.grids()
    planned, = done.plan.volumes
    assert done.check is None and done.plan.met and tuple(grid.volume.resolution) == planned.resolution
    assert planned.wanted is None and grid.volume.fitted and kept[0].grids()[0].sh.shape == grid.sh.shape
    assert json.loads(json.dumps(done.to_json()))["check"] is None and "Planned: probes" in done.to_text()


def test_a_fitted_volume_that_sees_no_surface_is_baked_by_defaults(tmp_path, monkeypatch):
    def blind(*_):
        raise NothingToSee("no surface can be seen from any probe", "move the Light Probe Volume to the geometry")

    scene = room(resolution=(2, 2, 2))
    monkeypatch.setattr(choice, "draw_sample", blind)
    done = bake_fitted(scene, tmp_path / "out", threads=1, motion=Motion())
    assert done.technique == "probes" and done.settings["error"] == 0.01 and done.volumes[0].probes == 8
