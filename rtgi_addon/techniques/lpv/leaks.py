"""Why light that spreads from cell to cell leaks: what lies behind a receiver's surface tells.

Source: A. Kaplanyan and C. Dachsbacher, I3D 2010 (blocking that is known to half a cell).
"""

import numpy as np

from ...transport.context import LightContext
from ...transport.rays.tracer import offset_origins
from ...transport.vectors import dot
from ..base import Cause

# A surface within this share of a cell under a receiver is its own.
OWN = 0.05
# Blocking is known to half a cell on either side of a surface: walls thinner than so many cells leak.
THIN_CELLS = 2.0


def causes_of_cells(context: LightContext, cell: np.ndarray, points: np.ndarray, normals: np.ndarray) -> np.ndarray:
    """The causes (n,) int8 where light spreads from cell to cell, ``cell`` (n,) [m] wide: what lies behind the surface of each of
    ``points`` (n, 3) with ``normals`` (n, 3)."""
    inward = -normals
    # Receivers lie just above their own surface.
    beneath = context.tracer.intersect(points, inward, (OWN * cell).astype(np.float32))
    surface = points + inward * np.where(beneath.primitive >= 0, beneath.t, 0.0).astype(np.float32)[:, None]
    hits = context.tracer.intersect(offset_origins(surface, normals, inward), inward)
    met = hits.primitive >= 0
    through = np.zeros(len(met), bool)
    through[met] = dot(context.geometry.normals_world[hits.primitive[met]], inward[met]) > 0
    thin = through & (hits.t < THIN_CELLS * cell)
    return np.where(thin, np.int8(Cause.THIN_WALL), np.where(through, np.int8(Cause.BETWEEN), np.int8(Cause.TWO_SIDED)))
