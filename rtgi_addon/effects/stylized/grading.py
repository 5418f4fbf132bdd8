"""Grading: contrast about middle grey, saturation and tint of the whole picture, before lines."""

import numpy as np

from ...transport.vectors import luminance
from .shading import saturated

MIDDLE_GREY = 0.18


def changes_colours(values: dict) -> bool:
    """False if pictures stay as they are."""
    return values["contrast"] != 1.0 or values["saturation"] != 1.0 or tuple(values["tint"]) != (1.0, 1.0, 1.0)


def graded(picture: np.ndarray, values: dict) -> np.ndarray:
    """``picture`` (h, w, 4) graded: luminance Y becomes g·(Y/g)^contrast with its colour kept."""
    colour = picture[..., :3]
    if values["contrast"] != 1.0:
        grey = np.maximum(luminance(colour), np.float32(1e-12)) / np.float32(MIDDLE_GREY)
        colour = colour * (grey ** np.float32(values["contrast"] - 1.0))[..., None]
    colour = saturated(colour, values["saturation"]) * np.float32(values["tint"])
    return np.concatenate([colour, picture[..., 3:]], axis=-1)
