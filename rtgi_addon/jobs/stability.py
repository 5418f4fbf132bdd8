"""The stability suite as a job: run, write the report and its pictures, keep what was measured if it is cancelled."""

import contextlib
from collections.abc import Iterable
from pathlib import Path

import numpy as np

from ..errors import Cancelled
from ..evaluate.stability import CASES, Result, StabilityReport, chosen, draw_result, measure, own_cases
from ..evaluate.stability.case import Sample
from ..evaluate.stability.report import SCHEMA
from ..progress import Progress
from ..scene import Scene
from ..scene.checks import check_scene, require
from ..storage.files import disk_error
from ..storage.parts import Parts
from ..storage.workplace import Workplace, workplace
from ..storage.writing import write_file, write_text
from ..techniques.lattice.coverage import require_usable
from .fingerprint import measured_on
from .report_files import check_report, put_report, read_report

REPORT, DATA, PICTURES = "stability.md", "stability.json", "pictures"


def run_stability(out=None, scene: Scene | None = None, *, cases: Iterable[str] | None = None,
                  techniques: Iterable[str] | None = None, variants: bool = True, pictures: bool = True, seed: int = 1,
                  threads: int | None = None, resume: bool = False, progress: Progress | None = None) -> StabilityReport:
    """Measure every chosen case for every chosen technique (None: all), with ``variants`` also without their remedies: the built-in
    cases, or those of ``scene``.

    ``out`` (None: nothing is written) is a folder that gets stability.md, stability.json and, with ``pictures``, one PNG a result.
    What is measured is kept in `OUT.partial` until they are written; with ``resume`` a run of the same arguments goes on from
    there. A cancelled run writes what it has measured, unless a complete report is there, and raises Cancelled. Raises UsageError
    for unknown names, BakeError if ``out`` cannot be written or ``scene`` cannot be baked.
    """
    progress = progress or Progress()
    target = None if out is None else check_stability(out, () if scene is None else scene.files)
    if scene is not None:
        require(check_scene(scene))
        require_usable(scene, threads)
    pairs = chosen(cases, techniques, CASES if scene is None else own_cases(scene, threads, seed=seed))
    tasks = [(case, technique, variant) for case, technique in pairs
             for variant in (None, *(case.variants.get(technique, ()) if variants else ()))]
    with contextlib.nullcontext() if target is None else workplace(target, "stability") as place:
        wanted = {"seed": seed, "pictures": pictures}
        suite = _Suite(seed, threads, pictures, place,
                       None if place is None else Parts(place, measured_on(scene, wanted), resume=resume))
        try:
            for number, (case, technique, variant) in enumerate(tasks):
                progress.step(number / len(tasks), f"{case.name}, {technique}" + (f", {variant.name}" if variant else ""))
                suite.measure(case, technique, variant, progress.span(number / len(tasks), (number + 1) / len(tasks)))
        except Cancelled:
            if place is not None and suite.results:
                _keep_incomplete(suite, place)
            raise
        report = suite.report()
        if place is not None:
            _write(place, report)
            suite.parts.remove()
    with contextlib.suppress(Cancelled):
        progress.step(1.0, "Done")
    return report


def check_stability(out, inputs=()) -> Path:
    """The absolute path of the folder ``out`` for a report, while ``inputs`` are read. Raises as ``check_report`` does."""
    return check_report(out, DATA, SCHEMA, (REPORT,), inputs)


class _Suite:
    """The results so far, and the pictures in ``place.new``; what ``parts`` has of an earlier run is not measured again."""

    def __init__(self, seed: int, threads: int | None, pictures: bool, place: Workplace | None, parts: Parts | None):
        self.seed, self.threads, self.parts = seed, threads, parts
        self.results: list[Result] = []
        self._place, self._pictures = place, pictures and place is not None
        self._drawn: dict[tuple[str, str], str] = {}

    def measure(self, case, technique: str, variant, progress: Progress) -> None:
        """Add the result of one case. Raises BakeError, Cancelled."""
        name = f"{case.name}, {technique}, {variant.name if variant else 'as it is'}"
        picture = f"{PICTURES}/{case.name}-{technique}.png" if self._pictures and variant is None else None
        stored = None if self.parts is None else self.parts.load(name)
        if stored is None:
            result = measure(case, technique, variant, seed=self.seed, threads=self.threads, progress=progress)
            drawn = picture is not None and draw_result(result, self._place.new / picture) is not None
            result = result.without_fields()
            if self.parts is not None:
                self._keep(name, result, self._place.new / picture if drawn else None)
        else:
            arrays, about = stored
            samples = [Sample(text, float(value)) for text, value in zip(about["parameters"], arrays["values"], strict=True)]
            result, drawn = Result(case, technique, tuple(samples), about["seconds"], variant), "picture" in arrays
            if drawn:
                write_file(self._place.new / picture, arrays["picture"].tobytes())
        if drawn:
            self._drawn[case.name, technique] = picture
        self.results.append(result)

    def report(self, cancelled: bool = False) -> StabilityReport:
        """All results so far."""
        return StabilityReport(tuple(result for result in self.results if result.variant is None),
                               tuple(result for result in self.results if result.variant is not None), self._drawn, self.seed,
                               "" if self._place is None else str(self._place.path), cancelled)

    def _keep(self, name: str, result: Result, picture: Path | None) -> None:
        arrays = {"values": np.array([sample.value for sample in result.samples], np.float64)}
        if picture is not None:
            arrays["picture"] = np.frombuffer(picture.read_bytes(), np.uint8)
        self.parts.save(name, arrays, {"parameters": [sample.parameter for sample in result.samples], "seconds": result.seconds})


def _keep_incomplete(suite: _Suite, place: Workplace) -> None:
    """What was measured, but not in the place of a report that is complete. Raises Cancelled."""
    earlier = read_report(place.path, DATA, SCHEMA)
    if earlier is not None and earlier.get("complete") is True:
        raise Cancelled(f"what was measured is in {place.folder}, the report in {place.path} is the earlier one; --resume goes on "
                        "from there") from None
    _write(place, suite.report(cancelled=True))
    raise Cancelled(f"what was measured is in {place.path}; --resume goes on from there") from None


def _write(place: Workplace, report: StabilityReport) -> None:
    try:
        write_text(place.new / REPORT, report.to_markdown())
    except OSError as error:
        raise disk_error(place.path / REPORT, error) from error
    put_report(place, DATA, report.to_json())
