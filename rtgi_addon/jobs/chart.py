"""From a Scene to a chart of speed against accuracy: every technique at every setting of its sweep, measured and drawn."""

import os
import platform
from collections.abc import Callable
from dataclasses import asdict, dataclass, replace
from pathlib import Path

import numpy as np

from .. import techniques
from ..discovery import named
from ..errors import BakeError, Cancelled, UsageError
from ..evaluate import chart_picture
from ..evaluate.atlas import ATLAS_SWEEP, AtlasSweep, wants_atlas
from ..evaluate.chart_data import SCHEMA, Chart, point_of
from ..evaluate.chart_text import markdown, picture_summary, summary
from ..evaluate.costs import Costs
from ..evaluate.effects_picture import draw_effects
from ..evaluate.error_map import ErrorMap
from ..evaluate.measure import Run, Yard
from ..evaluate.pictures import PictureReference
from ..evaluate.plain_chart import draw_plain_chart, draw_plain_effects
from ..evaluate.references import Reference
from ..exchange.plain import plain
from ..progress import Progress
from ..scene import Scene
from ..scene.capture import as_it_is
from ..scene.checks import check_scene, require
from ..storage.files import disk_error
from ..storage.parts import Parts
from ..storage.workplace import Workplace, workplace
from ..storage.writing import write_text
from ..techniques import Technique
from ..techniques.lattice.coverage import require_usable
from ..words import as_lines
from .chart_pictures import PictureSurvey, known_effects
from .fingerprint import measured_on
from .ready import select_volumes
from .report_files import check_report, put_report, read_report

# The report's files, but for those that depend on what was measured and what can be drawn.
DATA, FILES = "chart.json", ("chart.md", "chart.png", "chart.svg", "effects.png", "effects.svg", "errors.png", "reference.png")
# Shares of the progress: references until the first, measurements until the second, pictures until the third, then error maps.
REFERENCES_UNTIL, MEASURED_AT, PICTURED_AT = 0.15, 0.65, 0.9
# How far a technique's first measurement is when its code and tables are loaded, and the error maps when their reference is traced.
_WARM, _TRACED = 0.5, 0.6
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
        """chart.png, or without techniques effects.png, if it was drawn."""
        return next((self.folder / name for name in ("chart.png", "effects.png") if name in self.files), None)

    def to_json(self) -> dict:
        """All of chart.json, with where it lies."""
        return plain({"out": str(self.folder), "files": self.files, **self.chart.to_json()})

    def to_text(self) -> str:
        """The Pareto front and the files, as lines for a person."""
        chart = self.chart
        drawn = chart.pictures.effects() if chart.pictures else []
        and_effects = f" and {len(chart.pictures.points)} pictures of {len(drawn)} effect{'s' * (len(drawn) > 1)}" if drawn else ""
        return as_lines([f"Charted {len(chart.points)} settings of {len(chart.techniques())} techniques{and_effects} on "
                         f"{chart.scene}: {self.folder}",
                         *summary(chart).splitlines(), *picture_summary(chart).splitlines(), f"  files    {', '.join(self.files)}",
                         *(f"  left out {line}" for line in chart.left_out),
                         *([f"  note     {self.hint}"] if self.hint else [])])


