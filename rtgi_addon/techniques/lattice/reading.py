"""The look-up as a function of what is stored, with its derivatives: what it takes to fit the one to how the other is read.

Irradiance at a point is Σ w_i·E_i / Σ w_i over its probes i, where E_i is linear in a probe's coefficients and w_i depends on the
distances that it stores in the point's direction (`weights.py`). Pairs of a point and a probe are kept probe by probe, so that sums
over a probe's points are products of small matrices.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from ...numerics import octahedral, sh
from ...transport.parallel import parallel_for
from .field import ProbeField
from .lookup import GridLookup
from .normal_equations import Cells, Equations
from .weights import AT_PROBE, CRUSH_BELOW, TINY, UNSEEN_FLOOR, side_weight

# Pairs that are worked on at once: their arrays stay in a core's cache.
BLOCK = 1 << 13
LEAST_SHARE = 1e-3


@dataclass(frozen=True, eq=False)
class Stored:
    """What p probes store: ``coefficients`` (p, k, 3), and in T² directions the ``mean`` (p, T²) of distances [m] and their
    ``variance`` (p, T²) [m²]."""

    coefficients: np.ndarray
    mean: np.ndarray
    variance: np.ndarray

    def take(self, probes: slice) -> "Stored":
        """What some of the probes store."""
        return Stored(self.coefficients[probes], self.mean[probes], self.variance[probes])


@dataclass(frozen=True, eq=False)
class Weighed:
    """How n points weigh m pairs: the ``share`` (m,) of each pair in its point, the points' sums of weights ``total`` (n,), and the
    derivatives (m,) of the weights by the interpolated mean and mean square of distances."""

    share: np.ndarray
    total: np.ndarray
    by_mean: np.ndarray
    by_square: np.ndarray


@dataclass(frozen=True, eq=False)
class Read:
    """What n points read: ``irradiance`` (n, 3) float64, negative where it rings, and each pair's own ``light`` (m, 3)."""

    irradiance: np.ndarray
    light: np.ndarray


