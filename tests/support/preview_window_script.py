"""Runs inside a Blender with a window (tests/blender/test_preview_window.py starts it): switches to the engine RTGI, bakes from the
panel, moves a lamp, renders, undoes, opens a second window and a file, and looks at the pixels.

It opens FILE; what it saw goes to REPORT as JSON, screenshots to the folder beside it.
"""

import gc
import importlib
import sys
from pathlib import Path

import addon_utils
import bpy
import numpy as np

sys.path.insert(0, str(Path(__file__).parent))
from window_driver import area, in_view, run, screenshot, window

FILE, REPORT, ADDON = sys.argv[sys.argv.index("--") + 1:][:3]
FOLDER = Path(REPORT).parent
STEP, PATIENCE = 0.1, 30.0

seen = {}
module = importlib.import_module(f"{ADDON}.blender.session")
live = importlib.import_module(f"{ADDON}.blender.engine.live")


def until(done):
    """Wait until ``done()``."""
    for _ in range(int(PATIENCE / STEP)):
        if done():
            return
        yield STEP
    picture("timeout")
    state = [(found.picture.renderer and (found.unsettled, found.picture.renderer.samples), found._broken)
             for found in live_viewports()]
    pending = {name: (entry.pending, entry.error) for name, entry in live._live.items()}
    raise TimeoutError(f"waited {PATIENCE} s for {done.__name__}: {state}, {pending}")


def picture(name):
    """The 3D view's pixels (h, w, 3), row 0 at the bottom, as the screen shows them; the whole window is kept as a file."""
    path = FOLDER / f"{name}.png"
    screenshot(path)
    image = bpy.data.images.load(str(path))
    pixels = np.array(image.pixels, np.float32).reshape(image.size[1], image.size[0], -1)[..., :3]
    bpy.data.images.remove(image)
    view = next(part for part in area("VIEW_3D").regions if part.type == "WINDOW")
    return pixels[view.y:view.y + view.height, view.x:view.x + view.width]


