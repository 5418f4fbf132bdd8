"""Which lamps a frame is lit by, where there are more than it can draw shadow maps for."""

import numpy as np

# This share of the chances is the same for all lamps: a faint one that stands close by may matter most.
_EVEN = 0.5
# Halvings of the interval in which the scale of chances lies: more than a float64 tells apart.
_BISECTIONS = 60


def lamp_chances(power: np.ndarray, views: np.ndarray, budget: int) -> np.ndarray:
    """The probability (n,) with which each lamp of luminous ``power`` (n,) [W] and a number of ``views`` (n,) is taken, such that
    the views of those taken are ``budget`` on average; 1 for all where they fit."""
    count = len(power)
    if float(np.sum(views)) <= budget:
        return np.ones(count)
    importance = _EVEN / count + (1.0 - _EVEN) * np.asarray(power, np.float64) / max(float(np.sum(power)), 1e-30)
    low, high = 0.0, 1.0 / float(importance.min())
    for _ in range(_BISECTIONS):
        scale = 0.5 * (low + high)
        if float(np.sum(views * np.minimum(scale * importance, 1.0))) > budget:
            high = scale
        else:
            low = scale
    return np.minimum(low * importance, 1.0)


def choose_lamps(chances: np.ndarray, u: float) -> list[tuple[int, float]]:
    """Lamps taken with their ``chances`` (n,) and what to multiply their light by: systematic sampling with one number ``u`` in
    [0, 1), which takes each lamp evenly often over a sequence of even numbers."""
    steps = np.floor(np.concatenate([[0.0], np.cumsum(chances)]) + u)
    return [(index, 1.0 / float(chances[index])) for index in np.flatnonzero(np.diff(steps) > 0).tolist()]
