"""Where in a pixel, and around it, frames are sampled: as often as the pixel filter weighs it, so that their mean is filtered."""

from functools import cache

import numpy as np

from ...numerics.sampling import sobol_owen

# A Blackman-Harris window over this many pixels: what Cycles makes of Blender's default width of 1.5 (scene/film.cpp).
WIDTH = 3.0
_STEPS = 256
_SEED = 0


@cache
def _inverse() -> tuple[np.ndarray, np.ndarray]:
    """The window's cumulative sum and the offsets [pixels] it belongs to."""
    x = (np.arange(_STEPS) + 0.5) / _STEPS
    window = 0.35875 - 0.48829 * np.cos(2 * np.pi * x) + 0.14128 * np.cos(4 * np.pi * x) - 0.01168 * np.cos(6 * np.pi * x)
    cumulative = np.concatenate([[0.0], np.cumsum(window)])
    return cumulative / cumulative[-1], np.linspace(-0.5 * WIDTH, 0.5 * WIDTH, _STEPS + 1)


def sample_offset(index: int) -> np.ndarray:
    """Offset (2,) [pixels] of sample number ``index`` of a picture; the first is taken at the pixels' centres."""
    return filter_offset(sobol_owen(1, 2, _SEED, start=index)[0]) if index else np.zeros(2)


def filter_offset(u: np.ndarray) -> np.ndarray:
    """Offset (2,) [pixels] for ``u`` (2,) in [0, 1)."""
    cumulative, offsets = _inverse()
    return np.interp(u, cumulative, offsets)
