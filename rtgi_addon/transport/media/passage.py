"""What rays pass in media, piece by piece: transmittance, light given along the way, points where light scatters towards the eye.

Source of the integral over a piece: S. Hillaire, "Physically Based and Unified Volumetric Rendering in Frostbite", SIGGRAPH 2015.
"""

from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np


def slice_integral(extinction: np.ndarray, length: np.ndarray) -> np.ndarray:
    """∫₀^d e^(−σt) dt = (1 − e^(−σd))/σ [m] for ``extinction`` σ [1/m] and ``length`` d [m], which broadcast; d as σ goes to 0,
    1/σ for an infinite d.

    A source S a metre gives S times it through a slice: S·d, which is often taken, is 1.58 times too much at σd = 1.
    """
    extinction, length = np.broadcast_arrays(np.asarray(extinction, np.float64), np.asarray(length, np.float64))
    with np.errstate(invalid="ignore"):
        depth = np.where(extinction > 0, extinction * length, 0.0)
    # Below 1e-8 the quotient's rounding exceeds the quadratic term that the limit leaves out.
    thin = depth < 1e-8
    return np.where(thin, length, -np.expm1(-depth) / np.where(thin, 1.0, extinction))


class Scattered(NamedTuple):
    """One point a ray: ``distance`` (n,) along it, and ``weight`` (n, 3) = transmittance·σ_s/density. The mean of the weight times
    the light that is scattered there towards the origin is what a ray sees of it. Weight 0: nothing scatters along it."""

    distance: np.ndarray
    weight: np.ndarray


