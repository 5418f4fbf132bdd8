"""More rays where the light about probes is uneven: between bright and dark, not within an even wall or sky.

The first 256 rays of a group of probes lie one in each cell of a 16 × 16 grid on the unit square that directions are made from. A
scrambled Sobol sequence goes on with one more point in every cell for each further 256, and those of a cell are such a sequence
themselves. So a cell may take as many of its points as it likes, a power of two for them to fill it evenly, and the mean over the
sphere is that of the cells' means. Cells take numbers of rays that make the error of all least (stratified sampling after Neyman):
where an edge passes, the variance of n points falls with n^−3/2, which asks for n as v^0.4 where light differs by v.

How much it differs in a cell is asked of cells about it that have neither row nor column in common with it: digits of points are
scrambled in common within a row or a column alone, so a cell's own points know nothing of those, and the estimate is without bias
although its number of points follows from what rays have found. (What the cell's own first ray found would give it one: a small
lamp that it missed would be given fewer rays than one that it met.) What the method is not: sharp-eyed. A thing smaller than a cell
gets more rays only where something about it is uneven.

Sources: J. Neyman, "On the Two Different Aspects of the Representative Method", J. Royal Statistical Society 97(4), 1934; A. Owen,
"Scrambled Net Variance for Integrals of Smooth Functions", Ann. Statist. 25(4), 1997.
"""

from functools import cache
from typing import NamedTuple

import numpy as np

from ...numerics.sampling import hash_u32, sobol_owen_at

# Cells of the unit square along each side, and in all: as many as rays that every probe begins with.
SIDE, CELLS = 16, 256
# Rays of a refined probe when each cell has had its first number of them; and the most of one cell among these: two to this power.
REFINED, MOST_DOUBLED = 512, 5
# The variance of a cell with an edge in it falls with this power of its rays.
_FALL = 1.5
# Where that would leave more than this of the variance of as many rays everywhere, these are left as they are: their sequence
# evens out across cells what changes slowly, which the cells alone do not.
_WORTH = 0.75
# Every cell is taken to be as uneven as this share of the mean: what is even about a cell need not be so in it.
_LEAST = 0.05
# Weight of cells a knight's move away beside that of the four at the corners.
_FURTHER = 0.3


class Spread(NamedTuple):
    """The ``order`` (…) uint32 of rays, their numbers in the sequences of their groups, and the power of two (…) int8 of the rays
    of the cells that they lie in, as in ``Strata.doubled``."""

    order: np.ndarray
    doubled: np.ndarray

    @property
    def weights(self) -> np.ndarray:
        """What the rays count for (…) float32, as in ``Strata.weights``."""
        return _weights(self.doubled)


