"""Uniform directions in a cone: what a sun's disk and a lamp's sphere fill."""

import numpy as np

from ...numerics.sampling import disk_from_square, frame
from ..vectors import normalized


def uniform_in_cone(axis: np.ndarray, one_minus_cos: np.ndarray, uv: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Uniform directions in a cone about ``axis`` (n, 3), and their cosines; 1 − cos keeps small angles exact."""
    xy = disk_from_square(uv)
    squared = xy[:, 0] * xy[:, 0] + xy[:, 1] * xy[:, 1]
    cosine = 1.0 - squared * one_minus_cos
    xy = xy * np.sqrt(np.maximum(one_minus_cos * (2.0 - one_minus_cos * squared), 0.0))[:, None]
    tangent, bitangent = frame(axis)
    return normalized(tangent * xy[:, :1] + bitangent * xy[:, 1:] + axis * cosine[:, None]), cosine
