"""Plans through Blender's doors: the command line as a process, the operator, its panel, and what moves in a scene."""

import json
import os
import subprocess
import sys
from pathlib import Path
from types import SimpleNamespace

import pytest

bpy = pytest.importorskip("bpy", reason="needs Blender or its Python module")

from panel_layout import Layout  # noqa: E402

import rtgi_addon  # noqa: E402
from rtgi_addon.blender.motion import find_motion  # noqa: E402

ROOT = Path(__file__).resolve().parents[2]
CORNELL = ROOT / "sample_blends/cornell_box.blend"


def run(*words):
    """Exit code, stdout and stderr of the module's door."""
    done = subprocess.run([sys.executable, "-m", "rtgi_addon", *map(str, words)], capture_output=True, text=True, encoding="utf-8",
                          cwd=ROOT, timeout=300, env={**os.environ, "PYTHONPATH": str(ROOT)})
    return done.returncode, done.stdout, done.stderr


def test_the_command_line_plans_and_bakes_what_it_plans(tmp_path):
    code, text, err = run(CORNELL, "plan", "--error", "0.2", "--probes-only", "--json")
    assert code == 0, err
    plan = json.loads(text)
    assert plan["met"] and plan["technique"] == "probes" and plan["reasons"]
    code, text, err = run(CORNELL, "bake", "--technique", "auto", "--error", "0.2", "--out", tmp_path / "bake", "--json")
    assert code == 0, err
    baked = json.loads(text)
    assert [volume["resolution"] for volume in baked["volumes"]] == [volume["resolution"] for volume in plan["volumes"]]
    assert baked["settings"]["error"] == plan["settings"]["error"] and baked["plan"]["reasons"] == plan["reasons"]
    assert baked["check"]["within"] and baked["check"]["error"]["value"] < 0.25


def test_wrong_options_are_told_before_the_file_is_opened(tmp_path):
    out = "--out", tmp_path / "bake"
    for words, said in ((("bake", *out, "--technique", "auto", "--rays", "64"), "chooses rays itself"),
                        (("bake", *out, "--technique", "auto", "--set", "max_rays=512"), "chooses max_rays itself"),
                        (("bake", *out, "--technique", "auto", "--preset", "draft"), "preset"),
                        (("bake", *out, "--technique", "auto", "--device", "gpu"), "runs on the CPU"),
                        (("bake", *out, "--keep-air"), "are for a plan"),
                        (("bake", *out, "--technique", "auto", "--error", "7"), "error is 7"),
                        (("plan", "--memory", "none"), "memory"), (("plan", "--error", "0"), "error is 0")):
        code, _, err = run(tmp_path / "no.blend", *words)
        assert code == 2 and said in err, err


def test_memory_is_read_in_units():
    from rtgi_addon.blender.cli.plan import memory
    assert memory("512M") == memory("512") == 512 * 2**20 and memory("2g") == 2 * 2**30 and memory("64K") == 65536


@pytest.fixture
def lit_room(empty_blend, tmp_path):
    """The add-on in a file with a lit room seen from inside and a volume in it."""
    rtgi_addon.register()
    bpy.ops.mesh.primitive_cube_add(size=4)
    bpy.ops.object.light_add(type="POINT")
    bpy.context.object.name = "Bulb"
    bpy.ops.object.lightprobe_add(type="VOLUME")
    bpy.context.object.scale = (1.9, 1.9, 1.9)
    bpy.context.scene.rtgi.output = str(tmp_path / "bake")
    yield bpy.context.scene
    rtgi_addon.unregister()


def test_the_operator_plans_and_apply_writes_what_was_planned(lit_room):
    from rtgi_addon.blender.plan_ui import plans
    probe = next(obj for obj in lit_room.objects if obj.type == "LIGHT_PROBE")
    probe.data.rtgi.technique_probes.override_order = True
    lit_room.rtgi.technique = "vpl"
    assert bpy.ops.rtgi.plan(error=0.15, others=False) == {"FINISHED"}
    plan = plans.plans[lit_room.name]
    assert plan.met and plan.target.error == pytest.approx(0.15)
    assert bpy.ops.rtgi.apply_plan() == {"FINISHED"}
    data = probe.data
    assert (data.resolution_x, data.resolution_y, data.resolution_z) == plan.volumes[0].resolution
    assert lit_room.rtgi.technique == "probes" and lit_room.rtgi.mode == "ERROR"
    assert lit_room.rtgi.technique_probes.order == plan.settings["order"] and not data.rtgi.technique_probes.override_order
    assert lit_room.rtgi.technique_probes.error == pytest.approx(plan.settings["error"])


def test_the_panel_shows_the_reasons_and_what_else_there_is(lit_room):
    from rtgi_addon.blender.plan_ui import plans, rows
    assert bpy.ops.rtgi.plan(error=0.3, others=False) == {"FINISHED"}
    plan = plans.plans[lit_room.name]
    layout = Layout()
    bpy.types.RTGI_PT_plan.draw(SimpleNamespace(layout=layout), SimpleNamespace(
        scene=lit_room, region=SimpleNamespace(width=20000)))
    said = " ".join(layout.texts)
    assert "rtgi.apply_plan" in layout.shown and "The scene is enclosed" in said and rows(plan)[0][1] in said
    assert rows(plan)[0][0] and len(rows(plan)) >= 2


def test_a_fitted_volume_is_added_when_its_plan_is_applied(lit_room):
    bpy.data.objects.remove(next(obj for obj in lit_room.objects if obj.type == "LIGHT_PROBE"))
    assert bpy.ops.rtgi.plan(error=0.3, others=False) == {"FINISHED"}
    assert bpy.ops.rtgi.apply_plan() == {"FINISHED"}
    from rtgi_addon.blender.plan_ui import plans
    data, = (obj.data for obj in lit_room.objects if obj.type == "LIGHT_PROBE")
    assert (data.resolution_x, data.resolution_y, data.resolution_z) == plans.plans[lit_room.name].volumes[0].resolution


def test_what_cannot_be_planned_is_an_error_and_another_file_forgets(lit_room):
    from rtgi_addon.blender.plan_ui import plans
    plans.plans["Scene"] = "a plan"
    bpy.data.objects.remove(bpy.data.objects["Bulb"])
    with pytest.raises(RuntimeError, match="no light"):
        bpy.ops.rtgi.plan()
    bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
    assert plans.plans == {}


def test_what_moves_is_found(lit_room):
    assert find_motion() == find_motion().__class__()
    bulb, cube = bpy.data.objects["Bulb"], next(obj for obj in lit_room.objects if obj.type == "MESH")
    bulb.keyframe_insert("location", frame=1)
    bpy.ops.object.empty_add()
    empty = bpy.context.object
    cube.parent = empty
    empty.driver_add("location", 0)
    motion = find_motion()
    assert motion.lamps == ("Bulb",) and motion.objects == (cube.name,)
    bulb.animation_data_clear()
    cube.parent = None
    bulb.constraints.new("TRACK_TO").target = empty
    # A circle of constraints ends.
    empty.constraints.new("COPY_LOCATION").target = bulb
    assert find_motion().lamps == ("Bulb",) and find_motion().objects == ()
