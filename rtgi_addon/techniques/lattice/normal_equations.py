"""Least squares for the coefficients of probes: the equations are put together once for given weights, and solved for any price.

A point reads a linear combination of the coefficients of the probes about it. Points with the same probes about them share a block
of the matrix AᵀWA, so that a step of conjugate gradients no longer asks the points, but only their cells: thousands of points a
cell cost no more than a few. Where a cell has few points, their rows stand for its block. A probe's own coefficients are solved for
exactly in every step (block Jacobi): under the few normals of floors and walls they hang together far more than probes do.

Source: Å. Björck, *Numerical Methods for Least Squares Problems*, 1996, §2.1 (normal equations) and §7.4 (conjugate gradients).
"""

from typing import NamedTuple

import numpy as np

from ...numerics.minimize import solve
from ...transport.parallel import parallel_for

# Cells whose points are no more than these keep their rows, padded to that number; those of more keep the product of them.
PADDED = (4, 12, 36)
# Conjugate gradients end where what is missing is this share of all that the equations ask for.
ENOUGH = 1e-2
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

    def weighed(self, share: np.ndarray, weight: np.ndarray, light: np.ndarray) -> "Equations":
        """The equations for points that read their probes in the shares ``share`` (n, m), count by ``weight`` (n,) and should read
        ``light`` (n, 3)."""
        weight = weight[self._order]
        used = np.flatnonzero(weight > 0)
        places, root = self._order[used], np.sqrt(weight[used])[:, None]
        share, light = (share[places] * root).astype(np.float32), (light[places] * root).astype(np.float32)
        basis, starts = self._basis[used], np.flatnonzero(np.diff(self._cell[used], prepend=-1))
        sizes, groups = np.diff(np.append(starts, len(used))), []
        for fewer, most in zip((0, *PADDED), (*PADDED, np.inf), strict=True):
            own = np.flatnonzero((sizes > fewer) & (sizes <= most))
            if len(own):
                few = np.isfinite(most)
                made = (_padded(share, basis, light, starts[own], sizes[own], int(most)) if few else
                        self._products(share, basis, light, starts[own], sizes[own]))
                groups.append(_Group(self._index[used[starts[own]]], *made, few))
        return Equations(groups, self._count, self._terms)

    def _products(self, share, basis, light, starts, sizes) -> tuple[np.ndarray, np.ndarray]:
        """Products of the rows of each cell with themselves, (c, m·k, m·k), and with their light, (c, m·k, 3)."""
        side = share.shape[1] * self._terms
        matrix, right = np.zeros((len(starts), side, side), np.float32), np.zeros((len(starts), side, 3), np.float32)
        step = max(1, MOST_MULTIPLICATIONS // side**2)

        def work(i):
            own = slice(starts[i], starts[i] + sizes[i])
            rows = _rows(share[own], basis[own])
            np.matmul(rows.T, light[own], out=right[i])
            for first in range(0, len(rows), step):
                part = rows[first:first + step]
                matrix[i] += part.T @ part

        parallel_for(work, len(starts), self._threads)
        return matrix, right


def _rows(share: np.ndarray, basis: np.ndarray) -> np.ndarray:
    """What each coefficient (n, m·k) counts at points with ``share`` (n, m) and ``basis`` (n, k)."""
    return (share[:, :, None] * basis[:, None, :]).reshape(len(share), -1)


def _padded(share, basis, light, starts, sizes, most: int) -> tuple[np.ndarray, np.ndarray]:
    """The rows (c, ``most``, m·k) of each cell, zeros where it has fewer, and their products with their light, (c, m·k, 3)."""
    whole = np.zeros((len(starts), most, share.shape[1] * basis.shape[1]), np.float32)
    wanted = np.zeros((len(starts), most, 3), np.float32)
    cell = np.repeat(np.arange(len(starts)), sizes)
    within = np.arange(len(cell)) - np.repeat(np.cumsum(sizes) - sizes, sizes)
    rows = starts[cell] + within
    whole[cell, within], wanted[cell, within] = _rows(share[rows], basis[rows]), light[rows]
    return whole, np.matmul(whole.transpose(0, 2, 1), wanted)


class _Group(NamedTuple):
    """Cells alike: which ``probes`` (c, m) they read, the ``matrix`` of each (c, m·k, m·k), or its ``few`` points' rows
    (c, r, m·k), and its ``right`` side (c, m·k, 3)."""

    probes: np.ndarray
    matrix: np.ndarray
    right: np.ndarray
    few: bool


class Equations:
    """AᵀWA of some weights, and AᵀW times the light that should be read; see Cells."""

    def __init__(self, groups: list[_Group], count: int, terms: int):
        self._groups, self._count, self._terms = groups, count, terms
        # Where each probe's parts lie among those of all cells (p, most), the last place, which holds nothing, where it has fewer:
        # numpy sums what was gathered far faster than it adds to places.
        asked = np.concatenate([np.zeros(0, np.int64), *(group.probes.ravel() for group in groups)])
        order, counts = np.argsort(asked, kind="stable"), np.bincount(asked, minlength=count)
        self._parts = np.full((count, counts.max(initial=0)), len(asked))
        self._parts[np.arange(self._parts.shape[1]) < counts[:, None]] = order

    @staticmethod
    def join(parts: list["Equations"]) -> "Equations":
        """Those of several sets of points together."""
        return Equations([group for part in parts for group in part._groups], parts[0]._count, parts[0]._terms)

    def product(self, coefficients: np.ndarray) -> np.ndarray:
        """AᵀWA times ``coefficients`` (p, k, c), float32."""
        parts, coefficients = [], coefficients.astype(np.float32, copy=False)
        for probes, matrix, _, few in self._groups:
            own = coefficients[probes].reshape(len(probes), -1, coefficients.shape[2])
            parts.append(np.matmul(matrix.transpose(0, 2, 1), np.matmul(matrix, own)) if few else np.matmul(matrix, own))
        return self._summed(parts, self._terms * coefficients.shape[2]).reshape(coefficients.shape)

    def wanted(self) -> np.ndarray:
        """AᵀW times the light that should be read (p, k, 3), float32."""
        return self._summed([group.right for group in self._groups], self._terms * 3).reshape(self._count, self._terms, 3)

    def blocks(self) -> np.ndarray:
        """What AᵀWA has of each probe with itself (p, k, k), float32."""
        parts = []
        for probes, matrix, _, few in self._groups:
            shape = len(probes), -1, probes.shape[1], self._terms
            if few:
                rows = matrix.reshape(shape).transpose(0, 2, 1, 3)
                parts.append(np.matmul(rows.transpose(0, 1, 3, 2), rows))
            else:
                own = np.arange(probes.shape[1])
                parts.append(matrix.reshape(len(probes), *shape[2:], *shape[2:])[:, own, :, own].transpose(1, 0, 2, 3))
        return self._summed(parts, self._terms**2).reshape(self._count, self._terms, self._terms)

    def _summed(self, parts: list[np.ndarray], width: int) -> np.ndarray:
        """Sums (p, ``width``) over the cells of each probe, of ``parts`` by group."""
        flat = np.concatenate([*(part.reshape(-1, width) for part in parts), np.zeros((1, width), np.float32)])
        return flat[self._parts].sum(axis=1)

    def best(self, missing: np.ndarray, scale: np.ndarray, cost: float, start: np.ndarray, steps: int) -> np.ndarray:
        """The change x (p, k, 3) that is least in ½xᵀSAᵀWASx − x·S``missing`` + ½``cost``·|x|², S by ``scale`` (p, 1, 1): up to
        ``steps`` steps from ``start``."""
        own = scale**2 * self.blocks() + cost * np.eye(self._terms)
        unit = np.linalg.inv(np.linalg.cholesky(own)).astype(np.float32)
        back, scale = np.ascontiguousarray(unit.transpose(0, 2, 1)), scale.astype(np.float32)

        def turned(change):
            return scale * self.product(scale * change) + np.float32(cost) * change

        whole = np.matmul(unit, scale * missing.astype(np.float32))
        right = whole - np.matmul(unit, turned(start.astype(np.float32)))
        return start + np.matmul(back, solve(lambda scaled: np.matmul(unit, turned(np.matmul(back, scaled))), right, steps,
                                             ENOUGH, whole))
