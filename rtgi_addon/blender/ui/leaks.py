"""Leaks in Blender: an operator that compares the bake with the path reference on a worker thread, and what it found, by cause."""

from dataclasses import dataclass, field

import bpy
import numpy as np
from bpy.app.translations import pgettext_iface as iface_
from bpy.app.translations import pgettext_rpt as rpt_

from ...evaluate.error_map import FULL_SCALE
from ...evaluate.leaks import Cause, find_leaks
from ...progress import Progress
from ...transport.context import LightContext
from ..session import session
from ..translations import sentence
from ..worker import Job
from .modal_job import CancelJob, ModalJob, register_job, unregister_job
from .panel_kinds import ToolPanel
from .sidebar import draw_job, draw_lines
from .tool_settings import ToolSettings


@dataclass(eq=False)
class Leaks(Job):
    """The search under way, and by scene name and technique what was found with the field that it was found in."""

    found: dict[tuple[str, str], tuple] = field(default_factory=dict)

    def forget(self) -> None:
        """Drop what was found too."""
        super().forget()
        self.found.clear()

    def of(self, scene: bpy.types.Scene, field):
        """The LeakMap of ``field`` in ``scene``, or None: another bake has others."""
        for (name, _), (measured, found) in self.found.items():
            if name == scene.name and measured is field:
                return found
        return None


leaks = Leaks()


class RTGI_OT_find_leaks(ModalJob, bpy.types.Operator):
    """Compare the last bake of this session with the path reference on the scene's surfaces, and say why it is off where it is"""

    bl_idname = "rtgi.find_leaks"
    bl_label = "Find Leaks"
    bl_options = {"REGISTER"}
    job = leaks
    noun = "search"

    points: bpy.props.IntProperty(name="Points", description="How many points of surfaces are looked at", default=2000, min=16,
                                  max=100000)

    @classmethod
    def poll(cls, context):
        """Only with a bake of this session, and not while another one runs."""
        if not cls._free(rpt_("A bake or a search is already running")):
            return False
        if (context.scene.name, context.scene.rtgi.technique) not in session.baked:
            cls.poll_message_set(rpt_("Bake with this technique first: a bake from disk has no scene to compare with"))
            return False
        return True

    def _work(self, context):
        self._key = context.scene.name, context.scene.rtgi.technique
        baked, points = session.baked[self._key], self.points

        def search(progress: Progress):
            return baked.field, find_leaks(LightContext(baked.scene), baked.field, points, progress=progress)

        return search

    def _done(self, found):
        leaks.found[self._key] = found
        self.report({"INFO"}, sentence(found[1].lines()[0]))

    def _cancelled(self, outcome):
        return rpt_("Search cancelled; what was found before is kept")


class RTGI_OT_cancel_find_leaks(CancelJob, bpy.types.Operator):
    """Stop searching. What was found before is kept"""

    bl_idname = "rtgi.cancel_find_leaks"
    bl_label = "Cancel Search"
    job = leaks


class RTGI_PT_leaks(ToolPanel, bpy.types.Panel):
    """How much light goes where it should not, and why."""

    bl_label = "Leaks"

    def draw(self, context):
        """The button, the receivers by cause, the cause at the 3D cursor, and the switch of the overlay."""
        layout, scene, width = self.layout, context.scene, context.region.width
        SETTINGS.draw(layout, scene, not leaks.running)
        draw_job(layout, context, leaks, lambda column: SETTINGS.give(column.operator("rtgi.find_leaks", icon="VIEWZOOM"), scene),
                 "rtgi.cancel_find_leaks")
        found = leaks.found.get((scene.name, scene.rtgi.technique))
        if found is None:
            return
        field, leak_map = found
        counts = leak_map.counts()
        draw_lines(layout, sentence(leak_map.lines()[0]), width, "ERROR" if counts else "CHECKMARK")
        for cause, count in counts.items():
            draw_lines(layout, f"{count:,}: {sentence(cause.text)}", width, "BLANK1")
        row = leak_map.nearest(np.array(scene.cursor.location))
        if row is not None:
            draw_lines(layout, iface_("At the 3D cursor: {error}").format(error=at_receiver(leak_map, row)), width, "PIVOT_CURSOR")
        baked = session.baked.get((scene.name, scene.rtgi.technique))
        if baked is None or baked.field is not field:
            draw_lines(layout, iface_("Found in an earlier bake"), width, "INFO")
        layout.prop(scene.rtgi_preview, "leaks", text="Show on Surfaces")
        if scene.rtgi_preview.leaks:
            draw_lines(layout, iface_("Red is too bright, blue too dark, clear is right; full colour is an error of {share}% and "
                                      "more").format(share=f"{100 * FULL_SCALE:.0f}"), width, "COLOR")


def at_receiver(leak_map, row: int) -> str:
    """What a LeakMap says of one receiver."""
    cause = Cause(int(leak_map.cause[row]))
    off = f"{100.0 * leak_map.error[row]:+.0f}%"
    return off if cause is Cause.NONE else f"{off}, {sentence(cause.text)}"


SETTINGS = ToolSettings("rtgi_leaks", RTGI_OT_find_leaks, ("points",))
_CLASSES = (RTGI_OT_find_leaks, RTGI_OT_cancel_find_leaks, RTGI_PT_leaks)


def register() -> None:
    """Register operator and panel."""
    register_job(leaks, *_CLASSES)
    SETTINGS.register()


def unregister() -> None:
    """Stop a running search and take everything out."""
    SETTINGS.unregister()
    unregister_job(leaks, *_CLASSES)
