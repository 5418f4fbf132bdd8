"""What a chart of speed against accuracy says, as data: one point for every setting of every technique, with figures over seeds."""

from dataclasses import asdict, dataclass

from ..techniques import Technique
from .measure import Run, Yard
from .pareto import pareto_front
from .pictures import PictureChart
from .setting_labels import setting_label
from .statistics import CONFIDENCE, Interval, Spread, interval, log_interval, spread

SCHEMA = "rtgi-chart/1"
# What a setting costs, by the names of Point's attributes.
COSTS = ("seconds", "rays", "peak_bytes")
MEBIBYTE = float(1 << 20)


@dataclass(frozen=True)
class Accuracy:
    """``spread`` of the error over seeds, ``bias`` with its interval, and means of the other figures of measure.Errors."""

    spread: Spread
    bias: Interval
    relmse: float
    energy: float
    leak: float | None
    true_leak: float | None
    minimum: float


@dataclass(frozen=True)
class Point:
    """One setting of one technique, measured with some seeds.

    ``label`` says what differs from the defaults; ``default`` is true for the defaults themselves; ``lattice`` multiplies the
    volumes' resolution; ``accuracy`` is by place (measure.PLACES); ``runs`` are the single bakes as plain values; ``stored`` are
    the forms that the first can be stored in (Field.stored_forms).
    """

    technique: str
    technique_label: str
    label: str
    default: bool
    lattice: float
    settings: dict
    seconds: Interval
    cpu_seconds: Interval
    rays: Interval
    peak_bytes: Interval | None
    field_bytes: int
    lookup_seconds: float
    accuracy: dict[str, Accuracy]
    runs: tuple[dict, ...]
    stored: tuple[dict, ...] = ()

    def error(self, place: str = "surface") -> float | None:
        """Relative RMSE in ``place``, mean over seeds; None where it was not measured."""
        return self.accuracy[place].spread.error.mean if place in self.accuracy else None

    def cost(self, name: str) -> float | None:
        """One of COSTS, mean over seeds; None where it is not known."""
        value = getattr(self, name)
        return None if value is None else value.mean


@dataclass(frozen=True)
class Chart:
    """All that was measured on one scene. ``points`` are in the order of techniques and their sweeps; ``left_out`` says, a line
    each, what was not measured and why; ``complete`` is false for a chart that was cancelled. ``reference`` holds kind and noise,
    ``receivers`` their numbers, ``floor`` the least error that can be told from none, ``machine`` where it ran; ``pictures`` are
    those of effects, None where none was measured. Without techniques ``reference`` and ``receivers`` are empty."""

    scene: str
    reference: dict
    receivers: dict
    floor: float
    seeds: int
    threads: int | None
    machine: dict
    points: tuple[Point, ...]
    left_out: tuple[str, ...] = ()
    complete: bool = True
    pictures: PictureChart | None = None

    def front(self, cost: str = "seconds", place: str = "surface") -> list[int]:
        """Indices of the points on the Pareto front of ``cost`` and error in ``place``, by rising cost."""
        rows = [index for index, point in enumerate(self.points) if None not in (point.cost(cost), point.error(place))]
        front = pareto_front([self.points[row].cost(cost) for row in rows], [self.points[row].error(place) for row in rows])
        return [rows[index] for index in front]

    def measured(self, place: str) -> list[Point]:
        """The points that were measured in ``place``."""
        return [point for point in self.points if place in point.accuracy]

    def techniques(self, place: str | None = None) -> list[str]:
        """Names of what was measured (in ``place``), in order: techniques, and the light atlas, which is in its place alone."""
        return list(dict.fromkeys(point.technique for point in (self.points if place is None else self.measured(place))))

    def to_json(self) -> dict:
        """Everything, as plain values once infinities are dealt with (exchange.plain)."""
        return {"schema": SCHEMA, "confidence": CONFIDENCE, **asdict(self),
                "fronts": {cost: self.front(cost) for cost in COSTS}}


def point_of(yard: Yard, technique: Technique, runs: list[Run]) -> Point:
    """The figures of ``runs``: one setting of ``technique``, one run a seed."""
    settings, default, lattice = runs[0].settings, technique.Settings(), runs[0].lattice
    label = setting_label(settings, default) if lattice == 1.0 else f"lattice × {lattice:g}"
    peaks = [run.costs.peak_bytes for run in runs]
    return Point(
        technique.name, technique.label, label, settings == default and lattice == 1.0, lattice,
        asdict(settings),
        seconds=log_interval([run.costs.seconds for run in runs]),
        cpu_seconds=log_interval([run.costs.cpu_seconds for run in runs]),
        rays=interval([run.costs.rays for run in runs]), peak_bytes=None if None in peaks else interval(peaks),
        field_bytes=runs[0].field_bytes, lookup_seconds=min(run.lookup_seconds for run in runs),
        accuracy={place: _accuracy(yard, technique, runs, place) for place in runs[0].errors},
        runs=tuple({"seed": run.seed, **asdict(run.costs), "lookup_seconds": run.lookup_seconds,
                    "errors": {place: asdict(errors) for place, errors in run.errors.items()}} for run in runs),
        stored=runs[0].stored)


def _accuracy(yard: Yard, technique: Technique, runs: list[Run], place: str) -> Accuracy:
    errors = [run.errors[place] for run in runs]

    def mean(name):
        values = [getattr(of_run, name) for of_run in errors]
        return None if None in values else sum(values) / len(values)

    bias = interval([of_run.bias for of_run in errors])
    return Accuracy(spread(yard, technique, runs, place), bias, mean("relmse"), mean("energy"), mean("leak"),
                    mean("true_leak"), mean("minimum"))
