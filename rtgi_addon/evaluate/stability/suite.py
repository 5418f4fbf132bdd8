"""The cases of all families, and running them."""

import time
from collections.abc import Iterable

from ...errors import BakeError, UsageError
from ...progress import Progress
from . import atlas, energy, geometry, leaks, live, media, motion, reflections, scattered, spheres, style, voxels
from .case import Bench, Case, Result, Sample, Variant

CASES: dict[str, Case] = {case.name: case
                          for family in (leaks, geometry, energy, motion, live, style, media, reflections, spheres, voxels,
                                         scattered, atlas)
                          for case in family.CASES}


def chosen(cases: Iterable[str] | None = None, techniques: Iterable[str] | None = None,
           suite: dict[str, Case] = CASES) -> list[tuple[Case, str]]:
    """Cases and techniques of ``suite`` that are called so (None: all), where the case concerns the technique.

    Raises UsageError."""
    known = sorted({name for case in suite.values() for name in case.limits})
    cases = list(suite) if cases is None else list(cases)
    for kind, names, among in (("case", cases, suite), ("technique", techniques or (), known)):
        for name in names:
            if name not in among:
                raise UsageError(f"unknown {kind} {name!r}", f"choose one of {', '.join(among)}")
    wanted = set(known if techniques is None else techniques)
    pairs = [(suite[name], technique) for name in cases for technique in suite[name].limits if technique in wanted]
    if not pairs:
        raise UsageError(f"{', '.join(cases)} does not concern {', '.join(sorted(wanted))}", "choose another technique or case")
    return pairs


def measure(case: Case, technique: str, variant: Variant | None = None, *, seed: int = 1, threads: int | None = None,
            progress: Progress | None = None) -> Result:
    """One case for one technique: as it is, or as ``variant``. A technique that refuses a user's own scene has the worst figure,
    and its reason; raises BakeError for a built-in one, Cancelled."""
    started = time.monotonic()
    bench = Bench(technique, variant.settings if variant else {}, seed, threads, progress or Progress())
    try:
        samples = tuple(case.measure(bench))
    except BakeError as error:
        if case.remedies is None:
            raise
        samples = (Sample(f"refused: {error.cause}", float("inf")),)
    return Result(case, technique, samples, time.monotonic() - started, variant)
