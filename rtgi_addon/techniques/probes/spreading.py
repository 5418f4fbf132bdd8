"""The first rays of a bake's probes, kept until more follow: what they found says where those go, and counts for less there."""

import numpy as np

from .gather import FULL_SPHERE, GROUP, Along, Gatherer, project
from .items import Item
from .strata import CELLS, Spread, Strata


class Spreading:
    """Strata of a bake of so many ``probes`` with the ``seed``, and what the first CELLS rays of each found."""

    def __init__(self, probes: int, seed: int):
        self.strata = Strata(-(-probes // GROUP), seed)
        # Rows of ``_light`` and ``_emitted`` of each probe; −1: none.
        self._row = np.full(probes, -1)
        self._light = np.zeros((0, CELLS, 3), np.float32)
        self._emitted: np.ndarray | None = None

    def keep_item(self, item: Item, along: Along) -> None:
        """Remember what rays of an item's probes found, some of their first."""
        self._make_room(item.probes, along.emitted is not None)
        where = self._row[item.probes][:, None, :], (item.first[:, None] + np.arange(item.count))[:, :, None]
        self._light[where] = along.light
        if along.emitted is not None:
            self._emitted[where] = along.emitted

    def keep(self, probes: np.ndarray, light: np.ndarray, emitted: np.ndarray | None) -> None:
        """Remember the ``light`` (m, n, 3) along the first n rays of ``probes`` (m,), and what of it is ``emitted``."""
        self._make_room(probes, emitted is not None)
        self._light[self._row[probes], :light.shape[1]] = light
        if emitted is not None:
            self._emitted[self._row[probes], :light.shape[1]] = emitted

    def _make_room(self, probes: np.ndarray, emitted: bool) -> None:
        fresh = np.unique(probes[self._row[probes] < 0])
        if fresh.size:
            self._row[fresh] = len(self._light) + np.arange(len(fresh))
            self._light = _longer(self._light, len(fresh))
        if emitted:
            known = np.zeros_like(self._light[:0]) if self._emitted is None else self._emitted
            self._emitted = _longer(known, len(self._light) - len(known))

    def spread(self, key: np.ndarray) -> Spread | None:
        """The rays that ``key`` (c, 4) asks for, one after the other: of each row those of a group from how many it had to how many
        it shall have (and whose they are alone). None where no group is refined."""
        if not self.strata.refined(key[:, 0]).any():
            return None
        starts = np.cumsum(np.append(0, key[:, 2] - key[:, 1]))
        order, doubled = np.empty(starts[-1], np.uint32), np.empty(starts[-1], np.int8)
        refined = self.strata.refined(key[:, 0])
        spans = np.unique(np.column_stack([key[:, 1:3], refined]), axis=0)
        for before, after, of_refined in spans.tolist():
            rows = np.flatnonzero((key[:, 1] == before) & (key[:, 2] == after) & (refined == of_refined))
            where = starts[rows, None] + np.arange(after - before)
            order[where], doubled[where] = self.strata.spread(key[rows, 0], before, after)
        return Spread(order, doubled)

    def refine(self, gatherer: Gatherer, probes: np.ndarray, total: np.ndarray, emitted: np.ndarray | None) -> np.ndarray:
        """Spread further rays of the groups of ``probes`` (m,), which have had the first ones, by what those found, where it pays:
        the probes (r,) of which that is so. In the sums ``total`` (p, k, 3) and ``emitted`` their first rays then count for what
        they stand for among all."""
        if not probes.size:
            return probes
        groups, of_group = np.unique(probes // GROUP, return_inverse=True)
        for start in range(0, len(groups), GROUPS_AT_A_TIME):
            some = groups[start:start + GROUPS_AT_A_TIME]
            chosen = np.flatnonzero((of_group >= start) & (of_group < start + GROUPS_AT_A_TIME))
            light = np.full((len(some), GROUP, CELLS), -1, np.float32)
            light[of_group[chosen] - start, probes[chosen] % GROUP] = _brightness(self._light[self._row[probes[chosen]]])
            self.strata.refine(some, light)
        refined = probes[self.strata.refined(groups)[of_group]]
        groups, of_group = np.unique(refined // GROUP, return_inverse=True)
        rows = self._row[refined]
        for start in range(0, len(groups), GROUPS_AT_A_TIME):
            some = groups[start:start + GROUPS_AT_A_TIME]
            item = Item(some, np.zeros((len(some), 1), np.int64), np.zeros(len(some), np.int64), CELLS)
            directions = gatherer.directions(item)
            basis = gatherer.basis(item, directions)
            change = gatherer.ray_basis(item, directions) - basis
            chosen = np.flatnonzero((of_group >= start) & (of_group < start + GROUPS_AT_A_TIME))
            for sums, found in ((total, self._light), (emitted, self._emitted)):
                if found is not None and sums is not None:
                    by_probe = found[rows[chosen]][:, :, None]
                    sums[refined[chosen]] += project(change[of_group[chosen] - start], by_probe)[:, 0] * FULL_SPHERE
        self._forget(probes)
        return refined

    def _forget(self, probes: np.ndarray) -> None:
        self._row[probes] = -1
        left = np.flatnonzero(self._row >= 0)
        left = left[np.argsort(self._row[left])]
        self._light, self._emitted = (None if part is None else part[self._row[left]] for part in (self._light, self._emitted))
        self._row[left] = np.arange(len(left))

    def state(self) -> dict[str, np.ndarray]:
        """Everything it knows, for a checkpoint."""
        known = {"doubled": self.strata.doubled, "row": self._row, "light": self._light}
        return known if self._emitted is None else known | {"emitted": self._emitted}

    def restore(self, arrays: dict[str, np.ndarray]) -> None:
        """Take up from ``state``."""
        self.strata.doubled[:] = arrays["doubled"]
        self._row, self._light, self._emitted = arrays["row"].copy(), arrays["light"].copy(), arrays.get("emitted")


# Groups whose first rays are weighed again together: a few MiB of them.
GROUPS_AT_A_TIME = 64


def _brightness(light: np.ndarray) -> np.ndarray:
    """The sum of the colours (…) of ``light`` (…, 3), which numpy is slow to take along so short an axis."""
    return light[..., 0] + light[..., 1] + light[..., 2]


def _longer(rows: np.ndarray, more: int) -> np.ndarray:
    return np.concatenate([rows, np.zeros((more, *rows.shape[1:]), rows.dtype)])
