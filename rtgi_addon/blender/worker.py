"""A bake on a worker thread, watched from Blender's main thread, and what of it must run there. Nothing here touches Blender."""

import queue
import sys
import threading
import time
import traceback
from collections.abc import Callable
from concurrent.futures import Future, wait
from dataclasses import dataclass, field

from ..errors import BakeError, Cancelled, out_of_memory
from ..progress import Progress
from ..words import printable

# How long a bake waits for the main thread before it looks whether it was cancelled [s].
_PATIENCE = 0.05
# How long the main thread serves a bake at a time, and how long it waits for the next call [s]: the window stays alive.
_SERVICE, _FOLLOW_UP = 0.08, 0.02
# What a cancelled run is given to end [s].
_GRACE = 5.0


@dataclass(frozen=True)
class Report:
    """Where the bake stands: ``fraction`` 0 to 1, what it does, and the seconds left (None while unknown)."""

    fraction: float = 0.0
    label: str = ""
    seconds_left: float | None = None


@dataclass(frozen=True)
class Outcome:
    """How a bake ended: ``summary`` of the finished bundle, or ``error`` as one line, or neither when it was cancelled; ``kept``
    then says what of it is left, if anything."""

    summary: dict | None = None
    error: str = ""
    kept: str = ""

    @property
    def cancelled(self) -> bool:
        """True if the user stopped it."""
        return self.summary is None and not self.error


class MainThreadCalls:
    """Runs on the main thread what a bake asks for from its own: Blender's GPU works nowhere else."""

    def __init__(self):
        self._calls: queue.SimpleQueue[tuple[Future, Callable]] = queue.SimpleQueue()

    def call(self, progress: Progress, function: Callable, /, *arguments, **options):
        """``function``'s result, or its exception, from the main thread, which must ``serve``. Raises Cancelled once the user asks
        ``progress`` to stop, served or not."""
        if threading.current_thread() is threading.main_thread():
            return function(*arguments, **options)
        progress.check()
        future: Future = Future()
        self._calls.put((future, lambda: function(*arguments, **options)))
        while not wait([future], timeout=_PATIENCE).done:
            if progress.cancelled:
                future.cancel()
                progress.check()
        return future.result()

    def serve(self) -> None:
        """Run what waits, and what follows on its heels, for a moment: a bake asks again as soon as it is answered. For the main
        thread."""
        if self._calls.empty():
            return
        end = time.monotonic() + _SERVICE
        while (left := end - time.monotonic()) > 0:
            try:
                future, function = self._calls.get(timeout=min(left, _FOLLOW_UP))
            except queue.Empty:
                return
            if not future.set_running_or_notify_cancel():
                continue
            try:
                future.set_result(function())
            except BaseException as error:  # it belongs to who asked
                future.set_exception(error)


main_thread = MainThreadCalls()


class KernelsOnMainThread:
    """Kernels (techniques/kernels.py) whose every call runs through ``main_thread``."""

    def __init__(self, kernels, progress: Progress):
        self._kernels, self._progress = kernels, progress

    def __getattr__(self, name: str) -> Callable:
        kernel = getattr(self._kernels, name)
        return lambda *arguments, **options: main_thread.call(self._progress, kernel, *arguments, **options)


