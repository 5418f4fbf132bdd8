"""Lay every polygon flat on its own patch of a square texture."""

import numpy as np

# Texels kept free around a patch, so that bilinear lookups at its border never reach a neighbour.
PADDING = 2
# The least texels along a side of a patch: with fewer, a thin polygon may cover no texel's centre and stay unbaked.
MINIMUM = 3
# Factor on the scale of patches that did not fit, for the next try.
_SHRINK = 0.95
# What lengths are divided by at least.
_TINY_LENGTH, _TINY_SIZE = 1e-20, 1e-9


def polygon_uv(positions: np.ndarray, normals: np.ndarray, starts: np.ndarray, counts: np.ndarray, resolution: int) -> np.ndarray:
    """(loops, 2) float32 UV: each polygon projected on its plane, all at one scale (but for tiny ones, which are stretched),
    packed on shelves by falling height.

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
    tangent /= np.maximum(np.linalg.norm(tangent, axis=1, keepdims=True), _TINY_LENGTH)
    bitangent = np.cross(normals, tangent)
    flat = np.stack([np.einsum("ij,ij->i", positions, tangent[polygon]), np.einsum("ij,ij->i", positions, bitangent[polygon])], 1)
    low, high = np.minimum.reduceat(flat, starts), np.maximum.reduceat(flat, starts)
    size = high - low
    extent, corner = _fit(size, resolution)
    scale = np.divide(extent, size, out=np.zeros_like(size), where=size > 0)
    return ((corner[polygon] + PADDING + (flat - low[polygon]) * scale[polygon]) / resolution).astype(np.float32)


def _longest(edges: np.ndarray, starts: np.ndarray) -> np.ndarray:
    """(polygons,) the loop index at which each polygon's longest edge begins."""
    length = np.einsum("ij,ij->i", edges, edges)
    order = np.lexsort((-length, np.repeat(np.arange(len(starts)), np.diff(np.append(starts, len(edges))))))
    return order[starts]


def _fit(size: np.ndarray, resolution: int) -> tuple[np.ndarray, np.ndarray]:
    """((n, 2) extents, (n, 2) lower left corners) of patches in texels, at the largest scale that fits, within 5 %."""
    border = 2 * PADDING + 1.0
    area, edge = np.sum(size[:, 0] * size[:, 1]), border * np.sum(size)
    free = max(resolution**2 - len(size) * border**2, 1.0)
    scale = (np.sqrt(edge**2 + 4.0 * area * free) - edge) / (2.0 * area) if area > 0 else 1.0  # where all boxes fill the square
    scale = min(scale, resolution / max(float(size.max()), _TINY_SIZE))
    while True:
        extent = np.maximum(size * scale, MINIMUM)
        corner = _shelves(np.ceil(extent).astype(np.int64) + 2 * PADDING, resolution)
        if corner is not None:
            return extent, corner
        if extent.max() <= MINIMUM:
            raise ValueError(f"{len(size)} patches do not fit on {resolution}² texels")
        scale *= _SHRINK


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
