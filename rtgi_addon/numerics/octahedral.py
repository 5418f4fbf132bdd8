"""The octahedral map between the sphere and the square, and the texel tiles that probes store their distances in.

The upper hemisphere fills the inner diamond |x| + |y| ≤ 1 of the square [−1, 1]², the lower one is folded outwards into the
corners. A tile of resolution T has texel (row, column) at y, x = −1 + (2·i + 1)/T, flat index row·T + column.

Sources: Z. Cigolle et al., "Survey of Efficient Representations for Independent Unit Vectors", JCGT 3(2), 2014; the wrap at the
tile's border: Z. Majercik et al., "Dynamic Diffuse Global Illumination with Ray-Traced Irradiance Fields", JCGT 8(2), 2019.
"""

import numpy as np


def encode(directions: np.ndarray) -> np.ndarray:
    """Square coordinates (n, 2) in [−1, 1] of ``directions`` (n, 3), which need not be of unit length."""
    directions = np.asarray(directions)
    xy = directions[..., :2] / np.sum(np.abs(directions), axis=-1, keepdims=True)
    return np.where(directions[..., 2:] < 0, _fold(xy), xy)


def decode(xy: np.ndarray) -> np.ndarray:
    """Unit directions (n, 3) of square coordinates (n, 2) in [−1, 1]: the inverse of ``encode``."""
    xy = np.asarray(xy)
    z = 1.0 - np.abs(xy[..., :1]) - np.abs(xy[..., 1:])
    octahedron = np.concatenate([np.where(z < 0, _fold(xy), xy), z], axis=-1)
    return octahedron / np.linalg.norm(octahedron, axis=-1, keepdims=True)


def texel_index(directions: np.ndarray, resolution: int) -> np.ndarray:
    """Flat texel index (n,) int64 = row·resolution + column of each of ``directions`` (n, 3)."""
    cell = np.floor((encode(directions) + 1.0) * (0.5 * resolution)).astype(np.int64)
    np.clip(cell, 0, resolution - 1, out=cell)
    return cell[..., 1] * resolution + cell[..., 0]


def texel_directions(resolution: int) -> np.ndarray:
    """Unit directions (resolution², 3) float32 at the texel centres, in flat index order."""
    centres = (2.0 * np.arange(resolution) + 1.0) / resolution - 1.0
    y, x = np.meshgrid(centres, centres, indexing="ij")
    return decode(np.stack([x.ravel(), y.ravel()], axis=-1)).astype(np.float32)


def texel_solid_angles(resolution: int) -> np.ndarray:
    """Exact solid angle (resolution²,) float64 of every texel [sr]; they sum to 4π.

    Half-texel cells cut along their diagonal never cross a fold of the map, so each triangle lies in one face of the
    octahedron and its solid angle is that of a spherical triangle.
    """
    edges = np.arange(2 * resolution + 1) / resolution - 1.0
    y, x = np.meshgrid(edges, edges, indexing="ij")
    corners = decode(np.stack([x, y], axis=-1))
    lower, upper = corners[:-1], corners[1:]
    a, b, c, d = lower[:, :-1], lower[:, 1:], upper[:, 1:], upper[:, :-1]
    # |x| + |y| = 1 runs from b to d where x and y have one sign, from a to c where they differ.
    falling = _triangle_solid_angle(a, b, d) + _triangle_solid_angle(b, c, d)
    rising = _triangle_solid_angle(a, b, c) + _triangle_solid_angle(a, c, d)
    centre = (edges[:-1] + edges[1:]) / 2.0
    cells = np.where(centre[:, None] * centre[None, :] > 0, falling, rising)
    return cells.reshape(resolution, 2, resolution, 2).sum(axis=(1, 3)).ravel()


def bilinear(directions: np.ndarray, resolution: int) -> tuple[np.ndarray, np.ndarray]:
    """The four texels about each of ``directions`` (n, 3): flat indices (n, 4) int64 and weights (n, 4) that sum to 1.

    Past the tile's border the map goes on at the mirrored texel, so the interpolation is continuous over the whole sphere.
    """
    position = (encode(directions) + 1.0) * (0.5 * resolution) - 0.5
    base = np.floor(position)
    fraction = position - base
    low = base.astype(np.int64)
    columns, rows = [], []
    weights = np.empty((*position.shape[:-1], 4), position.dtype)
    for corner in range(4):
        i, j = corner & 1, corner >> 1
        columns.append(low[..., 0] + i)
        rows.append(low[..., 1] + j)
        along_x = fraction[..., 0] if i else 1.0 - fraction[..., 0]
        along_y = fraction[..., 1] if j else 1.0 - fraction[..., 1]
        weights[..., corner] = along_x * along_y
    column, row = np.stack(columns, axis=-1), np.stack(rows, axis=-1)
    outside_x, outside_y = (column < 0) | (column >= resolution), (row < 0) | (row >= resolution)
    last = resolution - 1
    wrapped_row = np.where(outside_x, last - np.clip(row, 0, last), np.clip(row, 0, last))
    wrapped_column = np.where(outside_y, last - np.clip(column, 0, last), np.clip(column, 0, last))
    return wrapped_row * resolution + wrapped_column, weights


def _fold(xy: np.ndarray) -> np.ndarray:
    """Reflect across the nearest edge of the diamond |x| + |y| = 1; its own inverse."""
    return (1.0 - np.abs(xy[..., ::-1])) * np.where(xy < 0, -1.0, 1.0).astype(xy.dtype)


def _triangle_solid_angle(a: np.ndarray, b: np.ndarray, c: np.ndarray) -> np.ndarray:
    """Solid angle of the spherical triangle of unit vectors (Van Oosterom & Strackee 1983)."""
    numerator = np.abs(np.sum(a * np.cross(b, c), axis=-1))
    denominator = 1.0 + np.sum(a * b, axis=-1) + np.sum(b * c, axis=-1) + np.sum(c * a, axis=-1)
    return 2.0 * np.arctan2(numerator, denominator)
