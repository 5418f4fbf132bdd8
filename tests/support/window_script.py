"""Runs inside a Blender with a window (tests/blender/test_window.py starts it): uses the panel as a user would.

It opens FILE, presses Bake, watches the progress, cancels with Esc, by the button, by opening another file, undoes in the middle,
and bakes to the end; what it saw goes to REPORT as JSON, screenshots to the folder beside it. A generator yields how long to
wait, Blender's timer resumes it: the window runs on in between.
"""

import hashlib
import importlib
import sys
from pathlib import Path

import bpy

sys.path.insert(0, str(Path(__file__).parent))
from window_driver import area, in_view, region, run, screenshot, window

FILE, REPORT, ADDON = sys.argv[sys.argv.index("--") + 1:][:3]
FOLDER = Path(REPORT).parent
OUT = FOLDER / "bake"
LONG, SHORT = 1 << 18, 64  # rays per probe: long enough to be interrupted, short enough to wait for

seen = {}
module = importlib.import_module(f"{ADDON}.blender.session")
wording = importlib.import_module(f"{ADDON}.blender.ui.progress_text")


def session():
    return module.session


def settings(rays):
    rtgi = window().scene.rtgi
    rtgi.output, rtgi.mode, rtgi.technique_probes.rays = str(OUT), "RAYS", rays


def bundle():
    """Name → digest of every file of the last bake."""
    return {str(path.relative_to(OUT)): hashlib.sha256(path.read_bytes()).hexdigest() for path in sorted(OUT.rglob("*"))
            if path.is_file()}


def press(kind, x, y):
    window().event_simulate(kind, "PRESS", x=x, y=y)
    window().event_simulate(kind, "RELEASE", x=x, y=y)


def until(done, seconds=60.0, step=0.1):
    """Wait until ``done()``; fails after ``seconds``."""
    for _ in range(int(seconds / step)):
        if done():
            return
        yield step
    raise TimeoutError(f"waited {seconds} s for {done.__name__}")


def ended():
    return not session().scene


def picture(name):
    screenshot(FOLDER / f"{name}.png")


def open_scene():
    bpy.ops.wm.open_mainfile(filepath=FILE, load_ui=False)
    yield 0.5
    view = area("VIEW_3D")
    view.spaces.active.show_region_ui = True
    view.spaces.active.region_3d.view_perspective = "CAMERA"
    area("PROPERTIES").spaces.active.context = "RENDER"
    yield 0.5
    region("VIEW_3D", "UI").active_panel_category = "RTGI"
    yield 0.5


def show_settings():
    """Give the properties editor more room, and its search field what leaves only our panel."""
    properties = area("PROPERTIES")
    x, y = properties.x - 1, properties.y + properties.height // 2
    window().event_simulate("MOUSEMOVE", "NOTHING", x=x, y=y)
    yield 0.2
    window().event_simulate("LEFTMOUSE", "PRESS", x=x, y=y)
    for moved in range(0, 181, 20):
        window().event_simulate("MOUSEMOVE", "NOTHING", x=x - moved, y=y)
        yield 0.02
    window().event_simulate("LEFTMOUSE", "RELEASE", x=x - 180, y=y)
    properties.spaces.active.search_filter = "RTGI"
    yield 0.7
    window().event_simulate("MOUSEMOVE", "NOTHING", x=properties.x + 200, y=properties.y + 200)
    for _ in range(20):
        press("WHEELDOWNMOUSE", properties.x + 200, properties.y + 200)
    yield 0.7


def show_volume():
    """Select the volume and turn the properties editor to its data."""
    volume = next(obj for obj in window().scene.objects if obj.type == "LIGHT_PROBE")
    with in_view():
        bpy.ops.object.select_all(action="DESELECT")
    volume.select_set(True)
    window().view_layer.objects.active = volume
    volume.data.rtgi.technique_probes.override_order = True
    yield 0.3
    area("PROPERTIES").spaces.active.context = "DATA"
    yield 0.7


def click_bake():
    """Move down the sidebar from below its first header, clicking, until a bake starts; notes may stand above the button."""
    sidebar = region("VIEW_3D", "UI")
    scale = bpy.context.preferences.system.ui_scale
    x = sidebar.x + sidebar.width // 2
    for down in range(50, 300, 8):
        y = sidebar.y + sidebar.height - int(down * scale)
        window().event_simulate("MOUSEMOVE", "NOTHING", x=x, y=y)
        yield 0.1
        press("LEFTMOUSE", x, y)
        yield 0.2
        if session().running:
            seen["clicked"] = True
            return
    raise AssertionError("no button in the sidebar started a bake")


