"""Kills: jobs are ended before every operation on files, and at random times, again while the next run mends what that left, and so
on; then they run to their end. Held to: nothing of the user's is lost or changed, what is there is the old result or the new one,
reading it changes nothing, and what comes out in the end is what an undisturbed run gives, with nothing beside it.
"""

import shutil
import time
from pathlib import Path

from common import Tally, differences, rng_of, snapshot
from jobs import JOBS, ready, reference
from kills import run_apart

# So often a run that follows a kill is killed too, and so often it continues from the checkpoint where it can.
AGAIN, RESUMES = 0.35, 0.7
MOST_KILLS = 4


class Killing:
    """Trials by number, in the folder ``place``."""

    def __init__(self, seed: int, place: Path, only: list[str] | None = None):
        ready()
        self.seed, self._place, self._names = seed, place, list(only or JOBS)
        self._templates: dict[str, tuple[Path, dict, int, float]] = {}

    def trial(self, number: int, tally: Tally) -> None:
        """Kill one job, at least once."""
        rng, name = rng_of("kills", self.seed, number), self._names[number % len(self._names)]
        job = JOBS[name]
        template, mine, operations, seconds = self._template(name)
        root = self._place / f"trial-{number}"
        shutil.copytree(template, root, symlinks=True)
        turn, kills, resume = number // len(self._names), 0, False

        def find(what: str) -> None:
            tally.findings.append((number, f"{name}, after {kills} kills: {what}"))

        while True:
            # Every operation in turn, and then whatever comes.
            at, after = (turn % operations + 1, None) if kills == 0 and turn < operations else \
                (None, rng.uniform(0.0, seconds)) if rng.random() < 0.4 else (int(rng.integers(1, operations + 1)), None)
            ended = run_apart(lambda resume=resume: job.run(root, True, resume) and None, root, at=at, after=after, limit=60.0)
            tally.costs(number, ended.seconds, ended.peak_bytes, 60.0)
            if isinstance(ended.outcome, TimeoutError):
                find(str(ended.outcome))
                break
            if not ended.killed:
                if isinstance(ended.outcome, BaseException):
                    find(f"{type(ended.outcome).__name__}: {ended.outcome}")
                break
            kills += 1
            tally.count("kills")
            tally.count(f"kills of {name}")
            before = snapshot(root)
            lost = differences(mine, {path: before.get(path, "gone") for path in mine})
            if lost:
                find(f"files of the user, {lost}")
            problem = job.problem(root)
            if problem:
                find(problem)
            written = differences(before, snapshot(root))
            if written:
                find(f"reading changed {written}")
            resume = job.resumes and rng.random() < RESUMES
            if kills >= MOST_KILLS or rng.random() > AGAIN:
                break
        self._finish(number, name, root, resume, mine, tally, find)
        shutil.rmtree(root)

    def _finish(self, number, name, root, resume, mine, tally, find) -> None:
        """The run that is left alone."""
        job = JOBS[name]
        ended = run_apart(lambda: job.run(root, True, resume) and None, root, limit=60.0)
        tally.costs(number, ended.seconds, ended.peak_bytes, 60.0)
        if ended.killed or isinstance(ended.outcome, BaseException):
            find(f"the next run ended with {type(ended.outcome).__name__}: {ended.outcome}")
            return
        tally.count("resumed to the end" if resume else "run anew to the end")
        after = snapshot(root)
        lost = differences(mine, {path: after.get(path, "gone") for path in mine})
        if lost:
            find(f"files of the user, {lost}")
        if job.content(root) != reference(job, root, True):
            find("the result is not what an undisturbed run gives")
        beside = sorted(path for path in after if path.split("/")[0] != "out" and path not in mine and not path.endswith("/"))
        if beside:
            find(f"left beside the result: {', '.join(beside[:4])}")

    def _template(self, name: str) -> tuple[Path, dict, int, float]:
        """A folder with the old result, what in it is the user's, and how many operations and seconds the new one takes."""
        if name not in self._templates:
            job, root = JOBS[name], self._place / f"template-{name}"
            root.mkdir()
            job.run(root, False, False)
            ours = snapshot(root)
            job.plant(root)
            mine = {path: what for path, what in snapshot(root).items() if ours.get(path) != what and not path.endswith("/")}
            for new in (False, True):
                reference(job, root, new)
            trial = self._place / f"measured-{name}"
            shutil.copytree(root, trial, symlinks=True)
            started = time.monotonic()
            ended = run_apart(lambda: job.run(trial, True, False) and None, trial)
            assert not isinstance(ended.outcome, BaseException), ended.outcome
            shutil.rmtree(trial)
            self._templates[name] = root, mine, ended.operations, time.monotonic() - started
        return self._templates[name]
