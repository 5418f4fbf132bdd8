"""What scripts need that run inside a Blender with a window: where a button is, and a timer that drives a story.

A story is a generator: it yields how many seconds to wait, Blender's timer resumes it, and the window runs on in between.
"""

import json
import traceback
from pathlib import Path

import bpy


def window():
    return bpy.context.window_manager.windows[0]


def area(kind):
    return next(found for found in window().screen.areas if found.type == kind)


def region(kind, name):
    return next(found for found in area(kind).regions if found.type == name)


def in_view():
    """A context as a button in the 3D view has it."""
    return bpy.context.temp_override(window=window(), area=area("VIEW_3D"), region=region("VIEW_3D", "WINDOW"))


def screenshot(path):
    bpy.ops.screen.screenshot(filepath=str(path))


def run(story, seen, report):
    """Drive ``story``, write to ``report`` what was ``seen``, as JSON, and the ``error`` that ended it, and quit in any case."""
    seen["error"] = "did not finish"
    bpy.context.preferences.view.show_splash = False
    bpy.context.preferences.use_preferences_save = False

    def tick():
        try:
            return next(story)
        except StopIteration:
            del seen["error"]
        except BaseException:
            seen["error"] = traceback.format_exc()
        Path(report).write_text(json.dumps(seen))
        bpy.ops.wm.quit_blender()
        return None

    bpy.app.timers.register(tick, first_interval=1.0, persistent=True)
