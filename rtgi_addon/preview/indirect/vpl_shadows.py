"""What every virtual light sees, small enough to keep: the plane of the nearest surface in each direction of a few hundred.

An imperfect shadow map (T. Ritschel et al., "Imperfect Shadow Maps for Efficient Computation of Indirect Illumination", SIGGRAPH
Asia 2008) in that each is coarse and their sum is not. Apart from the paper: maps are traced, and hold planes instead of depths. A
receiver is seen unless it lies behind the plane, so surfaces do not shadow themselves however slanted, and a wall holds from
its very back; what a texel misses is the edge of an object within it.
"""

import numpy as np

from ...numerics.sampling import frame
from ...techniques.lattice.focus import box_around
from ...transport.context import LightContext
from ...transport.parallel import CHUNK, chunks, parallel_for
from ...transport.vectors import dot, faced

# Texels along a side of a virtual light's hemisphere, and of a distant light's view.
SIDE, DISTANT_SIDE = 16, 48
# How far behind a plane a receiver is still seen: in shares of its distance, so that a sphere does not shadow itself between the
# texels, and in widths of a distant light's texel.
TOLERANCE, DISTANT_TOLERANCE = 0.02, 0.25
# A distant light's view covers this many times the box around all volumes, cut to the scene.
FOCUS = 2.0
# Parallel rays begin this much further away than all there is.
_OUTSIDE = 1.001
# A plane that every point is in front of.
_FREE = np.float32([0.0, 0.0, 0.0, -1e30])


def hemisphere(side: int) -> np.ndarray:
    """Unit directions (side², 3) float32 about +Z at the texels' centres: half an octahedron turned by 45° fills the square."""
    centres = (2.0 * np.arange(side) + 1.0) / side - 1.0
    v, u = np.meshgrid(centres, centres, indexing="ij")
    x, y = 0.5 * (u + v).ravel(), 0.5 * (u - v).ravel()
    directions = np.stack([x, y, 1.0 - np.abs(x) - np.abs(y)], axis=1)
    return (directions / np.linalg.norm(directions, axis=1, keepdims=True)).astype(np.float32)


def light_planes(context: LightContext, positions: np.ndarray, normals: np.ndarray, side: int = SIDE) -> np.ndarray:
    """(n, side², 4) float32: the planes (normal towards the light, distance from the world's origin) that lights at ``positions``
    (n, 3) see about ``normals`` (n, 3); where they see nothing, one that all points are in front of."""
    local, (tangent, bitangent) = hemisphere(side), frame(np.asarray(normals, np.float32))
    axes = np.stack([tangent, bitangent, normals], axis=1)

    def rays(span):
        directions = np.einsum("kc,ncd->nkd", local, axes[span]).reshape(-1, 3)
        return np.repeat(np.asarray(positions, np.float32)[span], len(local), axis=0), directions

    return _planes(context, rays, len(positions), len(local))


def focus(context: LightContext) -> tuple[np.ndarray, float]:
    """Centre (3,) float64 and radius [m] of what distant lights' views cover."""
    bounds = np.array(context.geometry.bounds(), np.float64)
    box = box_around(context.scene.volumes, FOCUS, bounds)
    if box is None:
        box = bounds
    return box.mean(axis=0), max(0.5 * float(np.linalg.norm(box[1] - box[0])), 1e-6)


def distant_planes(context: LightContext, directions: np.ndarray, side: int = DISTANT_SIDE) -> np.ndarray:
    """(m, side², 4) float32: the planes that parallel rays from ``directions`` (m, 3) meet first, in the square about ``focus``."""
    centre, radius = focus(context)
    centres = (2.0 * np.arange(side) + 1.0) / side - 1.0
    v, u = (offsets.ravel()[:, None] * radius for offsets in np.meshgrid(centres, centres, indexing="ij"))
    bounds = np.array(context.geometry.bounds(), np.float64)
    away = _OUTSIDE * (float(np.linalg.norm(np.abs(bounds - centre).max(axis=0))) + radius)
    directions = np.asarray(directions, np.float64)
    tangent, bitangent = frame(directions)

    def rays(span):
        origins = (centre + u * tangent[span, None] + v * bitangent[span, None] + away * directions[span, None])
        return origins.reshape(-1, 3).astype(np.float32), np.repeat(-directions[span], side * side, axis=0).astype(np.float32)

    return _planes(context, rays, len(directions), side * side)


class SeenPlanes:
    """Planes of one geometry's lights, of which those that stayed where they were need no rays again."""

    def __init__(self):
        self._lights, self._planes = np.zeros((0, 6), np.float32), np.zeros((0, SIDE * SIDE, 4), np.float32)
        self._directions, self._distant = np.zeros((0, 3), np.float32), np.zeros((0, DISTANT_SIDE**2, 4), np.float32)

    def of_lights(self, context: LightContext, positions: np.ndarray, normals: np.ndarray) -> np.ndarray:
        """See ``light_planes``."""
        lights = np.ascontiguousarray(np.concatenate([positions, normals], axis=1), np.float32)
        known = {row.tobytes(): index for index, row in enumerate(self._lights)}
        before = np.array([known.get(row.tobytes(), -1) for row in lights], np.intp)
        planes = np.empty((len(lights), SIDE * SIDE, 4), np.float32)
        old, new = np.flatnonzero(before >= 0), np.flatnonzero(before < 0)
        planes[old] = self._planes[before[old]]
        planes[new] = light_planes(context, positions[new], normals[new])
        self._lights, self._planes = lights, planes
        return planes

    def of_distant(self, context: LightContext, directions: np.ndarray) -> np.ndarray:
        """See ``distant_planes``."""
        if not np.array_equal(directions, self._directions):
            self._directions, self._distant = directions, distant_planes(context, directions)
        return self._distant


def _planes(context: LightContext, rays, count: int, per_light: int) -> np.ndarray:
    result = np.empty((count, per_light, 4), np.float32)
    spans = chunks(count, max(1, CHUNK // per_light))

    def work(i):
        origins, directions = rays(spans[i])
        hits = context.tracer.intersect(np.ascontiguousarray(origins), np.ascontiguousarray(directions))
        planes = np.tile(_FREE, (len(origins), 1))
        rows = np.flatnonzero(hits.primitive >= 0)
        primitive = hits.primitive[rows]
        normals = faced(context.geometry.normals_world[primitive], directions[rows])
        planes[rows, :3] = normals
        planes[rows, 3] = dot(normals, context.geometry.points(primitive, hits.u[rows], hits.v[rows]))
        result[spans[i]] = planes.reshape(-1, per_light, 4)

    parallel_for(work, len(spans), context.threads)
    return result
