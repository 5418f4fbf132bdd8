"""Probes that no surface reads: those with nothing but air, or nothing but the inside of solids, in all the cells around them."""

from itertools import product

import numpy as np

from ...numerics import grid as lattice
from ...scene import ProbeVolume
from ...transport.surfaces.geometry import Geometry
from ...transport.voxels.touched import touched_cells
from .weights import coverage

# How many cells off a surface light is wanted, for what stands there.
CLEARANCE = 1
# What of a triangle is in a cell has the corners of a box.
_CORNERS = np.array(list(product((0, 1), repeat=3)))


def worth_rays(geometry: Geometry, volumes: tuple[ProbeVolume, ...]) -> list[np.ndarray | None]:
    """For each of ``volumes``, which are one field, the probes (nz, ny, nx) that are worth rays, or None for all: as its mask says,
    or where ``near`` leaves it to this, by where surfaces are. What finer volumes cover is left to those; where no probe would be
    left, all are."""
    masks = []
    for volume in volumes:
        mask = volume.wanted
        if mask is None and volume.near is not None:
            mask = probes_near_surfaces(geometry, volume, volumes)
            mask = mask if mask.any() else None
        masks.append(mask)
    return masks


def probes_near_surfaces(geometry: Geometry, volume: ProbeVolume, volumes: tuple[ProbeVolume, ...]) -> np.ndarray:
    """(nz, ny, nx) bool: probes of ``volume``, one of ``volumes``, as its ``near`` says."""
    near, size = volume.near, lattice.cell_volume(volume.world_from_local, volume.nodes)
    half = np.linalg.norm(np.asarray(volume.world_from_local, np.float64)[:3, :3], axis=0)
    finer = tuple(other for other in volumes if lattice.cell_volume(other.world_from_local, other.nodes) < size)
    return wanted_probes(geometry, volume, near.clearance, near.outside / np.maximum(half, 1e-30),
                         near.outermost and not volume.planned, finer)


def wanted_probes(geometry: Geometry, volume: ProbeVolume, clearance: float = 0.0, margin=0.0, outermost: bool = False,
                  finer: tuple[ProbeVolume, ...] = ()) -> np.ndarray:
    """(nz, ny, nx) bool: probes of ``volume`` beside a cell that a surface reaches into, or beside one up to CLEARANCE cells or
    ``clearance`` [m] off such a cell.

    Surfaces up to ``margin`` (scalar or one for each axis) of the box's half side outside, at least a cell, count for the probes
    that they read there; ``outermost`` keeps the whole outermost layer, for surfaces anywhere outside. What one
    of ``finer`` volumes answers for alone is not looked at.
    """
    resolution = np.asarray(volume.resolution, np.int64)
    reach = np.maximum(1.0, 0.5 * margin * resolution + 0.5)
    corners = lattice.lattice_from_world(volume.world_from_local, resolution, geometry.triangles_world)
    least, most = corners.min(axis=1), corners.max(axis=1)
    chosen = np.flatnonzero(np.all((most > -reach) & (least < resolution - 1 + reach) & np.isfinite(most - least), axis=1))
    corners, least, most = corners[chosen], least[chosen], most[chosen]
    cells = np.zeros(tuple(resolution[::-1] + 1), bool)
    for rows, touched in touched_cells(corners, np.floor(-reach), np.ceil(resolution - 1 + reach)):
        # As far as a triangle can lie in the cell.
        low, high = np.maximum(least[rows], touched), np.minimum(most[rows], touched + 1)
        kept = np.flatnonzero(np.all((high > -reach) & (low < resolution - 1 + reach), axis=1))
        kept = kept[_left_over(volume, low[kept], high[kept], finer)]
        # Those outside count for the outermost.
        x, y, z = np.clip(touched[kept] + 1, 0, resolution).T
        cells[z, y, x] = True
    for _ in range(max(CLEARANCE, int(np.ceil(clearance / lattice.cell_size(volume.world_from_local, resolution).min())))):
        cells = _grown(cells)
    probes = np.zeros(tuple(resolution[::-1]), bool)
    nz, ny, nx = probes.shape
    # Cell (i, j, k) lies between the probes i - 1 and i of each axis.
    for dz, dy, dx in product((0, 1), repeat=3):
        probes |= cells[dz:dz + nz, dy:dy + ny, dx:dx + nx]
    if outermost:
        probes[[0, -1]] = probes[:, [0, -1]] = probes[:, :, [0, -1]] = True
    return probes


def _left_over(volume: ProbeVolume, low: np.ndarray, high: np.ndarray, finer: tuple[ProbeVolume, ...]) -> np.ndarray:
    """Rows of the boxes from ``low`` (n, 3) to ``high`` (n, 3) in the lattice of ``volume`` that none of ``finer`` covers whole."""
    rows = np.arange(len(low))
    for other in finer:
        points = np.where(_CORNERS, high[rows, None], low[rows, None]).reshape(-1, 3)
        world = lattice.transform_points(volume.world_from_local, lattice.local_from_lattice(points, volume.resolution))
        place = lattice.lattice_from_world(other.world_from_local, other.nodes, world)
        rows = rows[~(coverage(place, other.nodes) >= 1.0).reshape(-1, len(_CORNERS)).all(axis=1)]
    return rows


def _grown(cells: np.ndarray) -> np.ndarray:
    """``cells`` and all that touch them."""
    for axis in range(3):
        padded = np.pad(cells, [(1, 1) if other == axis else (0, 0) for other in range(3)])
        count = cells.shape[axis]
        cells = cells | padded.take(np.arange(count), axis) | padded.take(np.arange(2, count + 2), axis)
    return cells
