"""Small operations on arrays of 3-vectors, spelled out by component.

Sums of three products written out give a row the same bits in any chunk, which BLAS and einsum do not promise.
"""

import numpy as np

# Rec.709 luminance weights.
LUMINANCE = np.array([0.2126, 0.7152, 0.0722], np.float32)


def dot(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Row-wise dot product (n,) of (n, 3) arrays; either may have a single row."""
    return a[:, 0] * b[:, 0] + a[:, 1] * b[:, 1] + a[:, 2] * b[:, 2]


def normalized(vectors: np.ndarray) -> np.ndarray:
    """Unit vectors (n, 3); a zero vector stays zero."""
    length = np.sqrt(dot(vectors, vectors))
    return vectors / np.maximum(length, np.finfo(vectors.dtype).tiny)[:, None]


def luminance(colour: np.ndarray) -> np.ndarray:
    """Rec.709 luminance (...,) of scene-linear RGB (..., 3)."""
    return colour[..., 0] * LUMINANCE[0] + colour[..., 1] * LUMINANCE[1] + colour[..., 2] * LUMINANCE[2]
