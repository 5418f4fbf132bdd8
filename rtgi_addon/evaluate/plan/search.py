"""The cheapest lattice and ray setting whose error at the receivers stays below a target.

From the file's own on lattices become finer, by as much as the error still has to fall, until one will do, or coarser until one
will not; then the spacing is found between the last two, and each axis of each volume is coarsened as far as the light along it is
smooth. Every lattice that is decided upon has been measured itself.

A plan is to cost less than it saves: beyond the first look, on few points, everything is measured only while the rays of all that
stay below a share of those of the bake that would be planned now.
"""

from collections.abc import Callable
from dataclasses import dataclass
from math import log, log2

import numpy as np

from ...errors import BakeError
from ...progress import Progress
from ...scene import ProbeVolume
from ...techniques.probes.started import Finished
from ..metrics import Figure
from .pilot import CACHE_SHARE, PILOT_ERROR, Pilot, Reading
from .price import Prices
from .shapes import COARSENED, axes_of, changed, cheapest, shifted_by_one
from .tries import LEAST_BOUND, NO_STEP, RAY_ERRORS, Tries, upper

# How many times finer each lattice of the climb is than the one before, from what to what; and the share of an error's confidence
# that is added to it to tell.
LEAST_STRIDE, MOST_STRIDE, AIM = 1.5, 2.5, 0.5
# Refining the lattice is given up once it has lowered the error by less than this share a doubling, so many times in a row.
STALLED, STALLS = 0.1, 2
# A ray setting that the plan's cache does not serve is taken where all should cost less than this share.
WORTH_ANOTHER_CACHE = 0.5
# Tries at a spacing; each goes to where the last one says that the target is met, and a little past it, in no smaller steps than
# the third.
TRIES, OVERSHOOT, LEAST_STEP = 5, 1.03, 1.1
# Another exchange of rays for probes is tried where it should cost less than this share.
WORTH_TRYING = 0.75
# The most (volume, axis) pairs that are told apart.
MOST_AXES = 12
# Exponents of convergence that are believed.
LEAST_RATE, GREATEST_RATE = 0.5, 2.0
# The exponent where only one lattice was measured.
USUAL_RATE = 1.0
# A lattice that fits the light's shape is tried where it saves at least so much of the probes.
WORTH_SHAPING = 0.95
# Factors of the spacing are the same up to rounding.
_SAME = 1e-9
# Past the last factor below a limit these are tried, from the largest.
_LAST_STEPS = (2.0**0.75, 2.0**0.5, 2.0**0.25)


@dataclass(frozen=True, eq=False)
class Found:
    """A lattice (``reading``) with SH of ``order`` and rays until the target ``ray_error``; ``error`` is predicted; ``met`` tells
    whether the target is met with CONFIDENCE. ``rate`` is the exponent p of error ~ spacing^p over the last doubling, and ``climb``
    the doublings that were measured; ``limited`` names what kept the lattice from becoming finer, if anything did.
    With ``fitted`` the error is that of probes fitted to surfaces, by the bake that was ``finished``, and ``measured`` the lattice
    that would do without. ``nesting`` is "nested" where finer volumes lie in coarser ones, in place of the lattices ``single``, and
    "spread" where that was tried and saves too little."""

    reading: Reading
    order: int
    ray_error: float
    error: Figure
    met: bool
    rate: float | None
    climb: tuple[Reading, ...]
    limited: str = ""
    nesting: str = ""
    single: Reading | None = None
    fitted: bool = False
    finished: Finished | None = None
    measured: Reading | None = None


