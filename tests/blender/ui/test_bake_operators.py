"""What the panel holds and does, in a Blender without a window: generated settings, the bake operator, drawing."""

import json
import threading
from dataclasses import fields
from pathlib import Path

import pytest

bpy = pytest.importorskip("bpy", reason="needs Blender or its Python module")

from fake_technique import FakeTechnique  # noqa: E402

import rtgi_addon  # noqa: E402
from rtgi_addon.errors import BakeError  # noqa: E402
from rtgi_addon.techniques import registry  # noqa: E402


@pytest.fixture
def fake(monkeypatch, empty_blend):
    """The add-on registered with a technique of our own in a lit room of one volume, chosen for the scene."""
    technique = FakeTechnique()
    monkeypatch.setitem(registry(), "fake", technique)
    rtgi_addon.register()
    bpy.ops.mesh.primitive_cube_add(size=4)
    bpy.context.object.name = "Room"
    bpy.ops.object.light_add(type="POINT")
    bpy.ops.object.lightprobe_add(type="VOLUME")
    bpy.context.object.name = "Probes"
    probe = bpy.context.object.data
    probe.resolution_x, probe.resolution_y, probe.resolution_z = 4, 3, 2
    bpy.context.scene.rtgi.technique = "fake"
    yield technique
    rtgi_addon.unregister()


@pytest.fixture
def out(tmp_path):
    """An absolute output folder, set on the scene."""
    bpy.context.scene.rtgi.output = str(tmp_path / "bake")
    return tmp_path / "bake"


def session():
    from rtgi_addon.blender.session import session
    return session


def test_every_setting_of_every_technique_is_in_the_panel_with_range_and_tooltip(fake):
    from rtgi_addon.blender.ui.properties import attribute
    for technique in registry().values():
        group = getattr(bpy.context.scene.rtgi, attribute(technique.name))
        for item in fields(technique.Settings):
            declared, meta = group.bl_rna.properties[item.name], item.metadata
            assert declared.name == meta["label"]
            assert declared.description.startswith(meta["description"].rstrip("."))
            assert not declared.description.endswith(".")
            if declared.type in {"INT", "FLOAT"}:
                for limit, key in ((declared.hard_min, "minimum"), (declared.hard_max, "maximum")):
                    assert meta[key] is None or limit == pytest.approx(meta[key])
            if meta["choices"]:
                assert [choice.identifier for choice in declared.enum_items] == [str(choice) for choice in meta["choices"]]


def test_every_property_has_a_tooltip(fake):
    def bare(group):
        for declared in group.bl_rna.properties:
            if declared.identifier in {"rna_type", "name"}:
                continue
            if declared.type == "POINTER":
                yield from bare(getattr(group, declared.identifier))
            elif not declared.description:
                yield f"{type(group).__name__}.{declared.identifier}"

    probe = bpy.data.objects["Probes"].data
    assert not [*bare(bpy.context.scene.rtgi), *bare(probe.rtgi)]


def test_defaults_in_the_panel_are_the_techniques_own(fake):
    from rtgi_addon.blender.ui.properties import scene_settings
    for name, technique in registry().items():
        bpy.context.scene.rtgi.technique = name
        assert scene_settings(bpy.context.scene) == (technique, technique.Settings())


def test_what_is_set_reaches_the_settings(fake):
    from rtgi_addon.blender.ui.properties import scene_settings
    group = bpy.context.scene.rtgi.technique_fake
    group.order, group.reach, group.direct, group.filtering, group.tile = 4, 2.5, True, "LANCZOS", "16"
    group.error = 0.003
    settings = scene_settings(bpy.context.scene)[1]
    assert (settings.order, settings.reach, settings.direct, settings.filtering, settings.tile) == (4, 2.5, True, "LANCZOS", 16)
    assert (settings.error, settings.rays, settings.bounces) == (0.003, None, None)
    bpy.context.scene.rtgi.mode = "RAYS"
    group.rays, group.use_bounces, group.bounces = 300, True, 5
    settings = scene_settings(bpy.context.scene)[1]
    assert (settings.rays, settings.bounces) == (300, 5)


def test_a_volumes_overrides_win_over_the_scene(fake, out):
    bpy.context.scene.rtgi.technique_fake.order = 4
    override = bpy.data.objects["Probes"].data.rtgi.technique_fake
    override.order, override.override_order, override.direct = 1, True, True
    bpy.ops.rtgi.bake()
    scene, settings = fake.bakes[-1]
    assert settings.order == 4
    assert scene.volumes[0].settings == {"order": 1}


