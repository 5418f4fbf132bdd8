"""What probes should store so that what is read from them is right: least squares at many points, for coefficients and distances.

What a look-up gives is linear in the coefficients, and smooth in the distances by which it weighs them. Both are moved from what
was measured until what is read is as near as can be to the irradiance at points where it is known, and moving costs something. The
price is no constant: from dear to cheap, some are tried on points that the fit does not see, and the one that does best there is
taken, if it does no worse than the measurement where it must not.

A probe moves in proportion to its own light: one that holds none keeps none.

Sources: L. Kavan, A. W. Bargteil and P.-P. Sloan, "Least Squares Vertex Baking", Computer Graphics Forum 30(4) (EGSR), 2011, which
fits values at vertices to how they are interpolated. The distances of DDGI (Majercik et al., JCGT 8(2), 2019) are measured; fitted,
they say where which probe is to be believed.
"""

from copy import copy
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from ...numerics import sh
from ...numerics.minimize import minimize
from ...progress import Progress
from ...transport.vectors import luminance
from .field import ProbeField
from .normal_equations import Equations
from .reading import FieldReading, Stored, Weighed

# What it costs to move away from what was measured, from dear to cheap: relative squared error of what is read, if all light
# changes by as much as there is. What distances that change by a factor e cost, in each direction.
PRICES, DISTANCE_PRICE = (1.0, 0.2, 0.04), 3e-4
# Steps of conjugate gradients for the coefficients, and of BFGS for distances; and how many of these may bring nothing at the held
# points before it ends.
LINEAR_STEPS, STEPS, PATIENCE = 30, 2, 1
FIRST_STEP = 0.2
# Coefficients are found anew, so often, where dark targets became too bright: by this share of how far all is off.
ROUNDS, LITTLE = 2, 0.1
LABEL = "fitting probes to surfaces"
# Distances shrink by no more than this, as a logarithm, and grow by no more than the second: a probe may be believed less where it
# sees, not more behind what stands in its way. Their squares stay within what engines hold in 16 bits for cells of 20 m.
MOST_MOVED, MOST_GROWN = 1.5, 0.25
# Distances scatter by this share of their mean at least: below, the 16 bits in which engines hold means and mean squares would tell
# something else, and where they do not scatter at all nothing could be learned from a derivative.
LEAST_SCATTER = 0.1
# Where there is less than this share of the mean light, light that was not read there before counts so many times more: it is seen
# at once, and must not be what better light elsewhere is paid with.
DARK, DARK_WEIGHT = 0.03, 1e4
# No more light than this share of the mean may be added to a held point where there is none, on average over those.
MOST_LEAKED, FEW_DARK = 0.01, 0.01
# A dearer price is kept if what is won by a cheaper one is less than this share of the squared error.
WORTH = 0.02


@dataclass(frozen=True, eq=False)
class Targets:
    """Irradiance (n, 3) [W·m⁻²] that should be read at ``points`` (n, 3) under ``normals`` (n, 3), each of some ``weight`` (n,)."""

    points: np.ndarray
    normals: np.ndarray
    irradiance: np.ndarray
    weight: np.ndarray

    def take(self, rows: np.ndarray) -> "Targets":
        """Those in ``rows`` alone."""
        return Targets(self.points[rows], self.normals[rows], self.irradiance[rows], self.weight[rows])


