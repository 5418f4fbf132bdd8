"""The cheapest lattice and ray setting whose error at the receivers stays below a target.

Lattices are doubled from the coarsest until one will do, which measures how fast the error falls; then the spacing is found between
the last two, and each axis of each volume is coarsened as far as the light along it is smooth. Every lattice that is decided upon
has been measured itself.
"""

from collections.abc import Callable
from dataclasses import dataclass
from math import ceil, log

import numpy as np

from ...errors import BakeError
from ...progress import Progress
from ..metrics import Figure
from .pilot import LEVELS, Pilot, Reading
from .price import Prices

# Target errors of the probes' own rays that are weighed against a finer lattice.
RAY_ERRORS = (0.1, 0.05, 0.03, 0.02, 0.01, 0.005)
# One-sided confidence of what is promised, and the normal quantile that goes with it.
CONFIDENCE, QUANTILE = 0.9, 1.2816
# Doubling the lattice is given up once it has lowered the error by less than this share, so many times in a row.
STALLED, STALLS = 0.1, 2
# An unreachable target: of so many lattices with the least error, the cheapest within this factor of it is as good as there is.
NEARLY, CANDIDATES = 1.1, 3
# Tries at a spacing; each goes to where the last one says that the target is met, and a little past it, in no smaller steps than
# the third; coarser again only where that is worth more than the fourth.
TRIES, OVERSHOOT, LEAST_STEP, NO_STEP = 5, 1.01, 1.1, 0.95
# Another exchange of rays for probes is tried where it should cost less than this share.
WORTH_TRYING = 0.9
# How much coarser an axis is made to see what the light along it does, and the most (volume, axis) pairs that are told apart.
COARSENED, MOST_AXES = 1.5, 12
# Each axis is held to cause at least this share of what it would if all caused the same.
LEAST_SHARE = 0.2
# Exponents of convergence that are believed.
LEAST_RATE, GREATEST_RATE = 0.25, 3.0

Resolutions = tuple[tuple[int, int, int], ...]


@dataclass(frozen=True, eq=False)
class Found:
    """A lattice (``reading``) with SH of ``order`` and rays until the target ``ray_error``; ``error`` is predicted; ``met`` tells
    whether the target is met with CONFIDENCE. ``rate`` is the exponent p of error ~ spacing^p over the last doubling, and ``climb``
    the doublings that were measured; ``limited`` names what kept the lattice from becoming finer, if anything did."""

    reading: Reading
    order: int
    ray_error: float
    error: Figure
    met: bool
    rate: float | None
    climb: tuple[Reading, ...]
    limited: str = ""


def upper(figure: Figure) -> float:
    """The bound that an error stays below with CONFIDENCE, over the choice of receivers."""
    spread = figure.standard_error
    return figure.value + (QUANTILE * spread if np.isfinite(spread) else 0.0)


