"""The parts of a prepared bake on a cluster of Dask's `distributed`, and their bundle.

The cluster's own scheduler does the distributing: it hands parts to whoever is free, gives those of a worker that died to another,
and takes workers in as they come. What is added here: that all machines see the same prepared bake and the same versions, that
parts which stand already are kept, that a wish to stop reaches the workers, and that a part which one slow worker holds at the end
is begun once more by one that has nothing to do. All machines must reach the folders under the same paths.
"""

import os
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import numpy as np

from ..errors import BakeError, Cancelled
from ..exchange.array_folder import ours, read_folder
from ..exchange.bundle import check_target
from ..exchange.prepared import PART, PREPARED, is_prepared, kernels_here, read_prepared, versions
from ..progress import Progress
from ..storage.inventory import remove_ours
from ..storage.reading import sha256_of_file
from ..storage.workplace import workplace
from ..transport.parallel import thread_count
from ..transport.rays.choose import slow_rays_warning
from .prepared_bake import Ready, bake_prepared, merge_parts
from .report import BakeSummary

# A part that takes this many times as long as parts usually do is begun a second time where somebody is idle.
SLOW = 3.0
# How often a part is given to another worker after its own died, or failed for want of memory or disk.
RETRIES = 2
_POLL, _CONNECT = 0.5, 20.0
_INSTALL = "install it on every machine (pip install 'rtgi[farm]')"
# How far a farm is when all parts stand.
_MADE = 0.95


def farm_bake(prepared, scheduler: str, parts: int, out, *, progress: Progress | None = None) -> BakeSummary:
    """Bake ``prepared`` in ``parts`` parts on the cluster whose scheduler is at ``scheduler`` (tcp://HOST:PORT), into the bundle
    ``out``: the very bytes that ``bake_prepared`` gives.

    Parts go to `OUT.parts`, are kept for the next call where this one is stopped, and removed once the bundle stands. Raises
    BakeError for a cluster that is not there or cannot do it, naming the worker, and for what a part raises; Cancelled.
    """
    distributed = _distributed()
    progress = progress or Progress()
    target = check_target(out, inputs=(str(prepared),))
    progress.stage("read")
    progress.step(0.0, "Reading what was prepared")
    folder = read_prepared(prepared)
    prepared, parts = Path(prepared).resolve(), min(parts, folder.document["blocks"])
    places = {number: Path(f"{target}.parts") / f"{number}-of-{parts}" for number in range(1, parts + 1)}
    # Whoever bakes to the same bundle is told before the cluster is.
    with workplace(target, "farm"):
        pass
    progress.stage("parts")
    done = {number: place for number, place in places.items() if _stands(place, folder.digest, number, parts)}
    if len(done) < parts:
        with _client(distributed, scheduler) as client:
            _require_alike(client, prepared)
            run = _Run(distributed, client, prepared, folder.digest, places)
            try:
                run.until_done(done, progress.span(0.0, _MADE))
            finally:
                run.stop()
    summary = merge_parts([done[number] for number in sorted(done)], target, progress=progress.span(_MADE, 1.0))
    for place in done.values():
        _remove(place)
    _remove_empty(Path(f"{target}.parts"))
    return summary


class _Run:
    """The parts that are still to be made at ``places`` (number → folder), and the futures of those at work."""

    def __init__(self, distributed, client, prepared: Path, digest: str, places: dict[int, Path]):
        self._distributed, self._client, self._prepared = distributed, client, prepared
        self._places = places
        self._stop = distributed.Event(f"rtgi-stop-{digest[:16]}-{os.getpid()}-{time.time_ns()}", client=client)
        self._stop.clear()
        self._futures: dict = {}
        self._begun: dict[int, float] = {}
        self._again: set[int] = set()

    def until_done(self, done: dict[int, Path], progress: Progress) -> None:
        """Fill ``done`` (number → folder) until every part stands."""
        for number in self._places:
            if number not in done:
                self._submit(number, self._places[number])
        took: list[float] = []
        while len(done) < len(self._places):
            progress.step(len(done) / len(self._places),
                          f"{len(done):,} of {len(self._places):,} parts, {len(self._client.nthreads())} workers")
            for future in [future for future in self._futures if future.done()]:
                number, place = self._futures.pop(future)
                if number in done or future.cancelled():
                    continue
                error = future.exception()
                if error is not None:
                    if any(other == number for other, _ in self._futures.values()):
                        continue  # it is being made elsewhere too
                    raise _of_part(number, error)
                done[number] = place
                took.append(future.result())
                for other in [other for other, (of, _) in self._futures.items() if of == number]:
                    self._client.cancel([other], force=True)
            self._help_slow(done, took)
            time.sleep(_POLL if self._futures else 0.0)

    def _submit(self, number: int, place: Path, workers=None) -> None:
        future = self._client.submit(
            make_part, str(self._prepared), number, len(self._places), str(place), self._stop.name,
            key=f"rtgi-{place.name}-{self._stop.name}", retries=RETRIES, pure=False, workers=workers,
            allow_other_workers=workers is not None)
        self._futures[future] = number, place

    def _help_slow(self, done: dict[int, Path], took: list[float]) -> None:
        """Begin parts that take far too long a second time on workers that have nothing to do."""
        if len(took) < 2:
            return
        now, working = time.monotonic(), self._client.processing()
        busy = {key for keys in working.values() for key in keys}
        idle = [worker for worker, keys in working.items() if not keys]
        for future, (number, place) in list(self._futures.items()):
            if future.key not in busy:
                continue
            since = self._begun.setdefault(number, now)
            if idle and number not in self._again and number not in done and now - since > SLOW * float(np.median(took)):
                self._again.add(number)
                self._submit(number, place.with_name(f"{place.name}-again"), [idle.pop()])

    def stop(self) -> None:
        """Tell all workers to stop what they are making of this run."""
        left = list(self._futures)
        if left:
            self._stop.set()
            self._client.cancel(left, force=True)


