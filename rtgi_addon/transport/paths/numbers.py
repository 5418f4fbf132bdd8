"""Uniform numbers for paths: Owen-scrambled Sobol points at the first vertices, hashes beyond."""

import numpy as np

from ...numerics.sampling import hash_u32, sobol_owen_at, unit_interval

# Vertices whose numbers are low-discrepancy; deeper ones hardly gain from it.
SOBOL_DEPTH = 4
# What numbers are drawn for at a vertex: each purpose has sequences of its own.
SCATTER, LAMP, EMITTER, BRIGHT, ROULETTE, SIDE = range(6)
# Tells keys apart from the seeds of those.
_HASHES = 0x5EED


class PathNumbers:
    """Uniform numbers by path: ``key`` (n,) uint32 tells sequences apart, ``index`` (n,) is the place in each sequence."""

    def __init__(self, key: np.ndarray, index: np.ndarray):
        self._key, self._index = key, index

    def take(self, rows: np.ndarray) -> "PathNumbers":
        """The numbers of some of the paths."""
        return PathNumbers(self._key[rows], self._index[rows])

    def hashes(self, depth: int) -> np.ndarray:
        """(n,) uint32: a key of each path at a depth, for what takes any number of numbers."""
        return hash_u32(self._key, self._index, depth, _HASHES)

    def dense(self, n: int) -> tuple[np.ndarray, np.ndarray]:
        """Keys and places (n,) uint32 each, as kernels take them."""
        return tuple(np.ascontiguousarray(np.broadcast_to(part, (n,)).astype(np.uint32, copy=False))
                     for part in (self._key, self._index))

    @staticmethod
    def join(parts: "list[PathNumbers]") -> "PathNumbers":
        """The numbers of several sets of paths, one after the other."""
        return PathNumbers(*(np.concatenate([getattr(part, name) for part in parts]) for name in ("_key", "_index")))

    def draw(self, depth: int, purpose: int, dims: int) -> np.ndarray:
        """(n, dims) float32 in [0, 1), independent between depths and purposes, stratified over the index."""
        seed = hash_u32(self._key, depth, purpose)
        if depth < SOBOL_DEPTH:
            return sobol_owen_at(self._index, dims, seed, shuffle=True)
        return unit_interval(np.stack([hash_u32(seed, self._index, d) for d in range(dims)], axis=1))
