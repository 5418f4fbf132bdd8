"""Probes as coloured triangles, for shaders that know nothing of harmonics; knows no GPU."""

from collections.abc import Sequence

import numpy as np

from ..numerics import sh
from ..techniques.base import ProbeGrid
from .overlay_shapes import probe_rows, sphere_triangles
from .settings import OverlaySettings

# Faces of a sphere: columns and rows; and the most probes that are shown: more would be a cloud.
_COLUMNS, _ROWS, _MOST = 12, 6, 8192
# Where the coefficients begin in a row of probe_rows.
_HEAD = 8


def sphere_colours(grids: Sequence[ProbeGrid], settings: OverlaySettings) -> tuple[np.ndarray, np.ndarray]:
    """World positions (n, 3) of the corners of all triangles of the probes' spheres, and their colours (n, 4), scene-linear: white
    balls in the irradiance of their probes, or the probes' state."""
    rows, order = probe_rows(grids, settings.probe_size)
    rows, ball = rows[:_MOST], sphere_triangles(_COLUMNS, _ROWS)
    positions = rows[:, None, :3] + rows[:, None, 3:4] * ball
    colours = np.ones((*positions.shape[:2], 4), np.float32)
    if settings.probes == "light":
        coefficients = rows[:, _HEAD:].reshape(len(rows), 3, -1)[:, :, :sh.coefficient_count(order)]
        colours[..., :3] = np.maximum(np.einsum("pck,nk->pnc", coefficients, sh.evaluate(ball, order)), 0.0) / np.pi
    else:
        colours[..., :3] = rows[:, None, 4:7]
    return positions.reshape(-1, 3).astype(np.float32), colours.reshape(-1, 4).astype(np.float32)