class Fit:
    """Fits what the probes of ``field``, read linearly, store to ``kinds`` of targets, each of which counts alike; ``held`` are as
    many kinds that the fit does not see. Of those, each of the ``guarded`` groups of kinds (numbers) must not get worse. Where the
    first kind is off by no more than ``enough``, all stays as it was measured. ``distances`` are fitted only where the targets are
    said to tell them.

    ``stored`` is what did best, at which ``price``, None where nothing did better than the measurement; ``errors`` are, by kind,
    the relative RMSE at the held points (before, after). Raises Cancelled.
    """

    def __init__(self, field: ProbeField, kinds: list[Targets], held: list[Targets], guarded: tuple[tuple[int, ...], ...],
                 enough: float, distances: bool, threads: int | None, progress: Progress):
        self._live = np.concatenate([lookup.live for lookup in field.lookups])
        self._count = max(1, int(self._live.sum()))
        self._progress, self._guarded = progress, guarded
        measured = measured_by(field)
        self._distances = distances
        self._asked, self._judge = (_Asked(field, targets, measured, threads) for targets in (kinds, held))
        self.stored, self.price = measured, None
        self._before = self._best = self._judge.squares(measured, self._judge.weigh(measured))
        if np.sqrt(self._before[self._judge.kind == 0].sum()) > enough:
            self._find(measured)
        self.errors = [tuple(float(np.sqrt(squares[self._judge.kind == kind].sum())) for squares in (self._before, self._best))
                       for kind in range(len(kinds))]

    def _find(self, measured: Stored) -> None:
        # Coefficients alone, at the price that is found for them; then distances, with coefficients at the least price.
        self._progress.step(0.0, LABEL)
        self._asked.balance(measured)
        found = self._priced(measured)
        if self._distances:
            self._move(measured, found, PRICES[-1])

    def _try(self, found: Stored, price: float, weighed=None) -> bool:
        """Whether ``found`` is the best so far at the held points: then it is kept."""
        judge = self._judge
        weighed = weighed or judge.weigh(found)
        squares = judge.squares(found, weighed)
        if not self._ratio(squares) < (1.0 - WORTH) * self._ratio(self._best) or judge.leaked(found, weighed) > MOST_LEAKED:
            return False
        if any(_worse(*(part[np.isin(judge.kind, group)] for part in (squares, self._before))) for group in self._guarded):
            return False
        self.stored, self.price, self._best = found, price, squares
        return True

    def _ratio(self, squares: np.ndarray) -> float:
        """The mean over kinds of the share of the squared error that is left."""
        left, before = (np.bincount(self._judge.kind, part) for part in (squares, self._before))
        return float(np.mean(left / np.maximum(before, np.finfo(np.float64).tiny)))

    def _priced(self, measured: Stored) -> Stored:
        """Coefficients at the distances that were ``measured`` for each of the PRICES, tried; the last of them."""
        problem, held = _Problem(self._asked, measured, self._scale(measured)), self._judge.weigh(measured)
        equations, found = self._asked.equations(self._asked.weigh(measured)), measured
        for price in PRICES:
            self._progress.check()
            found = problem.solved(equations, found, price / self._count)[0]
            self._try(found, price, held)
        return found

    def refitted(self, measured: Stored, price: float, irradiance: list[np.ndarray]) -> Stored:
        """What is ``measured`` with the coefficients that are best for ``irradiance`` (n, 3) by kind where its distances are left
        as they are."""
        asked = self._asked.lit_by(np.concatenate(irradiance), measured)
        problem = _Problem(asked, measured, self._scale(measured))
        return problem.solved(asked.equations(asked.weigh(measured)), measured, price / self._count)[0]

    def _scale(self, measured: Stored) -> np.ndarray:
        """What a probe's coefficients are expected to move by (p, 1, 1): as its own light, or for dim probes the geometric mean of
        that with the RMS of all; 0 for those that hold none."""
        norms = np.sqrt(np.sum(measured.coefficients**2, axis=(1, 2)))
        rms = np.sqrt(np.mean(norms[self._live] ** 2)) if self._live.any() else 0.0
        return (np.sqrt(norms * np.maximum(norms, rms)) * self._live)[:, None, None]

    def _move(self, measured: Stored, start: Stored, price: float) -> None:
        """Distances that are better, from ``start`` on, each with the coefficients that are best for them; the best of them is
        kept."""
        problem = _Problem(self._asked, measured, self._scale(measured))
        distances = _Distances(measured, problem, price / self._count, DISTANCE_PRICE / self._count)
        begun, calls, worse = distances.begin(start), 0, 0

        def function(place):
            nonlocal calls
            self._progress.step(min(1.0, calls / (STEPS + 1)), LABEL)
            calls += 1
            return distances.error_and_slopes(place)

        def enough():
            nonlocal worse
            worse = 0 if self._try(distances.found, price) else worse + 1
            return worse >= PATIENCE

        minimize(function, begun, STEPS, FIRST_STEP, enough)


def numbers_of(order: int, tile: int) -> int:
    """How many numbers of a probe a fit changes, each channel's coefficients taken as one: with SH of ``order`` and a ``tile`` so
    wide."""
    return sh.coefficient_count(order) + 2 * tile**2


def _worse(squares: np.ndarray, before: np.ndarray) -> bool:
    """Whether the sum of ``squares`` (n,) lies above that of those ``before`` by more than the chance of the points explains: some
    share a place, which is why it is allowed twice as much."""
    more = squares - before
    return bool(more.sum() > 2.0 * np.sqrt(max(len(more), 1)) * more.std()) if len(more) else False


