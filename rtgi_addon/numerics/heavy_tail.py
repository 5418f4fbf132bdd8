"""How far a relative RMSE over points may be from that over other points, where few points hold most of the squared error.

A bootstrap draws from the points there are, so it knows nothing of greater errors than theirs. Here the greatest squares are drawn
from a generalized Pareto distribution that is fitted to them: J. Pickands, "Statistical Inference Using Extreme Order Statistics",
Annals of Statistics 3(1), 1975, for why; J. Hosking and J. Wallis, "Parameter and Quantile Estimation for the Generalized Pareto
Distribution", Technometrics 29(3), 1987, eq. 4-5, for how. What lies below them is drawn as it is: B. Efron and R. Tibshirani, *An
Introduction to the Bootstrap*, 1993, §13. What no point was near stays unknown.
"""

import numpy as np

from .sampling import hash_u32, unit_interval

# Draws, the share of the points that are the tail, and the fewest of them.
DRAWS, TAIL, FEWEST = 300, 0.15, 10
# Exponents that are believed: a few hundred points say too little of a heavy tail, and above the second there is no mean.
LEAST_EXPONENT, GREATEST_EXPONENT = 0.5, 0.9
# Plotting position of Hosking and Wallis.
_POSITION = 0.35
_PURPOSE = 0x7461696C


def root_ratio(off: np.ndarray, power: np.ndarray) -> float:
    """√(Σ ``off`` / Σ ``power``) of squares (n,) each; 0 without power."""
    total = float(power.sum())
    return float(np.sqrt(max(float(off.sum()), 0.0) / total)) if total > 0 else 0.0


def interval_of_another_draw(off: np.ndarray, power: np.ndarray, confidence: float) -> tuple[float, float]:
    """Between what two values √(Σ off / Σ power) of as many other points lies with ``confidence``, from the squared errors ``off``
    (n,) and squares of the truth ``power`` (n,) of some: both draws vary, hence √2 times as far on the logarithm."""
    value = root_ratio(off, power)
    if value <= 0.0:
        return 0.0, float(np.quantile(_plain(off, power), 0.5 * (1.0 + confidence)))
    side = 0.5 * (1.0 - confidence)
    plain, tailed = _plain(off, power), _tailed(off, power)
    low = max(float(np.quantile(plain, side)), 1e-3 * value)
    high = max(value, *(float(np.quantile(draws, 1.0 - side)) for draws in (plain, tailed)))
    return float(value * min(low / value, 1.0) ** np.sqrt(2.0)), float(value * (high / value) ** np.sqrt(2.0))


def _rows(count: int) -> np.ndarray:
    return hash_u32(_PURPOSE, np.arange(DRAWS)[:, None], np.arange(count)) % np.uint32(count)


def _plain(off: np.ndarray, power: np.ndarray) -> np.ndarray:
    rows = _rows(len(off))
    return _roots(off[rows], power[rows])


def _tailed(off: np.ndarray, power: np.ndarray) -> np.ndarray:
    count = len(off)
    beyond = min(max(FEWEST, int(TAIL * count)), count - 1)
    if beyond < 2:
        return _plain(off, power)
    order = np.argsort(off, kind="stable")
    top = order[count - beyond:]
    threshold = max(float(off[order[count - beyond - 1]]), 0.0)
    excess = np.sort(np.maximum(off[top] - threshold, 0.0))
    mean = float(excess.mean())
    weighted = float(np.mean(excess * (1.0 - (np.arange(1, beyond + 1) - _POSITION) / beyond)))
    exponent = float(np.clip(2.0 - mean / max(mean - 2.0 * weighted, 1e-30), LEAST_EXPONENT, GREATEST_EXPONENT))
    scale = mean * (1.0 - exponent)
    rows, is_top = _rows(count), np.zeros(count, bool)
    is_top[top] = True
    drawn, replaced = off[rows], is_top[rows]
    number = 1.0 - unit_interval(hash_u32(_PURPOSE + 1, *np.nonzero(replaced)))
    drawn[replaced] = threshold + scale * (np.maximum(number, 1e-9) ** -exponent - 1.0) / exponent
    return _roots(drawn, power[rows])


def _roots(off: np.ndarray, power: np.ndarray) -> np.ndarray:
    return np.sqrt(np.maximum(off.sum(axis=1), 0.0) / np.maximum(power.sum(axis=1), 1e-300))
