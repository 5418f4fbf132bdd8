"""Rays of probes in blocks of one shape: what is traced, shaded and projected at a time."""

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from .strata import Spread


@dataclass(frozen=True, eq=False)
class Item:
    """Blocks of ``count`` rays of some ``groups`` (g,), from ray ``first`` (g,) of each group's sequence, for as many of its
    probes: ``probes`` (g, m). ``first`` and ``count`` are multiples of RAYS_PER_LIGHT_SAMPLE; a group may occur with several
    blocks. Rays are ordered block by block, direction by direction: (g, n, m) with n = ``count``. ``spread`` (g, n) is which of the
    groups' sequences they are and what they count for, where that is another."""

    groups: np.ndarray
    probes: np.ndarray
    first: np.ndarray
    count: int
    spread: Spread | None = None

    @property
    def shape(self) -> tuple[int, int, int]:
        """(g, n, m)."""
        return len(self.groups), self.count, self.probes.shape[1]

    @property
    def ray_count(self) -> int:
        """Rays in the item."""
        return self.probes.size * self.count

    @cached_property
    def _runs(self) -> np.ndarray:
        # Blocks of the same probes follow one another.
        return np.flatnonzero(np.append(True, (np.diff(self.groups) != 0) | (np.diff(self.probes[:, 0]) != 0)))

    @property
    def merged_probes(self) -> np.ndarray:
        """The probes (b, m) that ``merged`` sums belong to, each once."""
        return self.probes[self._runs]

    def merged(self, part: np.ndarray) -> np.ndarray:
        """Sums (b, …) of ``part`` (g, …) over the blocks of the same probes."""
        return np.add.reduceat(part, self._runs, axis=0)

    def probe_of(self, rows: np.ndarray) -> np.ndarray:
        """The probe (h,) that each of the rays ``rows`` (h,) leaves from."""
        _, n, m = self.shape
        return self.probes.reshape(-1)[rows // (n * m) * m + rows % m]


def batches(items: list[Item], most: int) -> Iterator[list[Item]]:
    """``items`` in runs of up to ``most`` rays: what is held in memory between tracing and shading."""
    start = 0
    while start < len(items):
        stop, rays = start, 0
        while stop < len(items) and (stop == start or rays + items[stop].ray_count <= most):
            rays += items[stop].ray_count
            stop += 1
        yield items[start:stop]
        start = stop
