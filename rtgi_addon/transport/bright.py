"""Surfaces on which lamps shine brightly, sampled as light sources of their own.

The floor under a window, the ceiling above a lamp: most of a room's indirect light can start from a few square decimetres,
which rays find only by luck. The first reflection from such slots is sampled from a pool of points on them (virtual point lights,
Keller 1997) and balanced against rays that hit them (Veach 1995), so nothing needs clamping.
"""

import numpy as np

from ..numerics.sampling import hash_u32, sobol_owen_at
from .concentration import concentration_limit
from .context import LightContext
from .rays import offset_origins
from .texels import TexelLayout
from .vectors import dot, luminance

# Points tried for the pool, by which a patch's pattern of light and shadow is known.
POOL = 1 << 15
# Connections from each texel to the pool.
TEXEL_SAMPLES = 16


class BrightSurfaces:
    """Bright slots and a pool of lit points on them. ``count`` is the number of points, 0 where no surface is bright.

    ``pdf_area`` maps a slot's texels to the density [m⁻²] of pool points on their lit parts: index it by texel; the last row is 0.
    """

    def __init__(self, context: LightContext, layout: TexelLayout, slots: np.ndarray, radiance: np.ndarray, light_at, seed: int):
        """``slots`` (n,) and first-bounce ``radiance`` (n, 3) of all texels; ``light_at(slots, primitive, u, v, uv)`` gives the
        exact radiance (m, 3) that lamps leave at points, with points and normals (m, 3)."""
        self._context = context
        self.count, self.pdf_area = 0, np.zeros(len(slots) + 1, np.float32)
        self._slots, self._slot_density = np.zeros(0, np.int32), np.zeros(0, np.float32)
        if len(slots) == 0:
            return
        brightness = luminance(radiance).astype(np.float64)
        areas = layout.areas(slots)
        limit = concentration_limit(brightness, areas / areas.sum())
        rows = np.flatnonzero(brightness > limit)
        if rows.size == 0:
            return
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
        radiance, points, normals = light_at(unique[chosen], primitive, u, v, xi[:, 2:])
        # What lies in shadow within a bright slot would only waste connections. Those that are left stand for all.
        lit = np.flatnonzero(radiance.any(axis=1))
        if lit.size == 0:
            return
        density *= np.float32(POOL / lit.size)
        self.count = lit.size
        self._points, self._normals, self._radiance, self._density = points[lit], normals[lit], radiance[lit], density[chosen[lit]]
        self._slots, self._slot_density = unique.astype(np.int32), density
        self.cover(slots)

    def cover(self, slots: np.ndarray) -> None:
        """Bring ``pdf_area`` up to date with the slots (n,) of all texels.

        A texel of a bright slot shares the slot's density even if it is dark itself or was made later: pool points lie all over
        the slot, and a hit there must be weighted against them.
        """
        self.pdf_area = np.zeros(len(slots) + 1, np.float32)
        if self.count:
            position = np.minimum(np.searchsorted(self._slots, slots), len(self._slots) - 1)
            self.pdf_area[:-1] = np.where(self._slots[position] == slots, self._slot_density[position], 0)

    def state(self) -> dict[str, np.ndarray]:
        """Everything in it, for a checkpoint."""
        pool = {} if self.count == 0 else {"points": self._points, "normals": self._normals, "radiance": self._radiance,
                                           "density": self._density}
        return {"pdf_area": self.pdf_area, "slots": self._slots, "slot_density": self._slot_density, **pool}

    @classmethod
    def restored(cls, context: LightContext, arrays: dict[str, np.ndarray]) -> "BrightSurfaces":
        """One made from ``state``."""
        self = object.__new__(cls)
        self._context, self.pdf_area = context, arrays["pdf_area"]
        self._slots, self._slot_density = arrays["slots"], arrays["slot_density"]
        self.count = len(arrays.get("points", ()))
        if self.count:
            self._points, self._normals = arrays["points"], arrays["normals"]
            self._radiance, self._density = arrays["radiance"], arrays["density"]
        return self

    def connect(self, numbers: np.ndarray, points: np.ndarray, per_light: float, per_ray: float,
                receiver: tuple[np.ndarray, np.ndarray] | None = None):
        """Join ``points`` (n, 3) to the pool, one connection each, by ``numbers`` (n,) in [0, 1).

        Returns unit directions (n, 3) and contributions (n, 3) = L·T·V / (per_light·p + per_ray·T): T is cosine·cosine/distance²
        [m⁻²] and p the density of pool points, so this is the balance heuristic's share of what ``per_light`` connections and rays
        of density ``per_ray``·T find together. ``receiver``: shading and face normals (n, 3), None in free space.
        """
        pick = np.minimum((numbers * np.float32(self.count)).astype(np.int64), self.count - 1)
        towards = np.take(self._points, pick, axis=0) - points
        squared = np.maximum(dot(towards, towards), np.float32(1e-20))
        distance = np.sqrt(squared)
        direction = towards / distance[:, None]
        radiance = np.take(self._radiance, pick, axis=0)
        transfer = np.maximum(-dot(np.take(self._normals, pick, axis=0), direction), 0) / squared
        if receiver is not None:
            shading, face = receiver
            transfer *= np.maximum(dot(shading, direction), 0) * (dot(face, direction) > 0)
        rows = np.flatnonzero(transfer > 0)
        pick, transfer = pick[rows], transfer[rows]
        start = points[rows] if receiver is None else offset_origins(points[rows], receiver[1][rows], direction[rows])
        end = offset_origins(self._points[pick], self._normals[pick], -direction[rows])
        free = ~self._context.tracer.occluded(start, end - start, np.full(len(rows), 1.0 - 1e-5, np.float32))
        share = transfer * free / (per_light * self._density[pick] + per_ray * transfer)
        contribution = np.zeros((len(points), 3), np.float32)
        contribution[rows] = radiance[rows] * share[:, None]
        return direction, contribution
