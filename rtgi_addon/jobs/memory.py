"""The most memory this process has held, on every platform."""

import ctypes
import sys

if sys.platform == "win32":
    class _Counters(ctypes.Structure):
        """PROCESS_MEMORY_COUNTERS of psapi.h."""

        _fields_ = [("cb", ctypes.c_uint32), ("PageFaultCount", ctypes.c_uint32),
                    *((name, ctypes.c_size_t) for name in (
                        "PeakWorkingSetSize", "WorkingSetSize", "QuotaPeakPagedPoolUsage", "QuotaPagedPoolUsage",
                        "QuotaPeakNonPagedPoolUsage", "QuotaNonPagedPoolUsage", "PagefileUsage", "PeakPagefileUsage"))]

    def peak_memory_bytes() -> int:
        """Peak resident memory of this process [bytes]; 0 where the system does not tell."""
        counters = _Counters(cb=ctypes.sizeof(_Counters))
        kernel = ctypes.windll.kernel32
        kernel.GetCurrentProcess.restype = ctypes.c_void_p
        kernel.K32GetProcessMemoryInfo.argtypes = [ctypes.c_void_p, ctypes.POINTER(_Counters), ctypes.c_uint32]
        done = kernel.K32GetProcessMemoryInfo(kernel.GetCurrentProcess(), ctypes.byref(counters), counters.cb)
        return int(counters.PeakWorkingSetSize) if done else 0
else:
    import resource

    def peak_memory_bytes() -> int:
        """Peak resident memory of this process [bytes]."""
        peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
        # getrusage counts bytes on macOS and kibibytes elsewhere.
        return peak if sys.platform == "darwin" else peak * 1024
