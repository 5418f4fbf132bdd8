"""The panel in a real Blender with a window. RTGI_BLENDER holds the command that starts one, with a display, for example

    RTGI_BLENDER='python tools/debian_tree.py run TREE --bind /tmp -- xvfb-run -a -s "-screen 0 1440x900x24" blender \
        --gpu-backend vulkan'

(tools/debian_tree.py makes the tree). Screenshots are kept in RTGI_SCREENSHOTS, if that names a folder.
"""

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
    """What tests/support/window_script.py saw."""
    report = tmp_path_factory.mktemp("window") / "report.json"
    ran = blender("-p", 0, 0, 1440, 900, "--enable-event-simulate", "--python", REPOSITORY / "tests/support/window_script.py",
                  "--", REPOSITORY / "sample_blends/cornell_box.blend", report, f"{ADDON}.rtgi_addon")
    assert report.exists(), ran.stdout[-2000:] + ran.stderr[-2000:]
    keep = os.environ.get("RTGI_SCREENSHOTS")
    if keep:
        for picture in report.parent.glob("*.png"):
            shutil.copy(picture, keep)
    seen = json.loads(report.read_text())
    assert "error" not in seen, seen["error"]
    return {**seen, "stderr": ran.stderr}


def test_the_button_bakes_and_progress_moves(seen):
    assert seen["clicked"]
    fractions = seen["progress"]["fractions"]
    assert len(set(fractions)) >= 3 and fractions == sorted(fractions)
    assert all(0 <= fraction <= 1 for fraction in fractions)
    assert "%" in seen["progress"]["text"]


def test_the_window_stays_alive_during_a_bake(seen):
    assert seen["progress"]["rounds"] >= 3
    assert not seen["a second bake may start"]


def test_escape_and_the_button_cancel_and_leave_the_last_bake_whole(seen):
    assert seen["cancelled by Esc"] and seen["cancelled by the button"]
    assert seen["first"] and "bake.json" in seen["first"]
    assert seen["after Esc"] == seen["first"]


def test_a_bake_survives_undo(seen):
    assert seen["baking after undo"]
    assert seen["after undo"] != seen["first"]
    assert seen["folder after undo"].endswith("bake")


def test_a_preset_is_one_step_of_undo(seen):
    assert seen["preset"] == [0.01, 0.1, 0.01]


def test_opening_a_file_ends_the_bake_in_order(seen):
    assert seen["cancelled by opening a file"]
    assert seen["after opening a file"] == seen["after undo"]


def test_a_change_of_the_scene_is_noticed(seen):
    assert seen["stale after the bake"] is False
    assert seen["stale after a change"] is True


def test_a_scene_without_geometry_is_said_to_have_none(seen):
    assert "no geometry" in seen["nothing to bake"] or "no visible geometry" in seen["nothing to bake"]


def test_a_whole_bake_replaces_the_last(seen):
    assert seen["whole bake"].keys() == seen["first"].keys()
    assert seen["whole bake"] != seen["first"]
    assert seen["probes"] == 64


def test_nothing_was_thrown_while_drawing(seen):
    assert "Traceback" not in seen["stderr"]
    assert "rna_uiItem" not in seen["stderr"]


def test_scripts_can_be_reloaded(blender, tmp_path):
    """Blender's Reload Scripts takes the add-on out and in again, with fresh code below the root module."""
    script = tmp_path / "reload.py"
    script.write_text(f"""
import sys, addon_utils, bpy
addon_utils.enable("{ADDON}", default_set=True)
before = sys.modules["{ADDON}.rtgi_addon.blender.ui.bake_operators"]
bpy.utils.load_scripts(reload_scripts=True)  # what the operator does, which puts it off until the window comes round
after = sys.modules["{ADDON}.rtgi_addon.blender.ui.bake_operators"]
classes = [cls for cls in bpy.types.Operator.__subclasses__() if cls.__name__ == "RTGI_OT_bake" and cls.is_registered]
print("RELOADED", after is not before, len(classes), bpy.context.scene.rtgi.technique)
""")
    ran = blender("--background", "--python-exit-code", "9", "--python", script)
    assert ran.returncode == 0, ran.stderr
    assert "RELOADED True 1 probes" in ran.stdout


def test_blender_quits_in_the_middle_of_a_bake(blender, tmp_path):
    script = tmp_path / "quit.py"
    script.write_text(f"""
import bpy
def start():
    scene = bpy.context.scene
    scene.rtgi.output, scene.rtgi.mode, scene.rtgi.technique_probes.rays = {str(tmp_path / "bake")!r}, "RAYS", 1 << 20
    window = bpy.context.window_manager.windows[0]
    area = next(area for area in window.screen.areas if area.type == "VIEW_3D")
    with bpy.context.temp_override(window=window, area=area, region=area.regions[-1]):
        print("STARTED", bpy.ops.rtgi.bake("INVOKE_DEFAULT"))
    bpy.app.timers.register(bpy.ops.wm.quit_blender, first_interval=1.0)
bpy.app.timers.register(start, first_interval=1.0)
""")
    ran = blender("-p", 0, 0, 1440, 900, REPOSITORY / "sample_blends/cornell_box.blend", "--python", script)
    assert "STARTED {'RUNNING_MODAL'}" in ran.stdout
    assert ran.returncode == 0, ran.stderr
    assert not (tmp_path / "bake").exists()
