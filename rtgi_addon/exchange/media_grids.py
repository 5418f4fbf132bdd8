"""Media as files and engines hold them: everywhere, or on a grid over a box.

The inside of a closed mesh becomes a grid over the mesh's own box: of one cell where the mesh is that box, which is exact, else of
how much of each cell lies inside. Read trilinearly, such an edge is a cell wide on either side of the surface.
"""

from dataclasses import replace

import numpy as np

from ..numerics import grid as lattice
from ..scene import ClosedMesh, DensityGrid, Medium
from ..transport.media.inside import inside_of

# Cells along the longest side of a mesh's box, and samples along each axis of a cell that the surface passes.
CELLS, SAMPLES = 64, 4
# What a mesh may differ from its box, of the box's volume, and be that box all the same.
_SAME = 1e-4
# What a box that is flat along an axis is given there, of its longest side.
_FLAT = 1e-4


def on_a_grid(medium: Medium) -> Medium:
    """``medium`` without a closed mesh: as it is where it has none, else on a grid; see the module's docstring."""
    if medium.bounds is None:
        return medium
    if medium.grid is not None:
        share = _share_inside(medium.bounds, medium.grid.world_from_local, medium.grid.resolution)
        return _times(medium, medium.grid, share)
    box = _own_box(medium.bounds)
    if _is_box(medium.bounds):
        return replace(medium, bounds=None, grid=DensityGrid(box, np.ones((1, 1, 1), np.float32)))
    sides = np.linalg.norm(box[:3, :3], axis=0)
    resolution = tuple(int(count) for count in np.maximum(np.ceil(CELLS * sides / sides.max() - 1e-6), 1))
    full = DensityGrid(box, np.ones(resolution[::-1], np.float32))
    return _times(medium, full, _share_inside(medium.bounds, box, resolution))


def _times(medium: Medium, grid: DensityGrid, share: np.ndarray) -> Medium:
    """``medium`` on ``grid``, of which ``share`` (nz, ny, nx) of each cell is filled. Density does not dim emission, which is given
    its own grid where there is any."""
    emission = None
    if medium.is_emissive:
        emission = (1.0 if grid.emission is None else grid.emission) * np.repeat(share[..., None], 3, axis=3)
    return replace(medium, bounds=None, grid=replace(grid, density=grid.density * share, emission=emission))


def _own_box(mesh: ClosedMesh) -> np.ndarray:
    """(4, 4): the box along the mesh's own axes that holds it."""
    used = np.asarray(mesh.vertices_local, np.float64)[np.unique(mesh.triangles)]
    low, high = used.min(axis=0), used.max(axis=0)
    half = 0.5 * (high - low)
    matrix = np.eye(4)
    matrix[:3, :3] = np.diag(np.maximum(half, _FLAT * max(half.max(), 1e-30)))
    matrix[:3, 3] = 0.5 * (low + high)
    return np.asarray(mesh.world_from_local, np.float64) @ matrix


def _is_box(mesh: ClosedMesh) -> bool:
    """Whether the mesh is the box that holds it: one that fills all its volume (by the divergence theorem) is."""
    corners = np.asarray(mesh.vertices_local, np.float64)[mesh.triangles]
    used = corners.reshape(-1, 3)
    sides = np.ptp(used, axis=0)
    corners = corners - used.mean(axis=0)
    filled = abs(np.sum(np.einsum("ij,ij->i", corners[:, 0], np.cross(corners[:, 1], corners[:, 2])))) / 6.0
    low, high = used.min(axis=0), used.max(axis=0)
    on_faces = np.any((used - low <= _SAME * sides) | (high - used <= _SAME * sides), axis=1)
    return bool(on_faces.all() and abs(filled - np.prod(sides)) <= _SAME * np.prod(sides))


def _share_inside(mesh: ClosedMesh, world_from_local: np.ndarray, resolution) -> np.ndarray:
    """(nz, ny, nx) float32: how much of each cell of a lattice lies inside ``mesh``; samples are taken where it differs between
    neighbours."""
    inside = inside_of(mesh)
    centres = lattice.lattice_points(world_from_local, resolution)
    share = inside.contains(centres.reshape(-1, 3)).reshape(centres.shape[:3]).astype(np.float32)
    mixed = np.zeros(share.shape, bool)
    for axis, count in enumerate(share.shape):
        along, last = np.moveaxis(share, axis, 0), np.moveaxis(mixed, axis, 0)
        differs = along[1:] != along[:-1]
        last[1:] |= differs
        last[:-1] |= differs
        # The outermost cells are where surfaces lie.
        last[0] |= along[0] > 0
        last[count - 1] |= along[count - 1] > 0
    z, y, x = np.nonzero(mixed)
    steps = (np.arange(SAMPLES) + 0.5) / SAMPLES - 0.5
    offsets = np.stack(np.meshgrid(steps, steps, steps, indexing="ij"), axis=-1).reshape(-1, 3)
    cells = np.stack([x, y, z], axis=-1)[:, None] + offsets
    points = lattice.transform_points(world_from_local, lattice.local_from_lattice(cells, resolution))
    share[z, y, x] = inside.contains(points.reshape(-1, 3)).reshape(len(z), -1).mean(axis=1)
    return share
