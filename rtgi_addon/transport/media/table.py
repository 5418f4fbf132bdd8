"""All media of a scene, made ready for rays: how much light they leave along segments, what they give, where they scatter."""

from collections.abc import Callable, Iterable

import numpy as np

from ...scene import Medium
from ..parallel import chunks, parallel_for
from ..rays.tracer import INFINITE
from .grid import Coefficients, GridTable
from .inside import Everywhere, Inside, Spans, inside_of
from .passage import Passage

# Rays per unit of work: a passage keeps a hundred numbers a ray alive, more where there are grids.
CHUNK = 1 << 13


class Filling:
    """One medium: where it is and what it does there."""

    def __init__(self, medium: Medium, threads: int | None = None):
        self.medium = medium
        self._bounds: Inside = Everywhere() if medium.bounds is None else inside_of(medium.bounds, threads)
        self.grid = None if medium.grid is None else GridTable(medium)
        self._scattering, self._absorption, self._emission = (
            np.asarray(part, np.float64) for part in (medium.scattering, medium.absorption, medium.emission))

    @property
    def majorant(self) -> np.ndarray:
        """What extinction (3,) [1/m] exceeds nowhere."""
        return self.medium.extinction if self.grid is None else self.grid.majorant

    def spans(self, origins, directions, t_max) -> Spans:
        """See Inside.spans."""
        spans = self._bounds.spans(origins, directions, t_max)
        if self.grid is None:
            return spans
        box = self.grid.box.spans(origins, directions, t_max)
        enter = np.maximum(spans.enter, box.enter)
        return Spans(enter, np.maximum(np.minimum(spans.leave, box.leave), enter))

    def contains(self, points: np.ndarray) -> np.ndarray:
        """(n,) bool: which of ``points`` (n, 3) it fills."""
        inside = self._bounds.contains(points)
        return inside if self.grid is None else inside & self.grid.box.contains(points)

    def coefficients(self, points: np.ndarray) -> Coefficients:
        """What it does at ``points`` (n, 3), which it fills."""
        if self.grid is not None:
            return self.grid.coefficients(points)
        return Coefficients(*(np.broadcast_to(part, (len(points), 3))
                              for part in (self._scattering, self._absorption, self._emission)))

    def optical_depth(self, origins, directions, t_max) -> np.ndarray:
        """∫σ_t (n, 3) along rays from 0 to ``t_max`` (n,); 0 times an infinite length is 0."""
        spans, depth = self.spans(origins, directions, t_max), np.zeros((len(origins), 3))
        if self.grid is None:
            length = np.sum(spans.leave - spans.enter, axis=1)
            for channel in np.flatnonzero(self.medium.extinction > 0):
                depth[:, channel] = self.medium.extinction[channel] * length
            return depth
        for enter, leave in zip(spans.enter.T, spans.leave.T, strict=True):
            depth += self.grid.optical_depth(origins, directions, enter, leave)
        return depth


