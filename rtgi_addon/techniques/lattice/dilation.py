"""Give probes inside geometry the light of their nearest usable neighbours, for whoever interpolates the lattice trilinearly."""

from dataclasses import replace
from itertools import product

import numpy as np

from ...numerics import grid as lattice
from ...scene import ProbeVolume
from ..base import ProbeGrid

_NEIGHBOURS = np.array([step for step in product((-1, 0, 1), repeat=3) if any(step)])
# Probes that are filled in at a time: their neighbours take a kilobyte each.
_ROWS = 1 << 15


def live_probes(grid: ProbeGrid) -> np.ndarray:
    """(nz, ny, nx) bool: probes whose coefficients hold light, measured at the lattice point or where the probe was moved to."""
    return grid.in_the_open


def dilate(grid: ProbeGrid) -> ProbeGrid:
    """``grid`` with the SH of every probe that is not live replaced by its neighbours', weighted by inverse square distance.

    Validity, visibility and offsets stay: what was measured can still be told from what was filled in.
    """
    sh = dilated(grid.sh, live_probes(grid), grid.volume)
    return grid if sh is grid.sh else replace(grid, sh=sh)


def dilated(values: np.ndarray, live: np.ndarray, volume: ProbeVolume) -> np.ndarray:
    """``values`` (nz, ny, nx, …) of the probes of ``volume``, where those not ``live`` (nz, ny, nx) have their neighbours'.

    Layer by layer outwards from the live probes over the 26 neighbours, until none is left; without any live probe, or with none
    but those, ``values`` come back as they are.
    """
    if live.all() or not live.any():
        return values
    filled, values = live.copy(), values.copy()
    steps = _NEIGHBOURS[:, ::-1] @ lattice.cell_axes(volume.world_from_local, volume.resolution)
    closeness = 1.0 / np.sum(steps**2, axis=1)
    empty = np.argwhere(~filled)
    while len(empty):
        # What is filled in is not read before the layer is complete.
        reached = np.concatenate([_fill(values, filled, closeness, empty[i:i + _ROWS]) for i in range(0, len(empty), _ROWS)])
        filled[tuple(empty[reached].T)] = True
        empty = empty[~reached]
    return values


def _fill(values: np.ndarray, filled: np.ndarray, closeness: np.ndarray, empty: np.ndarray) -> np.ndarray:
    """Fill in ``values`` at the places ``empty`` (n, 3) that have ``filled`` neighbours, and say which (n,) those are."""
    shape = np.array(filled.shape)
    around = empty[:, None] + _NEIGHBOURS
    inside = np.all((around >= 0) & (around < shape), axis=-1)
    index = np.ravel_multi_index(np.moveaxis(np.clip(around, 0, shape - 1), -1, 0), filled.shape)
    weights = np.where(inside & filled.ravel()[index], closeness, 0.0)
    reached = weights.any(axis=1)
    weights, index = weights[reached], index[reached]
    weights = (weights / weights.sum(axis=1, keepdims=True)).astype(np.float32)
    flat = values.reshape(-1, *values.shape[3:])
    total = np.zeros((len(index), *values.shape[3:]), np.float32)
    for corner in range(len(_NEIGHBOURS)):
        # Where the weight is 0 the neighbour may hold anything, NaN included, so it is left out rather than multiplied.
        used = np.flatnonzero(weights[:, corner])
        total[used] += weights[used, corner].reshape(-1, *[1] * (total.ndim - 1)) * flat[index[used, corner]]
    values[tuple(empty[reached].T)] = total
    return reached