def chart_scene(scene: Scene, out, names: list[str] | None = None, *, seeds: int = 4, points: int = 128, normals_per_point: int = 4,
                probes: int = 64, noise: float = 0.01, volume=None, maps: bool = True, most_seconds: float = MOST_SECONDS,
                reference: Reference | None = None, pictures: PictureReference | None = None, effects: list[str] | None = None,
                threads: int | None = None, resume: bool = False, progress: Progress | None = None,
                on_point: Callable[[Chart], None] | None = None) -> ChartReport:
    """Measure the techniques ``names`` (None: all) on ``scene`` and write chart.json, chart.md and the pictures into ``out``. Where
    objects are in the light atlas, it is one of them ("atlas"), held to surfaces that are in it.

    Every setting of each technique's sweep is baked with ``seeds`` seeds and compared at ``points`` surface points under
    ``normals_per_point`` normals and at ``probes`` probes with ``reference`` (None: the path tracer, until its noise is ``noise``).
    All settings have their first seed before any has its second. ``maps`` also draws where in the scene each technique's
    defaults are wrong. ``pictures`` renders what the pictures of ``effects`` (None: all that have something to do in the scene)
    are held to; without it none are drawn. ``on_point`` is given the chart so far after every bake and picture. What is measured is
    kept in `OUT.partial` until the chart is written; with ``resume`` a run of the same arguments goes on from there.

    Raises BakeError for what the user can mend, and Cancelled: what was measured until then is then in ``out``, marked as
    incomplete, unless a complete chart is there.
    """
    progress = progress or Progress()
    methods = known_techniques(names)
    if ATLAS_SWEEP in methods and not wants_atlas(scene):
        if names is not None:
            raise BakeError("no object is in the light atlas", "name one (--atlas OBJECT), or put it there in its properties")
        methods.remove(ATLAS_SWEEP)
    if not methods and pictures is None:
        raise UsageError("a chart without techniques and without pictures of effects has nothing to measure", "name a technique")
    known_effects(effects)
    if not (seeds > 0 and points > 0 and normals_per_point > 0 and probes > 0 and noise > 0):
        raise UsageError("a chart needs seeds, points, normals, probes and a noise above 0", "give numbers above 0")
    folder = check_chart(out, inputs=scene.files)
    progress.stage("check")
    progress.step(0.0, "Checking the scene")
    scene = as_it_is(replace(scene, volumes=select_volumes(scene.volumes, volume, {})))
    require(check_scene(scene))
    require_usable(scene, threads)
    wanted = {"techniques": ", ".join(method.name for method in methods), "points": points, "normals": normals_per_point,
              "probes": probes, "noise": noise, "seeds": seeds, "most seconds": most_seconds, "threads": threads,
              "reference": "path" if reference is None else reference.kind,
              "effects": "none" if pictures is None else "all" if effects is None else ", ".join(effects)}
    with workplace(folder, "chart") as place:
        parts = Parts(place, measured_on(scene, wanted), resume=resume)
        yard = None
        if methods:
            yard = Yard(scene, points=points, normals_per_point=normals_per_point, probes=probes, noise=noise, threads=threads,
                        reference=reference, keep=parts)
            if yard.on_atlas is None and ATLAS_SWEEP in methods:
                raise BakeError("no surface in the light atlas is seen from a probe",
                                "put one there that is, or measure more points")
            progress.stage("references")
            yard.prepare([method.knows for method in methods], progress.span(0.0, REFERENCES_UNTIL))
        drawn = PictureSurvey(scene, effects, pictures, most_seconds, threads, parts)
        survey = _Survey(scene, yard, methods, seeds, most_seconds, parts, drawn)
        tell = on_point or (lambda chart: None)
        try:
            progress.stage("measure")
            survey.run(progress.span(REFERENCES_UNTIL, MEASURED_AT), tell)
            progress.stage("pictures")
            drawn.run(progress.span(MEASURED_AT, PICTURED_AT), lambda: tell(survey.chart(complete=False)))
            sheets = {}
            if maps and methods:
                progress.stage("error maps")
                sheets = _maps(survey, progress.span(PICTURED_AT, 1.0))
        except Cancelled:
            _keep_incomplete(survey, place)
            raise
        if methods and not survey.runs:
            raise BakeError("no technique could be measured on this scene: " + "; ".join(survey.left_out), "mend the scene")
        report = _write(survey.chart(), place, sheets)
        parts.remove()
    progress.step(1.0, "Done")
    return report


def known_techniques(names: list[str] | None) -> list[Technique | AtlasSweep]:
    """The techniques called ``names`` (None: all) and the light atlas, by its name, each once. Raises UsageError for one that does
    not exist."""
    known = {**techniques.registry(), ATLAS_SWEEP.name: ATLAS_SWEEP}
    every = [*techniques.names(), ATLAS_SWEEP.name]
    return [named(known, name, "technique") for name in dict.fromkeys(every if names is None else names)]


def check_chart(out, inputs=()) -> Path:
    """The absolute path of the folder ``out`` for a chart, while ``inputs`` are read. Raises as ``check_report`` does."""
    return check_report(out, DATA, SCHEMA, FILES, inputs)