class Reading:
    """Points (n, 3) with unit ``normals`` (n, 3) as ``lookup`` reads them.

    ``known`` (n,) bool: points with a live probe among their eight; irradiance is 0 at the others. Dilated probes are left out.
    ``index`` (n, 8) are the probes about each point, ``basis`` (n, k) what coefficients count under its normal.
    """

    def __init__(self, lookup: GridLookup, points: np.ndarray, normals: np.ndarray, threads: int | None = None):
        normals = np.asarray(normals, np.float32)
        self.index, trilinear = lookup.neighbours(points, normals)
        pairs = np.flatnonzero((trilinear > 0) & lookup.live[self.index])
        self._pairs = pairs = pairs[np.argsort(self.index.ravel()[pairs], kind="stable")]
        self.count, self._threads, self._tile = len(normals), threads, lookup.tile
        self._row, self._probe = pairs // 8, self.index.ravel()[pairs]
        self._starts = np.searchsorted(self._probe, np.arange(len(lookup.positions) + 1))
        self._trilinear = trilinear.ravel()[pairs]
        offset = (np.asarray(points, np.float64) - lookup.centre).astype(np.float32)[self._row] - lookup.positions[self._probe]
        normal = normals[self._row]
        self._side = np.ones(len(pairs), np.float32)
        if lookup.settings.normal_weight:
            self._side = side_weight(-offset, normal)
        offset += np.float32(lookup.bias) * normal
        self._distance = np.linalg.norm(offset, axis=-1)
        at_probe = (self._distance <= AT_PROBE * lookup.bias)[:, None]
        self._texels, self._shares = _read_texels(np.where(at_probe, np.float32([0, 0, 1]), offset), lookup.tile)
        order = sh.order_of(lookup.coefficients.shape[1])
        self.basis = (sh.evaluate(normals, order) * sh.cosine_coefficients(order)).astype(np.float32)
        self._basis = self.basis[self._row]
        self.known = np.bincount(self._row, minlength=self.count) > 0
        self._blocks = _blocks(self._starts)
        # Texels are numbered within each block.
        for first, last in self._blocks:
            span = slice(self._starts[first], self._starts[last])
            self._texels[span] += ((self._probe[span] - first) * self._tile**2)[:, None]

    def weigh(self, stored: Stored) -> Weighed:
        """How the points weigh their probes by the distances that are ``stored``."""
        count = len(self._row)
        weights, by_mean, by_square = (np.empty(count, np.float32) for _ in range(3))
        mean = stored.mean.astype(np.float32).ravel()
        square = (stored.mean**2 + stored.variance).astype(np.float32).ravel()

        def work(i):
            first, last = self._blocks[i]
            span, tiles = slice(self._starts[first], self._starts[last]), slice(first * self._tile**2, last * self._tile**2)
            weights[span], by_mean[span], by_square[span] = self._weigh(span, mean[tiles], square[tiles])

        parallel_for(work, len(self._blocks), self._threads)
        total = np.maximum(np.bincount(self._row, weights, self.count), TINY)
        return Weighed((weights / total[self._row]).astype(np.float32), total.astype(np.float32), by_mean, by_square)

    def by_corner(self, weighed: Weighed) -> np.ndarray:
        """The shares (n, 8) of the probes in ``index``."""
        share = np.zeros(self.index.size, np.float32)
        share[self._pairs] = weighed.share
        return share.reshape(self.index.shape)

    def read(self, weighed: Weighed, coefficients: np.ndarray) -> Read:
        """What the points receive by ``coefficients`` (p, k, 3)."""
        light, coefficients = np.empty((len(self._row), 3), np.float32), coefficients.astype(np.float32)

        def work(i):
            for probe in range(*self._blocks[i]):
                own = slice(self._starts[probe], self._starts[probe + 1])
                np.matmul(self._basis[own], coefficients[probe], out=light[own])

        parallel_for(work, len(self._blocks), self._threads)
        irradiance = np.stack([np.bincount(self._row, weighed.share * light[:, c], self.count) for c in range(3)], axis=1)
        return Read(irradiance, light)

    def by_distances(self, stored: Stored, weighed: Weighed, read: Read, gradient: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Derivatives by the mean and the variance (p, T²) that are ``stored`` of a function whose derivatives by the irradiance
        that was ``read`` are ``gradient`` (n, 3)."""
        gradient, irradiance = gradient.astype(np.float32), read.irradiance.astype(np.float32)

        def work(i):
            first, last = self._blocks[i]
            span = slice(self._starts[first], self._starts[last])
            rows = self._row[span]
            by_weight = np.einsum("pc,pc->p", read.light[span] - irradiance[rows], gradient[rows]) / weighed.total[rows]
            texels, count = self._texels[span].ravel(), (last - first) * self._tile**2
            return [np.bincount(texels, (self._shares[span] * (by_weight * slope[span])[:, None]).ravel(), count)
                    for slope in (weighed.by_mean, weighed.by_square)]

        parts = parallel_for(work, len(self._blocks), self._threads)
        mean, square = (np.concatenate([part[i] for part in parts]).reshape(stored.mean.shape) for i in range(2))
        # What is interpolated is the mean square, m² + v.
        return mean + 2.0 * stored.mean * square, square

    def by_coefficients(self, weighed: Weighed, gradient: np.ndarray) -> np.ndarray:
        """The derivatives (p, k, 3) by coefficients, as in ``by_distances``."""
        coefficients = np.zeros((len(self._starts) - 1, self._basis.shape[1], 3))
        gradient = gradient.astype(np.float32)

        def work(i):
            for probe in range(*self._blocks[i]):
                own = slice(self._starts[probe], self._starts[probe + 1])
                coefficients[probe] = self._basis[own].T @ (weighed.share[own, None] * gradient[self._row[own]])

        parallel_for(work, len(self._blocks), self._threads)
        return coefficients

    def curvature(self, stored: Stored, weighed: Weighed, read: Read, weight: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Diagonal of the Gauss-Newton matrix of Σ ``weight`` (n,) · irradiance², by the logarithms of mean and variance (p, T²):
        how much each of them matters."""
        mean, variance = stored.mean.ravel(), stored.variance.ravel()

        def work(i):
            first, last = self._blocks[i]
            span = slice(self._starts[first], self._starts[last])
            rows = self._row[span]
            power = weight[rows] * np.sum((read.light[span] - read.irradiance[rows]) ** 2, axis=1) / weighed.total[rows] ** 2
            texels, shares = self._texels[span], self._shares[span]
            tiles = slice(first * self._tile**2, last * self._tile**2)
            m, v = mean[tiles][texels], variance[tiles][texels]
            slopes = (shares * m * (weighed.by_mean[span, None] + 2.0 * m * weighed.by_square[span, None]),
                      shares * v * weighed.by_square[span, None])
            count = (last - first) * self._tile**2
            return [np.bincount(texels.ravel(), (power[:, None] * slope**2).ravel(), count) for slope in slopes]

        parts = parallel_for(work, len(self._blocks), self._threads)
        mean, variance = (np.concatenate([part[i] for part in parts]).reshape(stored.mean.shape) for i in range(2))
        return mean, variance

    def _weigh(self, span: slice, mean: np.ndarray, square: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """See weights.py: `seen_share` and `probe_weight`, with their derivatives."""
        texels, shares = self._texels[span], self._shares[span]
        m = np.einsum("pt,pt->p", shares, mean[texels])
        spread = np.einsum("pt,pt->p", shares, square[texels]) - m * m
        variance, behind = np.abs(spread), self._distance[span] - m
        inverse = 1.0 / np.sqrt(np.maximum(variance + behind * behind, TINY))
        # Smaller shares weigh nothing, crushed, and would be slow numbers.
        share = np.maximum(0.5 - 0.5 * behind * inverse, np.float32(LEAST_SHARE))
        side, trilinear = self._side[span], self._trilinear[span]
        seen = side * share * share
        low, crushing = seen < CRUSH_BELOW, seen * seen * np.float32(1.0 / CRUSH_BELOW**2)
        weight = trilinear * (np.where(low, seen * crushing, seen) + np.float32(UNSEEN_FLOOR))
        slope = trilinear * np.where(low, np.float32(3.0) * crushing, np.float32(1.0)) * (2.0 * side * share)
        slope *= share > LEAST_SHARE
        cubed = inverse * inverse * inverse
        by_variance = slope * 0.25 * behind * cubed * np.sign(spread)
        by_mean = slope * 0.5 * variance * cubed - 2.0 * m * by_variance
        return weight, by_mean, by_variance


class FieldReading:
    """Points (n, 3) with ``normals`` (n, 3) as a whole ``field`` reads them: each of its lattices has its share in them. What is
    stored is that of all lattices, one after another as the field's lookups are; methods are those of Reading, for lists of what it
    takes and gives, one for each lattice."""

    def __init__(self, field: ProbeField, points: np.ndarray, normals: np.ndarray, threads: int | None = None):
        self._parts, self.count, first = [], len(points), 0
        self.known = np.ones(len(points), bool)
        for lookup, share in zip(field.lookups, field.shares(points).T, strict=True):
            rows, last = np.flatnonzero(share), first + len(lookup.positions)
            reading = Reading(lookup, points[rows], normals[rows], threads)
            self.known[rows[~reading.known]] = False
            self._parts.append((slice(first, last), rows, share[rows, None].astype(np.float64), reading))
            first = last
        self._probes, self._threads = first, threads

    def weigh(self, stored: Stored) -> list[Weighed]:
        """See Reading."""
        return [reading.weigh(stored.take(span)) for span, _, _, reading in self._parts]

    def read(self, weighed: list[Weighed], coefficients: np.ndarray) -> "FieldRead":
        """See Reading."""
        total, parts = np.zeros((self.count, 3)), []
        for (span, rows, share, reading), own in zip(self._parts, weighed, strict=True):
            parts.append(reading.read(own, coefficients[span]))
            total[rows] += share * parts[-1].irradiance
        return FieldRead(total, parts)

    def by_distances(self, stored: Stored, weighed: list[Weighed], read: "FieldRead",
                     gradient: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """See Reading."""
        parts = [reading.by_distances(stored.take(span), own, part, share * gradient[rows])
                 for (span, rows, share, reading), own, part in zip(self._parts, weighed, read.parts, strict=True)]
        return tuple(np.concatenate(values) for values in zip(*parts, strict=True))

    def curvature(self, stored: Stored, weighed: list[Weighed], read: "FieldRead",
                  weight: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """See Reading."""
        parts = [reading.curvature(stored.take(span), own, part, share[:, 0] ** 2 * weight[rows])
                 for (span, rows, share, reading), own, part in zip(self._parts, weighed, read.parts, strict=True)]
        return tuple(np.concatenate(values) for values in zip(*parts, strict=True))

    def by_coefficients(self, weighed: list[Weighed], gradient: np.ndarray) -> np.ndarray:
        """See Reading."""
        return np.concatenate([reading.by_coefficients(own, share * gradient[rows])
                               for (_, rows, share, reading), own in zip(self._parts, weighed, strict=True)])

    def equations(self, weighed: list[Weighed], weight: np.ndarray, light: np.ndarray) -> Equations:
        """The normal equations of the coefficients (p, k) for points that count by ``weight`` (n,) and should read ``light``
        (n, 3)."""
        shares = [share * reading.by_corner(own) for (_, _, share, reading), own in zip(self._parts, weighed, strict=True)]
        parts = [cells.weighed(np.concatenate([shares[lattice][at] for lattice, at in places], axis=1), weight[rows], light[rows])
                 for rows, places, cells in self._cells]
        return Equations.join(parts)

    @cached_property
    def _cells(self) -> list[tuple[np.ndarray, list, Cells]]:
        """Points by the lattices that they read: which they are (m,), for each of the lattices its number and their rows in its
        reading, and the cells of all their probes."""
        place = np.full((self.count, len(self._parts)), -1)
        for lattice, (_, rows, _, _) in enumerate(self._parts):
            place[rows, lattice] = np.arange(len(rows))
        found = []
        patterns, which = np.unique(place >= 0, axis=0, return_inverse=True)
        for number, pattern in enumerate(patterns):
            rows = np.flatnonzero(which.reshape(-1) == number)
            places = [(int(lattice), place[rows, lattice]) for lattice in np.flatnonzero(pattern)]
            index = np.concatenate([self._parts[lattice][3].index[at] + self._parts[lattice][0].start for lattice, at in places],
                                   axis=1)
            lattice, at = places[0]
            found.append((rows, places, Cells(index, self._parts[lattice][3].basis[at], self._probes, self._threads)))
        return found


@dataclass(frozen=True, eq=False)
class FieldRead:
    """What n points read: ``irradiance`` (n, 3), and the ``parts`` that each lattice has in it."""

    irradiance: np.ndarray
    parts: list[Read]


def _read_texels(directions: np.ndarray, tile: int) -> tuple[np.ndarray, np.ndarray]:
    """Texels (n, 4) of a tile without its border that are read in ``directions`` (n, 3), and their shares (n, 4) float32."""
    first, fraction = octahedral.bilinear(directions, tile)
    inner = octahedral.add_border(np.arange(tile**2).reshape(tile, tile, 1)).ravel()
    width = tile + 2
    x, y = fraction[:, 0].astype(np.float32), fraction[:, 1].astype(np.float32)
    texels = np.stack([inner[first + step] for step in (0, 1, width, width + 1)], axis=1)
    return texels, np.stack([(1 - x) * (1 - y), x * (1 - y), (1 - x) * y, x * y], axis=1)


def _blocks(starts: np.ndarray) -> list[tuple[int, int]]:
    """Runs (first, last) of probes with some BLOCK of pairs together."""
    blocks, first = [], 0
    while first < len(starts) - 1:
        last = max(first + 1, int(np.searchsorted(starts, starts[first] + BLOCK, side="right")) - 1)
        blocks.append((first, last))
        first = last
    return blocks