class Strata:
    """Which numbers of rays the cells of each of ``groups`` groups have, of a bake with the ``seed``."""

    def __init__(self, groups: int, seed: int):
        self._seed = seed
        # The power of two of each cell's rays among the first REFINED; −1 where a group is not refined.
        self.doubled = np.full((groups, CELLS), -1, np.int8)

    def refined(self, groups: np.ndarray) -> np.ndarray:
        """Which (g,) of ``groups`` (g,) are refined."""
        return self.doubled[groups, 0] >= 0

    def refine(self, groups: np.ndarray, light: np.ndarray) -> None:
        """Give the cells of ``groups`` (g,) rays, where it pays, by the ``light`` (g, m, CELLS) that the first rays of their m
        probes found, in the order of the sequence; negative where there is no such probe."""
        there = light[:, :, 0] >= 0
        cell = self._cells(groups, np.arange(CELLS)[None])
        by_cell = np.empty((CELLS, *light.shape[:2]), np.float32)
        by_cell[cell.T, np.arange(len(groups))] = light.transpose(2, 0, 1)
        scale = np.square(by_cell).mean(axis=0)
        uneven = _uneven(by_cell.reshape(SIDE, SIDE, *light.shape[:2])).reshape(by_cell.shape)
        uneven *= np.where(there & (scale > 0), 1.0 / np.where(scale > 0, scale, 1.0), 0.0).astype(np.float32)
        uneven = uneven.sum(axis=2).T.astype(np.float64)
        uneven += _LEAST * uneven.mean(axis=1, keepdims=True) + 1e-30
        doubled = _doublings(uneven)
        left = (uneven * np.exp2(-_FALL * doubled)).sum(axis=1) / (uneven.sum(axis=1) * (REFINED / CELLS) ** -_FALL)
        self.doubled[groups] = np.where(left[:, None] < _WORTH, doubled, -1)

    def spread(self, groups: np.ndarray, before: int, after: int) -> Spread:
        """Rays ``before`` up to ``after`` (g, after − before) of ``groups`` (g,), all refined or none: any of those that are not,
        and from CELLS to REFINED, or from there to twice as many, of those that are."""
        if not len(groups) or not self.refined(groups[:1])[0]:
            order = np.broadcast_to(np.arange(before, after, dtype=np.uint32), (len(groups), after - before))
            return Spread(order, np.full(order.shape, -1, np.int8))
        if before != CELLS and after != 2 * before:
            raise ValueError(f"rays {before} to {after} of a refined group")
        most = np.left_shift(1, self.doubled[groups].astype(np.int64)) * (after // REFINED)
        least = np.ones_like(most) if before == CELLS else most // 2
        taken = (most - least).reshape(-1)
        which = np.repeat(np.arange(taken.size), taken)
        section = np.arange(which.size) - np.repeat(np.cumsum(taken) - taken, taken) + least.reshape(-1)[which]
        first = self._first_points(groups).reshape(-1)[which]
        order = section * CELLS + (first ^ _turns(int(most.max()))[section])
        shape = len(groups), after - before
        return Spread(order.astype(np.uint32).reshape(shape), self.doubled[groups].reshape(-1)[which].reshape(shape))

    def weights(self, groups: np.ndarray, points: np.ndarray) -> np.ndarray | None:
        """Weights (g, n) float32 of rays of ``groups`` (g,) with the ``points`` (g, n, 2) of their sequences, whose mean is 1 over
        all rays of a probe; None where none is refined."""
        chosen = self.doubled[groups]
        if not np.any(chosen[:, 0] >= 0):
            return None
        return np.take_along_axis(_weights(chosen), _cell_of(points), axis=1)

    def _cells(self, groups: np.ndarray, index: np.ndarray) -> np.ndarray:
        return _cell_of(sobol_owen_at(index, 2, hash_u32(self._seed, groups)[:, None]))

    def _first_points(self, groups: np.ndarray) -> np.ndarray:
        """The number (g, CELLS) of the point among the first of each sequence that lies in each cell."""
        return np.argsort(self._cells(groups, np.arange(CELLS)[None]), axis=1)


def _weights(doubled: np.ndarray) -> np.ndarray:
    """Of rays in cells that are ``doubled`` (…) so often."""
    return np.take(_known_weights(), doubled, mode="wrap")


@cache
def _known_weights() -> np.ndarray:
    """By the power of two; the last for the −1 of cells that are not refined."""
    return np.append(np.ldexp(np.float32(REFINED / CELLS), -np.arange(MOST_DOUBLED + 1)), 1).astype(np.float32)


def _cell_of(points: np.ndarray) -> np.ndarray:
    cell = (points * np.float32(SIDE)).astype(np.int64)
    return cell[..., 0] * SIDE + cell[..., 1]


def _turns(sections: int) -> np.ndarray:
    """What each of the first ``sections`` runs of CELLS points of a sequence changes (s,) in which of its points lies in which
    cell: as the digits of Sobol's points are sums without carry, the numbers of points in a cell differ by the same bits whatever
    the cell, and scrambling changes nothing in that."""
    return _known_turns(1 << (sections - 1).bit_length())[:sections]


@cache
def _known_turns(sections: int) -> np.ndarray:
    first = np.argsort(_cell_of(sobol_owen_at(np.arange(CELLS), 2, 0)))
    return first[_cell_of(sobol_owen_at(np.arange(sections) * CELLS, 2, 0))]


def _uneven(light: np.ndarray) -> np.ndarray:
    """By how much (SIDE, SIDE, …) the ``light`` (SIDE, SIDE, …) of the cells about each varies, squared: those at its corners and
    those a knight's move away, none of which has its row or its column. Azimuth goes round; beyond a pole what lies on the other
    side of the cell is taken."""
    def beside(part, step, axis):
        number = np.arange(SIDE)
        low, high = number - step, number + step
        if axis == 1:
            low, high = low % SIDE, high % SIDE
        else:
            low, high = np.where(low < 0, high, low), np.where(high >= SIDE, low, high)
        return np.take(part, low, axis=axis) + np.take(part, high, axis=axis)

    def about(part):
        near, far = beside(part, 1, 0), beside(part, 2, 0)
        return beside(near, 1, 1), beside(near, 2, 1) + beside(far, 1, 1)

    corners, knights = about(light)
    of_corners, of_knights = about(np.square(light))
    result = of_corners / 4 - np.square(corners / 4)
    result += np.float32(_FURTHER) * (of_knights / 8 - np.square(knights / 8))
    return np.maximum(result, 0, out=result)


def _doublings(uneven: np.ndarray) -> np.ndarray:
    """Powers of two (g, CELLS) int8 of the cells' rays, REFINED for each group, by how ``uneven`` (g, CELLS) they are: a cell is
    given another doubling where that takes most of the error for each ray."""
    wanted = np.log2(uneven) / (_FALL + 1.0)
    low, high = wanted.min(axis=1) - MOST_DOUBLED - 1, wanted.max(axis=1) + 1
    # At ``low`` all cells would have too many rays, at ``high`` each has one.
    for _ in range(14):
        middle = 0.5 * (low + high)
        many = np.ldexp(1.0, _clipped(wanted, middle)).sum(axis=1) > REFINED
        low, high = np.where(many, middle, low), np.where(many, high, middle)
    powers = _clipped(wanted, high)
    left = REFINED - np.left_shift(1, powers).sum(axis=1)
    # What cells of equal need leave goes to those with one ray, the most uneven first.
    single = np.where(powers == 0, -wanted, np.inf)
    rank = np.argsort(np.argsort(single, axis=1, kind="stable"), axis=1)
    powers += (rank < left[:, None]) & (powers == 0)
    # Where too few have one, all have as many.
    odd = np.left_shift(1, powers).sum(axis=1) != REFINED
    powers[odd] = int(np.log2(REFINED // CELLS))
    return powers.astype(np.int8)


def _clipped(wanted: np.ndarray, level: np.ndarray) -> np.ndarray:
    return np.clip(np.ceil(wanted - level[:, None]), 0, MOST_DOUBLED).astype(np.int32)
