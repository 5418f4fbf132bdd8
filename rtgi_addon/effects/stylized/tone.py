"""Bands of light: what quantizes tones, and how softly (lecture, cel shading; thresholds widened by the pixel's own change)."""

import numpy as np


def smooth_step(x: np.ndarray) -> np.ndarray:
    """0 below 0, 1 above 1, 3x² − 2x³ between: GLSL's smoothstep(0, 1, x)."""
    x = np.clip(x, 0.0, 1.0)
    return x * x * (3 - 2 * x)


def banded(tone: np.ndarray, bands: int, width) -> np.ndarray:
    """``tone`` in ``bands`` equal treads from 0 to 1, of the shape of ``tone``; the top one holds all that is brighter.

    A tread has the tone of its middle, so that the mean over evenly spread tones stays what it was (treads at a band's lower end
    lose half a band). Steps are ``width`` wide [tone], at most a band, centred on the borders.
    """
    if bands == 1:
        return np.full_like(tone, 0.5)
    place = tone * np.float32(bands)
    border = np.clip(np.floor(place + np.float32(0.5)), 1, bands - 1)
    width = np.clip(np.asarray(width, np.float32) * np.float32(bands), 1e-6, 1.0)
    return (border - np.float32(0.5) + smooth_step((place - border) / width + np.float32(0.5))) / np.float32(bands)


def pixel_change(values: np.ndarray, region: np.ndarray) -> np.ndarray:
    """How much ``values`` (h, w) change over a pixel: the largest difference to a neighbour of the same ``region`` (h, w) int."""
    change = np.zeros_like(values)
    for axis in (0, 1):
        here, there = [slice(None)] * 2, [slice(None)] * 2
        here[axis], there[axis] = slice(None, -1), slice(1, None)
        here, there = tuple(here), tuple(there)
        step = np.abs(values[there] - values[here]) * (region[there] == region[here])
        np.maximum(change[here], step, out=change[here])
        np.maximum(change[there], step, out=change[there])
    return change
