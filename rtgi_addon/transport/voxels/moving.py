"""Voxels that follow what has moved before the scene is put into them anew: what stood somewhere is taken out, and what a camera
sees is put in.

A camera sees one side of things: what it puts in has no back, and lies where its points lie. Points stand for the pieces of surface
that their pixels see, so a cell's opacity along an axis is Σ dA·|nₐ|/s² of the side that shows more, and at most 1; where a cell
holds surfaces that stayed as well it is the larger of both, not their sum, since the same surface would be counted twice.

Source: the lecture's injection of camera points (occupancy); S. Thiedemann et al., "Voxel-based Global Illumination", I3D 2011.
Apart from them: points bring the light that leaves them, so that a moved lamp shade or a coloured ball lights its new surroundings
at once.
"""

from dataclasses import dataclass, replace

import numpy as np

from ..surfaces.geometry import Geometry
from .crossings import TIE
from .grid import FACES
from .injection import inject
from .voxelize import NO_PLATE, Seen, Voxels

_TINY = np.finfo(np.float64).tiny
# Products of a normal's components, in the order of Voxels.lie.
_PRODUCTS = ((0, 0), (1, 1), (2, 2), (1, 2), (0, 2), (0, 1))


@dataclass(frozen=True, eq=False)
class CameraPoints:
    """Points on surfaces that a camera sees: world ``positions`` (n, 3) [m], unit ``normals`` (n, 3) of their triangles on the side
    that is seen, the ``areas`` (n,) [m²] that they stand for, the diffuse ``radiance`` (n, 3) [W·sr⁻¹·m⁻²] that leaves them, their
    ``albedo`` (n, 3), and the ``instance`` (n,) int of the scene that was drawn."""

    positions: np.ndarray
    normals: np.ndarray
    areas: np.ndarray
    radiance: np.ndarray
    albedo: np.ndarray
    instance: np.ndarray

    def of(self, chosen: np.ndarray) -> "CameraPoints":
        """Those of the instances that are ``chosen`` (i,) bool."""
        rows = np.flatnonzero(chosen[self.instance])
        return CameraPoints(*(getattr(self, name)[rows] for name in self.__dataclass_fields__))


