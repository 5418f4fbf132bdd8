"""From a Scene to a chart of speed against accuracy: every technique at every setting of its sweep, measured and drawn."""

import json
import os
import platform
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from .. import techniques
from ..errors import BakeError, Cancelled, UsageError
from ..evaluate import chart_picture
from ..evaluate.chart_data import Chart, point_of
from ..evaluate.chart_text import markdown, summary
from ..evaluate.error_map import ErrorMap
from ..evaluate.measure import Run, Yard
from ..evaluate.references import Reference
from ..exchange.files import disk_error, write_atomically
from ..exchange.plain import plain
from ..progress import Progress
from ..scene import Scene
from ..scene.checks import check_scene, require
from ..techniques import Technique
from .bake import select_volumes

# Shares of the progress: references until the first, measurements until the second, then error maps.
REFERENCES_UNTIL, MEASURED_AT = 0.2, 0.9
# A setting that took longer than this keeps its first seed only, and dearer ones of its technique are left out [s].
MOST_SECONDS = 120.0


@dataclass(frozen=True)
class ChartReport:
    """A chart and the files that hold it; ``hint`` says what is missing for the pictures, if they are not among them."""

    chart: Chart
    folder: Path
    files: tuple[str, ...]
    hint: str = ""

    @property
    def picture(self) -> Path | None:
        """chart.png, if it was drawn."""
        return self.folder / "chart.png" if "chart.png" in self.files else None

    def to_json(self) -> dict:
        """All of chart.json, with where it lies."""
        return plain({"out": str(self.folder), "files": self.files, **self.chart.to_json()})

    def to_text(self) -> str:
        """The Pareto front and the files, as lines for a person."""
        chart = self.chart
        return "\n".join([f"Charted {len(chart.points)} settings of {len(chart.techniques())} techniques on {chart.scene}: "
                          f"{self.folder}",
                          summary(chart), f"  files    {', '.join(self.files)}",
                          *(f"  left out {line}" for line in chart.left_out),
                          *([f"  note     {self.hint}"] if self.hint else [])])


def chart_scene(scene: Scene, out, names: list[str] | None = None, *, seeds: int = 4, points: int = 128, normals_per_point: int = 4,
                probes: int = 64, noise: float = 0.01, volume=None, maps: bool = True, most_seconds: float = MOST_SECONDS,
                reference: Reference | None = None, threads: int | None = None, progress: Progress | None = None,
                on_point: Callable[[Chart], None] | None = None) -> ChartReport:
    """Measure the techniques ``names`` (None: all) on ``scene`` and write chart.json, chart.md and the pictures into ``out``.

    Every setting of each technique's sweep is baked with ``seeds`` seeds and compared at ``points`` surface points under
    ``normals_per_point`` normals and at ``probes`` probes with ``reference`` (None: the path tracer, until its noise is ``noise``).
    All settings have their first seed before any has its second. ``maps`` also draws where in the scene each technique's
    defaults are wrong. ``on_point`` is given the chart so far after every bake.

    Raises BakeError for what the user can mend, and Cancelled: what was measured until then is in ``out``, marked as incomplete.
    """
    progress = progress or Progress()
    methods = [techniques.get(name) for name in dict.fromkeys(names or techniques.names())]
    if not (seeds > 0 and points > 0 and normals_per_point > 0 and probes > 0 and noise > 0):
        raise UsageError("a chart needs seeds, points, normals, probes and a noise above 0", "give numbers above 0")
    folder = _folder(out)
    progress.stage("check")
    progress.step(0.0, "Checking the scene")
    scene = replace(scene, volumes=select_volumes(scene.volumes, volume, {}))
    require(check_scene(scene))
    yard = Yard(scene, points=points, normals_per_point=normals_per_point, probes=probes, noise=noise, threads=threads,
                reference=reference)
    progress.stage("references")
    yard.prepare([method.knows for method in methods], progress.span(0.0, REFERENCES_UNTIL))
    survey = _Survey(yard, methods, seeds, most_seconds)
    try:
        progress.stage("measure")
        survey.run(progress.span(REFERENCES_UNTIL, MEASURED_AT if maps else 1.0), folder, on_point)
        sheets = {}
        if maps:
            progress.stage("error maps")
            sheets = _maps(survey, progress.span(MEASURED_AT, 1.0))
    except Cancelled:
        if survey.runs:
            chart = survey.chart(complete=False)
            _write(chart, folder, {})
            raise Cancelled(f"{len(chart.points)} settings that were measured are in {folder}") from None
        raise
    if not survey.runs:
        raise BakeError("no technique could be measured on this scene: " + "; ".join(survey.left_out), "mend the scene")
    report = _write(survey.chart(), folder, sheets)
    progress.step(1.0, "Done")
    return report


