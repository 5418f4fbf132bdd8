"""An operator that works on a worker thread: the same beginning, ticks and end for every one of them, the bake's too."""

from collections.abc import Callable

import bpy

from ...errors import BakeError
from ...progress import Progress
from ..session import redraw, redraw_progress, session
from ..translations import sentence
from ..worker import BakeWorker, Job, Outcome, Report
from .progress_text import status_text

# How often the window looks after the worker [s].
_TICK = 0.1


def refuse(operator: bpy.types.Operator, error: str) -> set[str]:
    """Say why ``operator`` cannot; its result."""
    operator.report({"ERROR"}, sentence(error))
    return {"CANCELLED"}


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
    """Mixed into an operator, which says what is its own.

    ``job`` is what it has under way, ``noun`` what that is called in an error, ``_free`` is for its ``poll``. ``_work(context)``
    reads the scene and returns ``work(progress) -> result``, which touches Blender no more, or raises BakeError; ``_done(result)``
    keeps and reports the result, ``_cancelled(outcome)`` says what a cancelled run leaves.
    """

    job: Job
    noun: str
    # Those of this run: the job has another worker as soon as it is started again.
    _worker: BakeWorker | None = None
    _scene = ""
    _timer = None

    @classmethod
    def _free(cls, busy: str) -> bool:
        """Whether neither this job nor a bake is running; ``busy`` is said where one is. A run that is being cancelled is waited
        for."""
        if cls.job.occupied or (session.running and cls.job is not session):
            cls.poll_message_set(busy)
            return False
        return True

    def execute(self, context):
        """Work here and now, and return when it is done: for scripts and for Blender without a window."""
        manager = context.window_manager
        manager.progress_begin(0, 100)
        try:
            if not self._prepared(context, on_report=lambda report: manager.progress_update(100 * report.fraction)):
                return {"CANCELLED"}
            self._worker.run()
        finally:
            manager.progress_end()
        return self._finish()

    def invoke(self, context, event):
        """Work on a thread while the window stays alive."""
        if bpy.app.background:
            return self.execute(context)
        if not self._prepared(context):
            return {"CANCELLED"}
        manager = context.window_manager
        manager.progress_begin(0, 100)
        self._timer = manager.event_timer_add(_TICK, window=context.window)
        manager.modal_handler_add(self)
        self._worker.start()
        self._show(context, self._worker.report)
        redraw()
        return {"RUNNING_MODAL"}

    def modal(self, context, event):
        """Show progress at every tick; stop on Esc; leave everything else to Blender."""
        worker = self._worker
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
        self._worker.cancel()
        self.job.leave(self._worker)
        self._clean_up(context)

    def _prepared(self, context, on_report: Callable[[Report], None] | None = None) -> bool:
        """Whether the job now has a worker that can run; a reason against it was reported."""
        self._scene = context.scene.name
        self.job.errors.pop(self._scene, None)
        try:
            self.job.require_ended(self.noun)
            work = self._work(context)
        except BakeError as error:
            self._fail(str(error))
            redraw()
            return False
        self._worker = self.job.take(BakeWorker(work, on_report), self._scene)
        return True

    def _finish(self) -> set[str]:
        outcome = self._worker.outcome
        self.job.leave(self._worker)
        redraw()
        if outcome.cancelled:
            self.report({"INFO"}, self._cancelled(outcome))
            return {"CANCELLED"}
        if outcome.error:
            return self._fail(outcome.error)
        self._done(outcome.summary)
        return {"FINISHED"}

    def _fail(self, error: str) -> set[str]:
        self.job.errors[self._scene] = error
        return refuse(self, error)

    def _work(self, context) -> Callable[[Progress], object]:
        raise NotImplementedError

    def _done(self, result) -> None:
        raise NotImplementedError

    def _cancelled(self, outcome: Outcome) -> str:
        raise NotImplementedError

    def _show(self, context, report: Report) -> None:
        context.window_manager.progress_update(100 * report.fraction)
        context.workspace.status_text_set(status_text(report, self._worker.progress.cancelled))
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


_jobs: list[Job] = []


def register_job(job: Job, *classes) -> None:
    """Register the ``classes`` of a tool; ``job`` is told when another file is opened."""
    for cls in classes:
        bpy.utils.register_class(cls)
    _jobs.append(job)


def unregister_job(job: Job, *classes) -> None:
    """Stop what is running, give it a moment to end, and take everything out."""
    job.stop()
    job.forget()
    _jobs.remove(job)
    for cls in reversed(classes):
        bpy.utils.unregister_class(cls)


def forget_jobs() -> None:
    """Another file is about to be opened: stop all jobs, and drop what is known of the old one's scenes."""
    for job in _jobs:
        job.forget()
