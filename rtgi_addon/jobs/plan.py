"""From a Scene to a plan, and from a plan to a finished bundle that says how good the plan was."""

from dataclasses import asdict, dataclass, replace

import numpy as np

from ..errors import UsageError
from ..evaluate.metrics import Figure
from ..evaluate.plan import Plan, Target, make_plan
from ..evaluate.plan.look import Motion
from ..evaluate.plan.reasons import percent, size
from ..evaluate.plan.sample import draw_sample
from ..evaluate.plan.search import CONFIDENCE, upper
from ..evaluate.references import PathReference
from ..exchange.bundle import check_target
from ..exchange.plain import plain
from ..progress import Progress
from ..scene import Scene
from ..scene.checks import check_scene, require
from ..techniques import Field
from ..techniques.probes.field import ProbeField
from ..transport.context import LightContext
from ..transport.ray_counter import count_rays
from .bake import bake_scene, select_volumes
from .report import BakeSummary

# Shares of the progress of a planned bake: the plan until the first, the bake until the second, then the check.
PLANNED_AT, BAKED_AT = 0.3, 0.9
# Surface points that a plan is checked on, which it has not seen; noise of their reference, and the most paths of all of them.
CHECK_POINTS, CHECK_NOISE, CHECK_PATHS = 256, 0.05, 1 << 18
# What makes the receivers of the check others than those of the plan.
HELD_BACK = 0x68656C64
# Stages that are not part of what a plan predicts the seconds of.
_OTHER_STAGES = frozenset({"plan", "extract", "check", "write", "verify", "picture"})


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
    by the path tracer with relative ``noise``, which is taken out. ``seconds`` and ``rays`` are those of the bake without plan,
    checks and files."""

    predicted: Figure
    error: Figure
    noise: float
    points: int
    predicted_seconds: float
    seconds: float
    predicted_rays: float
    rays: int
    target: float

    @property
    def within(self) -> bool:
        """Whether the error is below the target, or above it by less than one-sided CONFIDENCE takes."""
        return 2.0 * self.error.value - upper(self.error) <= self.target

    def to_text(self) -> str:
        """Two lines for a person."""
        verdict = "" if self.error.value <= self.target else \
            f", above {percent(self.target)} by less than the check can tell" if self.within else f", above {percent(self.target)}"
        return (f"  error    {percent(self.predicted.value)} predicted, {percent(self.error.value)} +- "
                f"{percent(self.error.standard_error)} found at {self.points} surface points that the plan did not see{verdict}\n"
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
    return PlanReport(make_plan(scene, target, seed=seed, threads=threads, motion=motion, others=others, progress=progress))


def bake_planned(scene: Scene, target: Target, out, *, seed: int = 0, threads: int | None = None, volume=None,
                 motion: Motion | None = None, check: bool = True, direct: bool = False, progress: Progress | None = None,
                 **options) -> PlannedBake:
    """Plan, bake into ``out`` as planned, and ``check`` the result at receivers that were held back.

    ``options`` go to bake_scene. The plan is in the bundle's notes. Raises as bake_scene does.
    """
    progress = progress or Progress()
    if direct and check:
        raise UsageError("a check holds the bake to indirect light, and --direct adds the lamps'", "add --no-check")
    check_target(out)
    plan = plan_scene(scene, target, seed=seed, threads=threads, volume=volume, motion=motion, others=False,
                      progress=progress.span(0.0, PLANNED_AT)).plan
    planned = plan.applied(scene)
    kept: list[Field] = []
    settings = {**plan.settings, **({"direct": True} if direct else {})}
    with count_rays() as counter:
        summary = bake_scene(planned, plan.technique, settings, out, seed=seed, threads=threads, volume=volume, keep=kept.append,
                             progress=progress.span(PLANNED_AT, BAKED_AT if check else 1.0), **options)
    found = None
    if check:
        progress.stage("verify")
        found = check_plan(plan, scene, kept[0], summary.seconds, counter.rays, threads, progress.span(BAKED_AT, 1.0))
        summary = replace(summary, seconds=progress.finish())
    return PlannedBake(plan, summary, found)


def check_plan(plan: Plan, scene: Scene, field: Field, seconds: dict[str, float], rays: int, threads: int | None,
               progress: Progress) -> Check:
    """Hold the baked ``field``, as the bundle ships it, to the path tracer at receivers of another seed; ``seconds`` by stage and
    ``rays`` are what the bake took. Raises Cancelled."""
    names = {volume.name for volume in plan.volumes}
    files = tuple(volume for volume in scene.volumes if volume.name in names)
    context = LightContext(scene, threads)
    sample = draw_sample(context, files, CHECK_POINTS, plan.seed ^ HELD_BACK)
    truth = PathReference(context, CHECK_NOISE, CHECK_PATHS, plan.seed + 1).irradiance(sample.receivers, progress)
    shipped = field if isinstance(field, ProbeField) else ProbeField(field.grids(), includes_direct=field.includes_direct)
    error = sample.error(shipped.irradiance(sample.receivers.points, sample.receivers.normals), truth)
    chosen, taken = plan.chosen, sum(value for stage, value in seconds.items() if stage not in _OTHER_STAGES)
    return Check(chosen.error, error, truth.noise, sample.points, chosen.price.seconds, taken, chosen.price.rays, rays,
                 plan.target.error)


def plan_text(plan: Plan, table: bool = True) -> str:
    """The plan as lines for a person, with or without the table of what else there is."""
    settings = ", ".join(f"{name} {value:g}" for name, value in plan.settings.items())
    lines = [f"Planned: {plan.technique} with {settings} on {', '.join(f'{v.name} {size([v.resolution])}' for v in plan.volumes)}"
             + ("" if plan.met else f" ({percent(plan.target.error)} is out of reach)"),
             *(f"  {line}" for line in plan.reasons)]
    if table:
        lines += ["", *_table(plan)]
    price = plan.chosen.price
    return "\n".join([*lines, f"  The plan took {plan.seconds:.2g} s and {plan.rays / 1e6:.2g} million rays; the bake is thought "
                              f"to take {price.seconds:.2g} s and {price.rays / 1e6:.2g} million."])


def plan_json(plan: Plan) -> dict:
    """The plan as JSON-able values."""
    return plain({
        "technique": plan.technique, "settings": plan.settings, "met": plan.met, "target": asdict(plan.target), "seed": plan.seed,
        "volumes": [{"name": volume.name, "resolution": list(volume.resolution),
                     "kept": None if volume.wanted is None else int(np.sum(volume.wanted))} for volume in plan.volumes],
        "probes": plan.probes, "kept": plan.kept, "confidence": CONFIDENCE, "convergence_rate": plan.rate,
        "reasons": list(plan.reasons), "scene": asdict(plan.look), "options": [_option_json(option) for option in plan.options],
        "measured": [{"resolutions": [list(resolution) for resolution in reading.resolutions],
                      "error": reading.error(plan.found.order)._asdict()} for reading in plan.found.climb],
        "plan_seconds": plan.seconds, "plan_rays": plan.rays})


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
        rows.append((*start, percent(option.error.value), percent(upper(option.error)), f"{price.seconds:.2g} s",
                     f"{price.bytes / 2**20:,.0f} MiB", "meets it" if option.meets else ""))
    widths = [max(len(row[column]) for row in rows) for column in range(len(rows[0]))]
    lines = ["  " + "  ".join(cell.ljust(width) for cell, width in zip(row, widths, strict=True)).rstrip() for row in rows]
    return [*lines, f"  * with {100 * CONFIDENCE:.0f} % confidence, over the choice of surface points"]


def _without_plan(notes: tuple[str, ...]) -> tuple[str, ...]:
    return tuple(note for note in notes if not note.startswith("planned: "))