class Search:
    """Looks for the cheapest lattices of ``pilot`` with an error of at most ``target``.

    ``fits(volumes, order)`` returns "" or the name of the limit that is passed.
    """

    def __init__(self, pilot: Pilot, prices: Prices, target: float, fits: Callable[[tuple[ProbeVolume, ...], int], str],
                 progress: Progress):
        self._pilot, self._prices, self._target = pilot, prices, target
        self._tries, self._limited = Tries(pilot, prices, target, fits, progress), ""
        # The climb is for bakes that go on with the plan's cache, where that is exact enough.
        self._climbed = PILOT_ERROR if CACHE_SHARE * PILOT_ERROR <= 0.5 * target else RAY_ERRORS[-1]

    def run(self) -> Found:
        """Raises Cancelled."""
        climb = self._climb()
        rate = _rate(climb[-2:], max(self._pilot.orders))
        exponent = float(np.clip(rate if rate is not None else USUAL_RATE, LEAST_RATE, GREATEST_RATE))
        ways = []
        for order in self._pilot.orders:
            for ray_error in RAY_ERRORS:
                factor = self._factor(climb, order, ray_error)
                if factor is not None:
                    finer = next(reading for climbed, reading in climb if climbed >= factor * (1 - _SAME))
                    rays = self._prices.marginal(finer, ray_error, self._tries.probes(factor))
                    # Less sure than what goes on with the plan's cache.
                    ways.append((rays / (1.0 if ray_error == PILOT_ERROR else WORTH_ANOTHER_CACHE), factor, order, ray_error))
        readings = tuple(reading for _, reading in climb)
        if not ways:
            return self._worthwhile(readings, climb)
        _, factor, order, ray_error = min(ways, key=lambda way: way[0])
        climbed, known = next((climbed, reading) for climbed, reading in climb
                              if climbed >= factor * (1 - _SAME) and self._tries.passes(reading, order, ray_error))
        known = self._tries.decided(known.resolutions, order, ray_error, self._tries.level(known))
        if not self._tries.passes(known, order, ray_error):
            factor, known = climbed * self._more(known, order, ray_error, exponent), None
        elif not self._tries.worth_trying(known, ray_error, factor / climbed):
            factor = climbed
        reading = self._settle(factor, order, ray_error, exponent, known)
        if reading is None:
            self._limited = self._limited or "convergence"
            return self._worthwhile(tuple(self._pilot.readings), climb)
        if self._tries.may_spend(self._tries.cost(reading, 1), reading, ray_error):
            reading, ray_error = self._exchange(reading, order, ray_error, exponent)
        shapes = self._tries.cost(reading, 0) * len(axes_of(reading.resolutions)) + self._tries.cost(reading, 1)
        if self._tries.may_spend(shapes, reading, ray_error):
            reading = self._shape(reading, order, ray_error, exponent)
        return Found(reading, order, ray_error, reading.error(order, ray_error), True, *self._seen(climb))

    def may_spend(self, rays: float, found: Found) -> bool:
        """Whether ``rays`` more may be spent on a choice between what was ``found`` and something else."""
        return self._tries.may_spend(rays, found.reading, found.ray_error)

    def _climb(self) -> list[tuple[float, Reading]]:
        """Factors and their readings, from the coarsest to the finest. The first is the file's own lattice; from there it goes to
        where the error says that the target is met, finer until one will do, the limit is reached or nothing improves, or coarser
        until one will not."""
        factor, climb, stalls = self._begin(), [], 0
        order, lowest = max(self._pilot.orders), min(self._pilot.orders)
        while True:
            reading = self._either(climb, factor, lowest)
            finest = climb[-1] if climb else None
            climb = sorted([*climb, (factor, reading)], key=lambda step: step[0])
            if self._tries.passes(reading, order, self._climbed):
                factor = self._coarser(climb, order)
                if factor is None:
                    return climb
                continue
            if climb[-1][1] is not reading:
                # Now it lies between one that does and one that does not.
                return climb
            steep = finest is None or reading.error(order).value < finest[1].error(order).value * \
                (1.0 - STALLED) ** log2(factor / finest[0])
            stalls = 0 if steep else stalls + 1
            if stalls >= STALLS:
                self._limited = "convergence"
                return climb
            wanted = self._stride(climb, order)
            if self._tries.probes(factor * wanted) > self._tries.cap:
                if any(other.bulk(order, self._climbed) <= self._target for _, other in climb):
                    # What is left lies on the worst points, which finer lattices do little about, and is not worth those.
                    self._limited = "effort"
                    return climb
                # One lattice so fine is worth a try, after one of as many probes as that, and where it should do.
                last = (self._tries.cap / self._tries.probes(factor)) ** (1.0 / 3.0)
                if last < 1.0 or (last < LEAST_STRIDE and wanted > MOST_STRIDE):
                    self._limited = "convergence" if stalls else "effort"
                    return climb
                wanted = last if last >= LEAST_STRIDE else wanted
            factor = factor * min(wanted, MOST_STRIDE)
            limited = self._tries.limit(self._tries.at(factor), lowest)
            if limited:
                factor = self._last_step(climb, lowest)
                if factor is None:
                    self._limited = limited
                    return climb

    def _begin(self) -> float:
        """The factor of the first lattice: the file's own, or what is left of it within the limits."""
        order, factor = min(self._pilot.orders), 1.0
        while limit := self._tries.limit(self._tries.at(factor), order):
            if self._tries.at(factor) == self._tries.at(0.0):
                raise BakeError(f"the coarsest lattice takes more than the {limit} allows", f"allow more {limit}")
            factor *= 0.5
        return factor

    def _stride(self, climb: list[tuple[float, Reading]], order: int) -> float:
        """How many times finer than the finest of ``climb`` the next lattice is tried."""
        wanted = OVERSHOOT * (self._aimed(climb[-1][1], order) / self._target) ** (1.0 / self._believed(climb, order))
        return max(float(wanted), LEAST_STRIDE)

    def _coarser(self, climb: list[tuple[float, Reading]], order: int) -> float | None:
        """The factor of a lattice coarser than the coarsest of ``climb``, which does; None where that is not worth a try."""
        factor, reading = climb[0]
        wanted = OVERSHOOT * (self._aimed(reading, order) / self._target) ** (1.0 / self._believed(climb, order))
        following = factor * float(np.clip(wanted, 1.0 / MOST_STRIDE, 1.0))
        if not self._tries.passes(reading, order, self._climbed) or following > NO_STEP * factor:
            return None
        return None if self._tries.at(following) == self._tries.at(factor) else following

    def _aimed(self, reading: Reading, order: int) -> float:
        """What is held to the target where the next lattice is looked for: that will be decided upon on more points."""
        error = reading.error(order, self._climbed)
        return error.value + AIM * (upper(error) - error.value)

    @staticmethod
    def _believed(climb: list[tuple[float, Reading]], order: int) -> float:
        """The exponent of convergence that the next step of ``climb`` goes by."""
        rate = _rate(climb[-2:], order)
        return float(np.clip(USUAL_RATE if rate is None else rate, LEAST_RATE, GREATEST_RATE))

    def _either(self, climb: list[tuple[float, Reading]], factor: float, order: int) -> Reading:
        """The lattice at ``factor``, or where that is no better than the finest before it the one that has a probe more along each
        axis: it may miss the wall that a layer of the other lies in."""
        highest = max(self._pilot.orders)
        reading, shifted = self._tries.measure(self._tries.at(factor), 0), shifted_by_one(self._tries.at(factor))
        worse = climb and climb[-1][0] < factor and reading.error(highest).value >= climb[-1][1].error(highest).value
        if worse and self._tries.probes(factor) <= self._tries.cap and not self._tries.limit(shifted, order):
            reading = min(reading, self._tries.measure(shifted, 0), key=lambda way: way.error(highest).value)
        error = reading.error(highest, self._climbed)
        if error.value <= self._target < upper(error):
            # More points cost less than the next lattice.
            reading = self._tries.decided(reading.resolutions, highest, self._climbed, 1)
        return reading

    def _last_step(self, climb: list[tuple[float, Reading]], order: int) -> float | None:
        """The largest factor below the limit, past the finest one that was measured."""
        steps = (climb[-1][0] * step for step in _LAST_STEPS)
        return next((factor for factor in steps if not self._tries.limit(self._tries.at(factor), order)), None)

    def _factor(self, climb, order: int, ray_error: float) -> float | None:
        """The factor at which the target is thought to be met, between two that were measured; None if none meets it."""
        before = None
        for factor, reading in climb:
            bound = upper(reading.error(order, ray_error))
            if self._tries.limit(reading.resolutions, order):
                return None
            if bound <= self._target:
                if before is None:
                    return factor
                coarse, coarse_bound = before
                slope = log(coarse_bound / max(bound, LEAST_BOUND)) / log(factor / coarse)
                met = coarse * (coarse_bound / self._target) ** (1.0 / max(slope, LEAST_RATE))
                met = min(factor, max(met, LEAST_STEP * coarse))
                # What was measured is known: hardly fewer probes are not worth another lattice.
                return factor if met > NO_STEP * factor else met
            before = factor, bound * self._tries.luck(reading, order, ray_error)
        return None

    def _settle(self, factor: float, order: int, ray_error: float, rate: float, known: Reading | None = None) -> Reading | None:
        """The coarsest lattice near ``factor`` that does, on all receivers, or ``known``, which does; None if none was found that
        does."""
        failed = 0.0
        for _ in range(TRIES):
            self._limited = self._tries.limit(self._tries.at(factor), order)
            if self._limited:
                break
            reading = self._tries.decided(self._tries.at(factor), order, ray_error, 0)
            following = factor * self._more(reading, order, ray_error, rate)
            if not self._tries.passes(reading, order, ray_error):
                failed = factor
                if known is not None:
                    break
                factor = max(following, factor * LEAST_STEP)
            else:
                known = reading
                if following <= failed or self._tries.at(following) == self._tries.at(factor) or \
                        not self._tries.worth_trying(reading, ray_error, following / factor):
                    break
                factor = following
        return known

    def _more(self, reading: Reading, order: int, ray_error: float, rate: float) -> float:
        """How many times finer than ``reading`` a lattice is thought to do."""
        likely = upper(reading.error(order, ray_error)) * self._tries.luck(reading, order, ray_error)
        return (likely / self._target) ** (1.0 / rate) * OVERSHOOT

    def _exchange(self, reading: Reading, order: int, ray_error: float, rate: float) -> tuple[Reading, float]:
        """``reading`` and its ray setting, or another that takes fewer rays in all: a finer lattice with fewer rays a probe, or a
        coarser one with more, now that the whole error is known at one of them."""
        def cost(other: float) -> tuple[float, float]:
            scale = (upper(reading.error(order, other)) / self._target) ** (1.0 / rate)
            return self._prices.rays(reading, other, scale**3 * reading.lattice_points), scale

        best = min(RAY_ERRORS, key=lambda other: cost(other)[0])
        spent = self._prices.rays(reading, ray_error)
        if best == ray_error or cost(best)[0] > WORTH_TRYING * spent:
            return reading, ray_error
        factor = (reading.lattice_points / sum(map(np.prod, self._tries.files))) ** (1.0 / 3.0)
        other = self._settle(factor * cost(best)[1] * OVERSHOOT, order, best, rate)
        if other is None or self._prices.rays(other, best) > spent:
            return reading, ray_error
        return other, best

    def _shape(self, base: Reading, order: int, ray_error: float, rate: float) -> Reading:
        """``base`` or a cheaper lattice with more probes along axes where the light changes and fewer where it does not."""
        axes = axes_of(base.resolutions)
        if len(axes) < 2 or len(axes) > MOST_AXES:
            return base
        square = self._tries.measure(base.resolutions, 0).error(order).value ** 2
        shares = {}
        for volume, axis in axes:
            coarser = changed(base.resolutions, volume, axis, max(2, round(base.resolutions[volume][axis] / COARSENED)))
            ratio = base.resolutions[volume][axis] / coarser[volume][axis]
            if ratio > 1.0:
                rise = self._tries.measure(coarser, 0).error(order).value ** 2 - square
                shares[volume, axis] = max(rise, 0.0) / (ratio ** (2 * rate) - 1.0)
        allowed = square * (self._target / max(upper(base.error(order, ray_error)), LEAST_BOUND)) ** 2
        proposal = cheapest(base.resolutions, shares, square, allowed, rate)
        middle = tuple(tuple(round((before * after) ** 0.5) for before, after in zip(old, new, strict=True))
                       for old, new in zip(base.resolutions, proposal, strict=True))
        for resolutions in (proposal, middle):
            if sum(map(np.prod, resolutions)) > WORTH_SHAPING * base.lattice_points or self._tries.limit(resolutions, order):
                continue
            reading = self._tries.decided(resolutions, order, ray_error, 1)
            if self._tries.passes(reading, order, ray_error):
                return reading
            if not self._tries.may_spend(self._tries.cost(reading, 1), base, ray_error):
                break
        return base

    def _worthwhile(self, readings: tuple[Reading, ...], climb: list[tuple[float, Reading]]) -> Found:
        """Where the target is out of reach: what of all that was measured is worth its rays (WORTH_POWER)."""
        sane = [way for way in self._tries.ways(readings) if way[0].lattice_points <= self._tries.cap]
        reading, order, ray_error = self._tries.worth(sane or self._tries.ways(readings))
        reading = self._tries.decided(reading.resolutions, order, ray_error, 0)
        error = reading.error(order, ray_error)
        return Found(reading, order, ray_error, error, upper(error) <= self._target, *self._seen(climb), self._limited)

    def _seen(self, climb: list[tuple[float, Reading]]) -> tuple[float | None, tuple[Reading, ...]]:
        """Rate and readings of ``climb``, as all receivers that were asked since then have them."""
        known = self._pilot.readings
        latest = [(factor, max((other for other in known if other.resolutions == reading.resolutions),
                               key=lambda other: len(other.variance))) for factor, reading in climb]
        return _rate(latest[-2:], max(self._pilot.orders)), tuple(reading for _, reading in latest)


def _rate(pair: list[tuple[float, Reading]], order: int) -> float | None:
    """p of error ~ spacing^p between two readings; None if there are not two or one has no error."""
    if len(pair) < 2:
        return None
    (coarse, first), (fine, second) = pair
    errors = first.error(order).value, second.error(order).value
    return log(errors[0] / errors[1]) / log(fine / coarse) if min(errors) > 0 else None