@dataclass(frozen=True, eq=False)
class Passage:
    """``limits`` (n, k + 1) float64: where pieces of rays begin and end, ascending; some are empty, the last may be infinite.
    ``extinction``, ``scattering`` [1/m] and ``emission`` [W·sr⁻¹·m⁻³] (n, k, 3) within them."""

    limits: np.ndarray
    extinction: np.ndarray
    scattering: np.ndarray
    emission: np.ndarray

    @cached_property
    def lengths(self) -> np.ndarray:
        """How long every piece (n, k) is [m]."""
        begin, end = self.limits[:, :-1], self.limits[:, 1:]
        return np.where(end > begin, end - np.where(end > begin, begin, 0.0), 0.0)

    @cached_property
    def depths(self) -> np.ndarray:
        """Optical depth (n, k + 1, 3) float64 up to every limit."""
        with np.errstate(invalid="ignore"):
            parts = np.where(self.extinction > 0, self.extinction * self.lengths[:, :, None], 0.0)
        return np.concatenate([np.zeros_like(parts[:, :1]), np.cumsum(parts, axis=1)], axis=1)

    def transmittance(self) -> np.ndarray:
        """The share (n, 3) that comes through all of it."""
        return self._left[:, -1]

    @cached_property
    def _left(self) -> np.ndarray:
        """Transmittance (n, k + 1, 3) up to every limit."""
        return np.exp(-self.depths)

    def emitted(self) -> np.ndarray:
        """∫T·ε dt (n, 3): radiance [W·sr⁻¹·m⁻²] that reaches the origin."""
        if not self.emission.any():
            return np.zeros((len(self.limits), 3))
        return self._gathered(self.emission).sum(axis=1)

    def scatter(self, u: np.ndarray) -> Scattered:
        """Draw one point a ray by ``u`` (n, 2) in [0, 1), with a density in proportion to what reaches the origin from it, were the
        light there the same everywhere (exactly so where extinction is grey)."""
        shares, total = self._shares, self._shares.sum(axis=1)
        upper = np.cumsum(shares, axis=1)
        piece = np.minimum(np.sum(upper <= (u[:, 0] * total)[:, None], axis=1), shares.shape[1] - 1)
        rows = np.arange(len(piece))
        begin, length = self.limits[rows, piece], self.lengths[rows, piece]
        along = _exponential(self.extinction[rows, piece].mean(axis=1), length, u[:, 1])
        density = self._density(piece, along)
        with np.errstate(divide="ignore", invalid="ignore"):
            weight = np.where((density > 0)[:, None], self._source(piece, along) / density[:, None], 0.0)
        return Scattered(np.where(total > 0, begin + along, 0.0), weight)

    def take(self, rows: np.ndarray) -> "Passage":
        """What the rays ``rows`` (indices) pass."""
        return Passage(*(part[rows] for part in (self.limits, self.extinction, self.scattering, self.emission)))

    @cached_property
    def scattering_between(self) -> tuple[np.ndarray, np.ndarray]:
        """From where to where (n,) along rays anything scatters; 0 and 0 where nothing does."""
        there = self._shares > 0
        begin = np.where(there, self.limits[:, :-1], np.inf).min(axis=1)
        return np.where(np.isinf(begin), 0.0, begin), np.where(there, self.limits[:, 1:], 0.0).max(axis=1)

    def reaching(self, distances: np.ndarray) -> np.ndarray:
        """T·σ_s (n, b) [1/m] at ``distances`` (n, b), the mean of its colours."""
        piece = np.zeros(distances.shape, np.intp)
        for begin in self.limits[:, 1:-1].T:
            piece += begin[:, None] <= distances
        rows = np.arange(len(piece))[:, None]
        along = np.clip(distances - self.limits[rows, piece], 0.0, self.lengths[rows, piece])
        grey, depth = self.extinction.mean(axis=2), self.depths.mean(axis=2)
        return self.scattering.mean(axis=2)[rows, piece] * np.exp(-depth[rows, piece] - grey[rows, piece] * along)

    def met(self, distance: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """At ``distance`` (n,) T·σ_s (n, 3) [1/m], and the density (n,) [1/m] with which ``scatter`` draws it."""
        piece, rows = self._piece(distance), np.arange(len(distance))
        along = np.clip(distance - self.limits[rows, piece], 0.0, self.lengths[rows, piece])
        return self._source(piece, along), self._density(piece, along)

    def _piece(self, distance: np.ndarray) -> np.ndarray:
        """The pieces (n,) that ``distance`` (n,) lies in."""
        return np.clip(np.sum(self.limits <= distance[:, None], axis=1) - 1, 0, self.limits.shape[1] - 2)

    def _depth(self, piece: np.ndarray, along: np.ndarray) -> np.ndarray:
        """Optical depth (n, 3) up to ``along`` (n,) [m] within ``piece`` (n,)."""
        rows = np.arange(len(piece))
        return self.depths[rows, piece] + self.extinction[rows, piece] * along[:, None]

    def _source(self, piece: np.ndarray, along: np.ndarray) -> np.ndarray:
        """T·σ_s (n, 3) there."""
        return self.scattering[np.arange(len(piece)), piece] * np.exp(-self._depth(piece, along))

    def _density(self, piece: np.ndarray, along: np.ndarray) -> np.ndarray:
        """Density (n,) [1/m] of ``scatter`` there: that of the piece, times that within it; 0 where nothing scatters."""
        rows = np.arange(len(piece))
        grey, total = self.extinction[rows, piece].mean(axis=1), self._shares.sum(axis=1)
        with np.errstate(divide="ignore", invalid="ignore"):
            density = self._shares[rows, piece] / total * np.exp(-grey * along) / slice_integral(grey, self.lengths[rows, piece])
        return np.where((total > 0) & (density > 0), density, 0.0)

    @cached_property
    def _shares(self) -> np.ndarray:
        """∫T·σ_s dt (n, k) of every piece, the mean of its colours."""
        return self._gathered(self.scattering).mean(axis=2)

    def _gathered(self, source: np.ndarray) -> np.ndarray:
        """∫T·source dt (n, k, 3) of every piece."""
        slices = slice_integral(self.extinction, self.lengths[:, :, None])
        # A piece without a source gives none, however long it is.
        return self._left[:, :-1] * np.where(source > 0, source * np.where(source > 0, slices, 0.0), 0.0)


def _exponential(extinction: np.ndarray, length: np.ndarray, u: np.ndarray) -> np.ndarray:
    """Distances (n,) in [0, length) with density in proportion to e^(−σt), for ``extinction`` σ (n,) from 0 on."""
    with np.errstate(invalid="ignore"):
        depth = np.where(extinction > 0, extinction * length, 0.0)
    thin = depth < 1e-6
    bent = -np.log1p(u * np.expm1(-depth)) / np.where(thin, 1.0, extinction)
    return np.where(thin, u * np.where(np.isfinite(length), length, 0.0), bent)