def test_the_operator_bakes_in_background_and_remembers_what(fake, out):
    assert bpy.ops.rtgi.bake() == {"FINISHED"}
    manifest = json.loads((out / "bake.json").read_text())
    assert manifest["technique"] == "fake"
    assert [volume["resolution"] for volume in manifest["volumes"]] == [[4, 3, 2]]
    assert manifest["settings"]["error"] == 0.01
    last = bpy.context.scene.rtgi.last_bake
    assert (last.folder, last.technique, last.probes, last.usable) == (str(out), "fake", 24, 1.0)
    assert last.error == pytest.approx(0.005) and last.seconds > 0


def test_it_bakes_what_is_under_edit_and_leaving_edit_mode_changes_nothing(fake, out):
    room = bpy.data.objects["Room"]
    bpy.context.view_layer.objects.active = room
    bpy.ops.object.mode_set(mode="EDIT")
    assert bpy.ops.rtgi.bake() == {"FINISHED"}
    scene, _settings = fake.bakes[-1]
    assert [len(scene.meshes[instance.mesh].triangles) for instance in scene.instances if instance.name == "Room"] == [12]
    bpy.ops.object.mode_set(mode="OBJECT")
    from rtgi_addon.blender.fingerprint import fingerprint
    now = fingerprint(bpy.context.scene, bpy.context.evaluated_depsgraph_get())
    assert now == bpy.context.scene.rtgi.last_bake.fingerprint


def test_the_seed_reaches_the_bundle(fake, out):
    bpy.context.scene.rtgi.seed = 11
    bpy.ops.rtgi.bake()
    assert json.loads((out / "bake.json").read_text())["seed"] == 11


@pytest.mark.parametrize(("failure", "message"), [
    (BakeError("Ceiling is too low", "raise it"), "Ceiling is too low: raise it"),
    (ZeroDivisionError("division by zero\nand more"), "the bake failed with ZeroDivisionError: division by zero"),
    (MemoryError(), "there is not enough memory"),
    (RuntimeError("can't start new thread"), "there is not enough memory"),
])
def test_a_failure_is_reported_as_one_line_and_leaves_the_last_bake(fake, out, failure, message, capsys):
    bpy.ops.rtgi.bake()
    before = {path: path.read_bytes() for path in out.rglob("*") if path.is_file()}
    fake.failure = failure
    with pytest.raises(RuntimeError) as raised:
        bpy.ops.rtgi.bake()
    assert str(raised.value).strip().startswith(f"Error: {message}")
    assert "and more" not in str(raised.value)
    assert {path: path.read_bytes() for path in out.rglob("*") if path.is_file()} == before
    assert session().errors[bpy.context.scene.name].startswith(message)
    fake.failure = None
    bpy.ops.rtgi.bake()
    assert bpy.context.scene.name not in session().errors


def test_a_scene_without_geometry_is_refused_by_name(fake, out):
    bpy.data.objects.remove(bpy.data.objects["Room"])
    bpy.context.scene.name = "Empty Stage"
    with pytest.raises(RuntimeError, match=r"Error: .*Empty Stage.*geometry"):
        bpy.ops.rtgi.bake()
    assert not out.exists()


def test_a_file_that_was_never_saved_is_baked_and_the_bake_moves_beside_it_once_it_is(fake, tmp_path):
    last = bpy.context.scene.rtgi.last_bake
    assert bpy.ops.rtgi.bake() == {"FINISHED"}
    before = Path(last.folder)
    assert (before / "bake.json").is_file() and Path(bpy.app.tempdir).resolve() in before.parents
    assert "never saved" in session().findings[bpy.context.scene.name][0].text
    (tmp_path / "game").mkdir()
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "game/level.blend"))
    assert Path(last.folder) == tmp_path / "game/rtgi_bake" and not before.exists()
    assert (tmp_path / "game/rtgi_bake/bake.json").is_file()
    bpy.ops.wm.open_mainfile(filepath=str(tmp_path / "game/level.blend"))
    assert Path(bpy.context.scene.rtgi.last_bake.folder) == tmp_path / "game/rtgi_bake"
    bpy.ops.rtgi.bake()
    assert not any("never saved" in found.text for found in session().findings[bpy.context.scene.name])


def test_what_lies_beside_a_file_is_not_replaced_by_saving_it(fake, tmp_path):
    bpy.ops.rtgi.bake()
    folder = bpy.context.scene.rtgi.last_bake.folder
    (tmp_path / "rtgi_bake").mkdir()
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "level.blend"))
    assert bpy.context.scene.rtgi.last_bake.folder == folder and not list((tmp_path / "rtgi_bake").iterdir())
    bpy.context.scene.rtgi.output = " "
    with pytest.raises(RuntimeError, match="no output folder is set"):
        bpy.ops.rtgi.bake()


