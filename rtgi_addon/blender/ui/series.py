"""A series from the panel: one bundle a frame of the scene's own frame range, read on the main thread and baked on a worker."""

import bpy
from bpy.app.translations import pgettext_iface as iface_
from bpy.app.translations import pgettext_rpt as rpt_

from ...jobs.series import frames_text
from ..bake_job import prepare_series, record_series
from ..frames import frames_of
from ..session import session
from ..worker import duration
from .modal_job import ModalJob
from .panel_kinds import ToolPanel
from .sidebar import draw_lines


class RTGI_OT_bake_frames(ModalJob, bpy.types.Operator):
    """Bake every frame of the scene's frame range, a bundle each, which the preview shows at its frame. Frames that an earlier \
run has baked and that have not changed are kept"""

    bl_idname = "rtgi.bake_frames"
    bl_label = "Bake Frames"
    bl_options = {"REGISTER"}
    job = session
    noun = "bake"
    _frame = 0

    @classmethod
    def poll(cls, context):
        """Not twice at a time."""
        return cls._free(rpt_("A bake is already running"))

    def _work(self, context):
        self._frame = context.scene.frame_current
        return prepare_series(context)

    def _finish(self):
        scene = bpy.data.scenes.get(self._scene)
        if scene is not None:
            scene.frame_set(self._frame)
        return super()._finish()

    def _done(self, summary):
        scene = bpy.data.scenes.get(self._scene)
        if scene is not None:
            record_series(scene, summary)
        text = rpt_("Baked frames {frames} in {time}") if summary.baked else rpt_("Nothing has changed: all frames are kept")
        self.report({"INFO"}, text.format(frames=frames_text(summary.baked), time=duration(summary.seconds)))

    def _cancelled(self, outcome):
        return rpt_("Cancelled; frames that are baked stay, and Bake Frames goes on with the others")


class RTGI_PT_series(ToolPanel, bpy.types.Panel):
    """A bundle a frame, for what moves."""

    bl_label = "Series"

    def draw(self, context):
        """Which frames, and the button; progress and cancel stand where those of a bake are."""
        layout, frames = self.layout, frames_of(context.scene)
        draw_lines(layout, iface_("Frames {frames}").format(frames=frames_text(frames)), context.region.width, "TIME")
        column = layout.column()
        column.enabled = not session.running
        column.operator("rtgi.bake_frames", icon="RENDER_ANIMATION")


_CLASSES = (RTGI_OT_bake_frames, RTGI_PT_series)


def register() -> None:
    """Register operator and panel; the job is the bake's own."""
    for cls in _CLASSES:
        bpy.utils.register_class(cls)


def unregister() -> None:
    """Take them out."""
    for cls in reversed(_CLASSES):
        bpy.utils.unregister_class(cls)
