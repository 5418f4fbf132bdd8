"""The nodes' words: which scattered probes each node of a volume's lattice names, so that only those are read there that see it."""

from itertools import product

import numpy as np

from ...numerics.grid import cell_size, lattice_points
from ...progress import Progress
from ...scene import ProbeVolume, Scattered
from ...scene.scattered import SLOTS, named, words
from ...transport.context import LightContext
from ..lattice.placement import place_points
from .blending import nearest, seeing, shares

# The nearest probes of which those are found that see a node.
AROUND = 64
_STEPS = np.array([step for step in product((-1, 0, 1), repeat=3) if any(step)])


def scattered_at(context: LightContext, volume: ProbeVolume, points: np.ndarray, progress: Progress) -> Scattered:
    """``points`` (p, 3) as the probes of ``volume``, whose lattice are the nodes. Nodes inside geometry, and those that none of the
    nearest probes sees, name what their neighbours name. Raises Cancelled."""
    places = lattice_points(volume.world_from_local, volume.nodes)
    shape = places.shape[:3]
    lattice = places.reshape(-1, 3)
    placed = place_points(context, (volume,), lattice, np.zeros(len(lattice), np.int64), True, progress.span(0.0, 0.4))
    rows = np.flatnonzero(placed.measured)
    open_places = placed.positions[rows].astype(np.float64)
    around = nearest(open_places, points, AROUND)
    of, weight = shares(open_places, points, around, seeing(context, open_places, points, around, progress.span(0.4, 1.0)))
    known = np.flatnonzero(weight.sum(axis=1) > 0)
    index, filled = np.zeros((len(lattice), SLOTS), np.int32), np.zeros(len(lattice), bool)
    index[rows[known]], filled[rows[known]] = words(of[known], weight[known]), True
    if not filled.any():
        # Probes that no node sees: the nearest is all there is.
        index[:, :], filled[:] = -words(nearest(lattice, points, 1), np.ones((len(lattice), 1))), True
    _fill(index, filled, shape)
    index = index.reshape(*shape, SLOTS)
    return Scattered(index, points, _reach(volume, lattice, points, index.reshape(-1, SLOTS)))


def _fill(index: np.ndarray, filled: np.ndarray, shape: tuple[int, ...]) -> None:
    """Give nodes that are not ``filled`` (n,) the words of their neighbours, layer by layer."""
    empty = np.argwhere(~filled.reshape(shape))
    while len(empty):
        around = empty[:, None] + _STEPS
        within = np.all((around >= 0) & (around < np.array(shape)), axis=2)
        flat = np.ravel_multi_index(np.moveaxis(np.clip(around, 0, np.array(shape) - 1), -1, 0), shape)
        usable = within & filled[flat]
        reached = usable.any(axis=1)
        probes, share = named(index[flat[reached]])
        closeness = usable[reached] / np.sum(_STEPS**2, axis=1)
        share = share * closeness[:, :, None]
        rows = np.ravel_multi_index(empty[reached].T, shape)
        index[rows] = -words(*_merged(probes.reshape(len(rows), -1), share.reshape(len(rows), -1)))
        filled[rows] = True
        empty = empty[~reached]


def _merged(probes: np.ndarray, share: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The same with every probe's shares (n, m) together where it is named first, and 0 elsewhere."""
    order = np.argsort(probes, axis=1, kind="stable")
    probes, share = np.take_along_axis(probes, order, axis=1), np.take_along_axis(share, order, axis=1)
    first = np.ones(probes.shape, bool)
    first[:, 1:] = probes[:, 1:] != probes[:, :-1]
    group = np.cumsum(first, axis=1) - 1 + np.arange(len(probes))[:, None] * probes.shape[1]
    sums = np.bincount(group.ravel(), share.ravel(), probes.size)
    return probes, np.where(first, sums[group], 0.0)


def _reach(volume: ProbeVolume, lattice: np.ndarray, points: np.ndarray, index: np.ndarray) -> np.ndarray:
    """How far (p,) each of ``points`` (p, 3) matters: to the cells about the farthest node that names it."""
    probes, share = named(index)
    distance = np.linalg.norm(points[probes] - lattice[:, None], axis=2)
    reach = np.zeros(len(points))
    np.maximum.at(reach, probes[share > 0], distance[share > 0])
    return (reach + 1.5 * np.linalg.norm(cell_size(volume.world_from_local, volume.nodes))).astype(np.float32)
