"""Every panel drawn in every state, on a layout that holds each call against what Blender has registered."""

from importlib import import_module
from types import SimpleNamespace

import pytest

bpy = pytest.importorskip("bpy", reason="needs Blender or its Python module")

from fake_technique import FakeTechnique  # noqa: E402
from panel_layout import Layout  # noqa: E402

import rtgi_addon  # noqa: E402
from rtgi_addon.techniques import registry  # noqa: E402


@pytest.fixture
def scene(monkeypatch, empty_blend, tmp_path):
    """The add-on registered, with the fake technique chosen, and a scene that has one volume."""
    monkeypatch.setitem(registry(), "fake", FakeTechnique())
    rtgi_addon.register()
    bpy.ops.mesh.primitive_cube_add(size=4)
    bpy.ops.object.light_add(type="POINT")
    bpy.ops.object.lightprobe_add(type="VOLUME")
    bpy.context.object.scale = 1.9, 1.9, 1.9
    scene = bpy.context.scene
    scene.rtgi.technique, scene.rtgi.output = "fake", str(tmp_path / "bake")
    yield scene
    rtgi_addon.unregister()


def draw(name, width=300):
    """What the panel called ``name`` shows: its texts as one string, and the properties and operators in it."""
    from rtgi_addon.blender.ui import panels
    layout, scene = Layout(), bpy.context.scene
    probe = next((obj.data for obj in scene.objects if obj.type == "LIGHT_PROBE"), None)
    context = SimpleNamespace(scene=scene, region=SimpleNamespace(width=width), lightprobe=probe)
    getattr(panels, name).draw(SimpleNamespace(layout=layout), context)
    return " ".join(layout.texts), layout.shown


def test_settings_are_in_the_render_properties(scene):
    _, shown = draw("RTGI_PT_render")
    assert {"technique", "mode", "error", "order", "use_bounces", "bounces"} <= set(shown)
    assert "rays" not in shown
    scene.rtgi.mode = "RAYS"
    shown = draw("RTGI_PT_render")[1]
    assert "rays" in shown and "error" not in shown
    assert {"output", "rtgi.bake"} <= set(draw("RTGI_PT_render_output")[1])
    assert "seed" in draw("RTGI_PT_render_advanced")[1]


@pytest.mark.parametrize("technique", [*registry()])
def test_the_settings_of_every_technique_can_be_drawn(scene, technique):
    from dataclasses import fields
    scene.rtgi.technique = technique
    names = {item.name for item in fields(registry()[technique].Settings)} - {"rays"}
    basic, advanced = (set(draw(f"RTGI_PT_render{part}")[1]) for part in ("", "_advanced"))
    if technique == "lpv":
        names = names - {"center"} | {"center_is"}
    assert names <= basic | advanced and not names & basic & advanced


def test_overrides_are_on_the_volume_only(scene):
    from rtgi_addon.blender.ui.panels import RTGI_PT_volume
    shown = draw("RTGI_PT_volume")[1]
    assert {"override_order", "order", "override_rays", "rays"} <= set(shown)
    plane = bpy.data.lightprobes.new("Mirror", "PLANE")
    assert not RTGI_PT_volume.poll(SimpleNamespace(lightprobe=plane))
    assert not RTGI_PT_volume.poll(SimpleNamespace())
    assert RTGI_PT_volume.poll(SimpleNamespace(lightprobe=bpy.data.lightprobes.new("Box", "VOLUME")))


def test_the_sidebar_before_and_after_a_bake(scene):
    assert "64 probes in 1 volume" in draw("RTGI_PT_bake")[0]
    assert "Nothing baked yet" in draw("RTGI_PT_last_bake")[0]
    assert draw("RTGI_PT_checks") == ("", ["rtgi.check"])
    bpy.ops.rtgi.bake()
    texts, shown = draw("RTGI_PT_last_bake")
    assert "64" in texts and "100.0%" in texts and "0.5%" in texts and "rtgi.open_folder" in shown
    assert "Nothing to report" in draw("RTGI_PT_checks")[0]


def test_the_sidebar_while_baking(scene):
    from rtgi_addon.blender.session import session
    from rtgi_addon.blender.worker import BakeWorker, Report

    def bake(progress):
        while True:
            progress.step(0.5, "tracing")

    session.worker, session.scene = BakeWorker(bake), scene.name
    session.worker.start()
    session.worker.report = Report(0.25, "tracing probes", 75)
    texts, shown = draw("RTGI_PT_bake")
    assert "25%  ·  1 min 15 s left" in texts and "Tracing probes" in texts
    assert shown == ["rtgi.cancel"]
    session.worker.cancel()
    assert "Cancelling…" in draw("RTGI_PT_bake")[0]
    assert session.worker.join(10)


def test_the_sidebar_says_why_a_bake_failed_and_what_was_found(scene):
    from rtgi_addon.blender.session import Finding, session
    session.errors[scene.name] = "Ceiling is too low: raise it"
    session.findings[scene.name] = [Finding("warning", "Lamp: is black"), Finding("note", "one material baked")]
    assert "Ceiling is too low: raise it" in draw("RTGI_PT_bake")[0]
    texts, _ = draw("RTGI_PT_checks")
    assert "Lamp: is black" in texts and "One material baked" in texts


