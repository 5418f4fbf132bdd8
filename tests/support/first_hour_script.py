"""Runs inside a Blender with a window (tests/blender/test_first_hour.py starts it): what somebody new does in the first hour.

Blender's startup scene, unsaved, is baked by one press, then with a volume at the origin; the file is saved and opened again
without what was recorded after; every job of the panel is begun and cancelled; the bake is exported, and another scene's refused;
overlays are looked at in another engine. What it saw goes to REPORT as JSON, screenshots to the folder beside it.
"""

import importlib
import sys
from pathlib import Path

import bpy

sys.path.insert(0, str(Path(__file__).parent))
from window_driver import area, in_view, region, run, screenshot, window

REPORT, ADDON = sys.argv[sys.argv.index("--") + 1:][:2]
FOLDER = Path(REPORT).parent
seen = {}


def module(name):
    return importlib.import_module(f"{ADDON}.blender.{name}")


session = module("session").session


def scene():
    return window().scene


def press(name, **options):
    """Press the button of an operator."""
    with in_view():
        return [*getattr(bpy.ops.rtgi, name)("INVOKE_DEFAULT", **options)]


def until(done, seconds=120.0, step=0.1):
    for _ in range(int(seconds / step)):
        if done():
            return
        yield step
    raise TimeoutError(f"waited {seconds} s")


def picture(name):
    screenshot(FOLDER / f"{name}.png")


def pixels(name):
    """The pixels of the 3D view's middle in a screenshot, as bytes."""
    image = bpy.data.images.load(str(FOLDER / f"{name}.png"), check_existing=False)
    width, height = image.size
    values = list(image.pixels)
    view = area("VIEW_3D")
    rows = range(view.y + view.height // 4, min(view.y + 3 * view.height // 4, height))
    columns = view.x + view.width // 4, view.x + 5 * view.width // 8
    bpy.data.images.remove(image)
    return [round(255 * value) for row in rows for value in values[4 * (row * width + columns[0]):4 * (row * width + columns[1])]]


def differing(one, other):
    """The share of numbers of two pictures that are not the same."""
    return sum(abs(a - b) > 8 for a, b in zip(one, other, strict=True)) / len(one)


def bake():
    press("bake")
    yield from until(lambda: not session.scene)
    yield 0.5


def findings():
    return [found.text for found in session.findings.get(scene().name, ())]


def first_click():
    """The startup scene as Blender opens it."""
    area("VIEW_3D").spaces.active.show_region_ui = True
    yield 0.5
    region("VIEW_3D", "UI").active_panel_category = "RTGI"
    rtgi = scene().rtgi
    rtgi.mode, rtgi.technique_probes.rays = "RAYS", 64
    yield from bake()
    seen["first"] = {"folder": rtgi.last_bake.folder, "probes": rtgi.last_bake.probes, "told": findings(),
                     "changed": bpy.data.is_dirty, "there": (Path(rtgi.last_bake.folder) / "bake.json").is_file()}
    with in_view():
        bpy.ops.object.lightprobe_add(type="VOLUME", location=(0, 0, 0))
        bpy.ops.rtgi.check()
    seen["checked"] = findings()
    yield from bake()
    seen["at the origin"] = {"told": findings(), "error": session.errors.get(scene().name, ""), "probes": rtgi.last_bake.probes}
    picture("first_hour")


def overlays_elsewhere():
    """In EEVEE's viewport: with them, without, and with Blender's own switch off."""
    space, preview = area("VIEW_3D").spaces.active, scene().rtgi_preview
    seen["engine"] = scene().render.engine
    preview.probes, preview.bounds = "light", True
    yield 1.0
    picture("overlays")
    preview.probes, preview.bounds = "none", False
    yield 1.0
    picture("none")
    with_them, without = pixels("overlays"), pixels("none")
    seen["overlays are seen"] = differing(with_them, without)
    space.overlay.show_overlays = False
    yield 1.0
    picture("all_off")
    preview.probes, preview.bounds = "light", True
    yield 1.0
    picture("switched_off")
    seen["overlays obey the switch"] = differing(pixels("all_off"), pixels("switched_off"))
    preview.probes, preview.bounds = "none", False
    space.overlay.show_overlays = True


def reopened():
    """Saved, baked again and opened without being saved after that."""
    path = FOLDER / "mine.blend"
    bpy.ops.wm.save_as_mainfile(filepath=str(path))
    seen["moved"] = scene().rtgi.last_bake.folder
    scene().rtgi.last_bake.folder = scene().rtgi.last_bake.fingerprint = ""
    scene().rtgi.last_bake.probes = 0
    bpy.ops.wm.save_mainfile()
    yield from bake()
    baked = scene().rtgi.last_bake.probes
    bpy.ops.wm.open_mainfile(filepath=str(path), load_ui=False)
    yield from until(lambda: scene().name in session.stale)
    last = scene().rtgi.last_bake
    seen["found"] = {"folder": last.folder, "probes": last.probes, "baked": baked, "stale": session.stale.get(scene().name)}


def jobs():
    """Each of the panel's jobs, begun and cancelled by its own button; what measures a volume without a usable probe says so."""
    area("VIEW_3D").spaces.active.show_region_ui = True
    plans = module("ui.plan").plans
    press("plan")
    yield from until(lambda: not plans.running and not plans.scene)
    seen["nothing to plan"] = plans.errors.get(scene().name, "")
    window().view_layer.objects.active = next(obj for obj in scene().objects if obj.type == "LIGHT_PROBE")
    seen["fitted"] = press("refit_volume")
    yield from bake()  # leaks are looked for in a bake of this session
    scene().rtgi.technique_probes.rays = 1 << 18
    ui = {name: module(f"ui.{name}") for name in ("chart", "leaks", "plan", "stability", "verify", "export")}
    begun = {"bake": (session, "cancel", {}), "chart": (ui["chart"].charts, "cancel_chart", {"seeds": 8}),
             "find_leaks": (ui["leaks"].leaks, "cancel_find_leaks", {"points": 100000}),
             "plan": (ui["plan"].plans, "cancel_plan", {"error": 0.01}),
             "stability": (ui["stability"].suite, "cancel_stability", {"technique": "probes"}),
             "verify": (ui["verify"].verifications, "cancel_verify", {})}
    seen["jobs"] = {}
    for name, (job, cancel, options) in begun.items():
        try:
            seen["jobs"][name] = {"began": press(name, **options)}
        except RuntimeError as error:
            seen["jobs"][name] = {"error": str(error)}
            continue
        # Soon: verification of a scene like this one is over in half a second.
        yield 0.05
        seen["jobs"][name] |= {"ran": job.running, "cancel": press(cancel) if job.running else []}
        yield from until(lambda: not job.running and not job.scene)  # noqa: B023
        seen["jobs"][name]["cancelled"] = job.worker.outcome.cancelled
        yield 0.2
    scene().rtgi.technique_probes.rays = 64


def exported():
    """The bake that is shown; then another scene's lies in its place."""
    exports = module("ui.export").exports
    export = scene().rtgi_export
    export.folder, export.model = str(FOLDER / "game"), True
    seen["exported"] = press("export")
    yield from until(lambda: not exports.scene)
    report = exports.reports.get(scene().name)
    seen["files"] = None if report is None else len(report.files)
    scene().name = "Another"
    with in_view():
        seen["another's may be exported"] = bpy.ops.rtgi.export.poll()
    yield 0.5
    picture("refused")


def story():
    """The hour, in order."""
    yield from first_click()
    yield from overlays_elsewhere()
    yield from reopened()
    yield from jobs()
    yield from exported()


run(story(), seen, REPORT)
