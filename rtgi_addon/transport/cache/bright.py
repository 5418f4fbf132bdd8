"""Surfaces on which lamps shine brightly, sampled as light sources of their own.

The floor under a window, the ceiling above a lamp: most of a room's indirect light can start from a few square decimetres,
which rays find only by luck. The first reflection from such slots is sampled from a pool of points on them (virtual point lights,
Keller 1997) and balanced against rays that hit them (Veach 1995), so nothing needs clamping.
"""

from collections.abc import Callable

import numpy as np

from ... import kernels
from ...numerics.sampling import hash_u32, sobol_owen_at
from ..context import LightContext
from ..lights.concentration import concentration_limit
from ..rays.ray_counter import record
from ..rays.tracer import offset_origins
from ..vectors import dot, luminance
from .surface_points import SurfacePoints
from .texels import TexelLayout, side_of

# Points tried for the pool, by which a patch's pattern of light and shadow is known.
POOL = 1 << 15
# Connections from each texel to the pool.
TEXEL_SAMPLES = 16
# Shadow rays to the pool's points, which were moved off their surfaces, end at this share of the way.
_SEGMENT = np.float32(1.0 - 1e-5)
# ``light_at(slots, primitive, u, v, uv)``: the exact radiance (m, 3) that lamps leave at points on slots (m,), and those points.
LightAt = Callable[[np.ndarray, np.ndarray, np.ndarray, np.ndarray, np.ndarray], tuple[np.ndarray, SurfacePoints]]
_NO_VECTORS, _NO_NUMBERS, _NO_SLOTS = np.zeros((0, 3), np.float32), np.zeros(0, np.float32), np.zeros(0, np.int32)


class BrightSurfaces:
    """Bright slots and a pool of lit points on them. ``count`` is the number of points, 0 where no surface is bright.

    ``pdf_area`` maps a slot's texels to the density [m⁻²] of pool points on their lit parts: index it by texel; the last row is 0.
    ``points``, ``normals`` (n, 3), the ``radiance`` (n, 3) that lamps leave there (in the mean over all angles), their ``density``
    (n,) and ``faces`` (n,) (Surfaces.face) are the pool's;
    ``slots`` (m,) ascending are the bright ones and ``slot_density`` (m,) that of the points on each.
    """

    def __init__(self, context: LightContext, points: np.ndarray = _NO_VECTORS, normals: np.ndarray = _NO_VECTORS,
                 radiance: np.ndarray = _NO_VECTORS, density: np.ndarray = _NO_NUMBERS, slots: np.ndarray = _NO_SLOTS,
                 slot_density: np.ndarray = _NO_NUMBERS, pdf_area: np.ndarray | None = None, faces: np.ndarray = _NO_SLOTS):
        self._context, self.count = context, len(points)
        self._points, self._normals, self._radiance, self._density = points, normals, radiance, density
        self._slots, self._slot_density, self._faces = slots, slot_density, faces
        self.pdf_area = np.zeros(1, np.float32) if pdf_area is None else pdf_area

    def cover(self, slots: np.ndarray) -> None:
        """Bring ``pdf_area`` up to date with the slots (n,) of all texels.

        A texel of a bright slot shares the slot's density even if it is dark itself or was made later: pool points lie all over
        the slot, and a hit there must be weighted against them.
        """
        self.pdf_area = np.zeros(len(slots) + 1, np.float32)
        if self.count:
            position = np.minimum(np.searchsorted(self._slots, slots), len(self._slots) - 1)
            self.pdf_area[:-1] = np.where(self._slots[position] == slots, self._slot_density[position], 0)

    def arrays(self) -> dict[str, np.ndarray]:
        """Everything in it by name, as it is constructed."""
        return {"points": self._points, "normals": self._normals, "radiance": self._radiance, "density": self._density,
                "slots": self._slots, "slot_density": self._slot_density, "pdf_area": self.pdf_area,
                "faces": self._faces}

    def connect(self, numbers: np.ndarray, points: np.ndarray, per_light: float, per_ray: float,
                receiver: tuple[np.ndarray, np.ndarray] | None = None):
        """Join ``points`` (n, 3) to the pool, one connection each, by ``numbers`` (n,) in [0, 1).

        Returns unit directions (n, 3) and contributions (n, 3) = L·T·V / (per_light·p + per_ray·T): T is cosine·cosine/distance²
        [m⁻²] and p the density of pool points, so this is the balance heuristic's share of what ``per_light`` connections and rays
        of density ``per_ray``·T find together. ``receiver``: shading and face normals (n, 3), None in free space.
        """
        by_angle = self._context.surfaces.albedo_by_angle
        tracer = self._context.tracers.view if receiver is None else self._context.tracers.diffuse
        if kernels.is_available() and not by_angle.present and getattr(tracer, "kernel", None):
            return self._connect(tracer, numbers, points, per_light, per_ray, receiver)
        pick = np.minimum((numbers * np.float32(self.count)).astype(np.int64), self.count - 1)
        towards = np.take(self._points, pick, axis=0) - points
        squared = np.maximum(dot(towards, towards), np.float32(1e-20))
        distance = np.sqrt(squared)
        direction = towards / distance[:, None]
        radiance = np.take(self._radiance, pick, axis=0)
        cosine = np.maximum(-dot(np.take(self._normals, pick, axis=0), direction), 0)
        transfer = cosine / squared
        if by_angle.present:
            radiance = radiance * by_angle.of(self._faces[pick], cosine)
        if receiver is not None:
            shading, face = receiver
            transfer *= np.maximum(dot(shading, direction), 0) * (dot(face, direction) > 0)
        rows = np.flatnonzero(transfer > 0)
        pick, transfer = pick[rows], transfer[rows]
        start = points[rows] if receiver is None else offset_origins(points[rows], receiver[1][rows], direction[rows])
        end = offset_origins(self._points[pick], self._normals[pick], -direction[rows])
        passed = tracer.transmittance(start, end - start, _SEGMENT, looks=True)
        share = transfer / (per_light * self._density[pick] + per_ray * transfer)
        contribution = np.zeros((len(points), 3), np.float32)
        contribution[rows] = radiance[rows] * share[:, None] * passed
        return direction, contribution

    def _connect(self, tracer, numbers, points, per_light, per_ray, receiver) -> tuple[np.ndarray, np.ndarray]:
        n, (directions, contributions) = len(points), np.empty((2, len(points), 3), np.float32)
        arrays = [numbers, points, *(receiver or ())]
        if any(len(array) != n for array in arrays):
            raise ValueError(f"{[array.shape for array in arrays]} of {n} connections")
        numbers, points, *normals = (np.ascontiguousarray(array, np.float32) for array in arrays)
        record(kernels.call("connect_bright", tracer.kernel, self.count, self._points, self._normals, self._radiance, self._density,
                            n, numbers, points, *(normals or (None, None)), per_light, per_ray, directions, contributions))
        return directions, contributions


