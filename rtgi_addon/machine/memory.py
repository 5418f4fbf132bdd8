"""How much memory this process has had, and how much it may still take."""

import ctypes
import os
import sys
from pathlib import Path

from .control_groups import group_bytes_left

if sys.platform != "win32":
    import resource

_PROC = Path("/proc")
# The stack of a thread where nothing limits it: what Linux and macOS give.
_STACK = 8 << 20
# glibc's mallopt(3): how many arenas malloc may open.
_M_ARENA_MAX = -8


class _Counters(ctypes.Structure):
    """PROCESS_MEMORY_COUNTERS of psapi.h."""

    _fields_ = [("cb", ctypes.c_uint32), ("PageFaultCount", ctypes.c_uint32),
                *((name, ctypes.c_size_t) for name in (
                    "PeakWorkingSetSize", "WorkingSetSize", "QuotaPeakPagedPoolUsage", "QuotaPagedPoolUsage",
                    "QuotaPeakNonPagedPoolUsage", "QuotaNonPagedPoolUsage", "PagefileUsage", "PeakPagefileUsage"))]


class _MemoryStatus(ctypes.Structure):
    """MEMORYSTATUSEX of sysinfoapi.h."""

    _fields_ = [("length", ctypes.c_uint32), ("load", ctypes.c_uint32), *((name, ctypes.c_uint64) for name in (
        "total", "available", "total_page", "available_page", "total_virtual", "available_virtual", "extended"))]


def peak_memory_bytes() -> int:
    """Peak resident memory of this process [bytes]; 0 where the system does not tell."""
    if sys.platform == "win32":
        counters = _Counters(cb=ctypes.sizeof(_Counters))
        kernel = ctypes.windll.kernel32
        kernel.GetCurrentProcess.restype = ctypes.c_void_p
        kernel.K32GetProcessMemoryInfo.argtypes = [ctypes.c_void_p, ctypes.POINTER(_Counters), ctypes.c_uint32]
        done = kernel.K32GetProcessMemoryInfo(kernel.GetCurrentProcess(), ctypes.byref(counters), counters.cb)
        return int(counters.PeakWorkingSetSize) if done else 0
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    # getrusage counts bytes on macOS and kibibytes elsewhere.
    return peak if sys.platform == "darwin" else peak * 1024


def available_bytes() -> int | None:
    """Memory [bytes] that this process may still take: what the system has free, less where a control group or a limit of the
    process itself allows less. None if unknown."""
    left = address_bytes_left()
    if left is not None:
        # Every core may get a thread of the ray tracer's and one of ours, each with a stack that counts in full.
        left = max(left - 2 * _cores() * _stack(), 1)
    known = [value for value in (_free_on_linux(), group_bytes_left(), left, _free_on_windows(), _total_by_sysconf()) if value]
    return min(known) if known else None


def address_bytes_left() -> int | None:
    """Address space [bytes] that `ulimit -v` (RLIMIT_AS) and `ulimit -d` (RLIMIT_DATA) leave this process, used or not; None
    without such a limit, and where the system does not say what is taken."""
    if sys.platform == "win32":
        return None
    limits = {"VmSize": resource.getrlimit(resource.RLIMIT_AS)[0], "VmData": resource.getrlimit(resource.RLIMIT_DATA)[0]}
    limits = {name: limit for name, limit in limits.items() if limit != resource.RLIM_INFINITY}
    if not limits:
        return None
    taken = _table(_PROC / "self/status")
    return min((max(limit - taken[name], 1) for name, limit in limits.items() if name in taken), default=None)


def threads_that_fit(wanted: int) -> int:
    """``wanted`` threads, or as many as there is address space for; at least one, which is this one. Python waits for ever for a
    thread that had no room to begin."""
    left = address_bytes_left() if wanted > 1 else None
    return wanted if left is None else max(1, min(wanted, left // (4 * _stack())))


def share_arenas() -> None:
    """Where address space is limited, let all threads allocate from one arena: each further one of glibc's takes up to 128 MiB."""
    if not sys.platform.startswith("linux") or address_bytes_left() is None:
        return
    mallopt = getattr(ctypes.CDLL(None), "mallopt", None)
    if mallopt is not None:
        mallopt(_M_ARENA_MAX, 1)


def _cores() -> int:
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def _stack() -> int:
    limit = resource.getrlimit(resource.RLIMIT_STACK)[0]
    return _STACK if limit == resource.RLIM_INFINITY else limit


def _free_on_linux() -> int | None:
    return _table(_PROC / "meminfo").get("MemAvailable")


def _table(file: Path) -> dict[str, int]:
    """The sizes [bytes] in a file of lines like `MemAvailable:  1234 kB`; empty if it cannot be read."""
    try:
        words = [line.split() for line in file.read_text().splitlines()]
        return {row[0].rstrip(":"): int(row[1]) * 1024 for row in words if len(row) == 3 and row[2] == "kB"}
    except (OSError, ValueError):
        return {}


def _total_by_sysconf() -> int | None:
    try:
        return os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES")
    except (AttributeError, ValueError, OSError):
        return None


def _free_on_windows() -> int | None:
    if not hasattr(ctypes, "windll"):
        return None
    status = _MemoryStatus(length=ctypes.sizeof(_MemoryStatus))
    if not ctypes.windll.kernel32.GlobalMemoryStatusEx(ctypes.byref(status)):
        return None
    # Windows promises no more than the paging file can take as well.
    return min(int(status.available), int(status.available_page))
