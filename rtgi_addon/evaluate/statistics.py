"""Several seeds of one setting as one figure each, with an interval, and noise kept apart from what all seeds share."""

from dataclasses import dataclass

import numpy as np

from .measure import Run, Yard

# Two-sided 95 % quantiles of Student's t for 1 … 10 degrees of freedom; beyond, 1.96 + 2.5/ν is within 0.3 %.
CONFIDENCE = 0.95
T_QUANTILES = (12.706, 4.303, 3.182, 2.776, 2.571, 2.447, 2.365, 2.306, 2.262, 2.228)


@dataclass(frozen=True)
class Interval:
    """A ``mean`` over seeds and the 95 % confidence interval ``low`` to ``high`` of it; both None with one seed."""

    mean: float
    low: float | None = None
    high: float | None = None


@dataclass(frozen=True)
class Spread:
    """An error over seeds. ``error`` is the relative RMSE of one bake; of its square, ``systematic``² is what every seed has in
    common and ``random``² what differs between them (None with one seed)."""

    error: Interval
    systematic: float | None
    random: float | None


def interval(values) -> Interval:
    """Mean and Student's t interval of ``values``, one a seed."""
    values = np.asarray(values, np.float64)
    mean = float(values.mean())
    if len(values) < 2:
        return Interval(mean)
    half = _t(len(values) - 1) * float(values.std(ddof=1)) / np.sqrt(len(values))
    return Interval(mean, mean - half, mean + half)


def log_interval(values) -> Interval:
    """The same for positive values that vary by factors, such as seconds and errors: on their logarithm. The mean is geometric; a
    value of 0 has no logarithm, then the interval ends at the extremes."""
    values = np.asarray(values, np.float64)
    if np.any(values <= 0):
        mean = float(values.mean())
        return Interval(mean) if len(values) < 2 else Interval(mean, float(values.min()), float(values.max()))
    logarithm = interval(np.log(values))
    return Interval(*(None if part is None else float(np.exp(part)) for part in (logarithm.mean, logarithm.low, logarithm.high)))


def spread(yard: Yard, technique, runs: list[Run], place: str) -> Spread:
    """The error of ``runs`` (one setting, different seeds) in ``place`` (measure.PLACES)."""
    error = log_interval([run.errors[place].error for run in runs])
    if len(runs) < 2:
        return Spread(error, None, None)
    truth = yard.truth_for(place, runs[0].estimates[place], technique)
    stack = np.stack([run.estimates[place] for run in runs]).astype(np.float64)
    if place == "probes":
        stack = stack[:, :, :truth.mean.shape[1]]
    power = float(np.sum(np.square(truth.mean)))
    if power == 0.0:
        return Spread(error, None, None)
    between = float(np.sum(stack.var(axis=0, ddof=1)))
    shared = float(np.sum((stack.mean(axis=0) - truth.mean) ** 2)) - between / len(runs) - float(np.sum(truth.variance))
    return Spread(error, float(np.sqrt(max(shared, 0.0) / power)), float(np.sqrt(between / power)))


def _t(degrees: int) -> float:
    return T_QUANTILES[degrees - 1] if degrees <= len(T_QUANTILES) else 1.96 + 2.5 / degrees
