"""From a Scene to a plan, and from a plan to a finished bundle that says how good the plan was."""

from collections.abc import Callable
from dataclasses import asdict, dataclass, replace

import numpy as np

from ..errors import UsageError
from ..evaluate.metrics import Figure
from ..evaluate.plan import Plan, Target, make_plan
from ..evaluate.plan.look import Motion
from ..evaluate.plan.reasons import percent, size
from ..evaluate.plan.sample import NothingToSee, draw_sample
from ..evaluate.plan.tries import CONFIDENCE, upper
from ..evaluate.references import PathReference
from ..exchange.bundle import check_target
from ..exchange.plain import plain
from ..progress import Progress
from ..scene import ProbeVolume, Scene
from ..scene.checks import check_scene, require
from ..storage.workplace import workplace
from ..techniques import Field
from ..techniques.lattice.coverage import require_usable
from ..techniques.lattice.field import ProbeField
from ..transport.context import LightContext
from ..transport.rays.ray_counter import count_rays
from ..words import as_lines
from .bake import bake_scene
from .plan_answer import by_rays, cost, error, spoken, what
from .plan_beside import beside
from .ready import select_volumes
from .report import BakeSummary

# Shares of the progress of a planned bake: the plan until the first, the bake until the second, then the check.
PLANNED_AT, BAKED_AT = 0.3, 0.9
# Surface points that a plan is checked on, which it has not seen; noise of their reference, and the most paths of all of them.
CHECK_POINTS, CHECK_NOISE, CHECK_PATHS = 256, 0.05, 1 << 18
# The share of other draws of points that the interval of the check is meant to cover.
CHECKED = 0.95
# What makes the receivers of the check others than those of the plan.
HELD_BACK = 0x68656C64
# What is baked where nobody names a technique.
USUAL = "probes"
# Stages that are not part of what a plan predicts the seconds of.
_OTHER_STAGES = frozenset({"plan", "extract", "check", "write", "verify", "picture", "fit", "spheres"})


@dataclass(frozen=True)
class PlanReport:
    """A plan for people and for programs."""

    plan: Plan

    def to_json(self) -> dict:
        """Everything in it as JSON-able values."""
        return plan_json(self.plan)

    def to_text(self) -> str:
        """The reasons, what is planned, and what else there is, as lines for a person."""
        return plan_text(self.plan)


@dataclass(frozen=True)
class Check:
    """How good a plan was: predicted against found. ``error`` is measured at ``points`` surface points that the plan did not see,
    by the path tracer with relative ``noise``, which is taken out; as many other points would say from ``low`` to ``high``
    (95 % of such draws: numerics/heavy_tail.py). ``seconds`` and ``rays`` are those of the bake without plan, checks and files."""

    predicted: Figure
    error: Figure
    low: float
    high: float
    noise: float
    points: int
    predicted_seconds: float
    seconds: float
    predicted_rays: float
    rays: int
    target: float

    @property
    def within(self) -> bool:
        """Whether the error is below the target, or above it by less than another draw of points may be below this one."""
        return self.low <= self.target

    def to_text(self) -> str:
        """Two lines for a person."""
        verdict = "" if self.error.value <= self.target else \
            f", above {percent(self.target)} by less than the check can tell" if self.within else f", above {percent(self.target)}"
        return (f"  error    {percent(self.predicted.value)} predicted, {percent(self.error.value)} found at "
                f"{self.points} surface points that the plan did not see ({percent(self.low)} to {percent(self.high)} at as many "
                f"others){verdict}\n"
                f"  time     {self.predicted_seconds:.2g} s predicted, {self.seconds:.2g} s taken; {self.predicted_rays / 1e6:.2g} "
                f"million rays predicted, {self.rays / 1e6:.2g} million traced")


@dataclass(frozen=True)
class PlannedBake:
    """A bake that was planned; ``check`` is None if it was not wanted."""

    plan: Plan
    bake: BakeSummary
    check: Check | None

    def to_json(self) -> dict:
        """The bake's values, with the plan's and the check's beside them."""
        check = None
        if self.check is not None:
            figures = {name: getattr(self.check, name)._asdict() for name in ("predicted", "error")}
            check = {**asdict(self.check), **figures, "within": self.check.within, "confidence": CONFIDENCE}
        return {**self.bake.to_json(), "plan": plan_json(self.plan), "check": plain(check)}

    def to_text(self) -> str:
        """The plan, the bake and how far one was from the other."""
        lines = [plan_text(self.plan, table=False), replace(self.bake, notes=_without_plan(self.bake.notes)).to_text()]
        return "\n".join([*lines, *([self.check.to_text()] if self.check else [])])


