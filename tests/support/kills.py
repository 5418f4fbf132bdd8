"""Killing a function at its n-th operation on files or after some time, in a process forked for it: nothing is cleaned up, as after
`kill -9`. And disks that refuse an operation.
"""

import builtins
import contextlib
import os
import pickle
import signal
import sys
import tempfile
import threading
import time
import traceback
import warnings
from pathlib import Path
from typing import NamedTuple

import pytest

needs_fork = pytest.mark.skipif(not hasattr(os, "fork"), reason="this system cannot fork")

# What changes a disk, by its audit event (Python's own list); an `open` only if it is for writing.
EVENTS = {"os.rename", "os.remove", "os.mkdir", "os.rmdir", "os.chmod", "os.truncate", "os.link", "os.symlink"}
_WRITES = os.O_WRONLY | os.O_RDWR | os.O_CREAT | os.O_TRUNC


class Ended(NamedTuple):
    """How a process ended: its operations on files (None if it was killed), result or exception, CPU seconds of all its threads
    (what the machine does beside it does not count), peak memory [bytes]."""

    operations: int | None
    outcome: object
    seconds: float
    peak_bytes: int

    @property
    def killed(self) -> bool:
        """True unless it came to its own end."""
        return self.operations is None


class _HalfWriter:
    """A file that takes what is written to it in two halves, with an operation to be killed at in between."""

    def __init__(self, file, operation):
        self._file, self._operation = file, operation

    def write(self, data):
        half = len(data) // 2
        written = self._file.write(data[:half])
        self._file.flush()
        self._operation()
        return written + self._file.write(data[half:])

    def __getattr__(self, name):
        return getattr(self._file, name)

    def __enter__(self):
        self._file.__enter__()
        return self

    def __exit__(self, *how):
        return self._file.__exit__(*how)


def run_killed(function, at: int | None, root, kill_signal=signal.SIGKILL):
    """Call ``function()`` in a process of its own that gets ``kill_signal`` before its operation ``at`` (from 1; None: never) on
    a file below ``root``: (how many operations there were, or None if it was killed; its result or exception)."""
    ended = run_apart(function, root, at=at, kill_signal=kill_signal)
    return ended.operations, ended.outcome


def run_apart(function, root, *, at: int | None = None, after: float | None = None, limit: float = 120.0,
              kill_signal=signal.SIGKILL) -> Ended:
    """As ``run_killed``, also ``after`` so many seconds. A process that runs longer than ``limit`` is ended, and counts as one that
    raised TimeoutError."""
    root = os.fspath(root)
    with tempfile.NamedTemporaryFile(delete=False) as answer:
        pass
    started = time.monotonic()
    with warnings.catch_warnings():
        # The child does without the threads that numpy and Blender have.
        warnings.simplefilter("ignore", DeprecationWarning)
        child = os.fork()
    if child == 0:
        _child(function, at, root, kill_signal, answer.name)
    ended = threading.Event()
    watch = threading.Thread(target=_watch, args=(child, ended, after, limit))
    watch.start()
    # Its number stays its own until the watch is over.
    os.waitid(os.P_PID, child, os.WEXITED | os.WNOWAIT)
    seconds = time.monotonic() - started
    ended.set()
    watch.join()
    _, status, usage = os.wait4(child, 0)
    late, seconds = seconds >= limit, usage.ru_utime + usage.ru_stime
    data = Path(answer.name).read_bytes()
    os.unlink(answer.name)
    peak = usage.ru_maxrss * (1 if sys.platform == "darwin" else 1024)
    if os.WIFSIGNALED(status):
        wanted = {kill_signal, *([signal.SIGKILL] if after is not None or late else [])}
        assert os.WTERMSIG(status) in wanted, f"died of signal {os.WTERMSIG(status)}"
        return Ended(None, TimeoutError(f"it ran for more than {limit:g} s") if late else None, seconds, peak)
    assert data, f"the process ended with {os.waitstatus_to_exitcode(status)}"
    return Ended(*pickle.loads(data), seconds, peak)


def _watch(child: int, ended: threading.Event, after: float | None, limit: float) -> None:
    if not ended.wait(limit if after is None else min(after, limit)):
        with contextlib.suppress(ProcessLookupError):
            os.kill(child, signal.SIGKILL)


def _child(function, at, root, kill_signal, answer):
    count = 0

    def operation():
        nonlocal count
        count += 1
        if count == at:
            os.kill(os.getpid(), kill_signal)

    def below(path) -> bool:
        return isinstance(path, (str, bytes, os.PathLike)) and os.fsdecode(path).startswith(root)

    def hook(event, arguments):
        if event == "open":
            path, _, flags = arguments
            if below(path) and flags & _WRITES:
                operation()
        elif event in EVENTS and any(below(argument) for argument in arguments):
            operation()

    real = builtins.open

    def open_in_halves(file, mode="r", *rest, **options):
        stream = real(file, mode, *rest, **options)
        return _HalfWriter(stream, operation) if below(file) and set(mode) & set("wax+") else stream

    try:
        sys.addaudithook(hook)
        builtins.open = open_in_halves
        try:
            outcome = function()
        except Exception as error:
            outcome = error
        builtins.open = real
        try:
            data = pickle.dumps((count, outcome))
        except Exception:
            data = pickle.dumps((count, None if not isinstance(outcome, Exception) else RuntimeError(repr(outcome))))
        with real(answer, "wb") as file:
            file.write(data)
    except BaseException:
        traceback.print_exc()
        os._exit(3)
    os._exit(0)


@contextlib.contextmanager
def refusing(at: int, root, error: OSError):
    """A disk that refuses operation number ``at`` (from 1) on a file below ``root``; if that is one of writing, all after it too,
    as a full one does. The list that it gives holds the names of the operations so far."""
    root, names = os.fspath(root), []

    def below(arguments) -> bool:
        return any(isinstance(path, (str, os.PathLike)) and os.fspath(path).startswith(root) for path in arguments)

    def operation(name):
        names.append(name)
        if len(names) == at or (len(names) > at and name == names[at - 1] == "write"):
            raise error

    def watched(name, real):
        def call(*arguments, **options):
            if name == "fsync" or below(arguments):
                operation(name)
            return real(*arguments, **options)

        return call

    real_open = builtins.open

    def watched_open(file, mode="r", *rest, **options):
        writes = below([file]) and set(mode) & set("wax+")
        if writes:
            operation("open")
        stream = real_open(file, mode, *rest, **options)
        return _HalfWriter(stream, lambda: operation("write")) if writes else stream

    reals = {name: getattr(os, name) for name in ("rename", "replace", "mkdir", "rmdir", "unlink", "fsync")}
    try:
        builtins.open = watched_open
        for name, real in reals.items():
            setattr(os, name, watched(name, real))
        yield names
    finally:
        builtins.open = real_open
        for name, real in reals.items():
            setattr(os, name, real)
