"""Which cell of a volume a surface stands before, and which cells around it are open to that one.

A surface lies anywhere in a cell, its block stands on the cell's faces: what lies before one may lie behind the other. Light is
put into, and taken from, the cell whose centre is nearest to a point half a cell before the surface, on the surface's own side of
its plane and of the walls beside it. ``faces`` (6, nz, ny, nx) float32 of a volume (`geometry_volume`) say what the face above
each cell along x, y and z lets through, and where, in cells above that face's plane, the surface crosses that stands on it.
include/standing.glsl is the twin.
"""

import numpy as np

# A cell's centre counts as before a plane from this many cells on, and a point as beyond a wall; a centre that is no farther before
# the plane than the second may lie behind a curved surface.
BEFORE_CELLS, HARDLY_BEFORE = 1e-3, 0.05
# Below this share let through, a face is a wall with two sides.
WALL = 0.5
# The cell that a surface stands before counts at least this much, wherever its centre.
LEAST_SHARE = 1e-4
_CORNERS = np.array([[corner & 1, corner >> 1 & 1, corner >> 2] for corner in range(8)])


def standing_cells(faces: np.ndarray | None, low: np.ndarray, fraction: np.ndarray, points: np.ndarray,
                   normals: np.ndarray | None) -> np.ndarray:
    """The cells (n, 3) int that surfaces stand before, of the eight from ``low`` (n, 3) to the next along each axis.

    ``fraction`` (n, 3) is the way from ``low``'s centre to the next; ``points`` (n, 3), in cells, and ``normals`` (n, 3) are the
    surfaces': None for free points, before which everything is.
    """
    best, chosen = np.full(len(low), -1.0), low.copy()
    for corner in _CORNERS:
        cell = low + corner
        weight = np.prod(np.where(corner == 1, fraction, 1.0 - fraction), axis=1)
        better = (weight > best) & (_height(cell, points, normals) > BEFORE_CELLS)
        best[better], chosen[better] = weight[better], cell[better]
    if faces is None:
        return chosen
    for axis in range(3):
        moved = chosen.copy()
        side = _side(faces, low, points, axis)
        moved[:, axis] = np.where(side == 0, moved[:, axis], low[:, axis] + (side > 0))
        kept = _height(moved, points, normals) > BEFORE_CELLS
        chosen[kept] = moved[kept]
    for axis in range(3 if normals is not None else 0):
        # Of two cells before the plane with a wall between them, the nearer one is behind the wall.
        ahead, face = chosen.copy(), chosen.copy()
        upward = normals[:, axis] > 0
        ahead[:, axis] = low[:, axis] + upward
        face[:, axis] = low[:, axis]
        hidden = (_face(faces, face, axis)[0] < WALL) & (_height(chosen, points, normals) < HARDLY_BEFORE)
        chosen[hidden] = ahead[hidden]
    return chosen


def _side(faces: np.ndarray, low: np.ndarray, points: np.ndarray, axis: int) -> np.ndarray:
    """On which side (n,) of the walls across ``axis`` between the eight cells a point lies: above more of the four than below
    (positive), or below more than above."""
    side = np.zeros(len(low), np.int64)
    for corner in _CORNERS[_CORNERS[:, axis] == 0]:
        let_through, crossing = _face(faces, low + corner, axis)
        above = points[:, axis] - (low[:, axis] + 1.0 + crossing)
        side += np.where((let_through < WALL) & (np.abs(above) > BEFORE_CELLS), np.sign(above), 0).astype(np.int64)
    return side


def open_weights(faces: np.ndarray | None, low: np.ndarray, fraction: np.ndarray, points: np.ndarray, normals: np.ndarray | None,
                 resolution) -> tuple[np.ndarray, np.ndarray]:
    """Indices (n, 8) of cells and weights (n, 8) float32, which sum to 1 or are all 0: trilinear among those of the eight from
    ``low`` on that lie before the surface, each as far as the faces on the way from the cell that the surface stands before let
    light through."""
    standing = standing_cells(faces, low, fraction, points, normals)
    nx, ny, _ = resolution
    indices, weights = [], []
    for corner in _CORNERS:
        cell = np.minimum(low + corner, np.asarray(resolution) - 1)
        weight = np.prod(np.where(corner == 1, fraction, 1.0 - fraction), axis=1)
        if faces is not None:
            weight = weight * _open_way(faces, standing, cell)
        weight = weight + LEAST_SHARE * np.all(cell == standing, axis=1)
        weights.append(np.where(_height(cell, points, normals) > BEFORE_CELLS, weight, 0.0))
        indices.append((cell[:, 2] * ny + cell[:, 1]) * nx + cell[:, 0])
    weights = np.stack(weights, axis=1)
    # Where there is no cell before the surface, nothing is left.
    weights /= np.maximum(weights.sum(axis=1, keepdims=True), 1e-6)
    return np.stack(indices, axis=1), weights.astype(np.float32)


def _height(cells: np.ndarray, points: np.ndarray, normals: np.ndarray | None) -> np.ndarray:
    """How far (n,) [cells] the centres of ``cells`` (n, 3) lie before the surfaces' planes."""
    if normals is None:
        return np.full(len(cells), np.inf)
    return np.einsum("na,na->n", cells + 0.5 - points, normals)


def _open_way(faces: np.ndarray, start: np.ndarray, end: np.ndarray) -> np.ndarray:
    """Share (n,) let through from cells ``start`` to their neighbours ``end``, along x, then y, then z."""
    share, at = np.ones(len(start)), start.copy()
    for axis in range(3):
        step = end[:, axis] - at[:, axis]
        face = at.copy()
        face[:, axis] += np.minimum(step, 0)
        share *= np.where(step == 0, 1.0, _face(faces, face, axis)[0])
        at[:, axis] = end[:, axis]
    return share


def _face(faces: np.ndarray, cells: np.ndarray, axis: int) -> tuple[np.ndarray, np.ndarray]:
    """What the faces above ``cells`` (n, 3) along ``axis`` let through, and where they are crossed; outside the volume they are
    open."""
    count = np.array(faces.shape[:0:-1])
    inside = np.all((cells >= 0) & (cells < count), axis=1)
    x, y, z = np.clip(cells, 0, count - 1).T
    return np.where(inside, faces[axis, z, y, x], 1.0), np.where(inside, faces[3 + axis, z, y, x], 0.0)