@pytest.mark.parametrize(("panel", "job", "starts", "cancels"), [
    ("chart", "charts", "rtgi.chart", "rtgi.cancel_chart"), ("plan", "plans", "rtgi.plan", "rtgi.cancel_plan"),
    ("leaks", "leaks", "rtgi.find_leaks", "rtgi.cancel_find_leaks"), ("export", "exports", "rtgi.export", "rtgi.cancel_export"),
    ("stability", "suite", "rtgi.stability", "rtgi.cancel_stability")])
def test_every_tool_shows_its_run_and_why_it_failed_as_the_bake_does(scene, panel, job, starts, cancels):
    from rtgi_addon.blender.worker import BakeWorker, Report
    module = import_module(f"rtgi_addon.blender.ui.{panel}")
    job = getattr(module, job)

    def drawn():
        layout = Layout()
        context = SimpleNamespace(scene=scene, region=SimpleNamespace(width=300))
        getattr(module, f"RTGI_PT_{panel}").draw(SimpleNamespace(layout=layout), context)
        return " ".join(layout.texts), layout.shown

    def work(progress):
        while True:
            progress.step(0.5, "tracing")

    assert starts in drawn()[1] and cancels not in drawn()[1]
    job.errors[scene.name] = "Ceiling is too low: raise it"
    assert "Ceiling is too low: raise it" in drawn()[0]
    job.take(BakeWorker(work), "Another Scene").start()
    job.worker.report = Report(0.25, "tracing probes", 75)
    texts, shown = drawn()
    assert "25%  ·  1 min 15 s left" in texts and "Another Scene: Tracing probes" in texts and "Ceiling" not in texts
    assert cancels in shown and starts not in shown
    operator = getattr(bpy.ops.rtgi, cancels.removeprefix("rtgi."))
    assert operator.poll() and operator() == {"FINISHED"}
    assert job.worker.join(10) and job.worker.outcome.cancelled and not operator.poll()


def test_a_stale_bake_is_said_to_be_one(scene):
    from rtgi_addon.blender.session import session
    bpy.ops.rtgi.bake()
    assert "changed" not in draw("RTGI_PT_last_bake")[0]
    session.stale[scene.name] = True
    assert "changed since" in draw("RTGI_PT_last_bake")[0]


def test_a_scene_without_a_volume_is_offered_one(scene):
    for obj in [obj for obj in scene.objects if obj.type == "LIGHT_PROBE"]:
        bpy.data.objects.remove(obj)
    texts, shown = draw("RTGI_PT_bake")
    assert "will be fitted" in texts and "rtgi.fit_volume" in shown


@pytest.mark.parametrize("width", [40, 180, 1200])
def test_long_lines_are_wrapped_to_the_region(scene, width):
    from rtgi_addon.blender.ui.sidebar import draw_lines
    text = "The scene or its settings have changed since, and a long line has to go somewhere in a narrow sidebar"
    layout = Layout()
    draw_lines(layout, text, width, "ERROR")
    assert " ".join(layout.texts) == text
    assert (len(layout.texts) == 1) == (width == 1200)


def test_without_embree_the_panels_say_what_it_costs_and_what_to_do(scene, monkeypatch):
    from rtgi_addon.transport.rays import embree
    assert "Embree" not in draw("RTGI_PT_bake", width=2000)[0]
    monkeypatch.setattr(embree, "rtcore_scene", None)
    for panel in ("RTGI_PT_bake", "RTGI_PT_render"):
        texts, _ = draw(panel, width=4000)
        assert "There is no Embree here" in texts and "5 times slower" in texts and "restart Blender" in texts


def test_a_click_on_a_line_selects_what_it_is_about(scene):
    from rtgi_addon.blender.session import Finding, session
    cube, lamp = bpy.data.objects["Cube"], bpy.data.objects["Point"]
    session.findings[scene.name] = [Finding("note", "Cube is left out " * 9, ("Cube",)), Finding("note", "of nothing")]
    text, shown = draw("RTGI_PT_checks")
    assert "left out" in text and shown.count("rtgi.select_named") > 2 and shown[-1] == "rtgi.check"
    assert bpy.ops.rtgi.select_named(objects="Cube") == {"FINISHED"}
    assert cube.select_get() and not lamp.select_get() and bpy.context.view_layer.objects.active == cube
    paint = bpy.data.materials.new("paint")
    cube.data.materials.append(paint)
    assert bpy.ops.rtgi.select_named(objects="Point", materials="paint") == {"FINISHED"}
    assert cube.select_get() and lamp.select_get()
    assert bpy.ops.rtgi.select_named(objects="gone") == {"CANCELLED"} and lamp.select_get()


def test_of_what_is_only_instanced_the_instancer_is_selected(scene):
    inside = bpy.data.objects.new("inside", None)
    collection = bpy.data.collections.new("kit")
    collection.objects.link(inside)
    instancer = bpy.data.objects.new("instancer", None)
    instancer.instance_type, instancer.instance_collection = "COLLECTION", collection
    scene.collection.objects.link(instancer)
    assert bpy.ops.rtgi.select_named(objects="inside") == {"FINISHED"}
    assert instancer.select_get()


def test_findings_know_the_objects_and_materials_they_name():
    from rtgi_addon.scene.checks import Finding
    subjects = {name: Finding("warning", name, "is odd", "mend it").subject
                for name in ("Room (and 2 more with its mesh)", "light Sun", "material paint", "light bulb")}
    assert subjects["Room (and 2 more with its mesh)"] == (("Room",), ()) and subjects["material paint"] == ((), ("paint",))
    assert "Sun" in subjects["light Sun"][0] and "light bulb" in subjects["light bulb"][0]
