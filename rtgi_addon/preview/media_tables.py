"""Media as texels, for include/media.glsl: a table of all of them, and the cells of those that differ from place to place.

On the GPU every medium is everywhere or in a box. A closed mesh that is no box is a grid of the shares of cells that it fills, 64
along its longest side. Where a grid has colours, their products with the density are interpolated, in numpy each factor by itself.
Knows no GPU, as `packing`.
"""

from dataclasses import dataclass

import numpy as np

from ..numerics.grid import lattice_points, transform_points
from ..scene import Medium
from ..scene.medium import ClosedMesh
from ..transport.media.inside import inside_of
from ..transport.media.phase import DraineLobe, lobes, phase_moments
from .packing import fold

# Texels of a medium in the table (include/media.glsl), and cells along the longest side of a mesh that is no box.
TEXELS, CELLS = 12, 64
# Rays along each axis of a cell by which its share inside a mesh is told.
_WITHIN = 2
_SAME = 1e-5


@dataclass(frozen=True, eq=False)
class MediaTexels:
    """``table`` and ``cells`` (h, w, 4) float32, and the ``count`` of media in them."""

    table: np.ndarray
    cells: np.ndarray
    count: int


@dataclass(frozen=True, eq=False)
class _Placed:
    """A medium in a box: ``world_from_box`` (4, 4), None everywhere; factors of its coefficients over the cells (z, y, x, 3), None
    where they are 1."""

    world_from_box: np.ndarray | None
    scattering: np.ndarray | None = None
    absorption: np.ndarray | None = None
    emission: np.ndarray | None = None


def media_texels(media: tuple[Medium, ...]) -> MediaTexels:
    """All of ``media``."""
    rows, cells, end = [], [], 0

    def place(values: np.ndarray | None) -> int:
        nonlocal end
        if values is None:
            return -1
        first, end = end, end + values[..., 0].size
        cells.append(values.reshape(-1, 3))
        return first

    for medium in media:
        placed = _placed(medium)
        scattering = place(placed.scattering)
        # What is the same is held once.
        absorption, emission = (scattering if part is placed.scattering else place(part)
                                for part in (placed.absorption, placed.emission))
        rows.append(_row(medium, placed, scattering, absorption, emission))
    table = fold(np.array(rows, np.float32).reshape(-1, 4 * TEXELS) if rows else np.zeros((1, 4 * TEXELS), np.float32))
    return MediaTexels(table, fold(np.concatenate(cells) if cells else np.zeros((1, 3), np.float32)), len(rows))


def box_of(mesh: ClosedMesh) -> np.ndarray | None:
    """The matrix (4, 4) that makes a closed mesh of the box [−1, 1]³; None if it is none along its own axes."""
    used = np.asarray(mesh.vertices_local, np.float64)[np.unique(mesh.triangles)]
    low, high = used.min(axis=0), used.max(axis=0)
    size = np.maximum(high - low, 1e-30)
    corners = (used - low) / size
    at_corner = np.all((np.abs(corners) < _SAME) | (np.abs(corners - 1.0) < _SAME), axis=1).all()
    if not at_corner or len(np.unique(np.round(corners), axis=0)) != 8:
        return None
    of_triangles = (np.asarray(mesh.vertices_local, np.float64)[mesh.triangles] - low) / size
    if not np.all(np.any(np.ptp(of_triangles, axis=1) < _SAME, axis=1)):
        return None
    matrix = np.diag([*(0.5 * size), 1.0])
    matrix[:3, 3] = 0.5 * (low + high)
    return np.asarray(mesh.world_from_local, np.float64) @ matrix