def watch(name):
    """Follow a bake for a while: the fractions it reports, and how often the window came round."""
    fractions, rounds = [], 0
    while len(set(fractions)) < 6 and rounds < 600 and session().running:
        fractions.append(session().worker.report.fraction)
        rounds += 1
        yield 0.05
    seen[name] = {"fractions": fractions, "rounds": rounds, "text": wording.status_text(session().worker.report, False)}


def story():
    """The whole session, in order."""
    yield from open_scene()
    settings(SHORT)
    with in_view():
        bpy.ops.rtgi.bake("INVOKE_DEFAULT")
    yield from until(ended)
    seen["first"] = bundle()
    seen["probes"] = window().scene.rtgi.last_bake.probes
    yield 1.0
    seen["stale after the bake"] = session().stale.get(window().scene.name)

    settings(LONG)
    yield from until(lambda: session().stale.get(window().scene.name))
    seen["stale after a change"] = session().stale.get(window().scene.name)
    yield from click_bake()
    yield from watch("progress")
    with in_view():
        seen["a second bake may start"] = bpy.ops.rtgi.bake.poll()
    press("ESC", 400, 300)
    yield from until(ended)
    seen["cancelled by Esc"] = session().worker.outcome.cancelled
    seen["after Esc"] = bundle()

    with in_view():
        bpy.ops.rtgi.bake("INVOKE_DEFAULT")
        yield 0.5
        bpy.ops.rtgi.cancel()
    yield from until(ended)
    seen["cancelled by the button"] = session().worker.outcome.cancelled

    settings(64 * SHORT)
    with in_view():
        for action in ("SELECT", "DESELECT", "SELECT"):
            bpy.ops.object.select_all(action=action)
            bpy.ops.ed.undo_push(message=action)
        bpy.ops.rtgi.bake("INVOKE_DEFAULT")
    yield 0.1
    with in_view():
        bpy.ops.ed.undo()
    seen["baking after undo"] = bool(session().scene)
    yield from until(ended)
    yield 0.2
    with in_view():
        bpy.ops.ed.undo()
    yield 0.2
    seen["folder after undo"] = window().scene.rtgi.last_bake.folder
    seen["after undo"] = bundle()

    def target():
        return round(window().scene.rtgi.technique_probes.error, 4)

    seen["preset"] = [target()]
    with in_view():
        bpy.ops.rtgi.apply_preset("EXEC_DEFAULT", True, filepath=bpy.utils.preset_find("Draft", "rtgi"))
        seen["preset"].append(target())
        bpy.ops.ed.undo()
    yield 0.2
    seen["preset"].append(target())

    settings(LONG)
    with in_view():
        bpy.ops.rtgi.bake("INVOKE_DEFAULT")
    yield 0.5
    worker = session().worker
    yield from open_scene()
    yield from until(lambda: not worker.running)
    seen["cancelled by opening a file"] = worker.outcome.cancelled
    seen["after opening a file"] = bundle()

    for obj in [obj for obj in window().scene.objects if obj.type == "MESH"]:
        bpy.data.objects.remove(obj)
    settings(SHORT)
    with in_view():
        try:
            bpy.ops.rtgi.bake("INVOKE_DEFAULT")
        except RuntimeError as error:
            seen["nothing to bake"] = str(error)
    yield from until(ended)
    seen["nothing to bake"] = seen.get("nothing to bake") or session().errors.get(window().scene.name)
    yield 0.3
    picture("failed")

    yield from open_scene()
    settings(SHORT)
    window().scene.rtgi.mode = "ERROR"
    yield from show_settings()
    with in_view():
        bpy.ops.rtgi.bake("INVOKE_DEFAULT")
    yield from until(ended)
    yield 1.5
    picture("baked")
    seen["whole bake"] = bundle()
    with in_view():
        window().scene.rtgi.technique_probes.error = 0.001
        bpy.ops.rtgi.bake("INVOKE_DEFAULT")
    yield from until(lambda: session().worker.report.fraction > 0.3 or ended())
    yield 0.3
    picture("panel")
    session().worker.cancel()
    yield from until(ended)
    yield from show_volume()
    picture("volume")


run(story(), seen, REPORT)