class Search:
    """Looks for the cheapest lattices of ``pilot`` with an error of at most ``target``.

    ``affordable(resolutions, order)`` returns "" or the name of the limit that is passed.
    """

    def __init__(self, pilot: Pilot, prices: Prices, target: float, affordable: Callable[[Resolutions, int], str],
                 progress: Progress):
        self._pilot, self._prices, self._target, self._affordable, self._progress = pilot, prices, target, affordable, progress
        self._files = tuple(tuple(volume.resolution) for volume in pilot.volumes)
        self._limited, self._measured = "", 0

    def run(self) -> Found:
        """Raises Cancelled."""
        climb = self._climb()
        rate = _rate(climb[-2:], max(self._pilot.orders))
        exponent = float(np.clip(rate if rate is not None else 1.0, LEAST_RATE, GREATEST_RATE))
        ways = []
        for order in self._pilot.orders:
            for ray_error in RAY_ERRORS:
                factor = self._factor(climb, order, ray_error)
                if factor is not None:
                    finer = next(reading for own, reading in climb if own >= factor * (1 - 1e-9))
                    probes = sum(map(np.prod, self.at(factor)))
                    ways.append((self._prices.rays(finer, ray_error, probes), factor, order, ray_error))
        readings = tuple(reading for _, reading in climb)
        if not ways:
            return self._best(readings, climb)
        _, factor, order, ray_error = min(ways, key=lambda way: way[0])
        reading = self._settle(factor, order, ray_error, exponent)
        if reading is None:
            self._limited = self._limited or "convergence"
            return self._best(tuple(self._pilot.readings), climb)
        reading, ray_error = self._exchange(reading, order, ray_error, exponent)
        reading = self._shape(reading, order, ray_error, exponent)
        return Found(reading, order, ray_error, reading.error(order, ray_error), True, *self._seen(climb))

    def at(self, factor: float) -> Resolutions:
        """The file's lattices with ``factor`` times the probes along each axis; no axis with several keeps only one."""
        return tuple(tuple(max(min(2, count), round(count * factor)) for count in resolution) for resolution in self._files)

    def _measure(self, resolutions: Resolutions, level: int = -1) -> Reading:
        self._progress.step(0.0, "measuring lattices")
        self._measured += 1
        done = self._measured / (self._measured + 4.0)
        return self._pilot.measure(resolutions, self._progress.span(done - 0.1 * (1 - done), done), level)

    def _passes(self, reading: Reading, order: int, ray_error: float) -> bool:
        return upper(reading.error(order, ray_error)) <= self._target

    def _climb(self) -> list[tuple[float, Reading]]:
        """Factors, each twice the one before, and their readings, until one will do, the limit is reached or nothing improves."""
        several = [count for resolution in self._files for count in resolution if count > 1]
        factor, climb, stalls = min(1.0, 2.0 / min(several, default=2)), [], 0
        order, lowest = max(self._pilot.orders), min(self._pilot.orders)
        while stalls < STALLS:
            self._limited = self._affordable(self.at(factor), lowest)
            if self._limited:
                factor = self._last_step(climb, lowest)
                if factor is None:
                    return climb
            reading = self._either(factor, lowest)
            worth_it = not climb or reading.error(order).value < (1 - STALLED) * climb[-1][1].error(order).value
            stalls = 0 if worth_it else stalls + 1
            climb.append((factor, reading))
            if self._limited or self._passes(reading, max(self._pilot.orders), RAY_ERRORS[-1]):
                return climb
            factor *= 2.0
        self._limited = "convergence"
        return climb

    def _either(self, factor: float, order: int) -> Reading:
        """The better of two lattices at ``factor``: the one that has a probe more along each axis may miss the wall that a layer of
        the other lies in."""
        highest = max(self._pilot.orders)
        reading = self._decided(self.at(factor), highest, RAY_ERRORS[-1], 0)
        shifted = _shifted(self.at(factor))
        if self._passes(reading, highest, RAY_ERRORS[-1]) or self._affordable(shifted, order):
            return reading
        return min(reading, self._decided(shifted, highest, RAY_ERRORS[-1], 0), key=lambda one: one.error(highest).value)

    def _decided(self, resolutions: Resolutions, order: int, ray_error: float, level: int) -> Reading:
        """A reading on as many receivers, from ``level`` up, as it takes to tell whether the target is met. Errors have rare great
        ones among them, which few receivers miss: beyond the lowest level a target counts as met on all of them alone."""
        for own in range(level, len(LEVELS)):
            reading = self._measure(resolutions, own)
            error = reading.error(order, ray_error)
            if 2.0 * error.value - upper(error) > self._target or (level == 0 and upper(error) <= self._target):
                break
        return reading

    def _last_step(self, climb: list[tuple[float, Reading]], order: int) -> float | None:
        """The largest factor below the limit, past the last one that was measured."""
        if not climb:
            limit = self._affordable(self.at(0.0), order)
            raise BakeError(f"the coarsest lattice takes more than the {limit} allows", f"allow more {limit}")
        steps = (climb[-1][0] * step for step in (2.0**0.75, 2.0**0.5, 2.0**0.25))
        return next((factor for factor in steps if not self._affordable(self.at(factor), order)), None)

    def _factor(self, climb, order: int, ray_error: float) -> float | None:
        """The factor at which the target is thought to be met, between two that were measured; None if none meets it."""
        before = None
        for factor, reading in climb:
            bound = upper(reading.error(order, ray_error))
            if self._affordable(reading.resolutions, order):
                return None
            if bound <= self._target:
                if before is None:
                    return factor
                coarse, coarse_bound = before
                slope = log(coarse_bound / max(bound, 1e-9)) / log(factor / coarse)
                return min(factor, coarse * (coarse_bound / self._target) ** (1.0 / slope))
            before = factor, bound
        return None

    def _settle(self, factor: float, order: int, ray_error: float, rate: float) -> Reading | None:
        """The coarsest lattice near ``factor`` that does, on all receivers; None if none was found that does."""
        known, failed = None, 0.0
        for _ in range(TRIES):
            self._limited = self._affordable(self.at(factor), order)
            if self._limited:
                break
            reading = self._decided(self.at(factor), order, ray_error, 1)
            shifted = _shifted(self.at(factor))
            if not self._passes(reading, order, ray_error) and not self._affordable(shifted, order):
                others = reading, self._decided(shifted, order, ray_error, 1)
                reading = min(others, key=lambda one: upper(one.error(order, ray_error)))
            bound = upper(reading.error(order, ray_error))
            following = factor * (bound / self._target) ** (1.0 / rate) * OVERSHOOT
            if bound > self._target:
                failed = factor
                if known is not None:
                    break
                factor = max(following, factor * LEAST_STEP)
            else:
                known = reading
                if following > NO_STEP * factor or following <= failed or self.at(following) == self.at(factor):
                    break
                factor = following
        return known

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
        factor = (reading.lattice_points / sum(np.prod(own) for own in self._files)) ** (1.0 / 3.0)
        other = self._settle(factor * cost(best)[1] * OVERSHOOT, order, best, rate)
        if other is None or self._prices.rays(other, best) > spent:
            return reading, ray_error
        return other, best

    def _shape(self, base: Reading, order: int, ray_error: float, rate: float) -> Reading:
        """``base`` or a cheaper lattice with more probes along axes where the light changes and fewer where it does not."""
        axes = [(volume, axis) for volume, resolution in enumerate(base.resolutions) for axis in range(3) if resolution[axis] > 2]
        if len(axes) < 2 or len(axes) > MOST_AXES:
            return base
        square = self._measure(base.resolutions, 0).error(order).value ** 2
        shares = {}
        for volume, axis in axes:
            coarser = _changed(base.resolutions, volume, axis, max(2, round(base.resolutions[volume][axis] / COARSENED)))
            ratio = base.resolutions[volume][axis] / coarser[volume][axis]
            if ratio > 1.0:
                rise = self._measure(coarser, 0).error(order).value ** 2 - square
                shares[volume, axis] = max(rise, 0.0) / (ratio ** (2 * rate) - 1.0)
        allowed = square * (self._target / max(upper(base.error(order, ray_error)), 1e-9)) ** 2
        proposal = _cheapest(base.resolutions, shares, square, allowed, rate)
        middle = tuple(tuple(round((a * b) ** 0.5) for a, b in zip(old, new, strict=True))
                       for old, new in zip(base.resolutions, proposal, strict=True))
        for resolutions in (proposal, middle):
            if sum(map(np.prod, resolutions)) > 0.95 * base.lattice_points or self._affordable(resolutions, order):
                continue
            reading = self._decided(resolutions, order, ray_error, 1)
            if self._passes(reading, order, ray_error):
                return reading
        return base

    def _best(self, readings: tuple[Reading, ...], climb: list[tuple[float, Reading]]) -> Found:
        """The cheapest of what comes near the least error that can be had, on all receivers."""
        order = max(self._pilot.orders)
        nearest = sorted(readings, key=lambda reading: reading.error(order).value)[:CANDIDATES]
        ways = []
        for reading in [self._measure(reading.resolutions) for reading in nearest]:
            for own in self._pilot.orders:
                for ray_error in RAY_ERRORS:
                    if not self._affordable(reading.resolutions, own):
                        ways.append((reading.error(own, ray_error), self._prices.rays(reading, ray_error), reading, own, ray_error))
        least = min(way[0].value for way in ways)
        error, _, reading, order, ray_error = min((way for way in ways if way[0].value <= NEARLY * least), key=lambda way: way[1])
        return Found(reading, order, ray_error, error, upper(error) <= self._target, *self._seen(climb), self._limited)

    def _seen(self, climb: list[tuple[float, Reading]]) -> tuple[float | None, tuple[Reading, ...]]:
        """Rate and readings of ``climb``, as all receivers that were asked since then have them."""
        known = self._pilot.readings
        latest = [(factor, max((one for one in known if one.resolutions == reading.resolutions), key=lambda one: len(one.variance)))
                  for factor, reading in climb]
        return _rate(latest[-2:], max(self._pilot.orders)), tuple(reading for _, reading in latest)


