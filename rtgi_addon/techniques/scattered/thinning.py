"""Which of the candidates become probes: as few as predict the light at all others within a target."""

import numpy as np

from ...numerics import sh
from ...numerics.sampling import fibonacci_sphere
from ...progress import Progress
from ...transport.context import LightContext
from .blending import nearest, seeing, shares

# Candidates about each that may predict it.
AROUND = 96
# Normals under which light is compared.
NORMALS = 14
# Differences count against the light of a place, or this share of the light of all where that is less.
LEAST_LIGHT = 0.15
# No candidate within this many spacings of one that was chosen, and that it sees, is chosen in the same round: it may be needed no
# more.
SAME_ROUND = 1.5
MOST_ROUNDS = 64
# Only a probe within this many spacings stands for a candidate. From farther its tile does not tell the two sides of a wall apart:
# where all light is alike, a room with a single probe took some from the room next door.
FARTHEST = 2.0


def thinned(context: LightContext, points: np.ndarray, kept: np.ndarray, light: list[tuple[np.ndarray, np.ndarray]], spacing: float,
            error: float, progress: Progress) -> np.ndarray:
    """(n,) bool: the ``points`` (n, 3) that become probes, those that are ``kept`` (n,) among them. ``light`` are coefficients
    (n, k, 3) and their standard errors (n,) under each light that counts, of which those of the others shall be predicted within
    ``error``. Raises Cancelled."""
    rows = nearest(points, points, AROUND + 1)
    seen = seeing(context, points, points, rows, progress)
    distance = np.linalg.norm(points[rows] - points[:, None], axis=2)
    seen &= (rows != np.arange(len(points))[:, None]) & (distance <= FARTHEST * spacing)
    near = distance <= SAME_ROUND * spacing
    values, noise, scale = (np.stack(part) for part in zip(*(_irradiance(*one) for one in light), strict=True))
    chosen, open_rows = kept.copy(), np.flatnonzero(~kept)
    for number in range(MOST_ROUNDS):
        progress.step(number / MOST_ROUNDS, "thinning probes")
        of, weight = shares(points[open_rows], points, rows[open_rows], seen[open_rows] & chosen[rows[open_rows]])
        off = _off(values, noise, scale, open_rows, of, weight)
        # Who is seen by no probe yet comes first, and among those who see most.
        alone = weight.sum(axis=1) == 0
        urgency = np.where(alone, 1e6 + seen[open_rows].sum(axis=1), off)
        wanted = np.flatnonzero(urgency > error)
        if not len(wanted):
            break
        chosen[_apart(open_rows[wanted[np.argsort(-urgency[wanted], kind="stable")]], rows, seen,
                      near if number else np.ones_like(near))] = True
        open_rows = np.flatnonzero(~chosen)
    return chosen


def _irradiance(coefficients: np.ndarray, error: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Irradiance (n, NORMALS·3) under some normals, its variance (n,) for all of them together, and the squares (n,) that
    differences are compared with."""
    order = sh.order_of(coefficients.shape[1])
    basis = sh.evaluate(fibonacci_sphere(NORMALS).astype(np.float64), order) * sh.cosine_coefficients(order)
    values = np.einsum("dk,nkc->ndc", basis, coefficients).reshape(len(coefficients), -1)
    variance = np.where(np.isfinite(error), error, 0.0) ** 2 * np.sum(basis**2) * 3.0
    square = np.sum(values**2, axis=1)
    return values, variance, np.maximum(square, LEAST_LIGHT**2 * max(float(square.mean()), 1e-30))


def _off(values, noise, scale, places, of, weight) -> np.ndarray:
    """How far (m,) light at ``places`` (m,) is off if it is that of ``of`` (m, k) by ``weight`` (m, k), relative, noise taken out:
    the largest of all lights."""
    worst = np.zeros(len(places))
    for light, variance, square in zip(values, noise, scale, strict=True):
        predicted = np.zeros((len(places), light.shape[1]))
        for slot in range(of.shape[1]):
            predicted += weight[:, slot, None] * light[of[:, slot]]
        off = np.sum((predicted - light[places]) ** 2, axis=1) - variance[places] - np.sum(weight**2 * variance[of], axis=1)
        worst = np.maximum(worst, np.sqrt(np.maximum(off, 0.0) / square[places]))
    return worst


def _apart(wanted: np.ndarray, rows: np.ndarray, seen: np.ndarray, near: np.ndarray) -> list[int]:
    """Of ``wanted`` (m,), most urgent first, those that none chosen before them sees from ``near``."""
    taken, found = np.zeros(len(rows), bool), []
    for place in wanted.tolist():
        if not taken[place]:
            found.append(place)
            taken[rows[place][seen[place] & near[place]]] = True
    return found
