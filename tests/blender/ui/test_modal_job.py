"""What every operator on a worker thread does, whatever it works on; the ticks of a window are called by hand."""

from types import SimpleNamespace

import pytest

bpy = pytest.importorskip("bpy", reason="needs Blender or its Python module")

from rtgi_addon.blender.ui.modal_job import ModalJob, forget_jobs, register_job, unregister_job  # noqa: E402
from rtgi_addon.blender.worker import BakeWorker, Job  # noqa: E402
from rtgi_addon.errors import BakeError  # noqa: E402

TIMER = SimpleNamespace(type="TIMER", value="NOTHING")


class Trial(ModalJob):
    """An operator that is none of Blender's, and notes what it reports."""

    noun = "trial"

    def __init__(self, job, work):
        self.job, self.work, self.said = job, work, []

    def report(self, kind, text):
        self.said.append((*kind, text))

    def _work(self, context):
        return self.work()

    def _done(self, result):
        self.said.append(result)

    def _cancelled(self, outcome):
        return "cancelled"

    def _clean_up(self, context):
        pass


def context(scene="Scene"):
    return SimpleNamespace(scene=SimpleNamespace(name=scene))


def endless(progress):
    """Work until somebody cancels."""
    while True:
        progress.step(0.5)


def test_a_run_that_was_cancelled_ends_by_itself_and_leaves_the_next_alone():
    """The first's last tick comes when the second has already begun."""
    job = Job()
    first, second = Trial(job, lambda: endless), Trial(job, lambda: endless)
    assert first._prepared(context("Hall"))
    first._worker.start()
    first._worker.cancel()
    assert second._prepared(context("Cave")) and not first._worker.running
    second._worker.start()
    assert first.modal(None, TIMER) == {"CANCELLED"} and first.said == [("INFO", "cancelled")]
    assert job.running and job.scene == "Cave" and job.worker is second._worker
    second.cancel(None)
    assert job.worker.join(10) and job.scene == ""


def test_why_it_failed_is_known_until_the_next_attempt():
    job = Job()

    def refuse():
        raise BakeError("the lid is shut", "open it")

    def fail(progress):
        raise BakeError("the lid fell", "prop it")

    assert not Trial(job, refuse)._prepared(context()) and job.errors == {"Scene": "the lid is shut: open it"}
    assert job.worker is None and job.scene == ""
    failing = Trial(job, lambda: fail)
    assert failing._prepared(context()) and job.errors == {} and job.scene == "Scene"
    failing._worker.run()
    assert failing._finish() == {"CANCELLED"} and failing.said == [("ERROR", "the lid fell: prop it")]
    assert job.errors == {"Scene": "the lid fell: prop it"} and job.scene == ""
    working = Trial(job, lambda: lambda progress: "opened")
    assert working._prepared(context()) and job.errors == {}
    working._worker.run()
    assert working._finish() == {"FINISHED"} and working.said == ["opened"]


def test_only_a_run_that_nobody_cancelled_occupies_a_job():
    job = Job()
    job.worker = BakeWorker(endless)
    job.worker.start()
    assert job.running and job.occupied
    job.worker.cancel()
    assert not job.occupied and job.worker.join(10) and not job.running


def test_another_file_ends_the_jobs_that_are_registered_and_only_those():
    inside, outside = Job(), Job()
    for job in (inside, outside):
        job.worker, job.errors["Scene"] = BakeWorker(endless), "an error"
        job.worker.start()
    register_job(inside)
    forget_jobs()
    assert inside.worker.join(10) and not inside.errors and outside.running and outside.errors
    unregister_job(inside)
    outside.stop()
    assert outside.worker is None
