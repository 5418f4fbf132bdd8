"""How many rays each probe needs: errors measured from halves of its own sequence, extrapolated along the scene's own slope.

Each doubling gives two estimates from as many rays, the first half of an Owen-scrambled Sobol sequence and the second; their
difference measures the error of a half. The error of the whole is smaller by more than √2, since the points stratify: by how much
is read off the differences of two successive doublings, over all probes.
"""

import numpy as np

FIRST_ROUND = 256
# Errors fall like N^−slope: −½ for independent samples, −1 for a smooth integrand.
SLOPE_RANGE = (0.5, 1.0)
# A probe dimmer than this share of the volume's RMS is held to the error of one that bright.
DIM = 0.25
# The estimate of one probe is one sample of its error: lean on the mean of its neighbours by this share.
POOLED = 0.5
# Share of the target left to the sampling of probe rays; the rest is for the surface cache.
SAMPLING_SHARE = 0.8


class ErrorModel:
    """Keeps the sums of each probe's halves and says what error the whole has.

    ``total`` and ``first_half`` (p, k, 3) float64 sums of 4π·L·Y over all rays, and over the first half of them; ``rays`` (p,)
    int64. ``slope`` is the last measured exponent.
    """

    def __init__(self, probes: int, coefficients: int):
        self.total = np.zeros((probes, coefficients, 3))
        self.first_half = np.zeros((probes, coefficients, 3))
        self.rays = np.zeros(probes, np.int64)
        self.slope = SLOPE_RANGE[0]
        self._coarse = None

    def coefficients(self) -> np.ndarray:
        """SH estimate (p, k, 3) from all rays so far; zero where none were traced."""
        return self.total / np.maximum(self.rays, 1)[:, None, None]

    def add_first(self, probes: np.ndarray, quarters: np.ndarray, rays: int) -> None:
        """Record the first round: sums of its four quarters (4, m, k, 3), ``rays`` in all."""
        halves = quarters[0] + quarters[1], quarters[2] + quarters[3]
        self.total[probes], self.first_half[probes] = halves[0] + halves[1], halves[0]
        self.rays[probes] = rays

    def measure_first(self, probes: np.ndarray, quarter_difference: np.ndarray) -> None:
        """Set the slope from the first round: ``quarter_difference`` (m,) mean square difference between quarters' estimates."""
        self._set_slope(quarter_difference.sum(), (self._half_difference(probes) ** 2).sum())

    def add_doubling(self, probes: np.ndarray, second_half: np.ndarray) -> None:
        """Record as many further rays as ``probes`` had before: sums (m, k, 3)."""
        self.first_half[probes] = self.total[probes]
        self.total[probes] += second_half
        self.rays[probes] *= 2

    def measure_doubling(self, probes: np.ndarray, difference_before: np.ndarray) -> None:
        """Update the slope from probes whose differences were ``difference_before`` (m,) one doubling ago."""
        if len(probes) >= 8:
            self._set_slope((difference_before**2).sum(), (self._half_difference(probes) ** 2).sum())

    def half_difference(self, probes: np.ndarray) -> np.ndarray:
        """RMS difference (m,) between the estimates of the two halves, over √2: the error of a half."""
        return self._half_difference(probes)

    def _half_difference(self, probes):
        half = (self.rays[probes] / 2)[:, None, None]
        second = (self.total[probes] - self.first_half[probes]) / half
        difference = self.first_half[probes] / half - second
        return np.sqrt((difference**2).sum(axis=(1, 2)) / 2.0)

    def _set_slope(self, before: float, after: float) -> None:
        if before > 0 and after > 0:
            self.slope = float(np.clip(0.5 * np.log2(before / after), *SLOPE_RANGE))

    def error(self, probes: np.ndarray, groups: np.ndarray) -> np.ndarray:
        """Estimated norm (m,) of each probe's error, pooled with the other ``probes`` of its group (m,) int."""
        own = self._half_difference(probes) * 2.0**-self.slope
        relative = own / np.maximum(self.scale(probes), 1e-30)
        count = np.bincount(groups)
        pooled = np.sqrt(np.bincount(groups, relative**2) / np.maximum(count, 1))[groups]
        mixed = np.sqrt((1.0 - POOLED) * relative**2 + POOLED * pooled**2)
        return mixed * self.scale(probes)

    def scale(self, probes: np.ndarray) -> np.ndarray:
        """What a relative error is relative to (m,): the probe's own norm, but no less than DIM of the RMS over all probes."""
        norms = np.sqrt((self.coefficients() ** 2).sum(axis=(1, 2)))
        traced = self.rays > 0
        rms = np.sqrt((norms[traced] ** 2).mean()) if traced.any() else 0.0
        return np.maximum(norms[probes], DIM * rms)
