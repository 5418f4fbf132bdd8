"""Plans through Blender's doors: the command line as a process, the operator, its panel, and what moves in a scene."""

import json
import os
import re
import subprocess
import sys
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import pytest

bpy = pytest.importorskip("bpy", reason="needs Blender or its Python module")

from panel_layout import Layout  # noqa: E402

import rtgi_addon  # noqa: E402
from rtgi_addon.blender.motion import find_motion  # noqa: E402
from rtgi_addon.evaluate.plan.nesting import Box, nested_volume  # noqa: E402
from rtgi_addon.scene import NearSurfaces  # noqa: E402

ROOT = Path(__file__).resolve().parents[3]
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
    from rtgi_addon.blender.ui.plan import plans
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


def test_volumes_in_volumes_and_left_out_probes_are_applied_once_and_are_what_a_bake_reads(lit_room):
    from rtgi_addon.blender.extract import extract_scene
    from rtgi_addon.blender.ui.plan import plans
    probe = next(obj for obj in lit_room.objects if obj.type == "LIGHT_PROBE")
    probe.location, probe.rotation_euler = (0.1, 0.0, 0.05), (0.0, 0.0, 0.2)
    assert bpy.ops.rtgi.plan(error=0.3, others=False) == {"FINISHED"}
    plan = plans.plans[lit_room.name]
    base = replace(plan.volumes[0], resolution=(4, 4, 4), near=NearSurfaces(0.25, 0.5, False))
    fine = nested_volume(base, Box((0, 1, 2), (2, 3, 4), 0.5), "Volume fine 1")
    plans.plans[lit_room.name] = planned = replace(plan, volumes=(base, fine))
    for _ in range(2):
        assert bpy.ops.rtgi.apply_plan() == {"FINISHED"}
        read = extract_scene().volumes
        assert len(read) == 2
        for found, wanted in zip(read, planned.volumes, strict=True):
            assert (found.name, found.resolution, found.planned) == (wanted.name, wanted.resolution, wanted.planned)
            assert found.world_from_local == pytest.approx(wanted.world_from_local, abs=1e-5)
            assert (found.near.clearance, found.near.outside, found.near.outermost) == pytest.approx((0.25, 0.5, False))
    # They move with the volume that they lie in, and the next plan places its own.
    probe.location.x += 1.0
    bpy.context.view_layer.update()
    assert extract_scene().volumes[1].world_from_local[0, 3] == pytest.approx(fine.world_from_local[0, 3] + 1.0, abs=1e-5)
    probe.location.x -= 1.0
    assert bpy.ops.rtgi.plan(error=0.3, others=False) == {"FINISHED"}
    again = plans.plans[lit_room.name]
    assert [volume.name for volume in again.volumes if not volume.planned] == ["Volume"]
    applied = again.applied(extract_scene())
    assert [volume.name for volume in applied.volumes] == [volume.name for volume in again.volumes]
    assert bpy.ops.rtgi.apply_plan() == {"FINISHED"}
    assert [volume.name for volume in extract_scene().volumes] == [volume.name for volume in again.volumes]


def test_a_plan_is_undone_as_one_step(lit_room):
    from rtgi_addon.blender.ui.plan import plans
    assert bpy.ops.rtgi.plan(error=0.3, others=False) == {"FINISHED"}
    plan = plans.plans[lit_room.name]
    base = replace(plan.volumes[0], resolution=(5, 4, 3), near=NearSurfaces(0.25, 0.5, False))
    plans.plans["Scene"] = replace(plan, volumes=(base, nested_volume(base, Box((0, 1, 1), (2, 3, 2), 0.5), "Volume fine 1")))
    bpy.ops.ed.undo_push(message="before")
    bpy.ops.rtgi.apply_plan()
    bpy.ops.ed.undo_push(message="applied")
    assert "Volume fine 1" in bpy.data.objects
    bpy.ops.ed.undo()
    data, = (obj.data for obj in bpy.context.scene.objects if obj.type == "LIGHT_PROBE")
    assert data.resolution_x == 4 and not data.rtgi.near_surfaces
    bpy.ops.ed.redo()
    assert bpy.data.objects["Volume"].data.rtgi.near_surfaces and "Volume fine 1" in bpy.data.objects


def test_the_command_line_saves_a_copy_with_the_plan_in_it(tmp_path):
    out = tmp_path / "planned.blend"
    code, text, err = run(CORNELL, "plan", "--error", "0.2", "--probes-only", "--fit", "--apply", out)
    assert code == 0, err
    said = " ".join(text.split())
    assert f"The plan is written into {out}" in said and "Fitted to surfaces" in said and " for the fit, " in said
    options = re.search(r"does bake with (--technique probes (.*) --fit)\.", said).group(1).split()
    code, text, err = run(out, "bake", "--out", tmp_path / "bake", "--json", *options)
    assert code == 0, err
    baked = json.loads(text)
    planned = " x ".join(map(str, baked["volumes"][0]["resolution"]))
    assert re.search(rf"Planned: probes with order {baked['settings']['order']}, error [0-9.]+, fit on [^:]* {planned}: ", said)
    assert baked["settings"]["fit"]
    code, _, err = run(CORNELL, "plan", "--error", "0.2", "--apply", CORNELL)
    assert code != 0 and "--apply" in err, err


def test_the_panel_shows_the_reasons_and_what_else_there_is(lit_room):
    from rtgi_addon.blender.ui.plan import plans, rows
    assert bpy.ops.rtgi.plan(error=0.3, others=False) == {"FINISHED"}
    plan = plans.plans[lit_room.name]
    context = SimpleNamespace(scene=lit_room, region=SimpleNamespace(width=20000))

    def drawn(name):
        layout = Layout()
        panel = getattr(bpy.types, name)
        assert not hasattr(panel, "poll") or panel.poll(context)
        panel.draw(SimpleNamespace(layout=layout), context)
        return layout.texts, layout.shown

    said, shown = drawn("RTGI_PT_plan")
    assert shown == ["error", "memory", "keep_air", "nested", "fit", "others", "rtgi.plan", "rtgi.apply_plan"]
    assert len(said) == 3 and "light on surfaces off by" in said[1] and "MiB of memory" in said[2]
    assert "The scene is enclosed" in " ".join(drawn("RTGI_PT_plan_reasons")[0])
    assert rows(plan)[0][1] in drawn("RTGI_PT_plan_options")[0]
    assert rows(plan)[0][0] and len(rows(plan)) >= 2


def test_a_fitted_volume_is_added_when_its_plan_is_applied(lit_room):
    bpy.data.objects.remove(next(obj for obj in lit_room.objects if obj.type == "LIGHT_PROBE"))
    assert bpy.ops.rtgi.plan(error=0.3, others=False) == {"FINISHED"}
    assert bpy.ops.rtgi.apply_plan() == {"FINISHED"}
    from rtgi_addon.blender.ui.plan import plans
    data, = (obj.data for obj in lit_room.objects if obj.type == "LIGHT_PROBE")
    assert (data.resolution_x, data.resolution_y, data.resolution_z) == plans.plans[lit_room.name].volumes[0].resolution


def test_what_cannot_be_planned_is_an_error_and_another_file_forgets(lit_room):
    from rtgi_addon.blender.ui.plan import plans
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