def measured_by(field: ProbeField) -> Stored:
    """What the probes of all lattices of ``field`` store, one lattice after another as its lookups are."""
    tiles = [(lookup.moments.reshape(len(lookup.positions), lookup.tile + 2, lookup.tile + 2, 2)[:, 1:-1, 1:-1]
              ).reshape(len(lookup.positions), -1, 2).astype(np.float64) for lookup in field.lookups]
    tile = np.concatenate(tiles)
    mean = np.maximum(tile[..., 0], np.finfo(np.float32).tiny)
    return Stored(np.concatenate([lookup.coefficients for lookup in field.lookups]).astype(np.float64), mean,
                  np.maximum(tile[..., 1] - mean**2, (LEAST_SCATTER * mean) ** 2))


class _Weighed(NamedTuple):
    """Targets as they are ``weighed``, and the normal ``equations`` of that."""

    weighed: list[Weighed]
    equations: Equations


class _Asked:
    """Targets of all kinds and how they are read; the weighted squares of each kind are relative to those of its light."""

    def __init__(self, field: ProbeField, kinds: list[Targets], measured: Stored, threads: int | None):
        self.kind = np.repeat(np.arange(len(kinds)), [len(targets.points) for targets in kinds])
        points, normals, self.irradiance, self._given = (np.concatenate([getattr(targets, name) for targets in kinds])
                                                         for name in ("points", "normals", "irradiance", "weight"))
        self.reading = FieldReading(field, points, normals, threads)
        self.weigh = self.reading.weigh
        self._counts = np.ones(len(kinds))
        self._judge_light(measured)

    def _judge_light(self, measured: Stored) -> None:
        plain = np.where(self.reading.known, self._given, 0.0)
        power = np.bincount(self.kind, plain * np.sum(self.irradiance**2, axis=1))[self.kind]
        self.weight = np.where(power > 0, plain / np.where(power > 0, power, 1.0), 0.0) * self._counts[self.kind]
        light, count = luminance(self.irradiance), np.bincount(self.kind, self._given)
        self._mean = np.bincount(self.kind, self._given * light) / np.where(count > 0, count, 1.0)
        self.dark = np.flatnonzero(light < DARK * self._mean[self.kind])
        read = self.reading.read(self.weigh(measured), measured.coefficients).irradiance
        # No more than these should be read there: what is, or was.
        self.most = np.maximum(read, self.irradiance)[self.dark]

    def balance(self, measured: Stored) -> None:
        """From now on each kind counts by how far it was off as ``measured``, as much in all as before."""
        squares = np.bincount(self.kind, self.squares(measured, self.weigh(measured)), len(self._counts))
        if squares.any():
            self._counts = squares.mean() / np.maximum(squares, 1e-3 * squares.mean())
            self.weight = self.weight * self._counts[self.kind]

    def lit_by(self, irradiance: np.ndarray, measured: Stored) -> "_Asked":
        """The same places under other light (n, 3), which probes ``measured`` as well."""
        other = copy(self)
        other.irradiance = irradiance
        other._judge_light(measured)
        return other

    def equations(self, weighed) -> "_Weighed":
        """What the coefficients should be where targets are ``weighed`` so."""
        return _Weighed(weighed, self.reading.equations(weighed, self.weight, self.irradiance))

    def squares(self, stored: Stored, weighed) -> np.ndarray:
        """Each target's share (n,) of the squared relative RMSE of its kind."""
        difference = self.reading.read(weighed, stored.coefficients).irradiance - self.irradiance
        return self.weight * np.sum(difference**2, axis=1)

    def leaked(self, stored: Stored, weighed) -> float:
        """Light that was neither there nor read, on average over the dark targets of a kind, as a share of the mean light of all of
        it: of the kind where it is most. A few dark ones say little: they count as FEW_DARK of all targets."""
        if not len(self.dark):
            return 0.0
        more = luminance(np.maximum(self.reading.read(weighed, stored.coefficients).irradiance[self.dark] - self.most, 0.0))
        kind, kinds = self.kind[self.dark], len(self._mean)
        count = np.maximum(np.bincount(kind, minlength=kinds), FEW_DARK * np.bincount(self.kind, minlength=kinds))
        return float(np.max(np.bincount(kind, more, kinds) / np.maximum(count * self._mean, 1e-30)))


