"""The campaign: kills, mutations and random command lines against what docs/shell.md promises.

    python tests/campaign/run.py                      everything in its long form
    python tests/campaign/run.py kills --count 400 --seed 7
    python tests/campaign/run.py kills --seed 7 --only 123      one trial again, as a finding says
"""

import argparse
import os
import shutil
import signal
import sys
import tempfile
import time
import traceback
from multiprocessing import get_context
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parent))

from common import Tally
from company import in_company

LONG = {"kills": 2000, "mutations": 20000, "commands": 1000}


def part_of(name: str, seed: int, place: Path):
    """The part called ``name``, whose ``trial(number, tally)`` is to be run."""
    if name == "kills":
        from killing import Killing
        return Killing(seed, place)
    if name == "mutations":
        from mutating import Mutating
        return Mutating(seed, place)
    from commanding import Commanding
    return Commanding(seed, place)


def run(name: str, numbers, seed: int, place: Path, enough=None) -> Tally:
    """Run the trials ``numbers`` of a part one after the other, until ``enough(tally)``. Whoever ends the process early gets what
    was found so far."""
    tally, started = Tally(), time.monotonic()
    before = signal.signal(signal.SIGTERM, signal.default_int_handler)
    try:
        part = part_of(name, seed, place)
        if name == "mutations":
            in_company(part, numbers, tally)
            numbers = ()
        for number in numbers:
            if enough is not None and enough(tally):
                break
            tally.count("trials")
            part.trial(number, tally)
    except KeyboardInterrupt:
        tally.findings.append((0, f"interrupted after {time.monotonic() - started:.0f} s"))
    finally:
        # A pool ends its processes by SIGTERM: raised in one that holds the pool's lock, it left the pool waiting for ever.
        signal.signal(signal.SIGTERM, before)
    tally.seconds = time.monotonic() - started
    return tally


def _share(arguments) -> Tally:
    name, seed, first, step, count, place = arguments
    place = Path(place) / f"share-{first}"
    place.mkdir()

    def enough(tally: Tally) -> bool:
        return tally.counts.get(name, 0) >= -(-count // step)

    # A trial has one mutation or command line, and any number of kills.
    last = 100 * count if name == "kills" else count
    try:
        return run(name, range(first, last, step), seed, place, enough=enough)
    except Exception:
        # Raised here, it would have the pool end the other processes, which take that for a wish to stop and wait for more work.
        failed = Tally()
        failed.findings.append((first, f"the campaign itself failed:\n{traceback.format_exc()}"))
        return failed
    finally:
        shutil.rmtree(place, ignore_errors=True)


def campaign(name: str, count: int, seed: int, jobs: int) -> Tally:
    """``count`` kills, mutations or command lines, in so many processes."""
    total = Tally()
    with tempfile.TemporaryDirectory(prefix="campaign", dir=_memory()) as place:
        work = [(name, seed, first, jobs, count, place) for first in range(jobs)]
        if jobs == 1:
            total.add(_share(work[0]))
        else:
            with get_context("fork").Pool(jobs) as pool:
                for tally in pool.imap_unordered(_share, work):
                    total.add(tally)
                pool.close()
                pool.join()
    return total


def _memory() -> str | None:
    """A place in memory where there is one: a kill loses nothing that the system holds, so nothing needs to wait for a disk."""
    return "/dev/shm" if os.access("/dev/shm", os.W_OK) else None


def report(name: str, tally: Tally, seed: int) -> str:
    """What was tried and found, and how to see each finding again."""
    lines = [f"{name}: " + ", ".join(f"{count:,} {what}" for what, count in sorted(tally.counts.items())),
             f"  {tally.seconds:.0f} s of work, {tally.slowest:.1f} s and {tally.largest / 2**20:.0f} MiB at most"]
    lines += [f"  FOUND {what}\n    python tests/campaign/run.py {name} --seed {seed} --only {number}"
              for number, what in sorted(tally.findings)]
    return "\n".join(lines)


def main(argv: list[str]) -> int:
    """The exit code: 1 if anything was found."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("parts", nargs="*", choices=[[], *LONG], metavar="PART", help="kills, mutations, commands; default: all")
    parser.add_argument("--count", type=int, help="how many of each (default: " + ", ".join(f"{n:,} {k}" for k, n in LONG.items())
                                                  + ")")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--only", type=int, metavar="NUMBER", help="this trial alone")
    parser.add_argument("--jobs", type=int, default=os.cpu_count(), help="processes (default: one a core)")
    options = parser.parse_args(argv)
    found = False
    for name in options.parts or LONG:
        if options.only is not None:
            with tempfile.TemporaryDirectory(prefix="campaign", dir=_memory()) as place:
                tally = run(name, [options.only], options.seed, Path(place))
        else:
            tally = campaign(name, options.count or LONG[name], options.seed, options.jobs)
        print(report(name, tally, options.seed), flush=True)
        found = found or bool(tally.findings)
    return int(found)


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