def _keep_incomplete(survey: "_Survey", place: Workplace) -> None:
    """What was measured, where a chart that was cancelled is of use: not in the place of one that is complete. Raises Cancelled."""
    if not survey.runs and survey.drawn.chart is None:
        return
    chart = survey.chart(complete=False)
    earlier = read_report(place.path, DATA, SCHEMA)
    if earlier is not None and earlier.get("complete") is True:
        raise Cancelled(f"{_measured(chart)} that were measured are in {place.folder}, the chart in {place.path} is the "
                        "earlier one; --resume goes on from there") from None
    _write(chart, place, {})
    raise Cancelled(f"{_measured(chart)} that were measured are in {place.path}; --resume goes on from there") from None


def _measured(chart: Chart) -> str:
    pictures = len(chart.pictures.points) if chart.pictures else 0
    return f"{len(chart.points)} settings" + (f" and {pictures} pictures" if pictures else "")


class _Survey:
    """The bakes of a chart. ``runs`` maps (technique, number in its sweep) to one run a seed; what ``parts`` has of an earlier run
    is not measured again. ``drawn`` has the pictures of effects."""

    def __init__(self, scene: Scene, yard: Yard | None, methods: list[Technique | AtlasSweep], seeds: int, most_seconds: float,
                 parts: Parts, drawn: PictureSurvey):
        self.scene, self.drawn = scene, drawn
        self.yard, self.methods, self.seeds, self.most_seconds, self._parts = yard, methods, seeds, most_seconds, parts
        self.runs: dict[tuple[str, int], list[Run]] = {}
        self.defaults: dict[str, Run] = {}
        self.left_out: list[str] = []
        self._warm: set[str] = set()

    def run(self, progress: Progress, on_point) -> None:
        """Every setting with every seed, one seed after the other; each is kept once it is measured."""
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
                    if self._measure(key, method, settings, lattice, seed, span):
                        on_point(self.chart(complete=False))

    def chart(self, complete: bool = True) -> Chart:
        """All that was measured so far."""
        yard, left_out = self.yard, (*self.left_out, *self.drawn.left_out)
        if yard is None:
            return Chart(self.scene.name, {}, {}, 0.0, self.seeds, self.drawn.threads, _machine(), (), left_out, complete,
                         self.drawn.chart)
        points = tuple(point_of(yard, method, self.runs[method.name, number]) for method in self.methods
                       for number in range(len(_sweep(method))) if (method.name, number) in self.runs)
        count, normals = len(yard.receivers.points), round(len(yard.receivers.points) / yard.receivers.own.sum())
        return Chart(
            yard.scene.name,
            {"kind": yard.reference.kind, "noise": yard.truth.noise, "probe_noise": yard.probe_truth.noise},
            {"points": count // normals, "normals": normals, "atlas": 0 if yard.on_atlas is None else len(yard.on_atlas.rows),
             "dark": int(yard.dark.sum()), "probes": len(yard.probe_rows),
             "probes_in_all": int(sum(np.prod(volume.resolution) for volume in yard.scene.volumes))},
            yard.floor, self.seeds, yard.threads, _machine(), points, left_out, complete, self.drawn.chart)

    def baked_defaults(self, method: Technique, progress: Progress) -> Run | None:
        """The run of the defaults on the scene's own lattice with its field, baked anew if it was measured in an earlier run; None
        if it was not measured."""
        run = self.defaults.get(method.name)
        if run is None or run.baked is not None:
            return run
        return replace(run, baked=method.bake(self.yard.scene, run.settings, np.random.default_rng(run.seed), progress,
                                              threads=self.yard.threads))

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

    def _measure(self, key: tuple[str, int], method: Technique | AtlasSweep, settings, lattice: float, seed: int,
                 progress: Progress) -> bool:
        """True if the bake was measured; a technique that cannot bake this scene is left out with the reason."""
        name = f"{method.name}, setting {key[1] + 1}, seed {seed}"
        stored = self._parts.load(name)
        if stored is None:
            stored = self._measured(method, settings, lattice, seed, progress)
            self._parts.save(name, *stored[:2])
        estimates, about, *field = stored
        if "refused" in about:
            self.left_out.append(f"{method.name}, setting {key[1] + 1}: {about['refused']}")
            return False
        run = Run(method.name, settings, seed, Costs(**about["costs"]), about["lookup_seconds"], about["field_bytes"], {},
                  estimates, lattice=lattice, stored=tuple(about.get("stored", ())))
        run = self.yard.compared(run, method)
        if seed == 0 and settings == method.Settings() and lattice == 1.0:
            self.defaults[method.name] = replace(run, baked=field[0] if field else None)
        self.runs.setdefault(key, []).append(run)
        return True

    def _measured(self, method: Technique | AtlasSweep, settings, lattice: float, seed: int, progress: Progress) -> tuple:
        """The estimates of a bake, what else is known of it as a document, and its field; or the reason why there is none."""
        try:
            if method.name not in self._warm:
                # The first bake of a technique in a process also loads its code and makes its tables: that one is not counted.
                self._warm.add(method.name)
                self.yard.measure(method, _sweep(method)[0][0], seed, progress.span(0.0, _WARM))
            run = self.yard.measure(method, settings, seed, progress.span(_WARM, 1.0), lattice=lattice)
        except BakeError as error:
            return {}, {"refused": str(error)}
        about = {"costs": asdict(run.costs), "lookup_seconds": run.lookup_seconds, "field_bytes": run.field_bytes}
        if seed == 0 and run.baked is not None and settings == method.Settings() and lattice == 1.0:
            about["stored"] = [asdict(form) for form in run.baked.stored_forms()]
        return run.estimates, about, run.baked


