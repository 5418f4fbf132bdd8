"""The octahedral map between the sphere and the square, and the texel tiles that probes store their distances in.

The upper hemisphere fills the inner diamond |x| + |y| ≤ 1 of the square [−1, 1]², the lower one is folded outwards into the
corners. A tile of resolution T has texel (row, column) at y, x = −1 + (2·i + 1)/T, flat index row·T + column.

Sources: Z. Cigolle et al., "Survey of Efficient Representations for Independent Unit Vectors", JCGT 3(2), 2014; the wrap at the
tile's border: Z. Majercik et al., "Dynamic Diffuse Global Illumination with Ray-Traced Irradiance Fields", JCGT 8(2), 2019.
"""

import numpy as np

from .. import kernels


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
    if kernels.is_available() and directions.dtype == np.float32 and directions.ndim == 2:
        cells = np.empty(len(directions), np.int32)
        kernels.call("octahedral_cells", len(directions), np.ascontiguousarray(directions), resolution, cells)
        return cells.astype(np.int64)
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


def add_border(tiles: np.ndarray) -> np.ndarray:
    """``tiles`` (…, T, T, c) with one more texel on every side, (…, T + 2, T + 2, c): where the map goes on past its edge.

    Beyond an edge lies the texel mirrored along that edge, beyond a corner the opposite corner, so that plain bilinear
    interpolation of the result is continuous over the whole sphere.
    """
    resolution = tiles.shape[-2]
    row, column = np.meshgrid(np.arange(-1, resolution + 1), np.arange(-1, resolution + 1), indexing="ij")
    last = resolution - 1
    outside_row, outside_column = (row < 0) | (row > last), (column < 0) | (column > last)
    row, column = np.clip(row, 0, last), np.clip(column, 0, last)
    texel = np.where(outside_column, last - row, row) * resolution + np.where(outside_row, last - column, column)
    # As one index of texels this takes half the time of two.
    flat = np.take(tiles.reshape(*tiles.shape[:-3], resolution**2, tiles.shape[-1]), texel.ravel(), axis=-2)
    return flat.reshape(*tiles.shape[:-3], resolution + 2, resolution + 2, tiles.shape[-1])


def bilinear(directions: np.ndarray, resolution: int) -> tuple[np.ndarray, np.ndarray]:
    """Where to read tiles of ``resolution`` T that ``add_border`` has widened: the flat index (…) int32 of the first of the four
    texels about each of ``directions`` (…, 3), and the fractions (…, 2) of the way from it to the next column and row.

    The others follow at + 1, + (T + 2) and + (T + 3).
    """
    position = (encode(directions) + 1.0) * (0.5 * resolution) + 0.5
    low = np.clip(position.astype(np.int32), 0, resolution)
    return low[..., 1] * (resolution + 2) + low[..., 0], position - low.astype(position.dtype)


def _fold(xy: np.ndarray) -> np.ndarray:
    """Reflect across the nearest edge of the diamond |x| + |y| = 1; its own inverse."""
    return (1.0 - np.abs(xy[..., ::-1])) * np.where(xy < 0, -1.0, 1.0).astype(xy.dtype)


def _triangle_solid_angle(a: np.ndarray, b: np.ndarray, c: np.ndarray) -> np.ndarray:
    """Solid angle of the spherical triangle of unit vectors (Van Oosterom & Strackee 1983)."""
    numerator = np.abs(np.sum(a * np.cross(b, c), axis=-1))
    denominator = 1.0 + np.sum(a * b, axis=-1) + np.sum(b * c, axis=-1) + np.sum(c * a, axis=-1)
    return 2.0 * np.arctan2(numerator, denominator)
