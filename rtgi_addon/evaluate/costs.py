"""What a piece of work costs: wall-clock seconds, seconds of all threads together, rays, and memory.

Memory is by how much the process grew at its peak, arrays and ray tracer alike, above what it held before. Linux keeps the peak
and lets it be reset (`/proc/self/clear_refs`, proc(5)), so nothing is missed; elsewhere resident memory is sampled, which misses
what lives shorter than ``INTERVAL``.
"""

import ctypes
import gc
import os
import subprocess
import sys
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path

from ..transport.rays.ray_counter import count_rays

# Seconds between two samples of resident memory.
INTERVAL = 0.02
_PROC = Path("/proc/self")


@dataclass
class Costs:
    """``seconds`` of wall clock, ``cpu_seconds`` of all threads, ``rays``, and ``peak_bytes`` above the start (None: unknown)."""

    seconds: float = 0.0
    cpu_seconds: float = 0.0
    rays: int = 0
    peak_bytes: int | None = None


@contextmanager
def metered() -> Iterator[Costs]:
    """The costs of what happens within it, filled in at its end."""
    costs = Costs()
    with _peak_memory(costs), count_rays() as counter:
        wall, cpu = time.perf_counter(), time.process_time()
        yield costs
        costs.seconds, costs.cpu_seconds = time.perf_counter() - wall, time.process_time() - cpu
    costs.rays = counter.rays


@contextmanager
def _peak_memory(costs: Costs) -> Iterator[None]:
    _release_freed()
    before = resident_bytes()
    if _reset_peak():
        yield
        costs.peak_bytes = max(_status("VmHWM") - before, 0)
        return
    highest, done = [before or 0], threading.Event()

    def sample():
        while not done.wait(INTERVAL):
            highest[0] = max(highest[0], resident_bytes() or 0)

    sampler = threading.Thread(target=sample, name="rtgi memory", daemon=True)
    if before is not None:
        sampler.start()
    try:
        yield
    finally:
        done.set()
    if before is not None:
        sampler.join()
        costs.peak_bytes = max(highest[0], resident_bytes()) - before


def resident_bytes() -> int | None:
    """Memory that this process holds at the moment [bytes]; None where the system does not tell."""
    if (_PROC / "status").exists():
        return _status("VmRSS")
    if sys.platform == "win32":
        return _working_set()
    try:
        told = subprocess.run(["ps", "-o", "rss=", "-p", str(os.getpid())], capture_output=True, text=True, check=True)
        return int(told.stdout) * 1024
    except (OSError, ValueError, subprocess.SubprocessError):
        return None


def _status(name: str) -> int:
    """A field of /proc/self/status [bytes]."""
    for line in (_PROC / "status").read_text().splitlines():
        if line.startswith(name + ":"):
            return int(line.split()[1]) * 1024
    return 0


def _reset_peak() -> bool:
    """Set the peak of resident memory back to what is held now; False where that cannot be done."""
    try:
        (_PROC / "clear_refs").write_text("5")
    except OSError:
        return False
    return True


def _release_freed() -> None:
    """Give freed memory back to the system, or the next piece of work would grow into it unseen (malloc_trim(3), glibc only)."""
    gc.collect()
    if sys.platform == "linux":
        with suppress(OSError, AttributeError):
            ctypes.CDLL(None).malloc_trim(0)


def _working_set() -> int | None:
    """WorkingSetSize of PROCESS_MEMORY_COUNTERS (psapi.h)."""
    words = (ctypes.c_size_t * 10)()
    kernel = ctypes.windll.kernel32
    kernel.GetCurrentProcess.restype = ctypes.c_void_p
    kernel.K32GetProcessMemoryInfo.argtypes = [ctypes.c_void_p, ctypes.c_void_p, ctypes.c_uint32]
    # cb and PageFaultCount are two 32-bit words in front of the sizes: one size_t on every 64-bit system.
    done = kernel.K32GetProcessMemoryInfo(kernel.GetCurrentProcess(), ctypes.byref(words), 72)
    return int(words[2]) if done else None
