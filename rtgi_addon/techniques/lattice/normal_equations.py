"""Least squares for the coefficients of probes: the equations are put together once for given weights, and solved for any price.

A point reads a linear combination of the coefficients of the probes about it. Points with the same probes about them share a block
of the matrix AᵀWA, so that a step of conjugate gradients no longer asks the points, but only their cells: thousands of points a
cell cost no more than a few. Where a cell has few points, their rows stand for its block.

Source: Å. Björck, *Numerical Methods for Least Squares Problems*, 1996, §2.1 (normal equations) and §7.4 (conjugate gradients).
"""

import numpy as np

from ...numerics.minimize import solve
from ...transport.parallel import parallel_for

# Cells whose points are no more than these keep their rows, padded to that number; those of more keep the product of them.
PADDED = (4, 12, 36)
# OpenBLAS starts threads of its own for products of 2^18 multiplications or more, which under our threads only wait for each other.
MOST_MULTIPLICATIONS = (1 << 18) - 1


class Cells:
    """Rows of points grouped by the probes that they read: which do not change, whatever the weights.

    ``index`` (n, m) are the probes, ``probes`` of them in all, ``basis`` (n, k) what a coefficient counts under a point's normal.
    """

    def __init__(self, index: np.ndarray, basis: np.ndarray, probes: int, threads: int | None):
        self._threads, self._count, self._terms = threads, probes, basis.shape[1]
        self._order = np.lexsort(index.T[::-1])
        self._index, self._basis = index[self._order], basis[self._order].astype(np.float32)
        new = np.any(self._index[1:] != self._index[:-1], axis=1)
        self._cell = np.concatenate([[0], np.cumsum(new)])[:len(index)]

    def weighed(self, share: np.ndarray, weight: np.ndarray) -> "Equations":
        """The equations for points that read their probes in the shares ``share`` (n, m) and count by ``weight`` (n,)."""
        weight = weight[self._order]
        used = np.flatnonzero(weight > 0)
        share = (share[self._order[used]] * np.sqrt(weight[used])[:, None]).astype(np.float32)
        basis, starts = self._basis[used], np.flatnonzero(np.diff(self._cell[used], prepend=-1))
        sizes, groups = np.diff(np.append(starts, len(used))), []
        for fewer, most in zip((0, *PADDED), (*PADDED, np.inf), strict=True):
            own = np.flatnonzero((sizes > fewer) & (sizes <= most))
            if len(own):
                few = np.isfinite(most)
                matrix = (_padded(share, basis, starts[own], sizes[own], int(most)) if few else
                          self._products(share, basis, starts[own], sizes[own]))
                groups.append((self._index[used[starts[own]]], matrix, few))
        return Equations(groups, self._count, self._terms)

    def _products(self, share, basis, starts, sizes) -> np.ndarray:
        """Products (c, m·k, m·k) of the rows of each cell with themselves."""
        side = share.shape[1] * self._terms
        result, step = np.zeros((len(starts), side, side), np.float32), max(1, MOST_MULTIPLICATIONS // side**2)

        def work(i):
            own = slice(starts[i], starts[i] + sizes[i])
            rows = _rows(share[own], basis[own])
            for first in range(0, len(rows), step):
                part = rows[first:first + step]
                result[i] += part.T @ part

        parallel_for(work, len(starts), self._threads)
        return result


def _rows(share: np.ndarray, basis: np.ndarray) -> np.ndarray:
    """What each coefficient (n, m·k) counts at points with ``share`` (n, m) and ``basis`` (n, k)."""
    return (share[:, :, None] * basis[:, None, :]).reshape(len(share), -1)


def _padded(share, basis, starts, sizes, most: int) -> np.ndarray:
    """The rows (c, ``most``, m·k) of each cell, zeros where it has fewer."""
    whole = np.zeros((len(starts), most, share.shape[1] * basis.shape[1]), np.float32)
    cell = np.repeat(np.arange(len(starts)), sizes)
    within = np.arange(len(cell)) - np.repeat(np.cumsum(sizes) - sizes, sizes)
    rows = starts[cell] + within
    whole[cell, within] = _rows(share[rows], basis[rows])
    return whole


class Equations:
    """AᵀWA of some weights; see Cells."""

    def __init__(self, groups: list[tuple[np.ndarray, np.ndarray, bool]], count: int, terms: int):
        self._groups, self._count, self._terms = groups, count, terms
        # What cells ask of a probe lies together when it is summed: numpy adds to places far slower.
        asked = np.concatenate([np.zeros(0, np.int64), *(probes.ravel() for probes, _, _ in groups)])
        self._order = np.argsort(asked, kind="stable")
        asked = asked[self._order]
        self._starts = np.flatnonzero(np.diff(asked, prepend=-1))
        self._probes = asked[self._starts]

    @staticmethod
    def join(parts: list["Equations"]) -> "Equations":
        """Those of several sets of points together."""
        return Equations([group for part in parts for group in part._groups], parts[0]._count, parts[0]._terms)

    def product(self, coefficients: np.ndarray) -> np.ndarray:
        """AᵀWA times ``coefficients`` (p, k, c)."""
        parts = []
        for probes, matrix, rows in self._groups:
            own = coefficients[probes].astype(np.float32).reshape(len(probes), -1, coefficients.shape[2])
            parts.append(np.matmul(matrix.transpose(0, 2, 1), np.matmul(matrix, own)) if rows else np.matmul(matrix, own))
        return self._summed(parts, coefficients.shape[2]).reshape(coefficients.shape)

    def diagonal(self) -> np.ndarray:
        """That of AᵀWA (p, k)."""
        return self._summed([np.einsum("crs,crs->cs", matrix, matrix) if rows else np.einsum("css->cs", matrix)
                             for _, matrix, rows in self._groups], 1)

    def _summed(self, parts: list[np.ndarray], columns: int) -> np.ndarray:
        """Sums (p, k·``columns``) over the cells of each probe, of ``parts`` by group."""
        total, width = np.zeros((self._count, self._terms * columns)), self._terms * columns
        if len(self._probes):
            flat = np.concatenate([part.reshape(-1, width) for part in parts])
            total[self._probes] = np.add.reduceat(flat[self._order], self._starts, axis=0)
        return total

    def best(self, missing: np.ndarray, scale: np.ndarray, cost: float, start: np.ndarray, steps: int) -> np.ndarray:
        """The change x (p, k, 3) that is least in ½xᵀSAᵀWASx − x·S``missing`` + ½``cost``·|x|², S by ``scale`` (p, 1, 1): up to
        ``steps`` steps from ``start``."""
        unit = 1.0 / np.sqrt(scale**2 * self.diagonal()[:, :, None] + cost)

        def product(scaled):
            change = unit * scaled
            return unit * (scale * self.product(scale * change) + cost * change)

        return start + unit * solve(product, unit * (scale * missing) - product(start / unit), steps)


