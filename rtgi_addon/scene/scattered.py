"""Probes that stand anywhere in a volume, and the grid of words that says which of them are read where."""

from dataclasses import dataclass

import numpy as np

from ..numerics.grid import lattice_points

# How many probes a node names.
SLOTS = 4
# A word is WORD times the number of a probe and its share, of which the shares of a node have SHARES together; 0 names nothing.
# Words are whole numbers that a float32 holds, for textures: so many probes at most.
WORD, SHARES = 256, 255
MOST_PROBES = (1 << 24) // WORD
# Probes lie in rows no longer than this, and images of them in rows of rows.
_LONGEST_ROW = 128


@dataclass(frozen=True, eq=False)
class Scattered:
    """``index`` (nz, ny, nx, SLOTS) int32 are the words of the nodes of a lattice over the volume's box, placed as probes of a
    lattice are; light at a node is that of its probes by their shares, and between nodes their shares are interpolated. Words of a
    node that no probe sees are negative, and name what its neighbours do: they count where no other does.

    ``points_world`` (p, 3) float64 are where probes stand, and ``reach`` (p,) float32 is how far [m] their distances matter.
    """

    index: np.ndarray
    points_world: np.ndarray
    reach: np.ndarray

    @property
    def resolution(self) -> tuple[int, int, int]:
        """Nodes along x, y, z."""
        nz, ny, nx, _ = self.index.shape
        return nx, ny, nz


def of_grid(index: np.ndarray, world_from_local: np.ndarray, offset_world: np.ndarray, validity: np.ndarray) -> Scattered:
    """The probes that nodes name by ``index``, as the volume's images have them: ``offset_world`` (nz, ny, nx, 3) from the places
    that a lattice of them would have, and ``validity`` (nz, ny, nx), 0 for what fills up the rows."""
    nz, ny, nx = validity.shape
    points = (lattice_points(world_from_local, (nx, ny, nz)) + offset_world)[validity > 0.0]
    # What they see has been measured; nothing asks how far.
    return Scattered(index, points, np.zeros(len(points), np.float32))


def words(probes: np.ndarray, shares: np.ndarray) -> np.ndarray:
    """The words (…, SLOTS) int32 that name ``probes`` (…, s) with ``shares`` (…, s), at least 0 and some above: of the largest
    SLOTS shares, made to sum to SHARES, largest first."""
    order = np.argsort(-shares, axis=-1, kind="stable")[..., :SLOTS]
    probes, shares = (np.take_along_axis(values, order, axis=-1) for values in (probes, np.asarray(shares, np.float64)))
    if shares.shape[-1] < SLOTS:
        padding = [(0, 0)] * (shares.ndim - 1) + [(0, SLOTS - shares.shape[-1])]
        probes, shares = np.pad(probes, padding), np.pad(shares, padding)
    exact = SHARES * shares / shares.sum(axis=-1, keepdims=True)
    # By the largest remainders, so that none is lost.
    whole = np.floor(exact).astype(np.int64)
    rank = np.argsort(np.argsort(whole - exact, axis=-1, kind="stable"), axis=-1, kind="stable")
    whole += rank < SHARES - whole.sum(axis=-1, keepdims=True)
    return np.where(whole > 0, WORD * probes + whole, 0).astype(np.int32)


def named(index: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Numbers of probes and their shares float32 of the words ``index`` (…); the share is 0 where nothing is named."""
    index = np.abs(index)
    return index // WORD, (index % WORD).astype(np.float32) / np.float32(SHARES)


def packed(count: int) -> tuple[int, int, int]:
    """The resolution (x, y, z) of a list of ``count`` probes as bundles and textures hold it: rows of equal length with few left
    over."""
    if count <= _LONGEST_ROW:
        return count, 1, 1
    rows = -(-count // _LONGEST_ROW)
    layers = -(-rows // _LONGEST_ROW)
    rows = -(-rows // layers)
    return -(-count // (rows * layers)), rows, layers
