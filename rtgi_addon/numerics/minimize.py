"""Minima of smooth functions of many variables: quadratic ones by conjugate gradients, others by limited-memory BFGS.

Source: J. Nocedal and S. J. Wright, *Numerical Optimization*, 2nd edition, 2006: algorithms 5.2 (conjugate gradients), 7.4 (the
two-loop recursion), 7.5, and 3.1 (backtracking).
"""

from collections.abc import Callable

import numpy as np

# Pairs of steps and changes of the gradient that stand for the curvature, how often a step that leads too far is shortened, by how
# much at a time, and the share of the expected decrease that is enough.
MEMORY, MOST_TRIES, SHORTER, ENOUGH = 12, 10, (0.1, 0.5), 1e-4


def minimize(function: Callable[[np.ndarray], tuple[float, np.ndarray]], start: np.ndarray, steps: int,
             first_step: float, enough: Callable[[], bool] | None = None) -> np.ndarray:
    """The point (n,) float64 that up to ``steps`` steps from ``start`` (n,) lead to, none of which raises ``function``.

    ``function`` gives value and gradient (n,); ``first_step`` is how far the largest variable may move at first, before anything is
    known of the curvature. ``enough`` is asked after each step, with ``function`` last called where it led: True ends the search.
    """
    place = np.array(start, np.float64)
    value, gradient = function(place)
    pairs: list[tuple[np.ndarray, np.ndarray, float]] = []
    for _ in range(steps):
        direction = _downhill(gradient, pairs, first_step)
        slope, share = _dot(gradient, direction), 1.0
        for _ in range(MOST_TRIES):
            tried = place + share * direction
            new_value, new_gradient = function(tried)
            if new_value <= value + ENOUGH * share * slope:
                break
            # Where a parabola through what is known has its minimum.
            bend = new_value - value - share * slope
            shorter = -0.5 * share * slope / bend if np.isfinite(bend) and bend > 0.0 else 0.0
            share *= float(np.clip(shorter, *SHORTER))
        else:
            break
        step, change = tried - place, new_gradient - gradient
        curvature = _dot(step, change)
        if curvature > 1e-12 * _dot(change, change):
            pairs = [*pairs[-MEMORY + 1:], (step, change, curvature)]
        place, value, gradient = tried, new_value, new_gradient
        if enough is not None and enough():
            break
    return place


def solve(product: Callable[[np.ndarray], np.ndarray], right: np.ndarray, steps: int, enough: float = 1e-3,
          whole: np.ndarray | None = None) -> np.ndarray:
    """What ``product``, by a symmetric matrix without negative eigenvalues, turns into ``right`` (…, c), each of the c columns by
    itself: up to ``steps`` steps of conjugate gradients from zero, fewer once what is missing is ``enough`` of ``right``, or of the
    ``whole`` (…, c) of which ``right`` is what a first guess left."""
    found, missing = np.zeros_like(right), right.copy()
    direction = missing
    axes = tuple(range(right.ndim - 1))
    power = np.sum(missing**2, axis=axes)
    little = enough**2 * (power if whole is None else np.sum(whole**2, axis=axes))
    for _ in range(steps):
        if np.all(power <= little):
            break
        turned = product(direction)
        curvature = np.sum(direction * turned, axis=axes)
        share = np.where(curvature > 0, power / np.where(curvature > 0, curvature, 1.0), 0.0)
        found, missing = found + share * direction, missing - share * turned
        before, power = power, np.sum(missing**2, axis=axes)
        direction = missing + np.where(before > 0, power / np.where(before > 0, before, 1.0), 0.0) * direction
    return found


def _downhill(gradient: np.ndarray, pairs, first_step: float) -> np.ndarray:
    """Minus the product of the inverse curvature that ``pairs`` tell and the ``gradient`` (n,)."""
    direction, shares = -gradient, []
    for step, change, curvature in reversed(pairs):
        shares.append(_dot(step, direction) / curvature)
        direction = direction - shares[-1] * change
    if pairs:
        _, change, curvature = pairs[-1]
        direction *= curvature / _dot(change, change)
    else:
        direction *= first_step / max(float(np.abs(gradient).max()), np.finfo(np.float64).tiny)
    for (step, change, curvature), share in zip(pairs, reversed(shares), strict=True):
        direction = direction + step * (share - _dot(change, direction) / curvature)
    return direction


def _dot(a: np.ndarray, b: np.ndarray) -> float:
    # Not BLAS, whose threads wait busily for work as short as this.
    return float(np.einsum("i,i->", a, b))