def _sweep(method: Technique | AtlasSweep) -> list[tuple[object, float]]:
    """What is measured of a technique: its settings on the scene's own lattices, its defaults on coarser ones before and on finer
    ones after them."""
    coarser, finer = (sorted(factor for factor in method.lattices if (factor > 1.0) == above) for above in (False, True))
    return [*((method.Settings(), factor) for factor in coarser), *((settings, 1.0) for settings in method.sweep()),
            *((method.Settings(), factor) for factor in finer)]


def _maps(survey: _Survey, progress: Progress) -> dict[str, tuple[str, ErrorMap, np.ndarray]]:
    """File name → title, map and picture: the reference, and each technique at its defaults."""
    progress.step(0.0, "Tracing the reference of the error maps")
    error_map = ErrorMap(survey.yard.context, progress=progress.span(0.0, _TRACED))
    if not len(error_map.seen):
        return {}
    pictures = {"reference.png": ("indirect irradiance, path tracer", error_map, error_map.reference_picture())}
    for number, method in enumerate(method for method in survey.methods if method is not ATLAS_SWEEP):
        span = progress.span(_TRACED, 1.0).span(number / len(survey.methods), (number + 1) / len(survey.methods))
        span.step(0.0, f"Error map of {method.name}")
        run = survey.baked_defaults(method, span)
        if run is None:
            continue
        error = error_map.relative_error(run.baked)
        title = f"{method.label}, defaults: {100 * run.errors['own_normals'].error:.0f} % on surfaces"
        pictures[f"error_{method.name}.png"] = title, error_map, error_map.colours(error)
    return pictures


def _write(chart: Chart, place: Workplace, sheets: dict) -> ChartReport:
    """All files of ``chart``, put into its folder together."""
    folder = place.new
    for name, (_, error_map, picture) in sheets.items():
        error_map.write(folder / name, picture)
    shown, hint = [name for name in sheets if name.startswith("error_")], chart_picture.HOW_TO_GET_PICTURES
    if chart_picture.can_draw():
        hint, shown = "", ["chart.png"]
        if chart.points:
            chart_picture.draw_chart(chart, folder)
        if sheets:
            chart_picture.draw_error_sheet(folder / "errors.png", [(title, picture) for title, _, picture in sheets.values()])
            shown.append("errors.png")
    elif chart.points:
        draw_plain_chart(chart, folder / "chart.png")
        shown = ["chart.png", *shown]
    if chart.pictures is not None:
        if chart_picture.can_draw():
            draw_effects(chart.pictures, chart.scene, folder)
        else:
            draw_plain_effects(chart.pictures, chart.scene, folder / "effects.png")
    try:
        write_text(folder / "chart.md", markdown(chart, tuple(shown)))
    except OSError as error:
        raise disk_error(place.path / "chart.md", error) from error
    files = (DATA, *(item.name for item in folder.iterdir()))
    put_report(place, DATA, chart.to_json())
    return ChartReport(chart, place.path, tuple(sorted(files)), hint)


def _machine() -> dict:
    load = os.getloadavg()[0] if hasattr(os, "getloadavg") else None
    return {"system": platform.system(), "processor": platform.processor() or platform.machine(), "cores": os.cpu_count(),
            "load_average": load, "python": platform.python_version(), "numpy": np.__version__}
