"""When light is so concentrated that it should be sampled rather than left to chance."""

import numpy as np

# What rises above this many times the mean of the rest counts as concentrated.
CONCENTRATION = 4.0
# The concentrated part must take at least this relative variance (its mean square over the squared mean).
WORTHWHILE_VARIANCE = 0.05
# The limit is settled once a step leaves this share of it, or after so many steps.
_SETTLED, _MOST_STEPS = 0.99, 64


def concentration_limit(brightness: np.ndarray, share: np.ndarray) -> float:
    """The brightness above which light counts as concentrated; infinite if there is too little to be worth a shadow ray.

    ``brightness`` and ``share`` have one shape; the shares sum to 1. The limit is the fixed point of
    T = CONCENTRATION × mean(min(L, T)): the mean of what remains, not of what is taken out.
    """
    mean = float((brightness * share).sum())
    if mean <= 0.0:
        return np.inf
    limit = np.inf
    for _ in range(_MOST_STEPS):
        following = CONCENTRATION * float((np.minimum(brightness, limit) * share).sum())
        settled = following >= _SETTLED * limit
        limit = following
        if settled:
            break
    excess = np.maximum(brightness - limit, 0.0)
    return limit if float((excess**2 * share).sum()) > WORTHWHILE_VARIANCE * mean**2 else np.inf