def plan_scene(scene: Scene, target: Target, *, seed: int = 0, threads: int | None = None, volume=None,
               motion: Motion | None = None, others: bool = True, progress: Progress | None = None) -> PlanReport:
    """The plan for the volumes of ``scene`` (``volume``: None, a name or several). ``others`` measures every technique.

    Raises BakeError for what the user can mend, and Cancelled.
    """
    progress = progress or Progress()
    progress.stage("plan")
    scene = replace(scene, volumes=select_volumes(scene.volumes, volume, {}))
    require(check_scene(scene))
    require_usable(scene, threads)
    plan = make_plan(scene, target, seed=seed, threads=threads, motion=motion, others=others, progress=progress)
    return PlanReport(replace(plan, reasons=(*plan.reasons, *beside(scene, plan.probes))))


def bake_planned(scene: Scene, target: Target, out, *, seed: int = 0, threads: int | None = None, volume=None,
                 motion: Motion | None = None, check: bool = True, direct: bool = False,
                 keep: Callable[[Field], None] | None = None, progress: Progress | None = None, **options) -> PlannedBake:
    """Plan, bake into ``out`` as planned, and ``check`` the result at receivers that were held back.

    ``keep`` and ``options`` go to bake_scene. The plan is in the bundle's notes. Raises as bake_scene does.
    """
    progress = progress or Progress()
    if direct and check:
        raise UsageError("a check holds the bake to indirect light, and --direct adds the lamps'", "add --no-check")
    other = next((volume for volume in select_volumes(scene.volumes, volume, {}) if not volume.captures_all), None)
    if check and other is not None:
        raise UsageError(f"a check holds the bake to all light as it is, and volume {other.name} captures other light",
                         "add --no-check")
    kept: list[Field] = []
    # Nobody else takes the place while the plan is made.
    with workplace(check_target(out, inputs=scene.files), "bake") as place:
        plan = plan_scene(scene, target, seed=seed, threads=threads, volume=volume, motion=motion, others=False,
                          progress=progress.span(0.0, PLANNED_AT)).plan
        settings = {**plan.settings, **({"direct": True} if direct else {})}
        with count_rays() as counter:
            names = None if volume is None else [one.name for one in plan.volumes]
            summary = bake_scene(plan.applied(scene), plan.technique, settings, place, seed=seed, threads=threads, volume=names,
                                 keep=kept.append, begun=plan.found.reading.pilot.begun,
                                 progress=progress.span(PLANNED_AT, BAKED_AT if check else 1.0), **options)
    if keep is not None:
        keep(kept[0])
    found = None
    if check:
        progress.stage("verify")
        # Of the rays, as of the seconds, those of a fit and of sphere probes were not predicted.
        rays = counter.rays - sum(one["rays"] for one in kept[0].stats.get("fits", ())) - summary.stats.get("spheres_traced", 0)
        made, seconds = plan.found.finished, summary.seconds
        if made is not None and kept[0] is made.field:
            # The bake was made to plan it.
            rays, seconds = rays + made.rays, {**seconds, "in the plan": made.seconds}
        found = check_plan(plan, scene, kept[0], seconds, rays, threads, progress.span(BAKED_AT, 1.0))
        summary = replace(summary, seconds=progress.finish())
    return PlannedBake(plan, summary, found)


def bake_fitted(scene: Scene, out, *, progress: Progress | None = None, **options) -> PlannedBake | BakeSummary:
    """Bake ``scene``, whose volume was fitted because it has none, into ``out`` as a plan for the usual target says, without a
    check: how dense probes have to stand is not to be seen from the size of a scene. Probes that no surface reads stay, for what
    may move there. Where no surface is seen that a plan could go by, the fitted lattice is baked by defaults.

    ``options`` go to bake_planned. Raises as that does.
    """
    progress = progress or Progress()
    try:
        return bake_planned(scene, Target(keep_air=True), out, check=False, progress=progress, **options)
    except NothingToSee:
        options = {name: value for name, value in options.items() if name != "motion"}
        return bake_scene(scene, USUAL, {}, out, progress=progress, **options)


