"""Lattices next to a lattice: a probe more or less along an axis, and the cheapest shape for an error that all axes share."""

from math import ceil

import numpy as np

# How much coarser an axis is made to see what the light along it does.
COARSENED = 1.5
# Each axis is held to cause at least this share of what it would if all caused the same.
LEAST_SHARE = 0.2

Resolutions = tuple[tuple[int, int, int], ...]


def axes_of(resolutions: Resolutions) -> list[tuple[int, int]]:
    """(volume, axis) along which lattices of ``resolutions`` have more than two probes."""
    return [(volume, axis) for volume, resolution in enumerate(resolutions) for axis in range(3) if resolution[axis] > 2]


def shifted_by_one(resolutions: Resolutions) -> Resolutions:
    """A probe more along each axis that has several: its layers lie elsewhere."""
    return tuple(tuple(count + 1 if count > 1 else count for count in resolution) for resolution in resolutions)


def changed(resolutions: Resolutions, volume: int, axis: int, count: int) -> Resolutions:
    """``count`` probes along one axis of one volume."""
    lists = [list(resolution) for resolution in resolutions]
    lists[volume][axis] = count
    return tuple(map(tuple, lists))


def cheapest(base: Resolutions, shares: dict[tuple[int, int], float], square: float, allowed: float, rate: float) -> Resolutions:
    """The fewest probes for which the model square + sum of share * ((base / resolution)^2p - 1) stays within ``allowed``: from a
    finer lattice one probe less at a time, along the axis that saves most for what it costs in error."""
    exponent = 2.0 * rate
    # Along every axis some of the error stays, and all of it belongs to one of them.
    shares = {key: max(share, LEAST_SHARE * square / len(shares)) for key, share in shares.items()}
    scale = square / max(sum(shares.values()), 1e-30)
    current = [list(resolution) for resolution in base]
    for volume, axis in shares:
        current[volume][axis] = ceil(base[volume][axis] * COARSENED)

    def cause(key, count):
        return scale * shares[key] * ((base[key[0]][key[1]] / count) ** exponent - 1.0)

    causes = {key: cause(key, current[key[0]][key[1]]) for key in shares}
    while True:
        best = None
        for key in shares:
            volume, axis = key
            count = current[volume][axis]
            if count <= max(2, ceil(base[volume][axis] / COARSENED)):
                continue
            rise = cause(key, count - 1) - causes[key]
            if square + sum(causes.values()) + rise > allowed:
                continue
            saved = np.prod(current[volume]) / count
            if best is None or saved > best[0] * max(rise, 1e-12):
                best = saved / max(rise, 1e-12), key
        if best is None:
            return tuple(tuple(int(count) for count in resolution) for resolution in current)
        volume, axis = best[1]
        current[volume][axis] -= 1
        causes[best[1]] = cause(best[1], current[volume][axis])
