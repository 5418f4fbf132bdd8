"""Small operations on arrays of 3-vectors, spelled out by component.

Sums of three products written out give a row the same bits in any chunk, which BLAS and einsum do not promise.
"""

import numpy as np

# Rec.709 luminance weights.
LUMINANCE = np.array([0.2126, 0.7152, 0.0722], np.float32)


def dot(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Dot product (...,) of arrays (..., 3) that broadcast."""
    return a[..., 0] * b[..., 0] + a[..., 1] * b[..., 1] + a[..., 2] * b[..., 2]


def normalized(vectors: np.ndarray) -> np.ndarray:
    """Unit vectors (n, 3); a zero vector stays zero."""
    length = np.sqrt(dot(vectors, vectors))
    return vectors / np.maximum(length, np.finfo(vectors.dtype).tiny)[:, None]


def faced(normals: np.ndarray, directions: np.ndarray) -> np.ndarray:
    """Face normals (n, 3) turned to the side that rays along ``directions`` (n, 3) arrive on."""
    return normals * sides_met(normals, directions)


def sides_met(normals: np.ndarray, directions: np.ndarray) -> np.ndarray:
    """(n, 1) float32: 1 where rays along ``directions`` (n, 3) meet the side that ``normals`` (n, 3) point to, else -1."""
    return -np.copysign(np.float32(1.0), dot(normals, directions))[:, None]


def largest(vectors: np.ndarray) -> np.ndarray:
    """The largest component (...,) of ``vectors`` (..., 3): reducing over an axis of three costs numpy several times as much."""
    return np.maximum(np.maximum(vectors[..., 0], vectors[..., 1]), vectors[..., 2])


def luminance(colour: np.ndarray) -> np.ndarray:
    """Rec.709 luminance (...,) of scene-linear RGB (..., 3)."""
    return colour[..., 0] * LUMINANCE[0] + colour[..., 1] * LUMINANCE[1] + colour[..., 2] * LUMINANCE[2]
