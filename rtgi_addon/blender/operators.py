"""What the user can do: bake, cancel, check, fit a volume, open the folder. Light is traced on a worker thread; all that touches
Blender happens here, on its main thread."""

from pathlib import Path

import bpy
from bpy.app.translations import pgettext_rpt as rpt_

from ..errors import BakeError
from .bake_job import check, fitted_volume, last_bake_of, prepare, record
from .progress_text import status_text
from .session import redraw, redraw_progress, session
from .translations import sentence
from .worker import BakeWorker, Report, duration

_TICK = 0.1
_GRACE = 5.0


class RTGI_OT_bake(bpy.types.Operator):
    """Bake the light of this scene into its Light Probe Volumes"""

    bl_idname = "rtgi.bake"
    bl_label = "Bake Probes"
    bl_options = {"REGISTER"}

    @classmethod
    def poll(cls, context):
        """Not twice at a time, and not in the middle of an edit."""
        if session.running and not session.worker.progress.cancelled:
            cls.poll_message_set(rpt_("A bake is already running"))
            return False
        if context.mode != "OBJECT":
            cls.poll_message_set(rpt_("Baking reads the scene in Object Mode"))
            return False
        return True

    def execute(self, context):
        """Bake here and now, and return when it is done: for scripts and for Blender without a window."""
        manager = context.window_manager
        manager.progress_begin(0, 100)
        try:
            worker = self._worker(context, on_report=lambda report: manager.progress_update(100 * report.fraction))
            if worker is None:
                return {"CANCELLED"}
            worker.run()
        finally:
            manager.progress_end()
        return self._finish()

    def invoke(self, context, event):
        """Bake on a thread of its own while the window stays alive."""
        if bpy.app.background:
            return self.execute(context)
        worker = self._worker(context)
        if worker is None:
            return {"CANCELLED"}
        manager = context.window_manager
        manager.progress_begin(0, 100)
        self._timer = manager.event_timer_add(_TICK, window=context.window)
        manager.modal_handler_add(self)
        worker.start()
        self._show(context, worker.report)
        redraw()
        return {"RUNNING_MODAL"}

    def modal(self, context, event):
        """Show progress at every tick; stop on Esc; leave everything else to Blender."""
        worker = session.worker
        if event.type == "ESC" and event.value == "PRESS" and not worker.progress.cancelled:
            worker.cancel()
            self._show(context, worker.report)
            return {"RUNNING_MODAL"}
        if event.type != "TIMER":
            return {"PASS_THROUGH"}
        if worker.poll():
            self._show(context, worker.report)
            return {"PASS_THROUGH"}
        self._clean_up(context)
        return self._finish()

    def cancel(self, context):
        """Blender ends the operator itself: another file is opened, or the window closes."""
        if session.worker is not None:
            session.worker.cancel()
        self._clean_up(context)

    def _worker(self, context, on_report=None) -> BakeWorker | None:
        """The bake of this scene, ready to run; None once a reason against it was reported."""
        scene = context.scene
        session.errors.pop(scene.name, None)
        try:
            if session.worker is not None and not session.worker.join(_GRACE):
                raise BakeError("the bake that was cancelled is still ending", "try again in a moment")
            bake = prepare(context)
        except BakeError as error:
            session.errors[scene.name] = str(error)
            self.report({"ERROR"}, sentence(str(error)))
            redraw()
            return None
        session.worker, session.baking = BakeWorker(bake, on_report), scene.name
        return session.worker

    def _finish(self):
        outcome, scene = session.worker.outcome, bpy.data.scenes.get(session.baking)
        session.baking = ""
        redraw()
        if outcome.cancelled:
            self.report({"INFO"}, rpt_("Bake cancelled; the last one is as it was"))
            return {"CANCELLED"}
        if outcome.error:
            if scene is not None:
                session.errors[scene.name] = outcome.error
            self.report({"ERROR"}, sentence(outcome.error))
            return {"CANCELLED"}
        if scene is not None:
            record(scene, outcome.summary)
        done = last_bake_of(outcome.summary)
        text = rpt_("Baked {probes:,} probes in {time}, estimated error {error:.2g}%") if done["error"] >= 0 else \
            rpt_("Baked {probes:,} probes in {time}")
        self.report({"INFO"}, text.format(probes=done["probes"], time=duration(done["seconds"]), error=100 * done["error"]))
        return {"FINISHED"}

    def _show(self, context, report: Report) -> None:
        context.window_manager.progress_update(100 * report.fraction)
        context.workspace.status_text_set(status_text(report, session.worker.progress.cancelled))
        redraw_progress()

    def _clean_up(self, context) -> None:
        manager = context.window_manager
        if self._timer is not None:
            manager.event_timer_remove(self._timer)
            self._timer = None
        manager.progress_end()
        for workspace in bpy.data.workspaces:  # the user may have gone to another since
            with context.temp_override(workspace=workspace):
                workspace.status_text_set(None)

    _timer = None


