"""The preview in a real Blender with a window: see test_window.py for how to name one in RTGI_BLENDER."""

import json
import os
import shutil
from pathlib import Path

import numpy as np
import pytest

REPOSITORY = Path(__file__).resolve().parents[2]
ADDON = "bl_ext.user_default.rtgi_addon"
LEFT, MIDDLE, RIGHT = range(3)
RED, GREEN = 0, 1

pytestmark = [pytest.mark.slow, pytest.mark.skipif("RTGI_BLENDER" not in os.environ,
                                                   reason="RTGI_BLENDER names no Blender that can open a window")]


@pytest.fixture(scope="module")
def seen(blender, tmp_path_factory):
    """What tests/support/preview_window_script.py saw: colours of the left, the middle and the right of the view by moment."""
    report = tmp_path_factory.mktemp("preview") / "report.json"
    ran = blender("-p", 0, 0, 1440, 900, "--enable-event-simulate", "--python",
                  REPOSITORY / "tests/support/preview_window_script.py", "--", REPOSITORY / "sample_blends/cornell_box.blend",
                  report, f"{ADDON}.rtgi_addon")
    assert report.exists(), ran.stdout[-2000:] + ran.stderr[-2000:]
    keep = os.environ.get("RTGI_SCREENSHOTS")
    if keep:
        for picture in report.parent.glob("*.png"):
            shutil.copy(picture, Path(keep) / f"preview {picture.name}")
    found = json.loads(report.read_text())
    assert "error" not in found, found["error"]
    colours = {name: np.array(value) if isinstance(value, list) else value for name, value in found.items()}
    return {**colours, "stderr": ran.stderr}


def test_the_walls_have_their_colours(seen):
    colours = seen["baked"]
    assert colours[LEFT][RED] > 2 * colours[LEFT][GREEN] and colours[RIGHT][GREEN] > 1.2 * colours[RIGHT][RED]


def test_a_bake_from_the_panel_is_shown_at_once(seen):
    assert np.all(seen["baked"].sum(axis=1) > 1.1 * seen["without a bake"].sum(axis=1))
    assert seen["stale after the bake"] is False


def test_a_lamp_that_moves_is_followed_and_the_bake_said_to_be_out_of_date(seen):
    assert np.abs(seen["lamp moved"] - seen["baked"]).max() > 0.05
    assert seen["stale after the move"] is True


def test_indirect_light_alone_is_darker(seen):
    assert np.all(seen["indirect alone"].sum(axis=1) < seen["lamp moved"].sum(axis=1))


def test_reflective_shadow_maps_need_no_bake_and_follow_objects(seen):
    assert seen["maps without a bake"].min() > 0.01
    # Off the left wall, which reflects where the block stood in its light.
    assert np.abs(seen["block moved"] - seen["maps without a bake"]).max() > 0.02


def test_f12_renders_beside_the_window(seen):
    left, middle, right = seen["F12"]
    assert left[RED] > 1.5 * left[GREEN] and right[GREEN] > right[RED] and middle.min() > 0.1


@pytest.mark.parametrize("moment", ["after undo", "one window again", "back from another scene"])
def test_it_comes_back_to_the_same_picture(seen, moment):
    np.testing.assert_allclose(seen[moment], seen["lamp moved"], atol=0.01)


@pytest.mark.parametrize("moment", ["opened again", "enabled again"])
def test_an_opened_file_shows_the_bundle_on_disk(seen, moment):
    np.testing.assert_allclose(seen[moment], seen["baked"], atol=0.01)


def test_viewports_come_and_go_with_the_engine(seen):
    assert seen["viewports"] == 2
    assert seen["viewports while disabled"] == 0
    assert seen["viewports left"] == 0


def test_nothing_was_thrown(seen):
    assert "Traceback" not in seen["stderr"]
