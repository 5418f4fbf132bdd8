"""How many rays each probe needs, from how far parts of its own sequence disagree.

Sections of an Owen-scrambled Sobol sequence complement each other: the second half of the points falls where the first left gaps,
so the mean of both is better than the disagreement of two independent halves would say. Nothing needs to be assumed of that. Let
V(n) be the variance of what n points say, d the difference between the first n₁ points and the n₂ that follow, and w₁, w₂ their
shares of all N: as Y_N = w₁·Y₁ + w₂·Y₂, whatever the two have in common,

    w₁·w₂·E[d²] = w₁·V(n₁) + w₂·V(n₂) − V(N).

Numbers of rays double from round to round, where every section is a scrambled net of its own and has the variance of its number of
points (Owen, "Scrambled Net Variance for Integrals of Smooth Functions", Ann. Statist. 25(4), 1997). With V(n) = a·n^−2s each
doubling gives a, and two or more give s: from ½, that of independent rays, to 3/2, that of smooth functions; about 1 in plain
rooms; sharp patches of light have 0.65. Between powers of two a sequence errs hardly less than at the one before: the points beyond
it are those of a smaller net.

Where rays are spread anew by what the first have found (strata.py), a is another from then on and s the same: what came before
tells a only until two sections of what followed have been compared, and what some groups gain is thought to hold for the others.
"""

from dataclasses import dataclass

import numpy as np

# Rays of every probe before its error is first asked for: the last of the rounds that all have.
FIRST_ROUND = 256
# The s of V(n) = a·n^−2s before anything is known of it, how far it is thought to be off, and how much probes of one bake differ;
# what it is held within.
SLOPE, SLOPE_SPREAD, SLOPE_DIFFERENCE = 0.75, 0.25, 0.12
LEAST_SLOPE, MOST_SLOPE = 0.5, 1.5
# Squared differences of a group of probes are worth so many independent ones: bands and colours of one error, and neighbours under
# the same directions, have most in common.
FREEDOM = 4.0
# One probe's difference is one sample of its error: lean on the mean of its neighbours by this share.
POOLED = 0.5
# Rays that are spread anew have this share of the variance of as many others, at least and at most.
LEAST_GAIN, MOST_GAIN = 0.2, 1.0
# Weight of what earlier rounds said of a probe's error in what the next one makes of it.
REMEMBERED = 0.5
# Share of the target that is aimed at by the noise of probe rays and of the surface cache together, and what is left to probe rays
# at least, however noisy the cache is: what is told of it is too much where it is most (atrium 0.89 to 1.03 % for 0.78 to 0.82),
# and with half of the target left rays there were 1.6 times as many.
AIM, LEAST_SHARE = 0.8, 0.7
# What is left to probe rays usually: by that their numbers are told before the cache's noise is known.
SAMPLING_SHARE = 0.75
# The mean over all probes is held to the target, so that half of those that lie between two powers of two are above it and half
# below; no group of probes is left with more than this times the variance that goes with it.
MOST_ABOVE = 2.0


def sampling_share(cache_noise: float, target: float) -> float:
    """Share of ``target`` that is left to the noise of probe rays beside ``cache_noise``, a relative mean square."""
    return float(np.sqrt(max(AIM**2 - cache_noise / target**2, LEAST_SHARE**2)))