class MediaTable:
    """Several media together; where they overlap, they add up. Directions are unit; distances may be infinite.

    Nothing is asked of it where ``is_empty``.
    """

    def __init__(self, media: Iterable[Medium] = (), threads: int | None = None):
        self.fillings = tuple(Filling(medium, threads) for medium in media)
        self._threads = threads

    def part(self, kept: Callable[[Medium], bool]) -> "MediaTable":
        """The media that are ``kept``; itself if all are."""
        fillings = tuple(filling for filling in self.fillings if kept(filling.medium))
        if len(fillings) == len(self.fillings):
            return self
        result = MediaTable((), self._threads)
        result.fillings = fillings
        return result

    @property
    def is_empty(self) -> bool:
        """True if there is no medium."""
        return not self.fillings

    @property
    def scatters(self) -> bool:
        """True if some medium scatters."""
        return any(np.any(np.asarray(filling.medium.scattering) > 0) for filling in self.fillings)

    @property
    def is_emissive(self) -> bool:
        """True if some medium gives light of its own."""
        return any(filling.medium.is_emissive for filling in self.fillings)

    def passage(self, origins: np.ndarray, directions: np.ndarray, t_max: np.ndarray | None = None) -> Passage:
        """What rays pass, in pieces within which nothing changes; where there are grids, which change from cell to cell, in pieces
        of a cell's size. Keep it to ``CHUNK`` rays."""
        origins, directions, t_max = _rays(origins, directions, t_max)
        spans = [filling.spans(origins, directions, t_max) for filling in self.fillings]
        edges = [t_max[:, None], np.zeros((len(origins), 1))]
        for filling, (enter, leave) in zip(self.fillings, spans, strict=True):
            edges += [enter, leave]
            if filling.grid is not None:
                edges += [_divisions(*span, filling.grid.cell) for span in zip(enter.T, leave.T, strict=True)]
        limits = np.sort(np.concatenate(edges, axis=1), axis=1)
        begin, end = limits[:, :-1], limits[:, 1:]
        middle = np.where(np.isinf(end), begin + 1.0, 0.5 * (begin + np.where(np.isinf(end), begin, end)))
        sums = np.zeros((3, *middle.shape, 3))
        for filling, (enter, leave) in zip(self.fillings, spans, strict=True):
            within = np.any((enter[:, None] < middle[:, :, None]) & (middle[:, :, None] < leave[:, None]), axis=2)
            ray, piece = np.nonzero(within & (end > begin))
            points = origins[ray] + directions[ray] * middle[ray, piece, None]
            for total, part in zip(sums, filling.coefficients(points), strict=True):
                total[ray, piece] += part
        scattering, absorption, emission = sums
        return Passage(limits, scattering + absorption, scattering, emission)

    def emitted(self, origins: np.ndarray, directions: np.ndarray, t_max: np.ndarray | None = None) -> np.ndarray:
        """Radiance (n, 3) float32 that media themselves give along rays, what they take of it on the way taken off."""
        return self._by_chunks(origins, directions, t_max, lambda *rays: self.passage(*rays).emitted())

    def transmittance(self, origins: np.ndarray, directions: np.ndarray, t_max: np.ndarray | None = None) -> np.ndarray:
        """The share (n, 3) float32 of light that is neither absorbed nor scattered on its way from ``t_max`` (n,) (None: from
        infinitely far) to ``origins`` (n, 3) along ``directions`` (n, 3)."""
        def work(*rays):
            return np.exp(-sum(filling.optical_depth(*rays) for filling in self.fillings))
        return self._by_chunks(origins, directions, t_max, work)

    def at(self, points: np.ndarray) -> list[Coefficients]:
        """What each medium does at ``points`` (n, 3): nothing where it is not."""
        found = []
        for filling in self.fillings:
            rows = np.flatnonzero(filling.contains(points))
            parts = [np.zeros((len(points), 3)) for _ in Coefficients._fields]
            for whole, part in zip(parts, filling.coefficients(points[rows]), strict=True):
                whole[rows] = part
            found.append(Coefficients(*parts))
        return found

    def _by_chunks(self, origins, directions, t_max, work) -> np.ndarray:
        rays = _rays(origins, directions, t_max)
        spans = chunks(len(origins), CHUNK)
        parts = parallel_for(lambda i: work(*(part[spans[i]] for part in rays)).astype(np.float32), len(spans), self._threads)
        return np.concatenate(parts) if parts else np.zeros((0, 3), np.float32)


def _rays(origins, directions, t_max) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Rays in double precision, their lengths beyond what float32 tells from infinity made infinite."""
    n = len(origins)
    limits = np.full(n, np.inf) if t_max is None else np.broadcast_to(np.asarray(t_max, np.float64), (n,))
    return (np.asarray(origins, np.float64), np.asarray(directions, np.float64), np.where(limits >= INFINITE, np.inf, limits))


def _divisions(enter: np.ndarray, leave: np.ndarray, cell: float) -> np.ndarray:
    """Where (n, k) each span (n,) is divided into as many even parts as the longest one has cells."""
    length = leave - enter
    count = int(np.ceil(length.max(initial=0.0) / cell))
    return enter[:, None] + length[:, None] * (np.arange(1, count) / max(count, 1))
