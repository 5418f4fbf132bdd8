"""The cases of all families, and running them."""

import time
from collections.abc import Iterable

from ...errors import UsageError
from ...progress import Progress
from . import energy, geometry, leaks, motion
from .case import Bench, Case, Result, Variant

CASES: dict[str, Case] = {case.name: case for family in (leaks, geometry, energy, motion) for case in family.CASES}


def chosen(cases: Iterable[str] | None = None, techniques: Iterable[str] | None = None) -> list[tuple[Case, str]]:
    """Cases and techniques that are called so (None: all), where the case concerns the technique. Raises UsageError."""
    known = sorted({name for case in CASES.values() for name in case.limits})
    cases = list(CASES) if cases is None else list(cases)
    for kind, names, among in (("case", cases, CASES), ("technique", techniques or (), known)):
        for name in names:
            if name not in among:
                raise UsageError(f"unknown {kind} {name!r}", f"choose one of {', '.join(among)}")
    wanted = set(known if techniques is None else techniques)
    pairs = [(CASES[name], technique) for name in cases for technique in CASES[name].limits if technique in wanted]
    if not pairs:
        raise UsageError(f"{', '.join(cases)} does not concern {', '.join(sorted(wanted))}", "choose another technique or case")
    return pairs


def measure(case: Case, technique: str, variant: Variant | None = None, *, seed: int = 1, threads: int | None = None,
            progress: Progress | None = None) -> Result:
    """One case for one technique: as it is, or as ``variant``. Raises Cancelled."""
    started = time.monotonic()
    bench = Bench(technique, variant.settings if variant else {}, seed, threads, progress or Progress())
    return Result(case, technique, tuple(case.measure(bench)), time.monotonic() - started, variant)
