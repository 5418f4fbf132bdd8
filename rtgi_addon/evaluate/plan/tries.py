"""Lattices measured within what a plan may spend, how sure their errors are, and which of them is worth its rays."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from ...progress import Progress
from ...scene import ProbeVolume
from ..metrics import Figure
from .pilot import LEVELS, PILOT_ERROR, RAYS_A_PROBE, Pilot, Reading
from .price import Prices
from .sample import NORMALS_PER_POINT
from .shapes import Resolutions

# Target errors of the probes' own rays that are weighed against a finer lattice.
RAY_ERRORS = (0.1, 0.05, 0.03, 0.02, 0.01, 0.005)
# One-sided confidence of what is promised, and the normal quantile that goes with it.
CONFIDENCE, QUANTILE = 0.9, 1.2816
# What a plan may spend on its own choice, as a share of the rays of the bake that it would choose now, or of so many times those
# of the lattice that is worth its rays so far, if that is less: a fine one that fails in the end is no measure.
SHARE, CAUTION = 0.25, 4.0
# A coarser lattice, which costs less to bake, may still be tried within so many times that; and points are enough where the bound
# is below this share of the target.
MORE, CLEAR = 1.5, 0.8
# Rays that another lattice has to save for each that it takes to measure it.
WORTH_MEASURING = 2.0
# An unreachable target: rays are worth it while the error falls at least by this power of their number (light that is smooth
# between probes makes it a third or more: a lattice twice as fine has eight times the probes and half the error), and up to so many
# times the file's probes, or as many as the last of the three.
WORTH_POWER, MOST_TIMES, SOME_PROBES = 1.0 / 6.0, 8, 4096
# Lattices that are usually left to be measured, and the share of what is left that the next one is: the progress bar's guess.
_USUALLY_LEFT, _STEP = 4.0, 0.1
# How the number of probes that receivers read grows with theirs: neighbours share some.
_MORE_PROBES = 0.7
# What was measured is known: a lattice that would have more than this of its probes along each axis is not looked for.
NO_STEP = 0.9
# Bounds of errors are no less than this.
LEAST_BOUND = 1e-9


def upper(figure: Figure) -> float:
    """The bound that an error stays below with CONFIDENCE, over the choice of receivers."""
    spread = figure.standard_error
    return figure.value + (QUANTILE * spread if np.isfinite(spread) else 0.0)


class Tries:
    """Lattices of ``pilot`` at multiples of the resolutions ``files`` of its volumes, held to ``target``; ``fits(volumes, order)``
    returns "" or the name of the limit that is passed."""

    def __init__(self, pilot: Pilot, prices: Prices, target: float, fits: Callable[[tuple[ProbeVolume, ...], int], str],
                 progress: Progress):
        self._pilot, self._prices, self._target, self._fits, self._progress = pilot, prices, target, fits, progress
        self.files = tuple(tuple(volume.resolution) for volume in pilot.volumes)
        self._measured = 0

    def at(self, factor: float) -> Resolutions:
        """The file's lattices with ``factor`` times the probes along each axis; no axis with several keeps only one."""
        return tuple(tuple(max(min(2, count), round(count * factor)) for count in resolution) for resolution in self.files)

    @property
    def cap(self) -> float:
        """The most probes that are worth it where the target is out of reach."""
        return max(MOST_TIMES * self.probes(1.0), SOME_PROBES)

    def probes(self, factor: float) -> int:
        """Lattice points of all volumes at ``factor``."""
        return int(sum(map(np.prod, self.at(factor))))

    def limit(self, resolutions: Resolutions, order: int) -> str:
        """The name of the limit that lattices of ``resolutions`` pass, or ""."""
        return self._fits(tuple(replace(volume, resolution=resolution)
                                for volume, resolution in zip(self._pilot.volumes, resolutions, strict=True)), order)

    def measure(self, resolutions: Resolutions, level: int = -1) -> Reading:
        """What the volumes at ``resolutions`` are worth on the surface points of ``level``. Raises Cancelled."""
        self._progress.step(0.0, "measuring lattices")
        self._measured += 1
        done = self._measured / (self._measured + _USUALLY_LEFT)
        return self._pilot.measure(resolutions, self._progress.span(done - _STEP * (1 - done), done), level)

    def may_spend(self, rays: float, reading: Reading, ray_error: float, more: float = 1.0) -> bool:
        """Whether ``rays`` more are worth it if ``reading`` would be baked with ``ray_error``, or ``more`` times as many."""
        base, wanted = self._prices.rays(reading, ray_error), (self._pilot.spent + rays) / (SHARE * more)
        if wanted > base:
            return False
        # As bakes that go on with the plan's cache, which most are: all ray settings would take as long as a lattice.
        worth = self.worth(self.ways(self._pilot.readings, (PILOT_ERROR,)))
        return worth is None or wanted <= CAUTION * self._prices.rays(worth[0], worth[2])

    def cost(self, reading: Reading, level: int, known: int = 0) -> float:
        """About how many rays another lattice like that of ``reading`` takes on the points of ``level``, if ``known`` of its probes
        are there already."""
        points = self._pilot.points(level)
        more = NORMALS_PER_POINT * points / len(reading.variance)
        probes = min(reading.lattice_points, reading.probes * max(more, 1.0) ** _MORE_PROBES) - known
        missing = max(0, NORMALS_PER_POINT * points - len(self._pilot.truth.mean))
        return missing * self._pilot.receiver_rays + max(probes, 0.0) * RAYS_A_PROBE

    def passes(self, reading: Reading, order: int, ray_error: float) -> bool:
        """Whether ``reading`` meets the target with CONFIDENCE."""
        return upper(reading.error(order, ray_error)) <= self._target

    def decided(self, resolutions: Resolutions, order: int, ray_error: float, level: int) -> Reading:
        """A reading on as many receivers, from ``level`` up, as it takes to tell whether the target is met, or as that is worth.
        Errors have rare great ones among them, which few receivers miss: a target counts as met on all that is worth it."""
        reading = self.measure(resolutions, level)
        for following in range(level + 1, len(LEVELS)):
            error = reading.error(order, ray_error)
            fails = (2.0 * error.value - upper(error)) * self.luck(reading, order, ray_error) > self._target
            clear = fails or (following > 1 and upper(error) <= CLEAR * self._target)
            if clear or not self.may_spend(self.cost(reading, following, reading.probes), reading, ray_error):
                break
            reading = self.measure(resolutions, following)
        return reading

    def luck(self, reading: Reading, order: int, ray_error: float) -> float:
        """How many times as much as at the receivers of ``reading`` the error is at the most that any lattice was measured at, by
        that lattice, which was measured at both: points that are hard for one lattice are for another. No more than 1, for great
        errors are rare, and those points then count anyway."""
        most = max(self._pilot.readings, key=lambda other: len(other.variance))
        few = next((other for other in self._pilot.readings if other.resolutions == most.resolutions
                    and len(other.variance) == len(reading.variance)), most)
        bounds = [upper(other.error(order, ray_error)) for other in (most, few)]
        return min(1.0, bounds[0] / max(bounds[1], LEAST_BOUND))

    def worth_trying(self, known: Reading, ray_error: float, ratio: float) -> bool:
        """Whether a lattice ``ratio`` times as fine as ``known``, which does, would save enough for what it takes to find out."""
        saved = (1.0 - ratio**3) * self._prices.marginal(known, ray_error)
        cost = self.cost(known, self.level(known))
        return ratio <= NO_STEP and saved >= WORTH_MEASURING * cost and self.may_spend(cost, known, ray_error, MORE)

    def level(self, reading: Reading) -> int:
        """The level that ``reading`` was measured on."""
        points = len(reading.variance) // NORMALS_PER_POINT
        return next(level for level in range(len(LEVELS)) if self._pilot.points(level) >= points)

    def ways(self, readings: tuple[Reading, ...], ray_errors: tuple[float, ...] = RAY_ERRORS) -> list[tuple[Reading, int, float]]:
        """All ways to bake the lattices of ``readings`` within the limits: (reading, order, ray error)."""
        return [(reading, order, ray_error) for reading in readings for order in self._pilot.orders for ray_error in ray_errors
                if not self.limit(reading.resolutions, order)]

    def worth(self, ways: list[tuple[Reading, int, float]]) -> tuple[Reading, int, float] | None:
        """The cheapest of ``ways`` that meets the target but for the worst points; else the one whose error is small for its
        rays."""
        nearly = [way for way in ways if way[0].bulk(way[1], way[2]) <= self._target]
        if nearly:
            return min(nearly, key=lambda way: self._prices.marginal(way[0], way[2]))

        def cost(way):
            reading, order, ray_error = way
            return reading.bulk(order, ray_error) * self._prices.marginal(reading, ray_error) ** WORTH_POWER

        return min(ways, key=cost, default=None)
