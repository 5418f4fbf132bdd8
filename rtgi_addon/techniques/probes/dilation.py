"""Give probes inside geometry the light of their nearest usable neighbours, for whoever interpolates the lattice trilinearly."""

from dataclasses import replace
from itertools import product

import numpy as np

from ...numerics import grid as lattice
from ..base import BACKFACE_THRESHOLD, ProbeGrid

_NEIGHBOURS = np.array([step for step in product((-1, 0, 1), repeat=3) if any(step)])


def live_probes(grid: ProbeGrid) -> np.ndarray:
    """(nz, ny, nx) bool: probes whose coefficients hold light, measured at the lattice point or where the probe was moved to."""
    return (grid.validity >= 1.0 - BACKFACE_THRESHOLD) | np.any(grid.offset_world != 0, axis=-1)


def dilate(grid: ProbeGrid) -> ProbeGrid:
    """``grid`` with the SH of every probe that is not live replaced by its neighbours', weighted by inverse square distance.

    Layer by layer outwards from the live probes over the 26 neighbours, until none is left; a grid without any live probe
    comes back as it is. Validity, visibility and offsets stay: what was measured can still be told from what was filled in.
    """
    filled = live_probes(grid)
    if filled.all() or not filled.any():
        return grid
    filled = filled.copy()
    sh = grid.sh.copy()
    shape = np.array(filled.shape)
    steps = _NEIGHBOURS[:, ::-1] @ lattice.cell_axes(grid.volume.world_from_local, grid.volume.resolution)
    closeness = 1.0 / np.sum(steps**2, axis=1)
    empty = np.argwhere(~filled)
    while len(empty):
        around = empty[:, None] + _NEIGHBOURS
        inside = np.all((around >= 0) & (around < shape), axis=-1)
        index = np.ravel_multi_index(np.moveaxis(np.clip(around, 0, shape - 1), -1, 0), filled.shape)
        weights = np.where(inside & filled.ravel()[index], closeness, 0.0)
        reached = weights.any(axis=1)
        weights, index, layer = weights[reached], index[reached], tuple(empty[reached].T)
        weights = (weights / weights.sum(axis=1, keepdims=True)).astype(np.float32)
        flat = sh.reshape(-1, *sh.shape[3:])
        total = np.zeros((len(index), *sh.shape[3:]), np.float32)
        for corner in range(len(_NEIGHBOURS)):
            # Where the weight is 0 the neighbour may hold anything, NaN included, so it is left out rather than multiplied.
            used = np.flatnonzero(weights[:, corner])
            total[used] += weights[used, corner, None, None] * flat[index[used, corner]]
        sh[layer] = total
        filled[layer] = True
        empty = empty[~reached]
    return replace(grid, sh=sh)
