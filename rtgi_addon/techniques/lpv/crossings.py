"""Which faces between cells surfaces close, by rays from cell to cell.

A face is open as far as there is a way through it: from the centre of the cell on one side across to one of a few places beside
it, on to the same place in the next cell, and to that one's centre. A place that the centre does not see is another room's and
does not count. So centres on two sides of a closed surface are never joined, thin and slanted as it may be, while a pole or the
edge of a window closes its share of a face.
"""

import numpy as np

from ...transport.context import LightContext
from ...transport.parallel import parallel_for
from .geometry_volume import ROWS, GeometryVolume, Surfels, means, plane_shape, with_area
from .grid import LpvGrid

# Places along either side of a face; odd, so that the centre is one.
PLACES = 3


def trace_faces(context: LightContext, grid: LpvGrid, surfels: Surfels) -> GeometryVolume:
    """The geometry volume of all surfaces in ``grid``. ``surfels`` (`surfels.peel`) say near which cells there are any."""
    near = _near(grid, surfels)
    jobs = [(axis, u, v) for axis in range(3) for u in range(PLACES) for v in range(PLACES)]
    found = [np.flatnonzero(_beside(near, axis)) for axis in range(3)]
    traced = parallel_for(lambda job: _trace(context, grid, found[jobs[job][0]], *jobs[job]), len(jobs), context.threads)
    planes = []
    for axis, faces in enumerate(found):
        shape = plane_shape(grid, axis)
        counted, passed, sums = (sum(part[column] for job, part in zip(jobs, traced, strict=True) if job[0] == axis)
                                 for column in range(3))
        closed = np.zeros(np.prod(shape))
        closed[faces] = 1.0 - passed / counted
        whole = np.zeros((ROWS, len(closed)))
        whole[:, faces] = sums
        planes.append(means(whole.reshape(ROWS, *shape), closed.reshape(shape)))
    return with_area(grid, tuple(planes), surfels, lambda points, others: _sees(context, points, others))


def _near(grid: LpvGrid, surfels: Surfels) -> np.ndarray:
    """(nz + 2, ny + 2, nx + 2) bool: cells, and those around the volume, that have surfels in or beside them."""
    near = np.zeros(tuple(count + 4 for count in grid.shape), bool)
    cells = np.floor(grid.cells_of(surfels.positions)).astype(np.int64) + 2
    x, y, z = cells[np.all((cells >= 1) & (cells < np.array(grid.resolution) + 3), axis=1)].T
    near[z, y, x] = True
    for dimension in range(3):
        near = near | np.roll(near, 1, dimension) | np.roll(near, -1, dimension)
    return near[1:-1, 1:-1, 1:-1]


def _beside(near: np.ndarray, axis: int) -> np.ndarray:
    """Faces across ``axis`` with such a cell on either side, in the order of GeometryVolume.planes, flat."""
    inner = tuple(slice(None) if 2 - axis == dimension else slice(1, -1) for dimension in range(3))
    cells = np.moveaxis(near[inner], 2 - axis, 0)
    return np.ascontiguousarray(np.moveaxis(cells[:-1] | cells[1:], 0, 2 - axis)).ravel()


def _trace(context, grid, faces, axis, u, v) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """For ``faces`` across ``axis``, by the place (u, v): which count (n,), which of them let it through (n,), and of the surfaces
    that close the others the sums (ROWS, n)."""
    shape = plane_shape(grid, axis)
    # Half a cell below each plane lies the centre of the lower cell.
    position = np.stack([faces % shape[2], faces // shape[2] % shape[1], faces // (shape[1] * shape[2])], axis=1) + 0.5
    position[:, axis] -= 1.0
    place = np.zeros(3)
    place[[(axis + 1) % 3, (axis + 2) % 3]] = (np.array([u, v]) - (PLACES - 1) / 2) / PLACES
    lower, step = np.asarray(grid.corner) + position * grid.cell, np.eye(3)[axis] * grid.cell
    aside = place * grid.cell
    counted = np.ones(len(faces), bool)
    if aside.any():
        counted = (_hits(context, lower, aside).primitive < 0) & (_hits(context, lower + step, aside).primitive < 0)
    below, above = _hits(context, lower + aside, step), _hits(context, lower + step + aside, -step)
    rows = np.flatnonzero(counted & ((below.primitive >= 0) | (above.primitive >= 0)))
    sides = [(hits.primitive[rows], hits.u[rows], hits.v[rows]) for hits in (below, above)]
    heights = [below.t[rows] / grid.cell - 0.5, 0.5 - above.t[rows] / grid.cell]
    # What only one of two rays along the same line meets, at an edge, is the other's too.
    met = [side[0] >= 0 for side in sides]
    sides = [[np.where(there, mine, others) for mine, others in zip(side, sides[1 - number], strict=True)]
             for number, (side, there) in enumerate(zip(sides, met, strict=True))]
    heights = [np.where(there, heights[number], heights[1 - number]) for number, there in enumerate(met)]
    sums = np.zeros((ROWS, len(faces)))
    sums[:, rows] = [np.ones(len(rows)), np.mean(heights, axis=0), *_side(context, sides[0], axis, 1.0),
                     *_side(context, sides[1], axis, -1.0)]
    passed = counted.copy()
    passed[rows] = False
    return counted, passed, sums


def _side(context, hits, axis: int, way: float) -> list[np.ndarray]:
    """The columns of SIDE_ROWS of ``hits`` (primitives, u, v), met on a way up (1) or down (-1) the axis."""
    primitive, u, v = hits
    normals = context.geometry.normals_world[primitive]
    cosine = -normals[:, axis] * np.float32(way)
    albedo = context.surfaces.albedo_of_side(primitive, u, v, cosine)
    normals = normals * np.where(normals[:, axis] < 0, np.float32(-1.0), np.float32(1.0))[:, None]
    return [np.abs(normals).sum(axis=1), *normals.T, *albedo.T]


def _sees(context, points: np.ndarray, others: np.ndarray) -> np.ndarray:
    """(n,) bool: nothing stands between ``points`` and ``others``."""
    ways = others - points
    lengths = np.linalg.norm(ways, axis=1)
    directions = (ways / np.maximum(lengths, np.finfo(np.float32).tiny)[:, None]).astype(np.float32)
    return context.tracers.diffuse.intersect(points.astype(np.float32), directions, lengths.astype(np.float32)).primitive < 0


def _hits(context, origins: np.ndarray, way: np.ndarray):
    """What lies first on the ``way`` (3,) from each of ``origins`` (n, 3)."""
    length = float(np.linalg.norm(way))
    directions = np.tile((way / length).astype(np.float32), (len(origins), 1))
    return context.tracers.diffuse.intersect(origins.astype(np.float32), directions, np.full(len(origins), length, np.float32))