class RTGI_OT_cancel(bpy.types.Operator):
    """Stop the bake. What was baked before stays as it is"""

    bl_idname = "rtgi.cancel"
    bl_label = "Cancel Bake"
    bl_options = {"INTERNAL"}

    @classmethod
    def poll(cls, context):
        """Only while there is something to stop."""
        return session.running

    def execute(self, context):
        """Ask the worker to stop at its next step."""
        session.worker.cancel()
        redraw()
        return {"FINISHED"}


class RTGI_OT_check(bpy.types.Operator):
    """Read the scene as a bake would and list what would spoil it, without tracing a ray"""

    bl_idname = "rtgi.check"
    bl_label = "Check Scene"
    bl_options = {"REGISTER"}

    @classmethod
    def poll(cls, context):
        """As for a bake."""
        return RTGI_OT_bake.poll(context)

    def execute(self, context):
        """Fill the panel's list of findings."""
        try:
            findings = check(context)
        except BakeError as error:
            session.errors[context.scene.name] = str(error)
            self.report({"ERROR"}, sentence(str(error)))
            return {"CANCELLED"}
        session.errors.pop(context.scene.name, None)
        count = sum(finding.severity != "note" for finding in findings)
        if count:
            text = rpt_("1 thing to look at") if count == 1 else rpt_("{count} things to look at").format(count=count)
        else:
            text = rpt_("Nothing stands in the way of a bake")
        self.report({"INFO"}, text)
        redraw()
        return {"FINISHED"}


class RTGI_OT_fit_volume(bpy.types.Operator):
    """Add a Light Probe Volume that fits the scene, with evenly spaced probes"""

    bl_idname = "rtgi.fit_volume"
    bl_label = "Add Fitted Volume"
    bl_options = {"REGISTER", "UNDO"}

    @classmethod
    def poll(cls, context):
        """As for a bake."""
        return RTGI_OT_bake.poll(context)

    def execute(self, context):
        """Add the volume, select it and make it active."""
        try:
            fitted = fitted_volume(context)
        except BakeError as error:
            self.report({"ERROR"}, sentence(str(error)))
            return {"CANCELLED"}
        probe = bpy.data.lightprobes.new("Probe Volume", "VOLUME")
        probe.resolution_x, probe.resolution_y, probe.resolution_z = fitted.resolution
        volume = bpy.data.objects.new(probe.name, probe)
        volume.matrix_world = [list(row) for row in fitted.world_from_local]
        context.collection.objects.link(volume)
        for selected in context.selected_objects:
            selected.select_set(False)
        volume.select_set(True)
        context.view_layer.objects.active = volume
        nx, ny, nz = fitted.resolution
        self.report({"INFO"}, rpt_("Added {volume} with {x} × {y} × {z} = {probes:,} probes").format(
            volume=volume.name, x=nx, y=ny, z=nz, probes=nx * ny * nz))
        return {"FINISHED"}


class RTGI_OT_open_folder(bpy.types.Operator):
    """Show the folder of the last bake in the system's file browser"""

    bl_idname = "rtgi.open_folder"
    bl_label = "Open Bake Folder"
    bl_options = {"INTERNAL"}

    @classmethod
    def poll(cls, context):
        """Only where something was baked."""
        return bool(context.scene.rtgi.last_bake.folder)

    def execute(self, context):
        """Open it, if it is still there."""
        folder = Path(context.scene.rtgi.last_bake.folder)
        if not folder.is_dir():
            self.report({"ERROR"}, rpt_("{folder} is no longer there: bake again").format(folder=folder))
            return {"CANCELLED"}
        bpy.ops.wm.path_open(filepath=str(folder))
        return {"FINISHED"}


_CLASSES = (RTGI_OT_bake, RTGI_OT_cancel, RTGI_OT_check, RTGI_OT_fit_volume, RTGI_OT_open_folder)


def register() -> None:
    """Register the operators."""
    for cls in _CLASSES:
        bpy.utils.register_class(cls)


def unregister() -> None:
    """Stop a running bake, give it a moment to end, and take the operators out."""
    if session.worker is not None:
        session.worker.cancel()
        session.worker.join(_GRACE)
        session.worker = None
    for cls in reversed(_CLASSES):
        bpy.utils.unregister_class(cls)
