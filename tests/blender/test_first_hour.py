"""The first hour of somebody new, in a real Blender with a window (see test_window.py for RTGI_BLENDER)."""

import json
import os
import shutil
from pathlib import Path

import pytest

REPOSITORY = Path(__file__).resolve().parents[2]
ADDON = "bl_ext.user_default.rtgi_addon"

pytestmark = [pytest.mark.slow, pytest.mark.skipif("RTGI_BLENDER" not in os.environ,
                                                   reason="RTGI_BLENDER names no Blender that can open a window")]


@pytest.fixture(scope="module")
def seen(blender, tmp_path_factory):
    """What tests/support/first_hour_script.py saw."""
    report = tmp_path_factory.mktemp("hour") / "report.json"
    ran = blender("-p", 0, 0, 1440, 900, "--python", REPOSITORY / "tests/support/first_hour_script.py", "--", report,
                  f"{ADDON}.rtgi_addon")
    assert report.exists(), ran.stdout[-2000:] + ran.stderr[-2000:]
    keep = os.environ.get("RTGI_SCREENSHOTS")
    if keep:
        for picture in report.parent.glob("*.png"):
            shutil.copy(picture, keep)
    seen = json.loads(report.read_text())
    assert "error" not in seen, seen["error"]
    return {**seen, "folder": str(report.parent), "stderr": ran.stderr}


def test_the_startup_scene_bakes_unsaved_at_the_first_click(seen):
    first = seen["first"]
    assert first["there"] and first["probes"] > 64 and "rtgi_unsaved" in first["folder"]
    assert any("never saved" in line for line in first["told"]) and first["changed"]


def test_a_volume_at_the_origin_bakes_too_and_is_told_before(seen):
    told = "every probe of the volume 'Volume' lies inside geometry"
    assert any(told in line for line in seen["checked"]) and not seen["at the origin"]["error"]
    assert any(told in line for line in seen["at the origin"]["told"]) and seen["at the origin"]["probes"] > 64


def test_overlays_show_in_another_engine_and_obey_blenders_switch(seen):
    assert "EEVEE" in seen["engine"]
    assert seen["overlays are seen"] > 0.01 and seen["overlays obey the switch"] < 0.1 * seen["overlays are seen"]


def test_the_last_bake_is_found_after_reopening(seen):
    assert seen["moved"] == f"{seen['folder']}/rtgi_bake" == seen["found"]["folder"]
    assert seen["found"]["probes"] == seen["found"]["baked"] > 64 and seen["found"]["stale"] is False


def test_what_cannot_measure_a_buried_volume_says_so_and_one_press_mends_it(seen):
    assert "lies inside geometry" in seen["nothing to plan"] and "fit it to the scene" in seen["nothing to plan"]
    assert seen["fitted"] == ["FINISHED"]


@pytest.mark.parametrize("job", ["bake", "chart", "find_leaks", "plan", "stability", "verify"])
def test_every_job_can_be_cancelled(seen, job):
    assert seen["jobs"][job] == {"began": ["RUNNING_MODAL"], "ran": True, "cancel": ["FINISHED"], "cancelled": True}


def test_the_shown_bake_is_exported_and_another_scenes_is_not(seen):
    assert seen["exported"] == ["RUNNING_MODAL"] and seen["files"] > 10
    assert (Path(seen["folder"]) / "game/model.glb").is_file()
    assert seen["another's may be exported"] is False


def test_nothing_was_thrown_while_drawing(seen):
    assert "Traceback" not in seen["stderr"] and "rna_uiItem" not in seen["stderr"]