def check_plan(plan: Plan, scene: Scene, field: Field, seconds: dict[str, float], rays: int, threads: int | None,
               progress: Progress) -> Check:
    """Hold the baked ``field``, as the bundle ships it, to the path tracer at receivers of another seed; ``seconds`` by stage and
    ``rays`` are what the bake took. Raises Cancelled."""
    names = {volume.name for volume in plan.volumes}
    files = tuple(volume for volume in scene.volumes if volume.name in names)
    context = LightContext(scene, threads)
    sample = draw_sample(context, files, CHECK_POINTS, plan.seed ^ HELD_BACK)
    truth = PathReference(context, CHECK_NOISE, CHECK_PATHS, plan.seed + 1).irradiance(sample.receivers, progress)
    found = ProbeField.of(field).irradiance(sample.receivers.points, sample.receivers.normals)
    error, interval = sample.error(found, truth), sample.interval(found, truth, CHECKED)
    chosen, taken = plan.chosen, sum(value for stage, value in seconds.items() if stage not in _OTHER_STAGES)
    return Check(chosen.error, error, *interval, truth.noise, sample.points, chosen.price.seconds, taken, chosen.price.rays, rays,
                 plan.target.error)


def plan_text(plan: Plan, table: bool = True) -> str:
    """The plan as lines for a person, with or without the table of what else there is."""
    lines = [f"Planned: {what(plan)}", f"  error    {error(plan)}", f"  cost     {cost(plan)}", "",
             *(f"  {line}" for line in (*plan.reasons, *filter(None, [by_rays(plan)])))]
    if table:
        lines += ["", *_table(plan)]
    price = plan.chosen.price
    return as_lines([*lines, f"  The plan took {spoken(plan.seconds)} and {plan.rays / 1e6:.2g} million rays; the bake is thought "
                              f"to take {spoken(price.seconds)} and {price.rays / 1e6:.2g} million."])


def plan_json(plan: Plan) -> dict:
    """The plan as JSON-able values."""
    return plain({
        "technique": plan.technique, "settings": plan.settings, "met": plan.met, "target": asdict(plan.target), "seed": plan.seed,
        "volumes": [{"name": volume.name, "resolution": list(volume.resolution),
                     "kept": None if volume.wanted is None else int(np.sum(volume.wanted)), "within": volume.planned or None,
                     "world_from_local": volume.world_from_local, "dropped": _dropped(volume)} for volume in plan.volumes],
        "probes": plan.probes, "kept": plan.kept, "confidence": CONFIDENCE, "convergence_rate": plan.rate,
        "reasons": list(plan.reasons), "picture": _picture_json(plan), "scene": asdict(plan.look),
        "options": [_option_json(option) for option in plan.options],
        "measured": [{"resolutions": [list(resolution) for resolution in reading.resolutions],
                      "error": reading.error(plan.found.order)._asdict()} for reading in plan.found.climb],
        "plan_seconds": plan.seconds, "plan_rays": plan.rays})


def _picture_json(plan: Plan) -> dict | None:
    look, asked = plan.picture, plan.target.error
    return None if look is None else {**asdict(look), "samples": look.samples(asked), "seconds": look.seconds(asked)}


def _dropped(volume: ProbeVolume) -> list[list[int]]:
    """Ranges [first, last] of the flat indices, x fastest, of the probes of ``volume`` that get no rays."""
    if volume.wanted is None:
        return []
    edges = np.flatnonzero(np.diff(np.concatenate([[False], ~np.asarray(volume.wanted, bool).ravel(), [False]])))
    return [[int(first), int(last) - 1] for first, last in edges.reshape(-1, 2)]


def _option_json(option) -> dict:
    values = {"technique": option.technique, "label": option.label, "resolutions": [list(part) for part in option.resolutions],
              "meets": option.meets}
    if option.why_not:
        return {**values, "why_not": option.why_not}
    return {**values, "error": option.error._asdict(), **asdict(option.price)}


def _table(plan: Plan) -> list[str]:
    """What is planned and what else there is, in columns."""
    rows = [("technique", "how", "probes", "error", "below*", "time", "memory", "")]
    for option in plan.options:
        start = option.technique, option.label, size(option.resolutions)
        if option.why_not:
            rows.append((*start, "-", "-", "-", "-", option.why_not))
            continue
        price = option.price
        rows.append((*start, percent(option.error.value), percent(upper(option.error)), spoken(price.seconds),
                     f"{price.bytes / 2**20:,.0f} MiB", "meets it" if option.meets else ""))
    widths = [max(len(row[column]) for row in rows) for column in range(len(rows[0]))]
    lines = ["  " + "  ".join(cell.ljust(width) for cell, width in zip(row, widths, strict=True)).rstrip() for row in rows]
    return [*lines, f"  * with {100 * CONFIDENCE:.0f} % confidence, over the choice of surface points"]


def _without_plan(notes: tuple[str, ...]) -> tuple[str, ...]:
    return tuple(note for note in notes if not note.startswith("planned: "))
