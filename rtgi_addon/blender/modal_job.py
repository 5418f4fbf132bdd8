"""An operator that measures on a worker thread: the same beginning, ticks and end for every one of them."""

import bpy

from ..errors import BakeError
from .progress_text import status_text
from .session import redraw, redraw_progress
from .worker import BakeWorker, Report

_TICK = 0.1
# What a cancelled run is given to end [s].
GRACE = 5.0


class Job:
    """What one operator has under way: its ``worker``, None before the first run."""

    def __init__(self):
        self.worker: BakeWorker | None = None

    @property
    def running(self) -> bool:
        """True while the worker works."""
        return self.worker is not None and self.worker.running

    def stop(self) -> None:
        """Cancel what is running and give it a moment to end."""
        if self.worker is not None:
            self.worker.cancel()
            self.worker.join(GRACE)
            self.worker = None


class CancelJob:
    """Mixed into an operator that stops ``job``."""

    job: Job
    bl_options = {"INTERNAL"}

    @classmethod
    def poll(cls, context):
        """Only while there is something to stop."""
        return cls.job.running

    def execute(self, context):
        """Ask the worker to stop at its next step."""
        self.job.worker.cancel()
        redraw()
        return {"FINISHED"}


class ModalJob:
    """Mixed into an operator. ``job`` holds the ``worker`` under way; ``_prepared(context, on_report)`` sets it, or reports why
    not and returns something false; ``_finish()`` says what came out and returns the operator's result."""

    job = None
    _timer = None

    def execute(self, context):
        """Work here and now: for scripts and for Blender without a window."""
        if not self._prepared(context, on_report=lambda report: None):
            return {"CANCELLED"}
        self.job.worker.run()
        return self._finish()

    def invoke(self, context, event):
        """Work on a thread while the window stays alive."""
        if bpy.app.background:
            return self.execute(context)
        if not self._prepared(context):
            return {"CANCELLED"}
        self._timer = context.window_manager.event_timer_add(_TICK, window=context.window)
        context.window_manager.modal_handler_add(self)
        self.job.worker.start()
        redraw()
        return {"RUNNING_MODAL"}

    def modal(self, context, event):
        """Show progress at every tick; stop on Esc; leave everything else to Blender."""
        worker = self.job.worker
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
        if self.job.worker is not None:
            self.job.worker.cancel()
        self._clean_up(context)

    def _require_ended(self, what: str) -> None:
        """Raise BakeError while a cancelled run of ``what`` has not come to its end."""
        if self.job.worker is not None and not self.job.worker.join(GRACE):
            raise BakeError(f"the {what} that was cancelled is still ending", "try again in a moment")

    def _show(self, context, report: Report) -> None:
        context.workspace.status_text_set(status_text(report, self.job.worker.progress.cancelled))
        redraw_progress()

    def _clean_up(self, context) -> None:
        if self._timer is not None:
            context.window_manager.event_timer_remove(self._timer)
            self._timer = None
        for workspace in bpy.data.workspaces:  # the user may have gone to another since
            with context.temp_override(workspace=workspace):
                workspace.status_text_set(None)