def make_part(prepared: str, number: int, parts: int, out: str, stop: str) -> float:
    """On a worker: bake part ``number`` of ``parts`` to ``out``, going on with what an earlier try left, until the event called
    ``stop`` is set; the seconds that took. Raises BakeError, Cancelled."""
    import distributed
    worker, started, progress, finished = distributed.get_worker(), time.monotonic(), Progress(), threading.Event()
    threads = max(1, thread_count() // max(1, worker.state.nthreads))
    with distributed.worker_client(separate_thread=False) as client:
        event = distributed.Event(stop, client=client)

        def watch() -> None:
            while not finished.wait(2.0 * _POLL):
                try:
                    if event.is_set():
                        progress.cancel()
                        return
                except Exception:
                    # The scheduler has gone, and with it whoever wanted this.
                    progress.cancel()
                    return

        watcher = threading.Thread(target=watch, name="rtgi stop", daemon=True)
        watcher.start()
        try:
            ready = _take(prepared, threads)
            bake_prepared(prepared, out, part=(number, parts), threads=threads, progress=progress, resume=True, ready=ready)
            # Not after an error, which may have left it half changed.
            _free[prepared] = ready
        finally:
            finished.set()
            watcher.join()
    return time.monotonic() - started


# On a worker: what a thread that has finished a part of a prepared bake leaves to the next one, by the bake's folder.
_free: dict[str, Ready] = {}


def _take(prepared: str, threads: int) -> Ready:
    """What parts of ``prepared`` are made with, as an earlier part left it if the folder is still the same."""
    ready = _free.pop(prepared, None)
    _free.clear()
    if ready is not None and sha256_of_file(Path(prepared) / PREPARED.document) == ready.folder.digest:
        return ready
    return Ready.of(read_prepared(prepared), threads)


def about_worker(prepared: str) -> dict:
    """On a worker: its versions, whether it traces with Embree, and whether it sees the folder ``prepared``."""
    return {**versions(), "kernels": kernels_here(), "slow": slow_rays_warning() or "", "sees": is_prepared(prepared)}


def _require_alike(client, prepared: Path) -> None:
    try:
        found = client.run(about_worker, str(prepared))
    except Cancelled:
        raise
    except Exception as error:  # whatever a worker that lacks rtgi, or a part of it, raises
        raise BakeError(f"the workers cannot run rtgi ({type(error).__name__}: {error})", _INSTALL) from error
    if not found:
        raise BakeError("the cluster has no workers", "start some (dask worker ADDRESS)")
    first = next(iter(found))
    for worker, about in found.items():
        if about["kernels"] != found[first]["kernels"]:
            raise BakeError(f"worker {worker} has kernels {about['kernels']}, and {first} has {found[first]['kernels']}: their "
                            "bytes differ by rounding", "install the same kernels on every machine, or RTGI_KERNELS=off on all")
        for name, here in versions().items():
            if about[name] != here:
                raise BakeError(f"worker {worker} has {name} {about[name]}, and here it is {here}: bytes would differ",
                                "install the same version on every machine")
        if not about["sees"]:
            raise BakeError(f"worker {worker} does not see {prepared}", "put it, and --out, where all machines have the same path")
        if about["slow"]:
            raise BakeError(f"worker {worker} has no Embree, its bytes would differ: {about['slow']}", _INSTALL)


def _distributed():
    try:
        import distributed
    except ImportError as error:
        raise BakeError("Dask's distributed is not installed", _INSTALL) from error
    return distributed


@contextmanager
def _client(distributed, scheduler: str) -> Iterator:
    try:
        client = distributed.Client(scheduler, timeout=_CONNECT, set_as_default=False)
    except (OSError, TimeoutError, ValueError) as error:
        raise BakeError(f"there is no scheduler at {scheduler} ({error or type(error).__name__})",
                        "start one (dask scheduler), and give its address, tcp://HOST:8786") from error
    try:
        yield client
    finally:
        client.close(timeout=5.0)


def _of_part(number: int, error: BaseException) -> BaseException:
    if isinstance(error, BakeError):
        return type(error)(f"part {number}: {error.cause}", error.remedy)
    if isinstance(error, Cancelled):
        return Cancelled(f"a worker was told to stop part {number}")
    return BakeError(f"part {number} failed on its workers ({type(error).__name__}: {error})",
                     "see the worker's log; run the same command again to go on with the parts that stand")


def _stands(place: Path, digest: str, number: int, parts: int) -> bool:
    """Whether the part lies at ``place`` whole."""
    try:
        document = read_folder(PART, place).document
    except BakeError:
        return False
    return (document["prepared"], document["part"], document["parts"]) == (digest, number, parts)


def _remove(place: Path) -> None:
    try:
        remove_ours(place, ours(PART, place))
    # The bundle stands: what is left of its parts harms nobody.
    except (BakeError, OSError):
        pass


def _remove_empty(folder: Path) -> None:
    try:
        folder.rmdir()
    except OSError:
        pass