class _Survey:
    """The bakes of a chart. ``runs`` maps (technique, number in its sweep) to one run a seed."""

    def __init__(self, yard: Yard, methods: list[Technique], seeds: int, most_seconds: float):
        self.yard, self.methods, self.seeds, self.most_seconds = yard, methods, seeds, most_seconds
        self.runs: dict[tuple[str, int], list[Run]] = {}
        self.defaults: dict[str, Run] = {}
        self.left_out: list[str] = []

    def run(self, progress: Progress, folder: Path, on_point) -> None:
        """Every setting with every seed, one seed after the other; chart.json is written after each bake."""
        total = sum(len(_sweep(method)) for method in self.methods) * self.seeds
        done = 0
        for seed in range(self.seeds):
            for method in self.methods:
                for number, (settings, lattice) in enumerate(_sweep(method)):
                    span = progress.span(done / total, (done + 1) / total)
                    done += 1
                    key = method.name, number
                    if not self._worth_while(key, seed):
                        continue
                    span.step(0.0, f"{method.label}, setting {number + 1} of {len(_sweep(method))}, seed {seed + 1}")
                    if not self._measure(key, method, settings, lattice, seed, span):
                        continue
                    chart = self.chart(complete=False)
                    _write_json(chart, folder)
                    if on_point is not None:
                        on_point(chart)

    def chart(self, complete: bool = True) -> Chart:
        """All that was measured so far."""
        yard = self.yard
        points = tuple(point_of(yard, method, self.runs[method.name, number]) for method in self.methods
                       for number in range(len(_sweep(method))) if (method.name, number) in self.runs)
        count, normals = len(yard.receivers.points), round(len(yard.receivers.points) / yard.receivers.own.sum())
        return Chart(
            yard.scene.name,
            {"kind": yard.reference.kind, "noise": yard.truth.noise, "probe_noise": yard.probe_truth.noise},
            {"points": count // normals, "normals": normals, "dark": int(yard.dark.sum()), "probes": len(yard.probe_rows),
             "probes_in_all": int(sum(np.prod(volume.resolution) for volume in yard.scene.volumes))},
            yard.floor, self.seeds, yard.threads, _machine(), points, tuple(self.left_out), complete)

    def _worth_while(self, key: tuple[str, int], seed: int) -> bool:
        """False for settings that failed or would take too long by what is known of them or of cheaper ones."""
        name, number = key
        if seed:
            return key in self.runs and self.runs[key][0].costs.seconds <= self.most_seconds
        before = [self.runs[name, other][0] for other in range(number) if (name, other) in self.runs]
        dear = any(run.costs.seconds > self.most_seconds for run in before)
        if dear:
            self.left_out.append(f"{name}, setting {number + 1}: a cheaper one took more than {self.most_seconds:g} s")
        return not dear

    def _measure(self, key: tuple[str, int], method: Technique, settings, lattice: float, seed: int, progress: Progress) -> bool:
        """True if the bake was measured; a technique that cannot bake this scene is left out with the reason."""
        try:
            if seed == 0 and key[1] == 0:
                # The first bake of a technique in a process also loads its code and makes its tables: that one is not counted.
                self.yard.measure(method, settings, seed, progress.span(0.0, 0.5))
            run = self.yard.measure(method, settings, seed, progress.span(0.5, 1.0), lattice=lattice)
        except BakeError as error:
            self.left_out.append(f"{method.name}, setting {key[1] + 1}: {error}")
            return False
        if seed == 0 and settings == method.Settings() and lattice == 1.0:
            self.defaults[method.name] = run
        self.runs.setdefault(key, []).append(replace(run, baked=None))
        return True


def _sweep(method: Technique) -> list[tuple[object, float]]:
    """What is measured of a technique: its settings on the scene's own lattices, its defaults on coarser ones before and on finer
    ones after them."""
    coarser, finer = (sorted(factor for factor in method.lattices if (factor > 1.0) == above) for above in (False, True))
    return [*((method.Settings(), factor) for factor in coarser), *((settings, 1.0) for settings in method.sweep()),
            *((method.Settings(), factor) for factor in finer)]


def _maps(survey: _Survey, progress: Progress) -> dict[str, tuple[str, ErrorMap, np.ndarray]]:
    """File name → title, map and picture: the reference, and each technique at its defaults."""
    progress.step(0.0, "Tracing the reference of the error maps")
    error_map = ErrorMap(survey.yard.context, progress=progress.span(0.0, 0.6))
    if not len(error_map.seen):
        return {}
    pictures = {"reference.png": ("indirect irradiance, path tracer", error_map, error_map.reference_picture())}
    for number, (name, run) in enumerate(survey.defaults.items()):
        progress.step(0.6 + 0.4 * number / len(survey.defaults), f"Error map of {name}")
        error = error_map.relative_error(run.baked)
        title = f"{techniques.get(name).label}, defaults: {100 * run.errors['own_normals'].error:.0f} % on surfaces"
        pictures[f"error_{name}.png"] = title, error_map, error_map.colours(error)
    return pictures


def _write(chart: Chart, folder: Path, sheets: dict) -> ChartReport:
    """All files of ``chart``."""
    _write_json(chart, folder)
    files = ["chart.json", "chart.md"]
    for name, (_, error_map, picture) in sheets.items():
        error_map.write(folder / name, picture)
        files.append(name)
    shown, hint = [name for name in sheets if name.startswith("error_")], chart_picture.HOW_TO_GET_PICTURES
    if chart_picture.can_draw():
        hint, shown = "", ["chart.png"]
        chart_picture.draw_chart(chart, folder)
        files += ["chart.png", "chart.svg"]
        if sheets:
            chart_picture.draw_error_sheet(folder / "errors.png", [(title, picture) for title, _, picture in sheets.values()])
            files.append("errors.png")
            shown.append("errors.png")
    _write_file(folder / "chart.md", markdown(chart, tuple(shown)))
    return ChartReport(chart, folder, tuple(sorted(files)), hint)


def _write_json(chart: Chart, folder: Path) -> None:
    _write_file(folder / "chart.json", json.dumps(plain(chart.to_json()), indent=1) + "\n")


def _write_file(path: Path, text: str) -> None:
    try:
        write_atomically(path, text.encode())
    except OSError as error:
        raise disk_error(path, error) from error


def _folder(out) -> Path:
    folder = Path(out).expanduser().absolute()
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise disk_error(folder, error) from error
    return folder


def _machine() -> dict:
    load = os.getloadavg()[0] if hasattr(os, "getloadavg") else None
    return {"system": platform.system(), "processor": platform.processor() or platform.machine(), "cores": os.cpu_count(),
            "load_average": load, "python": platform.python_version(), "numpy": np.__version__}
