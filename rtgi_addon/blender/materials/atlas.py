"""Lay every polygon flat on its own patch of a square texture."""

import numpy as np

# Texels kept free around a patch, so that bilinear lookups at its border never reach a neighbour.
PADDING = 2


def polygon_uv(positions: np.ndarray, normals: np.ndarray, starts: np.ndarray, counts: np.ndarray, resolution: int) -> np.ndarray:
    """(loops, 2) float32 UV: each polygon projected on its plane, all at one scale, packed on shelves by falling height.

    ``positions`` (loops, 3) are the corners, ``normals`` (polygons, 3) unit; polygon i owns loops ``starts[i]`` to
    ``starts[i] + counts[i]``, which must follow each other without gaps. Polygons of no area get patches of no area.
    """
    polygon = np.repeat(np.arange(len(starts)), counts)
    following = np.arange(len(positions)) + 1
    last = starts + counts - 1
    following[last] = starts
    edges = positions[following] - positions
    longest = _longest(edges, starts)
    tangent = edges[longest]
    tangent /= np.maximum(np.linalg.norm(tangent, axis=1, keepdims=True), 1e-20)
    bitangent = np.cross(normals, tangent)
    flat = np.stack([np.einsum("ij,ij->i", positions, tangent[polygon]), np.einsum("ij,ij->i", positions, bitangent[polygon])], 1)
    low, high = np.minimum.reduceat(flat, starts), np.maximum.reduceat(flat, starts)
    size = high - low
    scale, corner = _fit(size, resolution)
    return ((corner[polygon] + PADDING + (flat - low[polygon]) * scale) / resolution).astype(np.float32)


def _longest(edges: np.ndarray, starts: np.ndarray) -> np.ndarray:
    """(polygons,) the loop index at which each polygon's longest edge begins."""
    length = np.einsum("ij,ij->i", edges, edges)
    order = np.lexsort((-length, np.repeat(np.arange(len(starts)), np.diff(np.append(starts, len(edges))))))
    return order[starts]


def _fit(size: np.ndarray, resolution: int) -> tuple[float, np.ndarray]:
    """The largest scale [texels per metre] at which all patches fit, within 5 %, and their lower left corners in texels."""
    area = float(np.sum(size[:, 0] * size[:, 1]))
    scale = resolution / max(np.sqrt(area), float(size.max()), 1e-9)
    while True:
        corner = _shelves(np.ceil(size * scale).astype(np.int64) + 2 * PADDING, resolution)
        if corner is not None:
            return scale, corner
        scale *= 0.95


def _shelves(box: np.ndarray, resolution: int) -> np.ndarray | None:
    """(n, 2) lower left corners of boxes put side by side on shelves, highest first; None if they do not fit."""
    if box.max() > resolution:
        return None
    order = np.argsort(-box[:, 1], kind="stable")
    corner = np.empty_like(box)
    x = y = height = 0
    for index in order.tolist():
        width, tall = box[index]
        if x + width > resolution:
            x, y, height = 0, y + height, 0
        if height == 0:
            height = tall
            if y + height > resolution:
                return None
        corner[index] = x, y
        x += width
    return corner