def without(voxels: Voxels, shown: np.ndarray, gone: np.ndarray, geometry: Geometry) -> tuple[Voxels, np.ndarray]:
    """``voxels`` without the triangles that are ``gone`` (t,) bool of ``geometry``, and what is left of their faces' radiance (m',
    6, 3), premultiplied; ``shown`` (e, 3) is that of what is seen. Cells that hold nothing else are empty then. Behind what is gone
    a face knows only what another face of the cell saw, and shows no light there."""
    seen, kept = voxels.seen, ~gone[voxels.seen.primitive]
    if kept.all():
        return voxels, voxels.by_face(shown)
    cells = len(voxels.cells)
    left = Seen(*(getattr(seen, name)[kept] for name in Seen.__dataclass_fields__))
    touched = np.bincount(seen.face[~kept] // FACES, minlength=cells) > 0
    weights, before = (np.bincount(part.face, part.weight, FACES * cells).reshape(cells, 3, 2) for part in (left, seen))
    opacity = np.where(touched[:, None], np.minimum(voxels.opacity, weights.max(axis=2)), voxels.opacity).astype(np.float32)
    area = voxels.area * np.where(touched, weights.sum(axis=(1, 2)) / np.maximum(before.sum(axis=(1, 2)), _TINY), 1.0)
    # What is left of cells that held both lies as the points say that still see it: a face sees |nₐ| of an area.
    rows = np.flatnonzero(touched[left.face // FACES])
    cell, primitive = left.face[rows] // FACES, left.primitive[rows]
    normals = geometry.normals_world[primitive].astype(np.float64)
    share = left.weight[rows] / np.maximum(np.abs(normals).sum(axis=1), _TINY)
    points = geometry.points(primitive, left.u[rows], left.v[rows])
    middle = voxels.grid.cells_of(points) - voxels.grid.cells_of(voxels.grid.centers_of(voxels.cells[cell]))
    means = _means(cell, share, cells, normals, np.clip(middle, -0.5, 0.5))
    normal, lie, middle = (np.where(touched[:, None], new, old) for new, old in
                           zip(means, (voxels.normal, voxels.lie, voxels.middle), strict=True))
    plates = np.where(touched[:, None], NO_PLATE, voxels.plates)
    result = replace(voxels, opacity=opacity, area=area, normal=normal, lie=lie, middle=middle, plates=plates, seen=left)
    radiance = result.by_face(shown[kept])
    stays = ~touched | (opacity.max(axis=1) > 0)
    return _rows(result, stays), radiance[stays]


def with_points(voxels: Voxels, radiance: np.ndarray, points: CameraPoints) -> tuple[Voxels, np.ndarray]:
    """``voxels`` whose faces show ``radiance`` (m, 6, 3), premultiplied, with ``points`` put in, and what their faces show then.
    The result's ``seen`` is that of ``voxels``: of what is put in fronts and walls are not known."""
    grid = voxels.grid
    column = np.floor(grid.cells_of(points.positions) + TIE).astype(np.int64)
    x, y, z = column.T
    within = np.all((column >= 0) & (column < grid.resolution), axis=1)
    if not within.any():
        return voxels, radiance
    met = ((z * grid.resolution[1] + y) * grid.resolution[0] + x)[within]
    cells = np.union1d(voxels.cells, met)
    row = np.full(grid.count, -1, np.int32)
    row[cells] = np.arange(len(cells), dtype=np.int32)
    before, count = row[voxels.cells], len(cells)
    positions, normals, areas = points.positions[within], np.asarray(points.normals, np.float64)[within], points.areas[within]
    put = inject(grid, row, positions, normals, areas[:, None] * np.column_stack([np.ones(len(areas)), points.radiance[within]]))
    put = np.concatenate([put, np.zeros((count - len(put), FACES, 4))])
    cover = np.minimum(put[..., 0], 1.0)
    light = put[..., 1:] * (cover / np.maximum(put[..., 0], _TINY))[..., None]

    def spread(values: np.ndarray) -> np.ndarray:
        full = np.zeros((count, *values.shape[1:]), np.float64)
        full[before] = values
        return full

    known = spread(voxels.opacity)
    opacity = np.maximum(known, cover.reshape(count, 3, 2).max(axis=2))
    # What stayed shows as far as what was put in leaves room.
    room = np.clip(np.repeat(opacity, 2, axis=1) - cover, 0.0, np.repeat(known, 2, axis=1))
    light += spread(radiance) * (room / np.maximum(np.repeat(known, 2, axis=1), _TINY))[..., None]
    at = row[met]
    middle = grid.cells_of(positions) - np.floor(grid.cells_of(positions) + TIE) - 0.5
    new = _means(at, areas, count, normals, middle, points.albedo[within])
    added, old = np.bincount(at, areas, count), spread(voxels.area)
    share = (added / np.maximum(added + old, _TINY))[:, None]
    normal, lie, middle, albedo = (share * put_in + (1.0 - share) * spread(was) for put_in, was in
                                   zip(new, (voxels.normal, voxels.lie, voxels.middle, voxels.albedo), strict=True))
    solid = np.ones(count, bool)
    solid[before] = voxels.solid
    plates = np.full((count, 3), NO_PLATE)
    plates[before] = voxels.plates
    plates[at] = NO_PLATE
    area = np.maximum(added, old)
    seen = replace(voxels.seen, face=FACES * before.astype(np.int64)[voxels.seen.face // FACES] + voxels.seen.face % FACES)
    result = replace(voxels, cells=cells, opacity=opacity.astype(np.float32), area=area, normal=normal, albedo=albedo, lie=lie,
                     middle=middle, solid=solid, plates=plates, seen=seen)
    return result, light.astype(np.float32)


def _means(cell: np.ndarray, weight: np.ndarray, count: int, normals: np.ndarray, middle: np.ndarray, *others) -> list[np.ndarray]:
    """Of points in the rows ``cell`` (p,) of so many, by ``weight`` (p,): mean normal, products of its components as in
    Voxels.lie, place and what ``others`` (p, …) are, (count, …) each."""
    total = np.maximum(np.bincount(cell, weight, count), _TINY)
    products = np.stack([normals[:, a] * normals[:, b] for a, b in _PRODUCTS], axis=1)
    return [np.stack([np.bincount(cell, weight * column, count) / total for column in values.T], axis=1)
            for values in (normals, products, middle, *others)]


def _rows(voxels: Voxels, stays: np.ndarray) -> Voxels:
    """``voxels`` in the rows that ``stays`` (m,) bool says."""
    if stays.all():
        return voxels
    renumbered = np.cumsum(stays) - 1
    inside = stays[voxels.seen.face // FACES]
    seen = Seen(*(getattr(voxels.seen, name)[inside] for name in Seen.__dataclass_fields__))
    seen = replace(seen, face=FACES * renumbered[seen.face // FACES] + seen.face % FACES)
    names = ("cells", "opacity", "area", "normal", "albedo", "lie", "middle", "solid", "plates")
    return replace(voxels, seen=seen, **{name: getattr(voxels, name)[stays] for name in names})