def _placed(medium: Medium) -> _Placed:
    if medium.fills_space:
        return _Placed(None)
    box = None if medium.bounds is None else box_of(medium.bounds)
    grid = medium.grid
    if grid is None:
        return _Placed(box) if box is not None else _voxels(medium.bounds)
    matrix = np.asarray(grid.world_from_local, np.float64)
    density = np.asarray(grid.density, np.float32)[..., None]
    if medium.bounds is not None and (box is None or not np.allclose(_corners(box), _corners(matrix), atol=1e-3)):
        density = density * _filled(medium.bounds, matrix, grid.resolution)[..., None]
    scattering = np.broadcast_to(density if grid.scattering is None else density * grid.scattering, (*density.shape[:3], 3))
    absorption = scattering
    if grid.scattering is not None or grid.absorption is not None:
        absorption = np.broadcast_to(density if grid.absorption is None else density * grid.absorption, scattering.shape)
    return _Placed(matrix, scattering, absorption, grid.emission)


def _voxels(mesh: ClosedMesh) -> _Placed:
    low, high = mesh.vertices_local.min(axis=0).astype(np.float64), mesh.vertices_local.max(axis=0).astype(np.float64)
    box = np.diag([*np.maximum(0.5 * (high - low), 1e-9), 1.0])
    box[:3, 3] = 0.5 * (low + high)
    matrix = np.asarray(mesh.world_from_local, np.float64) @ box
    lengths = np.linalg.norm(matrix[:3, :3], axis=0)
    resolution = np.clip(np.rint(CELLS * lengths / lengths.max()), 2, CELLS).astype(int)
    filled = np.repeat(_filled(mesh, matrix, tuple(resolution))[..., None], 3, axis=3)
    return _Placed(matrix, filled, filled, filled)


def _filled(mesh: ClosedMesh, matrix: np.ndarray, resolution) -> np.ndarray:
    """The share (z, y, x) float32 of each cell of the box ``matrix`` that is inside ``mesh``: exact along x, by _WITHIN rays along
    y and z each."""
    x, y, z = (int(count) for count in resolution)
    starts = lattice_points(matrix, (1, y * _WITHIN, z * _WITHIN)).reshape(-1, 3) - matrix[:3, 0]
    length = 2.0 * np.linalg.norm(matrix[:3, 0])
    spans = inside_of(mesh).spans(starts, np.broadcast_to(2.0 * matrix[:3, 0] / length, starts.shape), np.full(len(starts), length))
    limits = np.linspace(0.0, length, x + 1)
    filled = np.zeros((len(starts), x))
    for enter, leave in zip(spans.enter.T, spans.leave.T, strict=True):
        filled += np.maximum(np.minimum(leave[:, None], limits[1:]) - np.maximum(enter[:, None], limits[:-1]), 0.0)
    share = filled.reshape(z, _WITHIN, y, _WITHIN, x).mean(axis=(1, 3)) * (x / length)
    return np.minimum(share, 1.0).astype(np.float32)


def _corners(matrix: np.ndarray) -> np.ndarray:
    return transform_points(matrix, np.array([[-1.0, -1, -1], [1, -1, -1], [-1, 1, -1], [1, 1, 1]]))


def _row(medium: Medium, placed: _Placed, scattering: int, absorption: int, emission: int) -> np.ndarray:
    row = np.zeros((TEXELS, 4))
    row[0, :3], row[1, :3], row[2, :3] = medium.scattering, medium.absorption, medium.emission
    row[1, 3] = medium.visible_camera
    if placed.world_from_box is not None:
        row[0, 3] = 1.0
        row[3:6] = np.linalg.inv(placed.world_from_box)[:3]
    if placed.scattering is not None:
        resolution = np.array(placed.scattering.shape[2::-1])
        row[6] = *resolution, scattering
        row[7] = absorption, emission, (2.0 * np.linalg.norm(placed.world_from_box[:3, :3], axis=0) / resolution).min(), 0.0
    for texel, (weight, lobe) in zip((8, 9), lobes(medium.phase), strict=False):
        if isinstance(lobe, DraineLobe):
            row[texel] = weight, lobe.g, lobe.alpha, 1.0 + lobe.alpha * (1.0 + 2.0 * lobe.g**2) / 3.0
        else:
            row[10, 3], row[11, :3] = 1.0, lobe.terms
    row[10, :3] = phase_moments(medium.phase, 2)
    return row.ravel()
