"""The stability suite as a job: run, write the report and its pictures, keep what was measured if it is cancelled."""

import contextlib
import json
import os
from collections.abc import Iterable
from pathlib import Path

from ..errors import BakeError, Cancelled
from ..evaluate.stability import CASES, Result, StabilityReport, chosen, draw_result, measure, own_cases
from ..progress import Progress
from ..scene import Scene
from ..scene.checks import check_scene, require

REPORT, DATA, PICTURES = "stability.md", "stability.json", "pictures"


def run_stability(out=None, scene: Scene | None = None, *, cases: Iterable[str] | None = None,
                  techniques: Iterable[str] | None = None, variants: bool = True, pictures: bool = True, seed: int = 1,
                  threads: int | None = None, progress: Progress | None = None) -> StabilityReport:
    """Measure every chosen case for every chosen technique (None: all), with ``variants`` also without their remedies: the built-in
    cases, or those of ``scene``.

    ``out`` (None: nothing is written) is a folder that gets stability.md, stability.json and, with ``pictures``, one PNG a result.
    A cancelled run writes what it has measured and raises Cancelled. Raises UsageError for unknown names, BakeError if ``out``
    cannot be written or ``scene`` cannot be baked.
    """
    progress = progress or Progress()
    if scene is not None:
        require(check_scene(scene))
    pairs = chosen(cases, techniques, CASES if scene is None else own_cases(scene, threads, seed=seed))
    target = None if out is None else _prepared(out)
    tasks = [(case, technique, variant) for case, technique in pairs
             for variant in (None, *(case.variants.get(technique, ()) if variants else ()))]
    results: list[Result] = []
    drawn: dict[tuple[str, str], str] = {}
    try:
        for number, (case, technique, variant) in enumerate(tasks):
            progress.step(number / len(tasks), f"{case.name}, {technique}" + (f", {variant.name}" if variant else ""))
            result = measure(case, technique, variant, seed=seed, threads=threads,
                             progress=progress.span(number / len(tasks), (number + 1) / len(tasks)))
            if target is not None and pictures and variant is None:
                name = f"{PICTURES}/{case.name}-{technique}.png"
                if draw_result(result, target / name) is not None:
                    drawn[case.name, technique] = name
            results.append(result.without_fields())
    except Cancelled:
        if target is None or not results:
            raise
        _write(target, _report(results, drawn, seed, target, cancelled=True))
        raise Cancelled(f"what was measured is in {target}") from None
    report = _report(results, drawn, seed, target)
    if target is not None:
        _write(target, report)
    with contextlib.suppress(Cancelled):
        progress.step(1.0, "Done")
    return report


def _report(results, drawn, seed, target, cancelled=False) -> StabilityReport:
    return StabilityReport(tuple(result for result in results if result.variant is None),
                           tuple(result for result in results if result.variant is not None), drawn, seed,
                           "" if target is None else str(target), cancelled)


def _prepared(out) -> Path:
    path = Path(out)
    try:
        path.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise BakeError(f"cannot make the folder {path} ({error.strerror})", "choose another place for the report") from error
    return path


def _write(target: Path, report: StabilityReport) -> None:
    for name, text in ((REPORT, report.to_markdown()), (DATA, json.dumps(report.to_json(), indent=1) + "\n")):
        partial = target / f".{name}.{os.getpid()}.part"
        try:
            partial.write_text(text, encoding="utf-8")
            os.replace(partial, target / name)
        except OSError as error:
            with contextlib.suppress(OSError):
                partial.unlink()
            raise BakeError(f"cannot write {target / name} ({error.strerror})", "choose another place or free space") from error