def looked_at(name):
    """Mean colours of the view's left, middle and right thirds, in the lower middle where no panel hides it."""
    pixels = picture(name)
    height, width = pixels.shape[:2]
    rows = pixels[height // 4:height // 2]
    columns = ((0.28, 0.34), (0.45, 0.55), (0.66, 0.72))
    seen[name] = [rows[:, int(low * width):int(high * width)].mean(axis=(0, 1)).tolist() for low, high in columns]


def settled():
    """True once the viewport has nothing left to read, relight or average."""
    viewports = [found for found in live_viewports() if found.picture.renderer is not None]
    return bool(viewports) and not any(found.unsettled for found in viewports) and not any(
        entry.pending for entry in live._live.values())


def live_viewports():
    viewport = importlib.import_module(f"{ADDON}.blender.engine.viewport").Viewport
    return [found for found in gc.get_objects() if isinstance(found, viewport)]


def open_scene():
    bpy.ops.wm.open_mainfile(filepath=FILE, load_ui=False)
    yield 0.5
    scene, view = window().scene, area("VIEW_3D")
    scene.render.engine = "RTGI"
    scene.rtgi.output, scene.rtgi.mode, scene.rtgi.technique_probes.rays = str(FOLDER / "bake"), "RAYS", 256
    scene.rtgi_preview.samples, scene.rtgi_preview.render_samples, scene.rtgi_preview.shadow_resolution = 8, 2, 256
    view.spaces.active.region_3d.view_perspective = "CAMERA"
    view.spaces.active.overlay.show_overlays = view.spaces.active.show_gizmo = False
    view.spaces.active.shading.type = "RENDERED"
    view.spaces.active.show_region_ui = True
    area("PROPERTIES").spaces.active.context = "RENDER"
    yield 0.5
    next(part for part in view.regions if part.type == "UI").active_panel_category = "RTGI"
    yield 0.5


def story():
    """The whole session, in order."""
    yield from open_scene()
    yield from until(settled)
    looked_at("without a bake")

    with in_view():
        bpy.ops.rtgi.bake("INVOKE_DEFAULT")
    yield from until(lambda: not module.session.scene)
    yield 1.0
    yield from until(settled)
    looked_at("baked")
    seen["stale after the bake"] = module.session.stale.get(window().scene.name)

    lamp = next(obj for obj in window().scene.objects if obj.type == "LIGHT")
    lamp.location.x += 0.6
    yield 1.5
    yield from until(settled)
    looked_at("lamp moved")
    seen["stale after the move"] = module.session.stale.get(window().scene.name)
    bpy.ops.ed.undo_push(message="moved")

    window().scene.rtgi_preview.mode = "indirect"
    yield 0.3
    yield from until(settled)
    looked_at("indirect alone")
    # Software drivers take half a minute for a frame of it at full size.
    window().scene.rtgi_preview.resolution_scale, window().scene.rtgi.technique = 0.1, "rsm"
    yield 0.5
    yield from until(settled)
    looked_at("maps without a bake")
    block = bpy.data.objects["Tall Block"]
    before = block.location.x
    block.location.x -= 0.5
    yield 0.5
    yield from until(settled)
    looked_at("block moved")
    block.location.x = before
    window().scene.rtgi_preview.resolution_scale, window().scene.rtgi.technique = 1.0, "probes"
    window().scene.rtgi_preview.mode = "combined"
    yield 0.5
    yield from until(settled)

    scene = window().scene
    scene.render.resolution_x, scene.render.resolution_y = 64, 64
    scene.render.filepath = str(FOLDER / "f12.png")
    with in_view():
        bpy.ops.render.render("INVOKE_DEFAULT", write_still=True)
    yield 0.2
    yield from until(lambda: not bpy.app.is_job_running("RENDER") and (FOLDER / "f12.png").exists())
    yield 0.5
    image = bpy.data.images.load(str(FOLDER / "f12.png"))
    seen["F12"] = np.array(image.pixels).reshape(64, 64, -1)[..., :3].mean(axis=0)[[8, 32, 56]].tolist()
    bpy.data.images.remove(image)
    while len(bpy.context.window_manager.windows) > 1:
        with bpy.context.temp_override(window=bpy.context.window_manager.windows[-1]):
            bpy.ops.wm.window_close()
        yield 0.3

    with in_view():
        bpy.data.objects[lamp.name].location.x -= 0.3
        bpy.ops.ed.undo_push(message="moved back")
        bpy.ops.ed.undo()
    yield 1.0
    yield from until(settled)
    looked_at("after undo")

    with in_view():
        bpy.ops.wm.window_new_main()
    yield 1.0
    second = bpy.context.window_manager.windows[-1]
    other = next(found for found in second.screen.areas if found.type == "VIEW_3D")
    other.spaces.active.shading.type = "RENDERED"
    yield 1.0
    yield from until(settled)
    seen["viewports"] = sum(found.picture.renderer is not None for found in live_viewports())
    with bpy.context.temp_override(window=second):
        bpy.ops.wm.window_close()
    yield 0.5
    looked_at("one window again")

    empty = bpy.data.scenes.new("Empty")
    window().scene = empty
    empty.render.engine = "RTGI"
    yield from until(lambda: any("no visible geometry" in entry.error for entry in live._live.values()))
    window().scene = bpy.data.scenes[0] if bpy.data.scenes[0] != empty else bpy.data.scenes[1]
    yield 1.0
    yield from until(settled)
    looked_at("back from another scene")

    yield from open_scene()
    yield from until(settled)
    looked_at("opened again")
    addon_utils.disable(ADDON.rpartition(".")[0])
    yield 1.0
    gc.collect()
    seen["viewports while disabled"] = len(live_viewports())
    addon_utils.enable(ADDON.rpartition(".")[0])
    yield 1.0
    yield from until(settled)
    looked_at("enabled again")

    window().scene.render.engine = "BLENDER_EEVEE" if bpy.app.version >= (5, 0) else "BLENDER_EEVEE_NEXT"
    yield 1.0
    area("VIEW_3D").spaces.active.shading.type = "SOLID"
    yield 0.5
    gc.collect()
    seen["viewports left"] = sum(found.picture.renderer is not None for found in live_viewports())


run(story(), seen, REPORT)
