"""How many rays each probe needs, from how far two independent parts of its own sequence disagree.

An Owen-scrambled Sobol sequence errs like c·N^−slope. The estimates from its first N₁ and its next N₂ points are nearly
independent, so their mean square difference is c²(N₁^−2s + N₂^−2s): that gives c, and with it the error of all N₁ + N₂ points
and the number that a smaller error takes. The slope is what rays at sharp patches of light reach (−.66 measured in a sunlit
atrium); smooth rooms do better (−.77 to −.81, PHYSICS.md §5).
"""

import numpy as np

FIRST_ROUND = 256
SLOPE = 0.65
# One probe's difference is one sample of its error: lean on the mean of its neighbours by this share.
POOLED = 0.5
# Weight of what earlier rounds said of a probe's error in what the next one makes of it.
REMEMBERED = 0.5
# Share of the target left to the sampling of probe rays; the rest is for the surface cache.
SAMPLING_SHARE = 0.75
# A round goes this share of the way that the last estimate asks for, so that an overestimate is noticed before it is paid for.
STRIDE = 0.7


class ErrorModel:
    """Keeps the sums of each probe's rays and says what error they have.

    ``total`` (p, k, 3) float64 sums of 4π·L·Y over all ``rays`` (p,) int64.
    """

    def __init__(self, probes: int, coefficients: int):
        self.total = np.zeros((probes, coefficients, 3))
        self.rays = np.zeros(probes, np.int64)
        self._constant = np.full(probes, np.nan)

    def coefficients(self) -> np.ndarray:
        """SH estimate (p, k, 3) from all rays so far; zero where none were traced."""
        return self.total / np.maximum(self.rays, 1)[:, None, None]

    def add(self, probes: np.ndarray, sums: np.ndarray, rays: np.ndarray) -> None:
        """Add the ``sums`` (m, k, 3) of ``rays`` (m,) further rays of ``probes`` (m,), and compare them with those before."""
        before = self.rays[probes]
        compared = np.flatnonzero(before > 0)
        if compared.size:
            rows, n1, n2 = probes[compared], before[compared].astype(float), rays[compared].astype(float)
            difference = self.total[rows] / n1[:, None, None] - sums[compared] / n2[:, None, None]
            spread = n1 ** (-2 * SLOPE) + n2 ** (-2 * SLOPE)
            found = (difference**2).sum(axis=(1, 2)) / spread
            # One difference may be small by luck, and a probe that stops by it stays wrong: earlier ones keep half the say.
            known = np.where(np.isnan(self._constant[rows]), found, self._constant[rows] ** 2)
            self._constant[rows] = np.sqrt((1.0 - REMEMBERED) * found + REMEMBERED * known)
        self.total[probes] += sums
        self.rays[probes] += rays

    def state(self) -> dict[str, np.ndarray]:
        """Everything it knows, for a checkpoint."""
        return {"total": self.total, "rays": self.rays, "constant": self._constant}

    def restore(self, arrays: dict[str, np.ndarray]) -> None:
        """Take up from ``state``."""
        self.total, self.rays, self._constant = arrays["total"], arrays["rays"], arrays["constant"]

    def error(self, probes: np.ndarray, groups: np.ndarray) -> np.ndarray:
        """Estimated norm (m,) of each probe's error, pooled over the probes of its group (m,) int, relative to their scale."""
        return self._relative(probes, groups) * self.scale(probes) * self.rays[probes] ** -SLOPE

    def rays_needed(self, probes: np.ndarray, groups: np.ndarray, target: float) -> np.ndarray:
        """Number of rays (m,) at which each probe's error is expected to fall to ``target`` times its scale."""
        return (self._relative(probes, groups) / target) ** (1.0 / SLOPE)

    def scale(self, probes: np.ndarray) -> np.ndarray:
        """What a relative error is relative to (m,): the probe's own norm, or for dim probes its geometric mean with the RMS of
        all, since a few per cent of a dark corner are less seen than one of a bright wall."""
        norms = np.sqrt((self.coefficients() ** 2).sum(axis=(1, 2)))
        traced = self.rays > 0
        rms = np.sqrt((norms[traced] ** 2).mean()) if traced.any() else 0.0
        return np.sqrt(norms[probes] * np.maximum(norms[probes], rms))

    def _relative(self, probes, groups):
        scale = self.scale(probes)
        own = np.where(scale > 0, self._constant[probes] / np.where(scale > 0, scale, 1.0), 0.0)
        count = np.maximum(np.bincount(groups), 1)
        pooled = (np.bincount(groups, own**2) / count)[groups]
        return np.sqrt((1.0 - POOLED) * own**2 + POOLED * pooled)


def ladder(rays: np.ndarray, highest: int) -> np.ndarray:
    """The least number of rays not below ``rays`` (m,) on a ladder of four even rungs an octave from FIRST_ROUND up, at most
    ``highest``: few enough different numbers that neighbouring probes can share their work."""
    rung = FIRST_ROUND / 4.0 * 2.0 ** np.floor(np.log2(np.maximum(rays, FIRST_ROUND) / FIRST_ROUND))
    return np.minimum(np.ceil(rays / rung) * rung, highest).astype(np.int64)