def find_bright(context: LightContext, layout: TexelLayout, slots: np.ndarray, radiance: np.ndarray, light_at: LightAt,
                seed: int) -> BrightSurfaces:
    """The bright ones among the ``slots`` (n,) of texels that leave first-bounce ``radiance`` (n, 3), with a pool of points."""
    none = BrightSurfaces(context)
    if len(slots) == 0:
        return none
    brightness = luminance(radiance).astype(np.float64)
    areas = layout.areas(slots)
    limit = concentration_limit(brightness, areas / areas.sum())
    rows = np.flatnonzero(brightness > limit)
    if rows.size == 0:
        return none
    unique, index = np.unique(slots[rows], return_inverse=True)
    power = np.bincount(index.reshape(-1), brightness[rows] * areas[rows])
    slot_area = layout.areas(unique)
    cdf = np.cumsum(power) / power.sum()
    chosen = np.minimum(np.searchsorted(cdf, (np.arange(POOL) + 0.5) / POOL, side="right"), len(unique) - 1)
    # Each slot's share of the points is a sequence of its own: a patch's edge of light and shadow sets all the light of a room.
    index = np.arange(POOL) - np.searchsorted(chosen, chosen)
    xi = sobol_owen_at(index, 4, hash_u32(seed, unique)[chosen])
    density = (power / power.sum() / slot_area).astype(np.float32)
    primitive, u, v = (part[0] for part in layout.sample(unique[chosen], xi[None, :, :2]))
    radiance, surface = light_at(unique[chosen], primitive, u, v, xi[:, 2:])
    # What lies in shadow within a bright slot would only waste connections. Those that are left stand for all.
    lit = np.flatnonzero(radiance.any(axis=1))
    if lit.size == 0:
        return none
    density *= np.float32(POOL / lit.size)
    faces = context.surfaces.face(primitive, side_of(unique[chosen])[:, 0]).astype(np.int32)
    return BrightSurfaces(context, surface.points[lit], surface.face[lit], radiance[lit], density[chosen[lit]],
                          unique.astype(np.int32), density, faces=faces[lit])