class ErrorModel:
    """Keeps the sums of each probe's rays and says what error they have.

    ``total`` (p, k, 3) float64 sums of 4π·L·Y over all ``rays`` (p,) int64. ``brightness`` is the RMS norm of the coefficients of
    all probes of the bake, where these are but some of them (None: they are all). ``turned`` (p,) int64 is the number of rays
    beyond which they are spread in another way than before (0: they are not).
    """

    def __init__(self, probes: int, coefficients: int, brightness: float | None = None):
        self.total = np.zeros((probes, coefficients, 3))
        self.rays = np.zeros(probes, np.int64)
        self.turned = np.zeros(probes, np.int64)
        self._brightness = brightness
        # w₁·w₂·d² (p,) of each pair of sections (n₁, n₂), NaN where a probe was not asked.
        self._squares: dict[tuple[int, int], np.ndarray] = {}

    def coefficients(self) -> np.ndarray:
        """SH estimate (p, k, 3) from all rays so far; zero where none were traced."""
        return self.total / np.maximum(self.rays, 1)[:, None, None]

    def add(self, probes: np.ndarray, sums: np.ndarray, rays: np.ndarray) -> None:
        """Add the ``sums`` (m, k, 3) of ``rays`` (m,) further rays of ``probes`` (m,), and compare them with those before."""
        before = self.rays[probes]
        compared = (before > 0) & (before != self.turned[probes])
        for n1, n2 in np.unique(np.stack([before, rays], axis=1)[compared], axis=0).tolist():
            alike = np.flatnonzero(compared & (before == n1) & (rays == n2))
            difference = self.total[probes[alike]] / n1 - sums[alike] / n2
            column = self._squares.setdefault((n1, n2), np.full(len(self.rays), np.nan))
            column[probes[alike]] = (difference**2).sum(axis=(1, 2)) * (n1 * n2 / (n1 + n2) ** 2)
        self.total[probes] += sums
        self.rays[probes] += rays

    def state(self) -> dict[str, np.ndarray]:
        """Everything it knows, for a checkpoint."""
        pairs = np.array(list(self._squares), np.int64).reshape(-1, 2)
        squares = np.array(list(self._squares.values())).reshape(len(pairs), len(self.rays))
        return {"total": self.total, "rays": self.rays, "turned": self.turned, "pairs": pairs, "squares": squares}

    def restore(self, arrays: dict[str, np.ndarray]) -> None:
        """Take up from ``state``."""
        self.total, self.rays, self.turned = arrays["total"], arrays["rays"], arrays["turned"].copy()
        pairs = map(tuple, arrays["pairs"].tolist())
        self._squares = {pair: squares.copy() for pair, squares in zip(pairs, arrays["squares"], strict=True)}

    def error(self, probes: np.ndarray, groups: np.ndarray) -> np.ndarray:
        """Estimated norm (m,) of each probe's error, leaning on the probes of its group (m,) int."""
        scale = self.scale(probes)
        variance, slope = self._at_one(probes, groups, scale)
        return np.sqrt(variance * self.rays[probes] ** (-2.0 * slope[groups])) * scale

    def rays_needed(self, probes: np.ndarray, groups: np.ndarray, target: float, highest: int) -> np.ndarray:
        """See Forecast.rays_needed: of ``probes`` (m,) in ``groups`` (m,)."""
        return self.forecast(probes, groups).rays_needed(target, highest)

    def forecast(self, probes: np.ndarray, groups: np.ndarray) -> "Forecast":
        """How the errors of ``probes`` (m,) go on. Groups are runs of them that have had the same rays, counted from 0."""
        scale = self.scale(probes)
        variance, slope = self._at_one(probes, groups, scale)
        first = np.flatnonzero(np.diff(groups, prepend=-1))
        rays, size = self.rays[probes[first]], np.bincount(groups)
        now = np.bincount(groups, variance) * rays ** (-2.0 * slope) / size if len(probes) else np.zeros(0)
        return Forecast(groups, rays, size, now, slope, int(np.count_nonzero(scale)))

    def scale(self, probes: np.ndarray) -> np.ndarray:
        """What a relative error is relative to (m,): the probe's own norm, or for dim probes its geometric mean with the RMS of
        all, since a few per cent of a dark corner are less seen than one of a bright wall."""
        norms = np.sqrt((self.coefficients() ** 2).sum(axis=(1, 2)))
        rms, traced = self._brightness, self.rays > 0
        if rms is None:
            rms = np.sqrt((norms[traced] ** 2).mean()) if traced.any() else 0.0
        return np.sqrt(norms[probes] * np.maximum(norms[probes], rms))

    def _at_one(self, probes: np.ndarray, groups: np.ndarray, scale: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """The a (m,) of each probe's V(n), relative to its squared ``scale`` (m,), and the s (g,) of each group's."""
        count, pairs = int(groups.max(initial=-1)) + 1, sorted(self._squares, key=sum)
        if not pairs:
            return np.full(len(probes), np.nan), np.full(count, SLOPE)
        # A dark probe has no error.
        factor = np.where(scale > 0, 1.0 / np.where(scale > 0, scale, 1.0) ** 2, 0.0)
        squares = np.stack([self._squares[pair][probes] * factor for pair in pairs], axis=1)
        known = ~np.isnan(squares)
        squares = np.where(known, squares, 0.0)
        members = np.stack([np.bincount(groups, column, count) for column in known.T], axis=1)
        means = np.stack([np.bincount(groups, column, count) for column in squares.T], axis=1) / np.maximum(members, 1)
        turned = self.turned[probes]
        later = (turned[:, None] > 0) & (np.array([n1 for n1, _ in pairs]) > turned[:, None])
        of_groups = np.stack([np.bincount(groups, column, count) > 0 for column in later.T], axis=1)
        slope = _slopes(np.log([n1 + n2 for n1, n2 in pairs]), means, of_groups)
        alone = squares / np.stack([_disagreement(n1, n2, slope) for n1, n2 in pairs], axis=1)[groups]
        alone = _since(alone, known, later, (turned > 0) & (self.rays[probes] > turned))
        pooled = (np.bincount(groups, alone, count) / np.maximum(np.bincount(groups, minlength=count), 1))[groups]
        return (1.0 - POOLED) * alone + POOLED * pooled, slope


@dataclass(frozen=True, eq=False)
class Forecast:
    """Probes in ``groups`` (m,) that have ``rays`` (g,), ``size`` (g,) of them each, with a mean square of the relative errors of
    ``now`` (g,) that falls with twice the power ``slope`` (g,) of the rays; ``lit`` probes have any light."""

    groups: np.ndarray
    rays: np.ndarray
    size: np.ndarray
    now: np.ndarray
    slope: np.ndarray
    lit: int

    def rays_needed(self, target: float, highest: int) -> np.ndarray:
        """Number of rays (m,), at least those that they have and at most ``highest``, at which the mean square over lit probes
        of their errors, each relative to its scale, is expected to fall to that of ``target``; one for all of a group, doubled as
        often as it takes, the worst first."""
        if not len(self.groups):
            return np.zeros(0, np.int64)
        rays, size, now = self.rays, self.size, self.now
        # A mean over few groups may be small by luck: it is taken for as much more as one standard error of it.
        falls, allowed = 2.0 ** (-2.0 * self.slope), target**2 / (1.0 + np.sqrt(2.0 / (FREEDOM * len(size))))
        # Probes in the dark, which have no error, do not make room for that of others.
        sum_allowed = allowed * self.lit
        steps = np.arange(max(1, int(np.ceil(np.log2(max(highest, 1) / max(rays.min(), 1)))) + 1))
        values = now[:, None] * falls[:, None] ** steps
        open_steps = rays[:, None] * 2.0**steps < highest
        saved = np.where(open_steps, values * (1.0 - falls[:, None]) * size[:, None], 0.0).reshape(-1)
        order = np.argsort(-np.where(open_steps, values, -1.0).reshape(-1), kind="stable")
        left = float((now * size).sum()) - np.cumsum(np.append(0.0, saved[order]))
        # Each doubling is needed while what those before it leave is too much.
        doubled = np.zeros(len(order), bool)
        doubled[order[left[:-1] > sum_allowed]] = True
        doubled |= values.reshape(-1) > MOST_ABOVE * allowed
        times = (doubled & open_steps.reshape(-1)).reshape(values.shape).sum(axis=1)
        return np.minimum(rays * 2**times, np.maximum(highest, rays))[self.groups]


def _since(alone: np.ndarray, known: np.ndarray, later: np.ndarray, beyond: np.ndarray) -> np.ndarray:
    """The a (m,) that probes have now, from what each comparison says of it, ``alone`` (m, l), where ``known`` (m, l): of those
    ``later`` (m, l) than the turn, if there are any. Probes that are ``beyond`` (m,) it without a comparison are thought to have
    gained what others did."""
    def remembered(chosen):
        # The latest comparison has half the say, the one before it half of the rest.
        age = np.cumsum(chosen[:, ::-1], axis=1)[:, ::-1] - 1
        weight = np.where(chosen, REMEMBERED**age, 0.0)
        return (alone * weight).sum(axis=1) / np.maximum(weight.sum(axis=1), 1e-300)

    before, after = remembered(known & ~later), remembered(known & later)
    told = (known & later).any(axis=1)
    gain = np.clip(after[told].sum() / max(before[told].sum(), 1e-300), LEAST_GAIN, MOST_GAIN) if told.any() else MOST_GAIN
    return np.where(told, after, np.where(beyond, gain, 1.0) * before)


def _disagreement(n1: int, n2: int, slope: np.ndarray) -> np.ndarray:
    """w₁·w₂·E[d²] (g,) of sections of ``n1`` and ``n2`` points where V(n) = n^−2s with s = ``slope`` (g,)."""
    exponent, whole = -2.0 * slope, float(n1 + n2)
    return (n1 * float(n1) ** exponent + n2 * float(n2) ** exponent) / whole - whole**exponent


def _slopes(logs: np.ndarray, means: np.ndarray, later: np.ndarray) -> np.ndarray:
    """The s (g,) of groups of probes from their mean squared differences ``means`` (g, l) (0: unknown) at numbers of rays with
    ``logs`` (l,): straight lines by least squares, of all groups together first, from which each departs as far as its own
    differences and the usual departure say. Of those that are ``later`` (g, l) and those that are not the lines are parallel."""
    known = means > 0
    x = np.where(known, logs, 0.0)
    y = np.where(known, np.log(np.where(known, means, 1.0)), 0.0)
    for alike in (known & later, known & ~later):
        count = np.maximum(alike.sum(axis=1), 1)[:, None]
        x, y = (part - alike * ((part * alike).sum(axis=1, keepdims=True) / count) for part in (x, y))
    # A mean of squares with ν degrees of freedom has a logarithm of variance 2/ν.
    precision = (x**2).sum(axis=1) * FREEDOM / 2.0
    own = -0.5 * (x * y).sum(axis=1) * FREEDOM / 2.0
    # s is half of a slope, so its precision is four times as much.
    precision, own = 4.0 * precision, 4.0 * own
    prior = 1.0 / SLOPE_SPREAD**2
    # Of all together: a group says of it what its own departure leaves.
    share = 1.0 / (1.0 + precision * SLOPE_DIFFERENCE**2)
    common = (prior * SLOPE + (own * share).sum()) / (prior + (precision * share).sum())
    usual = 1.0 / SLOPE_DIFFERENCE**2
    return np.clip((usual * common + own) / (usual + precision), LEAST_SLOPE, MOST_SLOPE)
