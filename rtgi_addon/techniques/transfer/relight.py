"""Probes under other light, from their transfer: sums of products, and no ray."""

from dataclasses import replace

import numpy as np

from ...errors import UsageError
from ...numerics import dome, octahedral, sh
from ..base import ProbeGrid
from ..lattice.dilation import live_probes
from ..lattice.focus import probes_of
from .columns import GROUP, SUNS, WORLD
from .data import Transfer, TransferGrid
from .lighting import Lighting, NewLamp, Sky, sky_of

# Sites beyond the nearest so many that see a lamp give it nothing.
NEAREST_SITES = 5


def relit(transfer: Transfer, lighting: Lighting, sky: Sky | None = None) -> tuple[ProbeGrid, ...]:
    """The grids of ``transfer`` under ``lighting``, whose world as ``sky_of`` gives it may be known. Raises UsageError for a
    group that does not exist."""
    if lighting.world is not None and sky is None:
        sky = sky_of(lighting.world, transfer)
    factors = light_factors(transfer, lighting)
    suns = None if sky is None else sky.suns.astype(np.float64)
    bounced = sun_shares(transfer, lighting, sky)
    local = _site_powers(transfer, lighting.lamps)
    directions = sh.evaluate(transfer.sun_directions, transfer.order)
    result = []
    for grid in transfer.grids:
        light = _times(grid.lights, factors)
        if sky is not None:
            light += np.moveaxis(grid.sky @ sky.coefficients, -1, 0)
            light += _times(grid.bounce, sky.coefficients)
            if np.any(suns):
                # What is seen of the rest of the sky: a spike in each of the table's directions.
                spikes = directions[:, :, None] * suns[:, None]
                seen = grid.seen @ spikes.reshape(len(spikes), -1).astype(np.float32)
                light += np.moveaxis(seen.reshape(*grid.shape, -1, 3), -1, 0)
        light += _times(grid.suns, bounced)
        light += _times(grid.local, local)
        result.append(replace(grid.grid, sh=np.ascontiguousarray(np.moveaxis(light, 0, -1), np.float32),
                              standard_error=np.full(grid.shape, np.nan, np.float32)))
    return tuple(result)


def below_horizon(transfer: Transfer, lighting: Lighting) -> bool:
    """Whether a sun stands where nothing was transferred from."""
    return not transfer.sun_below and any(sun.towards[2] < 0 for sun in lighting.suns or ())


def group_names(transfer: Transfer) -> list[str]:
    """The groups that can be switched."""
    return [name for name, kind in transfer.lights if kind == GROUP]


def _times(matrices: np.ndarray, values: np.ndarray) -> np.ndarray:
    """(3, nz, ny, nx, k) of ``matrices`` (3, nz, ny, nx, k, C) and ``values`` (C, 3), of which those are read that are not zero."""
    used = np.flatnonzero(np.any(values != 0, axis=1))
    values = np.asarray(values, np.float32)
    if 4 * len(used) > len(values):
        return np.stack([matrices[c] @ values[:, c] for c in range(3)])
    total = np.zeros(matrices.shape[:-1], np.float32)
    for column in used:
        total += matrices[..., column] * values[column][:, None, None, None, None]
    return total


def sun_shares(transfer: Transfer, lighting: Lighting, sky: Sky | None) -> np.ndarray:
    """What bounces: irradiances (K, 3) float64 of suns from each of the table's directions, of ``lighting`` and of what the
    harmonics of ``sky`` leave."""
    bounced = np.zeros((len(transfer.sun_directions), 3)) if sky is None else np.array(sky.suns, np.float64)
    for sun in lighting.suns or ():
        index, share = dome.weights(np.asarray(sun.towards)[None], transfer.sun_side, transfer.sun_below)
        np.add.at(bounced, index[0], share[0][:, None] * np.asarray(sun.irradiance)[None])
    return bounced


def light_factors(transfer: Transfer, lighting: Lighting) -> np.ndarray:
    """What the bake's own lights are multiplied by: (G, 3). Raises UsageError for a group that does not exist."""
    known = group_names(transfer)
    for name in lighting.groups:
        if name not in known:
            raise UsageError(f"there is no light group {name!r}", f"choose one of {', '.join(known) or '(the bake has none)'}")
    factors = np.ones((len(transfer.lights), 3))
    for row, (name, kind) in enumerate(transfer.lights):
        if (kind == WORLD and lighting.world is not None) or (kind == SUNS and lighting.suns is not None):
            factors[row] = 0.0
        elif kind == GROUP and name in lighting.groups:
            factors[row] = lighting.groups[name]
    return factors


def _site_powers(transfer: Transfer, lamps: tuple[NewLamp, ...]) -> np.ndarray:
    """The watts (J, 3) that stand for ``lamps`` at the sites."""
    powers = np.zeros((len(transfer.sites), 3))
    for lamp in lamps:
        powers += site_shares(transfer, np.asarray(lamp.position, np.float64))[:, None] * np.asarray(lamp.watts)[None]
    return powers


def site_shares(transfer: Transfer, position: np.ndarray) -> np.ndarray:
    """How much (J,) of a lamp at ``position`` (3,) each site stands for: 1 in all. Those that see it share it by their distances,
    with weights that fall to 0 at the first site that gets nothing (Franke and Nielson's modification of Shepard's method,
    1980)."""
    if not len(transfer.sites):
        raise UsageError("the bundle has no lamp sites", "bake again with --set sites=32")
    offset = position - transfer.sites
    distance = np.maximum(np.linalg.norm(offset, axis=1), 1e-9)
    sees = distance <= 1.05 * _distances_seen(transfer, offset / distance[:, None])
    chosen = np.flatnonzero(sees) if sees.any() else np.arange(len(distance))
    order = chosen[np.argsort(distance[chosen], kind="stable")]
    limit = distance[order[NEAREST_SITES - 1]] if len(order) >= NEAREST_SITES else 2.0 * distance[order[-1]]
    nearest = order[:NEAREST_SITES]
    weight = (np.maximum(limit - distance[nearest], 1e-9 * limit) / (limit * distance[nearest])) ** 2
    shares = np.zeros(len(distance))
    shares[nearest] = weight / weight.sum()
    return shares


def _distances_seen(transfer: Transfer, towards: np.ndarray) -> np.ndarray:
    """How far (J,) each site sees ``towards`` (J, 3), by the map of distances of the probe that it is."""
    positions = np.concatenate([(_lattice(grid) + grid.grid.offset_world.reshape(-1, 3)) for grid in transfer.grids])
    live = np.concatenate([live_probes(grid.grid).reshape(-1) for grid in transfer.grids])
    reach, result = [grid.grid.visibility.reshape(-1, *grid.grid.visibility.shape[3:]) for grid in transfer.grids], []
    starts = np.cumsum([0, *(len(part) for part in reach)])
    for site, direction in zip(transfer.sites, towards, strict=True):
        gaps = np.where(live, np.sum((positions - site) ** 2, axis=1), np.inf)
        probe = int(np.argmin(gaps))
        volume = int(np.searchsorted(starts, probe, side="right") - 1)
        tile = reach[volume][probe - starts[volume]]
        seen = tile.reshape(-1, 2)[octahedral.texel_index(direction[None], tile.shape[0])[0], 0]
        # Distances are kept up to a limit: one that reaches it may be any.
        result.append(np.inf if seen >= 0.9 * tile[..., 0].max() else seen)
    return np.array(result)


def _lattice(grid: TransferGrid) -> np.ndarray:
    return probes_of((grid.grid.volume,))
