"""The file's working colour space: what scene-linear RGB means in it (Rec.709 up to Blender 4.5, the user's choice from 5.0)."""

import bpy
import numpy as np
from mathutils import Color

from ..transport.vectors import LUMINANCE

REC709 = "Linear Rec.709"


def working_space() -> str:
    """Blender's name of the working space."""
    return getattr(getattr(bpy.data, "colorspace", None), "working_space", REC709)


def working_from_rec709() -> np.ndarray | None:
    """(3, 3) float32 that turns linear Rec.709 into scene-linear RGB; None where they are the same."""
    if working_space() == REC709:
        return None
    return np.array([Color(unit).from_rec709_linear_to_scene_linear() for unit in np.eye(3)], np.float32).T


def luminance_weights() -> np.ndarray:
    """(3,) float32: the luminance of scene-linear RGB, as Blender turns a colour into a number."""
    if working_space() == REC709:
        return LUMINANCE
    return np.array([Color(unit).from_scene_linear_to_xyz_d65()[1] for unit in np.eye(3)], np.float32)
