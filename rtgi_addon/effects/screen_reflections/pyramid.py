"""Pyramids of a picture: the least depth of every block of pixels, for searches that step over what lies in front of all of it."""

import numpy as np

from ..frame import NOWHERE


def min_pyramid(depth: np.ndarray) -> list[np.ndarray]:
    """``depth`` (h, w) and its levels up to a single texel: texel (y, x) of level l has the least of the pixels whose coordinates
    shifted right by l are (y, x). Sizes are rounded up, so that the last row and column of odd sizes are in it."""
    levels = [np.asarray(depth, np.float32)]
    while max(levels[-1].shape) > 1:
        below = levels[-1]
        even = np.full([side + side % 2 for side in below.shape], np.float32(NOWHERE))
        even[:below.shape[0], :below.shape[1]] = below
        levels.append(even.reshape(even.shape[0] // 2, 2, even.shape[1] // 2, 2).min(axis=(1, 3)))
    return levels


def atlas_places(size: tuple[int, int]) -> list[tuple[int, int, int]]:
    """Left edge, width and height of every level from the first on in one texture, side by side, for ``size`` (width, height)."""
    width, height, left, places = *size, 0, []
    while max(width, height) > 1:
        width, height = (width + 1) // 2, (height + 1) // 2
        places.append((left, width, height))
        left += width
    return places
