"""Which settings are worth their cost: the Pareto front, and what each technique has to offer at equal cost or equal error.

Nothing is interpolated: every entry is a setting that was measured.
"""

import numpy as np


def pareto_front(costs, errors) -> np.ndarray:
    """Indices of the points that no other point beats in both, by rising cost; of equal points the first."""
    costs, errors = np.asarray(costs, np.float64), np.asarray(errors, np.float64)
    order = np.lexsort((errors, costs))
    order = order[np.isfinite(costs[order]) & np.isfinite(errors[order])]
    best = np.minimum.accumulate(np.concatenate([[np.inf], errors[order]]))
    return order[errors[order] < best[:-1]]


def best_within(costs, errors, budget: float) -> int | None:
    """The index of the least error among points that cost at most ``budget``; None if nothing does."""
    costs, errors = np.asarray(costs, np.float64), np.asarray(errors, np.float64)
    affordable = np.flatnonzero(costs <= budget)
    return int(affordable[np.argmin(errors[affordable])]) if len(affordable) else None


def cheapest_within(costs, errors, target: float) -> int | None:
    """The index of the least cost among points whose error is at most ``target``; None if none is."""
    return best_within(errors, costs, target)


def round_steps(low: float, high: float, factors: tuple[float, ...] = (1.0, 2.0, 5.0)) -> list[float]:
    """``factors`` times powers of ten, from the first at or above ``low`` to the first at or above ``high``; both positive."""
    exponents = range(int(np.floor(np.log10(low))), int(np.ceil(np.log10(high))) + 1)
    steps = [factor * 10.0**exponent for exponent in exponents for factor in factors]
    last = next(step for step in [*steps, np.inf] if step >= high * (1 - 1e-9))
    return [step for step in steps if low * (1 - 1e-9) <= step <= last]
