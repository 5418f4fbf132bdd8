"""Numbers as halves over a power of two: Godot reads halves below 2^-14 as 0, which of dim scenes would be much."""

import numpy as np

# The exponent of what the largest number of a texture is stored as at most.
_LARGEST = 15


def half_scale(values: np.ndarray) -> float:
    """What to store ``values`` over as halves, 1 at most: a power of two, which loses nothing, for which all that counts beside the
    largest is above 2^-14."""
    return 2.0 ** min(int(np.frexp(np.abs(values).max(initial=0.0))[1]) - _LARGEST, 0)


def over(values: np.ndarray, scale) -> np.ndarray:
    """``values`` float16 over a ``half_scale`` (or several, that broadcast)."""
    return (values / np.asarray(scale, np.float32)).astype(np.float16)