def test_a_second_bake_waits_for_its_turn(fake, out):
    from rtgi_addon.blender.worker import BakeWorker
    go = threading.Event()
    session().worker = BakeWorker(lambda progress: go.wait(10))
    session().worker.start()
    try:
        assert not bpy.ops.rtgi.bake.poll()
        assert bpy.ops.rtgi.cancel.poll()
        bpy.ops.rtgi.cancel()
        assert session().worker.progress.cancelled
    finally:
        go.set()
    session().worker.join(10)
    assert not bpy.ops.rtgi.cancel.poll()
    assert bpy.ops.rtgi.bake() == {"FINISHED"}


def test_opening_a_file_cancels_the_bake_of_the_old_one(fake, out):
    from rtgi_addon.blender.worker import BakeWorker

    def bake(progress):
        while True:
            progress.step(0.5, "Tracing")

    session().worker, session().scene = BakeWorker(bake), "Scene"
    session().worker.start()
    bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=True)
    assert session().worker.join(10)
    assert session().worker.outcome.cancelled
    assert not session().findings and not session().scene


def test_checking_lists_findings_without_baking(fake, out):
    for light in [obj for obj in bpy.data.objects if obj.type == "LIGHT"]:
        bpy.data.objects.remove(light)
    bpy.ops.rtgi.check()
    found = session().findings[bpy.context.scene.name]
    assert any(finding.severity == "error" and "light" in finding.text for finding in found)
    assert not fake.bakes and not out.exists()


def test_a_fitted_volume_holds_the_scene(fake):
    bpy.data.objects.remove(bpy.data.objects["Probes"])
    bpy.data.objects["Room"].location = (0.3, 0.4, 0.5)
    assert bpy.ops.rtgi.fit_volume() == {"FINISHED"}
    volume = bpy.context.object
    assert tuple(volume.location) == pytest.approx((0.3, 0.4, 0.5))
    assert volume.type == "LIGHT_PROBE" and volume.data.type == "VOLUME" and volume.select_get()
    assert [round(abs(size), 3) for size in volume.matrix_world.to_scale()] == [2.0, 2.0, 2.0]
    assert volume.data.resolution_x * volume.data.resolution_y * volume.data.resolution_z >= 64


@pytest.mark.parametrize(("edit", "stale"), [
    (lambda: None, False),
    (lambda: bpy.data.objects["Room"].select_set(True), False),
    (lambda: setattr(bpy.data.objects["Room"], "location", (0, 0, 1)), True),
    (lambda: setattr(bpy.data.objects["Point"].data, "energy", 5), True),
    (lambda: setattr(bpy.data.objects["Probes"].data, "resolution_x", 9), True),
    (lambda: setattr(bpy.data.objects["Probes"].data.rtgi.technique_fake, "override_order", True), True),
    (lambda: setattr(bpy.data.objects["Probes"].data.rtgi, "near_surfaces", True), True),
    (lambda: setattr(bpy.data.objects["Probes"].data.rtgi, "clearance", 1.0), False),
    (lambda: setattr(bpy.context.scene.rtgi.technique_fake, "order", 3), True),
    (lambda: setattr(bpy.data.meshes[0].vertices[0], "co", (9, 9, 9)), True),
    (lambda: bpy.data.objects["Room"].modifiers.new("Subdivision", "SUBSURF"), True),
])
def test_the_fingerprint_tells_a_changed_scene(fake, edit, stale):
    from rtgi_addon.blender.fingerprint import fingerprint
    before = fingerprint(bpy.context.scene, bpy.context.evaluated_depsgraph_get())
    edit()
    bpy.data.meshes[0].update()
    after = fingerprint(bpy.context.scene, bpy.context.evaluated_depsgraph_get())
    assert (before != after) == stale


def test_the_fingerprint_tells_a_changed_material(fake):
    from rtgi_addon.blender.fingerprint import fingerprint
    material = bpy.data.materials.new("Paint")
    if material.node_tree is None:  # Blender 4.5
        material.use_nodes = True
    bpy.data.objects["Room"].data.materials.append(material)
    before = fingerprint(bpy.context.scene, bpy.context.evaluated_depsgraph_get())
    material.node_tree.nodes["Principled BSDF"].location = (500, 0)
    assert fingerprint(bpy.context.scene, bpy.context.evaluated_depsgraph_get()) == before
    material.node_tree.nodes["Principled BSDF"].inputs["Base Color"].default_value = (1, 0, 0, 1)
    assert fingerprint(bpy.context.scene, bpy.context.evaluated_depsgraph_get()) != before


