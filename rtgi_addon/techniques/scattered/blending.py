"""Which probes stand for a place, and with what shares: those nearest of them that see it, by maximum entropy.

Shares are as even as they can be while their mean place is the place itself, near probes first: w_j ∝ exp(−β|p_j − x|² +
λ·(p_j − x)), where λ brings Σ w_j (p_j − x) to 0. So light that changes evenly is read as it is, and shares change smoothly with
the place. Where no λ does, outside of all probes, a small cost of λ leaves shares that come near.

Source: M. Arroyo and M. Ortiz, "Local maximum-entropy approximation schemes", Int. J. Numer. Methods Eng. 65(13), 2006.
"""

import numpy as np

from ...progress import Progress
from ...transport.context import LightContext
from ...transport.parallel import CHUNK, chunks, parallel_for
from ...transport.rays.tracer import SEGMENT

# Probes whose shares are found, of those that see a place.
NEAREST = 10
# β times the mean squared distance of these probes; and what |λ|² costs over the same, in the entropy's unit.
LOCALITY, COST = 2.0, 2e-3
_STEPS, _LONGEST_STEP = 12, 4.0
# Places and probes whose distances are held at once.
_PAIRS = 1 << 22


def nearest(places: np.ndarray, probes: np.ndarray, count: int) -> np.ndarray:
    """Rows (n, count) of the nearest of ``probes`` (p, 3) about each of ``places`` (n, 3), near ones first; all of them if there
    are fewer."""
    count = min(count, len(probes))
    found = np.empty((len(places), count), np.int64)
    norms = np.sum(probes**2, axis=1)
    for span in chunks(len(places), max(1, _PAIRS // max(1, len(probes)))):
        squares = norms - 2.0 * (places[span] @ probes.T)
        part = np.argpartition(squares, count - 1, axis=1)[:, :count] if count < len(probes) else np.tile(
            np.arange(count), (len(squares), 1))
        order = np.argsort(np.take_along_axis(squares, part, axis=1), axis=1, kind="stable")
        found[span] = np.take_along_axis(part, order, axis=1)
    return found


def seeing(context: LightContext, places: np.ndarray, probes: np.ndarray, rows: np.ndarray, progress: Progress) -> np.ndarray:
    """(n, m) bool: whether nothing lies between each of ``places`` (n, 3) and the ``probes`` (p, 3) in ``rows`` (n, m). Raises
    Cancelled."""
    spans = chunks(len(places), max(1, CHUNK // max(1, rows.shape[1])))

    def trace(i):
        origins = np.repeat(places[spans[i]], rows.shape[1], axis=0)
        way = probes[rows[spans[i]].ravel()] - origins
        limit = np.full(len(way), SEGMENT, np.float32)
        return ~context.tracer.occluded(origins.astype(np.float32), way.astype(np.float32), limit).reshape(-1, rows.shape[1])

    parts = parallel_for(trace, len(spans), context.threads, progress, "who sees whom")
    return np.concatenate([np.zeros((0, rows.shape[1]), bool), *parts])


def shares(places: np.ndarray, probes: np.ndarray, rows: np.ndarray, known: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The first NEAREST probes that are ``known`` (n, m) bool of those in ``rows`` (n, m), near ones first, for each of ``places``
    (n, 3): their rows (n, k) in ``probes`` (p, 3), and shares (n, k) float64 that sum to 1, or to 0 where none is known."""
    order = np.argsort(~known, axis=1, kind="stable")[:, :NEAREST]
    rows, known = np.take_along_axis(rows, order, axis=1), np.take_along_axis(known, order, axis=1)
    way = probes[rows] - places[:, None]
    square = np.where(known, np.sum(way**2, axis=2), 0.0)
    scale = np.sqrt(np.maximum(square.sum(axis=1) / np.maximum(known.sum(axis=1), 1), 1e-30))
    way, square = way / scale[:, None, None], square / scale[:, None] ** 2
    slope = np.zeros((len(places), 3))
    for _ in range(_STEPS):
        weight = _weights(way, square, known, slope)
        mean = np.einsum("nk,nkx->nx", weight, way)
        second = np.einsum("nk,nkx,nky->nxy", weight, way, way) - mean[:, :, None] * mean[:, None]
        step = np.linalg.solve(second + COST * np.eye(3), -(mean + COST * slope)[..., None])[..., 0]
        length = np.linalg.norm(step, axis=1, keepdims=True)
        slope += step * np.minimum(1.0, _LONGEST_STEP / np.maximum(length, 1e-30))
    return rows, _weights(way, square, known, slope)


def _weights(way: np.ndarray, square: np.ndarray, known: np.ndarray, slope: np.ndarray) -> np.ndarray:
    power = np.where(known, np.einsum("nkx,nx->nk", way, slope) - LOCALITY * square, -np.inf)
    highest = power.max(axis=1, keepdims=True)
    weight = np.exp(power - np.where(np.isfinite(highest), highest, 0.0))
    return weight / np.maximum(weight.sum(axis=1, keepdims=True), 1e-300)
