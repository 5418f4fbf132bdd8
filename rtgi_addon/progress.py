"""One callback that is both progress and cancel (as in Godot's lightmapper bake step)."""

import threading
import time
from collections import deque

from .errors import Cancelled

# The latest part of the work that says how long the rest will take: this share of the time so far, and so many seconds at least.
_LATEST, _LATEST_SECONDS = 0.4, 3.0


class Progress:
    """Counts work from 0 to 1 and carries the wish to stop from the user to the worker.

    The worker calls ``step``; whoever shows progress passes ``report(fraction, label, seconds_left)``, which is called from
    the worker's thread at most every ``interval`` seconds and once at the end of each stage. ``cancel`` may be called from
    any thread; the next ``step`` then raises ``Cancelled``.
    """

    def __init__(self, report=None, interval: float = 0.1):
        self._report = report
        self._interval = interval
        self._cancelled = threading.Event()
        self._started = time.monotonic()
        self._last = self._furthest = 0.0
        self._paces: deque[tuple[float, float]] = deque([(self._started, 0.0)])
        self._span = (0.0, 1.0)
        self._parent = None
        self.stage_seconds: dict[str, float] = {}
        self._stage = None
        self._stage_started = self._started

    def cancel(self) -> None:
        """Ask the worker to stop at its next ``step``."""
        self._root()._cancelled.set()

    @property
    def cancelled(self) -> bool:
        """True once ``cancel`` was called."""
        return self._root()._cancelled.is_set()

    def check(self) -> None:
        """Raise ``Cancelled`` if the user asked to stop; reports nothing. Safe from any thread."""
        if self.cancelled:
            raise Cancelled()

    def stage(self, name: str) -> None:
        """Begin a named stage: its wall-clock seconds are added up in ``stage_seconds`` (the bundle's statistics)."""
        root = self._root()
        now = time.monotonic()
        if root._stage is not None:
            root.stage_seconds[root._stage] = root.stage_seconds.get(root._stage, 0.0) + now - root._stage_started
        root._stage, root._stage_started = name, now

    def finish(self) -> dict[str, float]:
        """Close the running stage and return the seconds of every stage."""
        self.stage(None)
        return dict(self._root().stage_seconds)

    def step(self, fraction: float, label: str = "") -> None:
        """Say that ``fraction`` (0 to 1) of this span is done. Raises ``Cancelled`` if the user asked to stop."""
        self.check()
        low, high = self._span
        overall = low + (high - low) * min(max(fraction, 0.0), 1.0)
        if self._parent is not None:
            self._parent.step(overall, label)
            return
        # Work whose extent is only guessed may be found to be more; a bar that runs backwards tells nobody anything.
        overall = self._furthest = max(overall, self._furthest)
        now = time.monotonic()
        if self._report is None or (now - self._last < self._interval and fraction < 1.0):
            return
        self._last = now
        self._report(overall, label, self._seconds_left(overall, now))

    def _seconds_left(self, overall: float, now: float) -> float | None:
        """By the pace of the latest part of the work, which says more of the rest than its beginning; None while there is none."""
        self._paces.append((now, overall))
        elapsed = now - self._started
        while len(self._paces) > 2 and self._paces[1][0] <= now - max(_LATEST_SECONDS, _LATEST * elapsed):
            self._paces.popleft()
        if overall <= 0.01:
            return None
        then, fraction = self._paces[0]
        if overall > fraction and now > then:
            # Half by the whole so far: a short stage at another pace must not make the time left jump.
            recent = (now - then) / (overall - fraction)
            return (1.0 - overall) * 0.5 * (recent + elapsed / overall)
        return elapsed * (1.0 - overall) / overall

    def span(self, low: float, high: float) -> "Progress":
        """A child whose 0 to 1 covers ``low`` to ``high`` of this one; cancel and stages are shared."""
        child = Progress()
        child._parent, child._span = self, (low, high)
        return child

    def apart(self) -> "Progress":
        """A child over all of this one with stages of its own; cancel is shared."""
        child = Progress(lambda fraction, label, _left: self.step(fraction, label), interval=0.0)
        child._cancelled = self._root()._cancelled
        return child

    def _root(self) -> "Progress":
        return self if self._parent is None else self._parent._root()