class BakeWorker:
    """Runs ``bake(progress) -> summary`` in this thread (``run``) or in one of its own (``start``, then ``poll``)."""

    def __init__(self, bake: Callable[[Progress], dict], on_report: Callable[[Report], None] | None = None):
        self._bake = bake
        self._on_report = on_report
        self._reports: queue.SimpleQueue[Report] = queue.SimpleQueue()
        self._thread: threading.Thread | None = None
        self.progress = Progress(self._put)
        self.report = Report()
        self.outcome: Outcome | None = None

    def run(self) -> Outcome:
        """Bake here and now; exceptions become an ``Outcome``."""
        try:
            self.outcome = Outcome(summary=self._bake(self.progress))
        except Cancelled as cancelled:
            self.outcome = Outcome(kept=str(cancelled))
        except BakeError as error:
            self.outcome = Outcome(error=str(error))
        except Exception as error:
            memory = out_of_memory(error)
            if memory is not None:
                self.outcome = Outcome(error=str(memory))
                return self.outcome
            sys.stderr.write(printable(traceback.format_exc()))
            first_line = (str(error).splitlines() or [""])[0]
            self.outcome = Outcome(error=f"the bake failed with {type(error).__name__}: {first_line} (details in the console)")
        return self.outcome

    def start(self) -> None:
        """Bake on a thread of its own. A daemon, so that quitting Blender never waits for rays."""
        self._thread = threading.Thread(target=self.run, name="rtgi bake", daemon=True)
        self._thread.start()

    def poll(self) -> bool:
        """Do what the thread needs the main thread for, and take in what it has reported since; True while it is at work. For the
        main thread."""
        main_thread.serve()
        running = self.running
        while not self._reports.empty():
            self.report = self._reports.get()
        return running

    @property
    def running(self) -> bool:
        """True while the thread is at work."""
        return self._thread is not None and self._thread.is_alive()

    def cancel(self) -> None:
        """Ask the bake to stop at its next step."""
        self.progress.cancel()

    def join(self, timeout: float) -> bool:
        """Wait up to ``timeout`` seconds for the thread; True once it has ended."""
        if self._thread is not None:
            self._thread.join(timeout)
        return not self.running

    def _put(self, fraction: float, label: str, seconds_left: float | None) -> None:
        report = Report(fraction, label, seconds_left)
        if self._on_report is None:
            self._reports.put(report)
        else:
            self._on_report(report)


@dataclass(eq=False)
class Job:
    """What one operator has under way: its latest ``worker``, which may have ended, None before the first; ``scene``, the name of
    the one it works for while it does; ``errors``, why the last attempt failed, by scene name."""

    worker: BakeWorker | None = None
    scene: str = ""
    errors: dict[str, str] = field(default_factory=dict)

    @property
    def running(self) -> bool:
        """True while the worker works."""
        return self.worker is not None and self.worker.running

    @property
    def occupied(self) -> bool:
        """True while the worker works and nobody has asked it to stop."""
        return self.running and not self.worker.progress.cancelled

    def take(self, worker: BakeWorker, scene: str) -> BakeWorker:
        """``worker`` is what is under way now, for ``scene``; returns it."""
        self.worker, self.scene = worker, scene
        return worker

    def leave(self, worker: BakeWorker) -> None:
        """``worker`` has ended, or nobody waits for it; without effect where another one has taken its place."""
        if worker is self.worker:
            self.scene = ""

    def require_ended(self, noun: str) -> None:
        """Raise BakeError while a cancelled run, called ``noun``, has not come to its end."""
        if self.worker is not None and not self.worker.join(_GRACE):
            raise BakeError(f"the {noun} that was cancelled is still ending", "try again in a moment")

    def stop(self) -> None:
        """Cancel what is running and give it a moment to end."""
        if self.worker is not None:
            self.worker.cancel()
            self.worker.join(_GRACE)
            self.worker = None

    def forget(self) -> None:
        """Another file is about to be opened: cancel what is running, and drop what belongs to the old one's scenes."""
        if self.worker is not None:
            self.worker.cancel()
        self.scene = ""
        self.errors.clear()


def duration(seconds: float) -> str:
    """``seconds`` as a person reads it: 8 s, 2 min 05 s, 1 h 10 min."""
    whole = max(round(seconds), 0)
    minutes, seconds = divmod(whole, 60)
    hours, minutes_of_hour = divmod(minutes, 60)
    if hours:
        return f"{hours} h {minutes_of_hour:02d} min"
    return f"{minutes} min {seconds:02d} s" if minutes else f"{whole} s"
