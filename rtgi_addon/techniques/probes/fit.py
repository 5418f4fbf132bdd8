"""Probes fitted to where they are read: what a bake measured, changed until what is looked up is as near as can be to the light.

Points on surfaces, close above them and in the air are drawn, and what light there is at them (`fit_points.py`); the solver is
`techniques/lattice/fitting.py`. Measured in benchmarks/README.md.
"""

from dataclasses import replace

import numpy as np

from ...numerics.sampling import hash_u32
from ...progress import Progress
from ...scene.memory import require_memory
from ..base import ProbeGrid
from ..lattice.field import ProbeField
from ..lattice.fitting import Fit, measured_by
from ..lattice.lookup import LookupSettings
from ..lattice.reading import Stored
from .fit_points import FitPoints
from .relight import Relit

# What tells a fit's random numbers from those of its bake.
_PURPOSE = 0x666974
# How the kinds of points are called in a bake's statistics.
KINDS = ("on_surfaces", "above_surfaces", "in_the_air")
# What must not get worse, by number: surfaces, all that is off them, and of that the air.
_GUARDED = ((0,), (1, 2), (2,))
# Where what surfaces read is no further off than this, nothing is changed.
_ENOUGH = 0.01
# Of a point that is read, while all its pairs with probes, and their equations, are in memory: by the arrays' sizes, at order 2.
BYTES_PER_READ = 2400
# How far a fit is when all its points have their light.
_POINTS = 0.4


class SurfaceFit:
    """The fit of a finished ``bake``. ``rays`` were traced for it; ``stats`` say what it brought. Raises Cancelled."""

    def __init__(self, bake, progress: Progress):
        grids = bake.grids()
        field = _read_linearly(grids)
        self._points = FitPoints(bake, field, int(hash_u32(bake.cache.numbers.seed, _PURPOSE)), progress.span(0.0, _POINTS))
        targets, held = self._points.targets(), self._points.held()
        self._seen = [~rows for rows in held]
        require_memory({"the fit to surfaces": BYTES_PER_READ * sum(len(rows) for rows in held)})
        self._fit = Fit(field, [one.take(rows) for one, rows in zip(targets, self._seen, strict=True)],
                        [one.take(rows) for one, rows in zip(targets, held, strict=True)], _GUARDED, _ENOUGH,
                        self._points.tell_distances, bake.context.threads, progress.span(_POINTS, 1.0))
        self.rays = self._points.rays
        self.grids = self._fitted(field, grids, self._fit.stored)

    @property
    def stats(self) -> dict:
        """Relative RMSE of what is read at points that the fit did not see, before and after, by kind; the price of moving away
        from what was measured that did best (None: the measurement did); and how many rays it took."""
        return {"price": self._fit.price, "rays": self.rays, **dict(zip(KINDS, self._fit.errors, strict=True))}

    def relit(self, other: Relit, progress: Progress) -> tuple[ProbeGrid, ...]:
        """The grids of ``other`` light fitted to it, at the distances of this fit: as cheap as relighting itself. Raises BakeError,
        Cancelled."""
        if self._fit.price is None:
            return other.grids
        targets = self._points.relit(other, progress)
        field = _read_linearly(other.grids)
        measured = replace(measured_by(field), mean=self._fit.stored.mean, variance=self._fit.stored.variance)
        light = [one.irradiance[rows] for one, rows in zip(targets, self._seen, strict=True)]
        return self._fitted(field, other.grids, self._fit.refitted(measured, self._fit.price, light))

    def _fitted(self, field: ProbeField, grids: tuple[ProbeGrid, ...], stored: Stored) -> tuple[ProbeGrid, ...]:
        """``grids`` with what is ``stored`` in place of what their live probes measured."""
        if self._fit.price is None:
            return grids
        found, first = {}, 0
        for lookup in field.lookups:
            last = first + len(lookup.positions)
            found[id(lookup.volume)] = lookup.live, stored.take(slice(first, last))
            first = last
        return tuple(_holding(grid, *found[id(grid.volume)]) for grid in grids)


def _read_linearly(grids: tuple[ProbeGrid, ...]) -> ProbeField:
    return ProbeField(grids, lookup=LookupSettings("linear"))


def _holding(grid: ProbeGrid, live: np.ndarray, stored: Stored) -> ProbeGrid:
    live = live.reshape(grid.validity.shape)
    sh, visibility = grid.sh.copy(), grid.visibility.copy()
    sh[live] = stored.coefficients.reshape(grid.sh.shape)[live]
    tiles = np.stack([stored.mean, stored.mean**2 + stored.variance], axis=-1).reshape(grid.visibility.shape)
    visibility[live] = tiles[live]
    return replace(grid, sh=sh, visibility=visibility, fitted=True)
