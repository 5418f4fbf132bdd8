"""How many rays a piece of work traces, whatever it is and on however many threads: one yardstick for all techniques."""

import threading
from collections.abc import Iterator
from contextlib import contextmanager

_lock = threading.Lock()
_open: list["RayCounter"] = []


class RayCounter:
    """``rays`` traced so far while this counter was open: nearest hits and shadow rays alike, each layer of foliage one more."""

    def __init__(self):
        self.rays = 0


@contextmanager
def count_rays() -> Iterator[RayCounter]:
    """Count every ray of this process for as long as it is open; counters may overlap."""
    counter = RayCounter()
    with _lock:
        _open.append(counter)
    try:
        yield counter
    finally:
        with _lock:
            _open.remove(counter)


def record(rays: int) -> None:
    """For tracers: ``rays`` are about to be traced. Called once for many rays, so that the lock costs nothing."""
    if not _open:
        return
    with _lock:
        for counter in _open:
            counter.rays += rays