def _rate(pair: list[tuple[float, Reading]], order: int) -> float | None:
    """p of error ~ spacing^p between two readings; None if there are not two or one has no error."""
    if len(pair) < 2:
        return None
    (coarse, first), (fine, second) = pair
    errors = first.error(order).value, second.error(order).value
    return log(errors[0] / errors[1]) / log(fine / coarse) if min(errors) > 0 else None


def _shifted(resolutions: Resolutions) -> Resolutions:
    return tuple(tuple(count + 1 if count > 1 else count for count in resolution) for resolution in resolutions)


def _changed(resolutions: Resolutions, volume: int, axis: int, count: int) -> Resolutions:
    lists = [list(resolution) for resolution in resolutions]
    lists[volume][axis] = count
    return tuple(tuple(part) for part in lists)


def _cheapest(base: Resolutions, shares: dict[tuple[int, int], float], square: float, allowed: float, rate: float) -> Resolutions:
    """The fewest probes for which the model square + sum of share * ((base / resolution)^2p - 1) stays within ``allowed``: from a
    finer lattice one probe less at a time, along the axis that saves most for what it costs in error."""
    exponent = 2.0 * rate
    # Along every axis some of the error stays, and all of it belongs to one of them.
    shares = {key: max(share, LEAST_SHARE * square / len(shares)) for key, share in shares.items()}
    scale = square / max(sum(shares.values()), 1e-30)
    current = [list(resolution) for resolution in base]
    for volume, axis in shares:
        current[volume][axis] = ceil(base[volume][axis] * COARSENED)

    def part(key, count):
        return scale * shares[key] * ((base[key[0]][key[1]] / count) ** exponent - 1.0)

    parts = {key: part(key, current[key[0]][key[1]]) for key in shares}
    while True:
        best = None
        for key in shares:
            volume, axis = key
            count = current[volume][axis]
            if count <= max(2, ceil(base[volume][axis] / COARSENED)):
                continue
            rise = part(key, count - 1) - parts[key]
            if square + sum(parts.values()) + rise > allowed:
                continue
            saved = np.prod(current[volume]) / count
            if best is None or saved > best[0] * max(rise, 1e-12):
                best = saved / max(rise, 1e-12), key
        if best is None:
            return tuple(tuple(int(count) for count in resolution) for resolution in current)
        volume, axis = best[1]
        current[volume][axis] -= 1
        parts[best[1]] = part(best[1], current[volume][axis])