def test_undo_does_not_forget_the_bake(fake, out):
    from rtgi_addon.blender.handlers import keep_record_through_undo
    bpy.ops.rtgi.bake()
    bpy.context.scene.rtgi.last_bake.folder = ""  # what undo restores
    keep_record_through_undo(bpy.context.scene)
    assert bpy.context.scene.rtgi.last_bake.folder == str(out)


def test_blenders_startup_scene_bakes_unsaved_with_and_without_a_volume_at_the_origin(tmp_path):
    """The first click of somebody new: nothing saved, nothing set."""
    bpy.ops.wm.read_homefile(use_factory_startup=True)
    rtgi_addon.register()
    try:
        scene = bpy.context.scene
        scene.rtgi.mode, scene.rtgi.technique_probes.rays = "RAYS", 32
        assert bpy.ops.rtgi.bake() == {"FINISHED"}
        folder = Path(scene.rtgi.last_bake.folder)
        assert (folder / "bake.json").is_file() and "never saved" in session().findings[scene.name][0].text
        bpy.ops.object.lightprobe_add(type="VOLUME", location=(0, 0, 0))
        assert bpy.ops.rtgi.check() == {"FINISHED"}
        told = [found for found in session().findings[scene.name] if "lies inside geometry" in found.text]
        assert told[0].severity == "warning" and "Volume" in told[0].objects
        assert bpy.ops.rtgi.bake() == {"FINISHED"}
        found, = [found for found in session().findings[scene.name] if "was baked in its place" in found.text]
        bpy.context.object.select_set(False)
        assert bpy.ops.rtgi.select_named(objects="\n".join(found.objects)) == {"FINISHED"} and bpy.context.object.name == "Volume"
        assert bpy.ops.rtgi.refit_volume() == {"FINISHED"}
        assert bpy.context.object.data.resolution_x > 4 and bpy.context.object.matrix_world[0][0] > 1.5
        assert bpy.ops.rtgi.bake() == {"FINISHED"}
        assert not any("geometry" in found.text for found in session().findings[scene.name])
        bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "mine.blend"))
        assert Path(scene.rtgi.last_bake.folder) == tmp_path / "rtgi_bake" and (tmp_path / "rtgi_bake/bake.json").is_file()
    finally:
        rtgi_addon.unregister()


def test_a_scene_without_a_volume_is_planned_unless_the_panel_says_how_to_bake(monkeypatch):
    from rtgi_addon.blender import bake_job
    bpy.ops.wm.read_homefile(use_factory_startup=True)
    rtgi_addon.register()
    ways = []
    for way in ("bake_fitted", "bake_scene"):
        def taken(scene, *_, way=way, **options):
            ways.append((way, scene.volumes[0].fitted, "motion" in options))
            raise BakeError("enough", "stop here")

        monkeypatch.setattr(bake_job, way, taken)
    try:
        for choose in (lambda: None, lambda: setattr(bpy.context.scene.rtgi.technique_probes, "order", 1)):
            choose()
            with pytest.raises(RuntimeError, match="enough"):
                bpy.ops.rtgi.bake()
    finally:
        rtgi_addon.unregister()
    assert ways == [("bake_fitted", True, True), ("bake_scene", True, False)]


def test_the_last_bake_is_found_again_though_the_file_was_not_saved_after_it(fake, tmp_path):
    scene = bpy.context.scene
    scene.rtgi.output = "//bake"
    path = tmp_path / "hall.blend"
    bpy.ops.wm.save_as_mainfile(filepath=str(path))
    assert bpy.ops.rtgi.bake() == {"FINISHED"}
    before = {name: getattr(scene.rtgi.last_bake, name) for name in ("folder", "technique", "probes", "seconds", "fingerprint")}
    bpy.ops.wm.open_mainfile(filepath=str(path))  # without the record: it was not saved
    last = bpy.context.scene.rtgi.last_bake
    found = {name: getattr(last, name) for name in before}
    assert found.pop("seconds") == pytest.approx(before.pop("seconds"), abs=0.5)
    assert found == before and Path(last.folder) == tmp_path / "bake" and last.probes == 24 and last.fingerprint

    bpy.ops.wm.read_homefile(use_factory_startup=True)
    bpy.context.scene.name = "Other"
    bpy.context.scene.rtgi.output = str(tmp_path / "bake")
    from rtgi_addon.blender.bundles import find_last_bake
    assert not find_last_bake(bpy.context.scene) and not bpy.context.scene.rtgi.last_bake.folder
