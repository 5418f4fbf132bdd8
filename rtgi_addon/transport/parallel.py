"""Threads over chunks: numpy and embreex release the GIL, so plain threads use every core."""

import os
from concurrent.futures import ThreadPoolExecutor

from ..machine.memory import threads_that_fit
from ..progress import Progress

# Rays per unit of work: large enough to hide Python's overhead, small enough that a chunk's temporaries stay in cache.
CHUNK = 1 << 16


def thread_count(threads: int | None = None) -> int:
    """``threads``, or as many as this process may use."""
    if threads:
        return max(1, int(threads))
    if hasattr(os, "sched_getaffinity"):
        return max(1, len(os.sched_getaffinity(0)))
    return max(1, os.cpu_count() or 1)


def parallel_for(work, count: int, threads: int | None = None, progress: Progress | None = None, label: str = "") -> list:
    """Call ``work(i)`` for i in 0…count−1 on several threads; return the results in order.

    The result must depend on ``i`` alone, which makes it the same for any number of threads. The first exception of a worker
    is raised here, after the others have stopped; cancelling through ``progress`` raises ``Cancelled``. A thread for which there is
    no memory is one thread less.
    """
    results = [None] * count
    threads = threads_that_fit(min(thread_count(threads), count))
    if threads <= 1:
        for i in range(count):
            if progress is not None:
                progress.step(i / count, label)
            results[i] = work(i)
        return results
    with ThreadPoolExecutor(threads) as pool:
        futures = [pool.submit(work, i) for i in range(count)]
        try:
            for i, future in enumerate(futures):
                if progress is not None:
                    progress.step(i / count, label)
                results[i] = future.result()
        except BaseException:
            for future in futures:
                future.cancel()
            raise
    return results


def chunks(count: int, size: int = CHUNK) -> list[slice]:
    """Slices of at most ``size`` that cover ``range(count)``."""
    return [slice(start, min(start + size, count)) for start in range(0, count, size)]
