"""Leaks in Blender: an operator that compares the bake with the path reference on a worker thread, and what it found, by cause."""

import bpy
import numpy as np
from bpy.app.translations import pgettext_iface as iface_
from bpy.app.translations import pgettext_rpt as rpt_

from ..errors import BakeError
from ..evaluate.leaks import Cause, find_leaks
from ..progress import Progress
from ..transport.context import LightContext
from .modal_job import Job, ModalJob
from .panels import draw_lines
from .session import redraw, session
from .translations import sentence
from .worker import BakeWorker


class Leaks(Job):
    """The search under way (``worker``, for the scene and technique ``searching``), and by scene name and technique what was found
    with the field that it was found in."""

    def __init__(self):
        super().__init__()
        self.searching: tuple[str, str] = "", ""
        self.found: dict[tuple[str, str], tuple] = {}

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

    points: bpy.props.IntProperty(name="Points", description="How many points of surfaces are looked at", default=2000, min=16,
                                  max=100000)

    @classmethod
    def poll(cls, context):
        """Only with a bake of this session, and not while another one runs."""
        if leaks.running or session.running:
            cls.poll_message_set(rpt_("A bake or a search is already running"))
            return False
        if (context.scene.name, context.scene.rtgi.technique) not in session.baked:
            cls.poll_message_set(rpt_("Bake with this technique first: a bake from disk has no scene to compare with"))
            return False
        return True

    def _prepared(self, context, on_report=None) -> bool:
        """Whether there is now a worker that can run; a reason against it was reported."""
        try:
            self._require_ended("search")
        except BakeError as error:
            self.report({"ERROR"}, sentence(str(error)))
            return False
        key = context.scene.name, context.scene.rtgi.technique
        baked, points = session.baked[key], self.points

        def search(progress: Progress):
            return baked.field, find_leaks(LightContext(baked.scene), baked.field, points, progress=progress)

        leaks.worker, leaks.searching = BakeWorker(search, on_report), key
        return True

    def _finish(self):
        outcome = leaks.worker.outcome
        if outcome.error:
            self.report({"ERROR"}, sentence(outcome.error))
            return {"CANCELLED"}
        if outcome.cancelled:
            self.report({"INFO"}, rpt_("Search cancelled; what was found before is kept"))
            return {"CANCELLED"}
        leaks.found[leaks.searching] = outcome.summary
        redraw()
        self.report({"INFO"}, sentence(outcome.summary[1].lines()[0]))
        return {"FINISHED"}


class RTGI_PT_leaks(bpy.types.Panel):
    """How much light goes where it should not, and why."""

    bl_label = "Leaks"
    bl_parent_id = "RTGI_PT_bake"
    bl_space_type = "VIEW_3D"
    bl_region_type = "UI"
    bl_category = "RTGI"
    bl_options = {"DEFAULT_CLOSED"}

    def draw(self, context):
        """The button, the receivers by cause, the cause at the 3D cursor, and the switch of the overlay."""
        layout, scene, width = self.layout, context.scene, context.region.width
        layout.operator("rtgi.find_leaks", icon="VIEWZOOM")
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


def at_receiver(leak_map, row: int) -> str:
    """What a LeakMap says of one receiver."""
    cause = Cause(int(leak_map.cause[row]))
    off = f"{100.0 * leak_map.error[row]:+.0f}%"
    return off if cause is Cause.NONE else f"{off}, {sentence(cause.text)}"


@bpy.app.handlers.persistent
def forget_leaks(*_):
    """Another file is about to be opened: stop searching, and drop what belongs to the old one's scenes."""
    if leaks.worker is not None:
        leaks.worker.cancel()
    leaks.found.clear()


_CLASSES = (RTGI_OT_find_leaks, RTGI_PT_leaks)


def register() -> None:
    """Register operator, panel and handler."""
    for cls in _CLASSES:
        bpy.utils.register_class(cls)
    bpy.app.handlers.load_pre.append(forget_leaks)


def unregister() -> None:
    """Stop a running search, give it a moment to end, and take everything out."""
    leaks.stop()
    leaks.found.clear()
    bpy.app.handlers.load_pre.remove(forget_leaks)
    for cls in reversed(_CLASSES):
        bpy.utils.unregister_class(cls)
