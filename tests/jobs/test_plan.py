"""Planned bakes: the bundle is what was planned, and the report says how good the plan was."""

import json
from dataclasses import replace

import numpy as np
import pytest
import scene_builders as build

from rtgi_addon.errors import UsageError
from rtgi_addon.evaluate.metrics import Figure
from rtgi_addon.evaluate.plan import Target
from rtgi_addon.exchange.bundle import read_bundle
from rtgi_addon.jobs import plan as job
from rtgi_addon.jobs.plan import Check, bake_planned, plan_scene


def room(**volume_options):
    """A closed room with a lamp in its middle."""
    volume = build.volume(**{"resolution": (6, 6, 6), "half_size": 0.95, **volume_options})
    return replace(build.closed_box(), volumes=(volume,))


def test_a_plan_is_told_to_people_and_programs():
    report = plan_scene(room(), Target(0.15), others=True, threads=1)
    text, data = report.to_text(), json.loads(json.dumps(report.to_json()))
    assert text.startswith("Planned: probes with order") and "The plan took" in text
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


def test_a_check_tells_what_it_can_and_no_more():
    def check(error, spread):
        return Check(Figure(0.04, 0.002), Figure(error, spread), 0.03, 256, 1.0, 1.1, 1e6, 1_100_000, 0.05)

    good, near, bad = check(0.045, 0.004), check(0.053, 0.004), check(0.07, 0.004)
    assert good.within and near.within and not bad.within
    assert "above" not in good.to_text() and "by less than the check can tell" in near.to_text()
    assert "above 5 %" in bad.to_text() and "by less" not in bad.to_text()


def test_direct_light_cannot_be_checked(tmp_path):
    with pytest.raises(UsageError, match="no-check"):
        bake_planned(room(), Target(0.15), tmp_path / "bundle", direct=True, threads=1)
    done = bake_planned(room(resolution=(3, 3, 3)), Target(0.3), tmp_path / "bundle", direct=True, check=False, threads=1)
    assert done.check is None and done.bake.includes_direct and done.to_json()["check"] is None
