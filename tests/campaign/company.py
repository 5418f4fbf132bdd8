"""Many trials in one process: to make a process for each takes longer than the trial. One in which the process dies or hangs is
noticed from outside and counts as a finding; the others go on in a new process.
"""

import contextlib
import multiprocessing
import os
import resource
import signal
import sys
import time
import traceback
import warnings
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path

from common import Tally

# So long may one trial take before it counts as hanging [s of wall clock], and so often is said what was found [s].
PATIENCE, SAID = 120.0, 1.0


@dataclass
class Costs:
    """What a part of a trial took: ``seconds`` of CPU time of all threads, and the peak of resident memory [bytes]."""

    seconds: float = 0.0
    peak_bytes: int = 0


@contextlib.contextmanager
def held(allowance: int) -> Iterator[Costs]:
    """Let this process take no more than ``allowance`` bytes of address space above what it has. The costs that it gives are right
    once it is left."""
    costs, started = Costs(), time.process_time()
    # From now on the peak is that of what follows.
    Path("/proc/self/clear_refs").write_text("5")
    unlimited = resource.RLIM_INFINITY
    taken = int(Path("/proc/self/statm").read_text().split()[0]) * resource.getpagesize()
    resource.setrlimit(resource.RLIMIT_AS, (taken + allowance, unlimited))
    try:
        yield costs
    finally:
        resource.setrlimit(resource.RLIMIT_AS, (unlimited, unlimited))
        status = Path("/proc/self/status").read_text()
        costs.seconds = time.process_time() - started
        costs.peak_bytes = int(status.split("VmHWM:")[1].split()[0]) * 1024


def in_company(part, numbers: Iterable[int], tally: Tally) -> None:
    """Run the trials ``numbers`` of ``part`` in a process forked for them, and in another whenever one ended with a trial."""
    numbers = list(numbers)
    while numbers:
        numbers, failed = _batch(part, numbers, tally)
        if failed is not None:
            tally.count("trials")
            tally.findings.append(failed)


def _batch(part, numbers: list[int], tally: Tally) -> tuple[list[int], tuple[int, str] | None]:
    """The trials that are yet to be run, some of them again since nothing was heard of them, and the finding about one that ended
    its process."""
    ours, theirs = multiprocessing.Pipe(duplex=False)
    at = multiprocessing.RawValue("q", -1)
    with warnings.catch_warnings():
        # The child does without the threads that numpy has.
        warnings.simplefilter("ignore", DeprecationWarning)
        child = os.fork()
    if child == 0:
        ours.close()
        _serve(part, numbers, theirs, at)
    theirs.close()
    done, since, before, why = 0, time.monotonic(), -1, ""
    while True:
        if ours.poll(SAID):
            try:
                count, found = ours.recv()
            except EOFError:
                break
            done += count
            tally.add(found)
        if at.value != before:
            before, since = at.value, time.monotonic()
        elif time.monotonic() - since > PATIENCE:
            why = f"it ran for more than {PATIENCE:g} s"
            os.kill(child, signal.SIGKILL)
    ours.close()
    code = os.waitstatus_to_exitcode(os.waitpid(child, 0)[1])
    if code == 0:
        return numbers[done:], None
    failed = at.value
    rest = [number for number in numbers[done:] if number != failed]
    return rest, (failed, why or f"the process ended with {code}")


def _serve(part, numbers, pipe, at) -> None:
    """In the child: run them, and say now and then what was found."""
    code = 3
    try:
        tally, count, said = Tally(), 0, time.monotonic()
        for number in numbers:
            at.value = number
            tally.count("trials")
            part.trial(number, tally)
            count += 1
            if time.monotonic() - said > SAID:
                pipe.send((count, tally))
                tally, count, said = Tally(), 0, time.monotonic()
        pipe.send((count, tally))
        code = 0
    except BaseException:
        traceback.print_exc()
    finally:
        sys.stderr.flush()
        os._exit(code)
