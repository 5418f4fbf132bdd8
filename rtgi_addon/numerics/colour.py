"""The sRGB transfer function (IEC 61966-2-1), both ways."""

import numpy as np


def linear_from_srgb(encoded: np.ndarray) -> np.ndarray:
    """Scene-linear values (…) float32 of ``encoded`` ones."""
    return np.where(encoded <= 0.04045, encoded / 12.92, ((np.maximum(encoded, 0.0) + 0.055) / 1.055) ** 2.4).astype(np.float32)


def srgb_from_linear(linear: np.ndarray) -> np.ndarray:
    """The inverse of ``linear_from_srgb``, as float32."""
    return np.where(linear <= 0.0031308, linear * 12.92, 1.055 * np.maximum(linear, 0.0) ** (1 / 2.4) - 0.055).astype(np.float32)
