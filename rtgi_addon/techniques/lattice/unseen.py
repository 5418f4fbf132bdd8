"""Probes that no surface reads: those with nothing but air, or nothing but the inside of solids, in all the cells around them."""

from itertools import product

import numpy as np

from ...numerics import grid as lattice
from ...scene import ProbeVolume
from ...transport.surfaces.geometry import Geometry
from .weights import coverage

# Samples along each side of a cell; how many cells off a surface light is wanted, for what stands there.
SAMPLES_PER_CELL, CLEARANCE = 2, 1
# Triangles and samples that are worked on at once.
_TRIANGLES, _SAMPLES = 1 << 16, 1 << 21


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
    inside = np.all((corners.max(axis=1) > -reach) & (corners.min(axis=1) < resolution - 1 + reach), axis=1)
    corners = corners[inside & np.isfinite(corners).all(axis=(1, 2))]
    cells = np.zeros(tuple(resolution[::-1] + 1), bool)
    for start in range(0, len(corners), _TRIANGLES):
        for points in _samples(corners[start:start + _TRIANGLES], resolution, reach):
            _mark(cells, _left_over(volume, points, finer), resolution, reach)
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


def _left_over(volume: ProbeVolume, points: np.ndarray, finer: tuple[ProbeVolume, ...]) -> np.ndarray:
    """Those of ``points`` (n, 3) in the lattice of ``volume`` that none of ``finer`` covers in full."""
    for other in finer:
        if not len(points):
            break
        local = lattice.local_from_lattice(points, volume.resolution)
        world = lattice.transform_points(volume.world_from_local, local)
        place = lattice.lattice_from_world(other.world_from_local, other.nodes, world)
        points = points[coverage(place, other.nodes) < 1.0]
    return points


def _grown(cells: np.ndarray) -> np.ndarray:
    """``cells`` and all that touch them."""
    for axis in range(3):
        padded = np.pad(cells, [(1, 1) if other == axis else (0, 0) for other in range(3)])
        count = cells.shape[axis]
        cells = cells | padded.take(np.arange(count), axis) | padded.take(np.arange(2, count + 2), axis)
    return cells


def _samples(corners: np.ndarray, resolution: np.ndarray, reach: np.ndarray):
    """Points (n, 3) all over triangles (t, 3, 3) in lattice coordinates, as far as they can lie in the lattice, some at a time.

    A grid over the two axes along which a triangle is widest; what falls outside it is drawn to its edge: none is too small.
    """
    axis = np.abs(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])).argmax(axis=1)
    others = np.stack([(axis + 1) % 3, (axis + 2) % 3], axis=1)
    flat = np.take_along_axis(corners, others[:, None, :], axis=2)
    low = np.floor(np.maximum(flat.min(axis=1), -reach[others]) * SAMPLES_PER_CELL).astype(np.int64)
    high = np.ceil(np.minimum(flat.max(axis=1), (resolution - 1 + reach)[others]) * SAMPLES_PER_CELL).astype(np.int64)
    count = np.maximum(high - low + 1, 1)
    total = count.prod(axis=1)
    ends = np.cumsum(total)
    first = done = 0
    while first < len(corners):
        last = max(first + 1, int(np.searchsorted(ends, done + _SAMPLES, side="right")))
        rows = np.repeat(np.arange(first, last), total[first:last])
        number = np.arange(len(rows)) - np.repeat(ends[first:last] - total[first:last] - done, total[first:last])
        at = (low[rows] + np.stack([number % count[rows, 0], number // count[rows, 0]], axis=1)) / SAMPLES_PER_CELL
        yield _onto_triangle(corners[rows], flat[rows], at)
        first, done = last, int(ends[last - 1])


def _onto_triangle(corners: np.ndarray, flat: np.ndarray, at: np.ndarray) -> np.ndarray:
    """The points (n, 3) of triangles (n, 3, 3) over ``at`` (n, 2) in the plane of ``flat`` (n, 3, 2), drawn to the edge."""
    def cross(left, right):
        return left[:, 0] * right[:, 1] - left[:, 1] * right[:, 0]

    edge_u, edge_v, offset = flat[:, 1] - flat[:, 0], flat[:, 2] - flat[:, 0], at - flat[:, 0]
    area = cross(edge_u, edge_v)
    area = np.where(np.abs(area) > 1e-12, area, 1e-12)
    u, v = np.maximum(cross(offset, edge_v) / area, 0.0), np.maximum(cross(edge_u, offset) / area, 0.0)
    scale = np.maximum(u + v, 1.0)
    u, v = (u / scale)[:, None], (v / scale)[:, None]
    return corners[:, 0] + u * (corners[:, 1] - corners[:, 0]) + v * (corners[:, 2] - corners[:, 0])


def _mark(cells: np.ndarray, points: np.ndarray, resolution: np.ndarray, reach: np.ndarray) -> None:
    """Set the cells that ``points`` (n, 3) in lattice coordinates lie in; those less than ``reach`` (3,) outside count for the
    outermost."""
    points = points[np.all((points > -reach) & (points < resolution - 1 + reach), axis=1)]
    index = np.clip(np.floor(points).astype(np.int64) + 1, 0, resolution)
    cells[index[:, 2], index[:, 1], index[:, 0]] = True
