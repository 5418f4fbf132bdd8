"""What of surfaces in cells no eye gets to see: the inside of solids, and what lies in there.

A cell's face shows the mean of what lines see in it. At edges and the foot of a box that is its outside, and its inside as well;
and walls of such cells let rays through in part. So what is within shone out: of a closed box that glows every bounce stays
inside, and that is many times what its outside sends.
"""

import numpy as np

from ..context import LightContext
from ..parallel import CHUNK, chunks, parallel_for
from ..rays.tracer import offset_origins
from ..vectors import dot
from .voxelize import Seen, Voxels


def within_solids(context: LightContext, voxels: Voxels) -> np.ndarray:
    """(e,) bool: which points of ``voxels.seen`` are on backs of solids, or on sides of surfaces that look at such a back from
    inside, as a floor does under a box that stands on it."""
    seen = voxels.seen
    solid = context.solids.is_solid(np.arange(context.geometry.count))
    hidden = solid[seen.primitive] & (seen.side < 0)
    if not solid.any():
        return hidden
    rows = np.flatnonzero(~hidden)
    spans = chunks(len(rows), CHUNK)
    parts = parallel_for(lambda index: _looks_at_back(context, seen, rows[spans[index]], solid), len(spans), context.threads)
    for span, found in zip(spans, parts, strict=True):
        hidden[rows[span]] = found
    return hidden


def shown_alone(voxels: Voxels, hidden: np.ndarray, light: np.ndarray) -> np.ndarray:
    """``light`` (e, c) of the points of ``voxels.seen`` with the mean of what else their faces show in the place of what is
    ``hidden`` (e,) bool; nothing where that is all."""
    seen, result = voxels.seen, light.copy()
    count = int(seen.face.max(initial=-1)) + 1
    weight = np.where(hidden, np.float32(0), seen.weight)
    total = np.maximum(np.bincount(seen.face, weight, count), np.finfo(np.float32).tiny)
    for column in range(light.shape[1]):
        mean = np.bincount(seen.face, weight * light[:, column], count) / total
        result[hidden, column] = mean[seen.face[hidden]]
    return result


def _looks_at_back(context: LightContext, seen: Seen, rows: np.ndarray, solid: np.ndarray) -> np.ndarray:
    primitive = seen.primitive[rows]
    normals = context.geometry.normals_world[primitive] * seen.side[rows, None]
    points = context.geometry.points(primitive, seen.u[rows], seen.v[rows])
    met = context.tracers.diffuse.intersect(offset_origins(points, normals, normals), normals).primitive
    found = met >= 0
    met = np.where(found, met, 0)
    return found & solid[met] & (dot(context.geometry.normals_world[met], normals) > 0)
