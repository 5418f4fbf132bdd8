"""A grid of directions over a hemisphere, read bilinearly: the square [−1, 1]² folded onto a dome.

After the hemi-octahedral map of Z. Cigolle et al., "Survey of Efficient Representations for Independent Unit Vectors", JCGT 3(2),
2014: (x, y)/(|x| + |y| + |z|) lies in the diamond |x| + |y| ≤ 1, which is turned by 45° into the square. Here the diamond's
1 − |x| − |y| is (|z|/(|x| + |y| + |z|))^(1/POWER): nodes are closer to each other near the horizon, where a low sun lights another
strip of a wall with every degree. Nodes lie on the square's border too, which is the horizon; with ``side`` N node (row, column) is
at v, u = −1 + 2·i/(N − 1), flat index row·N + column. With
``below`` a second dome of N² nodes follows, of the directions with −z.
"""

import numpy as np

POWER = 1.5


def directions(side: int, below: bool = False) -> np.ndarray:
    """Unit directions (side², 3) float64 of the nodes, or (2·side², 3) with those ``below``."""
    return _at(2.0 * np.arange(side) / (side - 1) - 1.0, below)


def samples(side: int, fineness: int, below: bool = False) -> tuple[np.ndarray, np.ndarray]:
    """Directions all over a dome of ``side``² nodes, and how to fit nodes to what is found in them.

    The directions (m², 3), or (2·m², 3) with those ``below``, m = ``fineness``·(side − 1) + 2, lie in rows and columns as nodes do,
    ``fineness``² in each square between four nodes, and on its border, the horizon, where nothing beyond holds the fit. Nodes
    F·V·Fᵀ, of the values V (m, m) in one dome's directions and the matrix F (side, m), are those whose bilinear reading is nearest
    to V, in squares.
    """
    places = np.concatenate([[0.0], (np.arange(fineness * (side - 1)) + 0.5) / fineness, [side - 1.0]])
    tents = np.maximum(1.0 - np.abs(places[:, None] - np.arange(side)), 0.0)
    return _at(2.0 * places / (side - 1) - 1.0, below), np.linalg.solve(tents.T @ tents, tents.T)


def _at(steps: np.ndarray, below: bool) -> np.ndarray:
    """Directions of the places (v, u) of the square that have both from ``steps`` (s,), v first."""
    v, u = np.meshgrid(steps, steps, indexing="ij")
    x, y = 0.5 * (u + v).ravel(), 0.5 * (u - v).ravel()
    away = np.abs(x) + np.abs(y)
    z = np.maximum(1.0 - away, 0.0) ** POWER
    scale = (1.0 - z) / np.maximum(away, np.finfo(np.float64).tiny)
    upper = np.stack([scale * x, scale * y, z], axis=1)
    upper /= np.linalg.norm(upper, axis=1, keepdims=True)
    return np.concatenate([upper, upper * (1.0, 1.0, -1.0)]) if below else upper


def weights(towards: np.ndarray, side: int, below: bool = False) -> tuple[np.ndarray, np.ndarray]:
    """Nodes (n, 4) int64 about each of the unit directions ``towards`` (n, 3), and their bilinear weights (n, 4) float64, which sum
    to 1, or to 0 for directions with z < 0 where nothing is ``below``."""
    towards = np.asarray(towards, np.float64)
    flat = towards / np.sum(np.abs(towards), axis=1, keepdims=True)
    away = np.maximum(np.sum(np.abs(flat[:, :2]), axis=1, keepdims=True), np.finfo(np.float64).tiny)
    xy = flat[:, :2] * ((1.0 - np.abs(flat[:, 2:]) ** (1.0 / POWER)) / away)
    uv = np.stack([xy[:, 0] + xy[:, 1], xy[:, 0] - xy[:, 1]], axis=1)
    position = (np.clip(uv, -1.0, 1.0) + 1.0) * (0.5 * (side - 1))
    low = np.minimum(position.astype(np.int64), side - 2)
    (fu, fv), (column, row) = (position - low).T, low.T
    node = row * side + column
    under = towards[:, 2] < 0
    index = np.stack([node, node + 1, node + side, node + side + 1], axis=1) + np.where(under & below, side * side, 0)[:, None]
    share = np.stack([(1 - fu) * (1 - fv), fu * (1 - fv), (1 - fu) * fv, fu * fv], axis=1)
    if not below:
        share[under] = 0.0
    return index, share