class _Problem:
    """Least squares for the coefficients of probes that ``measured`` something else, at targets ``asked``, each probe moving by its
    ``scale`` (p, 1, 1)."""

    def __init__(self, asked: _Asked, measured: Stored, scale: np.ndarray):
        self.asked, self._measured, self._scale = asked, measured, scale
        # Which dark targets were too bright, by how much at most they may be read, (n, 3), the last time.
        self._bright, self._allowed = np.zeros(0, np.int64), np.zeros((0, 3))

    def solved(self, of: "_Weighed", start: Stored, cost: float):
        """``start`` with the coefficients that are best for the equations ``of`` targets, found from its own; what is read of them;
        how far all is off, with what moving costs; and the derivative (n, 3) of that by what is read."""
        asked, measured, weighed = self.asked, self._measured.coefficients, of.weighed
        change = np.where(self._scale > 0, (start.coefficients - measured) / np.where(self._scale > 0, self._scale, 1.0), 0.0)
        for _ in range(ROUNDS):
            equations = of.equations
            if len(self._bright):
                weight, light = np.zeros_like(asked.weight), np.zeros_like(asked.irradiance)
                weight[self._bright], light[self._bright] = DARK_WEIGHT * asked.weight[self._bright], self._allowed
                equations = equations.join([equations, asked.reading.equations(weighed, weight, light)])
            missing = equations.wanted() - equations.product(measured)
            change = equations.best(missing, self._scale, cost, change, LINEAR_STEPS)
            coefficients = measured + self._scale * change
            read = asked.reading.read(weighed, coefficients)
            difference = read.irradiance - asked.irradiance
            slope = asked.weight[:, None] * difference
            error = float(np.sum(slope * difference)) + cost * float(np.sum(change**2))
            too_much = np.maximum(read.irradiance[asked.dark] - asked.most, 0.0)
            by_dark = DARK_WEIGHT * asked.weight[asked.dark, None] * too_much
            penalty = float(np.sum(by_dark * too_much))
            slope[asked.dark] += by_dark
            bright = np.flatnonzero(too_much.any(axis=1))
            self._bright = asked.dark[bright]
            self._allowed = np.minimum(read.irradiance[self._bright], asked.most[bright])
            if penalty <= LITTLE * error:
                break
        return replace(start, coefficients=coefficients), read, error + penalty, 2.0 * slope


class _Distances:
    """How far all is off as a function of the distances that probes store, each with its best coefficients, for ``minimize``:
    variables are logarithms of factors of what was ``measured``, so that none becomes negative, in steps that matter alike.
    ``found`` is what was last tried.

    Source: G. Golub and V. Pereyra, "Separable nonlinear least squares: the variable projection method and its applications",
    Inverse Problems 19, 2003: where coefficients are best for distances, the derivative by distances is the one at those.
    """

    def __init__(self, measured: Stored, problem: _Problem, cost: float, price: float):
        self._measured, self._problem, self._cost, self._price = measured, problem, cost, price
        self.found = measured

    def begin(self, start: Stored) -> np.ndarray:
        """Where ``start`` lies; steps are counted by what matters there."""
        asked = self._problem.asked
        weighed = asked.weigh(start)
        read = asked.reading.read(weighed, start.coefficients)
        mean, variance = asked.reading.curvature(start, weighed, read, asked.weight)
        self._unit = 1.0 / np.sqrt(2.0 * (np.stack([mean, 4.0 * variance]) + self._price))
        self.found = start
        moved = np.stack([np.log(start.mean / self._measured.mean), 0.5 * np.log(start.variance / self._measured.variance)])
        return (moved / self._unit).ravel()

    def error_and_slopes(self, scaled: np.ndarray) -> tuple[float, np.ndarray]:
        """At variables (v,), and the derivatives (v,) there."""
        place = scaled.reshape(self._unit.shape) * self._unit
        mean, scatter = np.exp(np.clip(place, -MOST_MOVED, MOST_GROWN))
        mean = self._measured.mean * mean
        now = Stored(self.found.coefficients, mean,
                     np.maximum(self._measured.variance * scatter**2, (LEAST_SCATTER * mean) ** 2))
        asked, price = self._problem.asked, self._price
        weighed = asked.weigh(now)
        self.found, read, error, slope = self._problem.solved(self._problem.asked.equations(weighed), now, self._cost)
        by_mean, by_variance = asked.reading.by_distances(now, weighed, read, slope)
        # Where the least scatter holds, it follows the mean.
        by_scatter, least = 2.0 * by_variance * now.variance, now.variance <= (LEAST_SCATTER * now.mean) ** 2
        slopes = 2.0 * price * place + np.stack([by_mean * now.mean + least * by_scatter, ~least * by_scatter])
        return error + price * float(np.sum(place**2)), (self._unit * slopes).ravel()
