"""What texels of the surface cache leave to the compiled kernels: their points, their rays, and which hits belong to them."""

from typing import NamedTuple

import numpy as np

from ... import kernels
from ..rays.ray_counter import record
from ..rays.tracer import SEGMENT

# ``Layout`` and ``Hits`` of kernels/src/texels.c.
_LAYOUT = np.dtype([*((name, np.uint64) for name in ("cells", "corners", "own_triangles", "own_starts", "members", "group_starts",
                                                     "member_sums")),
                    *((name, np.int64) for name in ("triangles", "own", "groups", "member_count"))])
_HITS = np.dtype([*((name, np.uint64) for name in ("primitive", "slots", "u", "v")), ("n", np.int64)])


class LayoutTables:
    """What a TexelLayout knows, as kernels read it: its ``cells`` (t,), the ``corners`` (t, 3, 3) of triangles, the triangles that
    have cells of their own (m,) and from which slot on (m,), the members (k,) of groups, from which on each begins (g + 1,), and
    the sums (k + 1,) of their areas. ``lifts`` (2,) are those of groups and of cells."""

    def __init__(self, cells: np.ndarray, corners: np.ndarray, own_triangles: np.ndarray, own_starts: np.ndarray,
                 members: np.ndarray, group_starts: np.ndarray, member_sums: np.ndarray, lifts: np.ndarray):
        whole = (np.ascontiguousarray(part, np.int64) for part in (own_triangles, own_starts, members, group_starts))
        self._held = (cells, np.ascontiguousarray(corners, np.float32), *whole, np.ascontiguousarray(member_sums, np.float64))
        counts = (len(cells), len(own_triangles), len(group_starts) - 1, len(members))
        self._record = np.array([(*(part.ctypes.data for part in self._held), *counts)], _LAYOUT)
        self.lifts, self.address = np.ascontiguousarray(lifts, np.float32), self._record.ctypes.data


class HitTable:
    """Hits on surfaces as kernels read them: ``primitive``, ``slots``, ``u``, ``v`` (n,)."""

    def __init__(self, hits):
        self._held = (np.ascontiguousarray(hits.primitive, np.int32), np.ascontiguousarray(hits.slots, np.int32),
                      np.ascontiguousarray(hits.u, np.float32), np.ascontiguousarray(hits.v, np.float32))
        self.count = len(self._held[0])
        if any(part.shape != (self.count,) for part in self._held):
            raise ValueError(f"{[part.shape for part in self._held]} where {self.count} hits are expected")
        self._record = np.array([(*(part.ctypes.data for part in self._held), self.count)], _HITS)
        self.address = self._record.ctypes.data


class TexelRays(NamedTuple):
    """Rays (R·n) of texels: all ``directions`` (R·n, 3), and the ``density`` (R·n,) of each on what it met (0: nothing); of those
    that hit, ``found`` (h,), the ``primitive``, ``u``, ``v``, ``slots`` and ``cosine`` (h,) to the front's normal, and those (e,)
    that ``escaped``; the ``tint`` (R·n, 3) of what comes along all of them (None: unchanged)."""

    directions: np.ndarray
    density: np.ndarray
    found: np.ndarray
    primitive: np.ndarray
    u: np.ndarray
    v: np.ndarray
    slots: np.ndarray
    cosine: np.ndarray
    escaped: np.ndarray
    tint: np.ndarray | None = None


def tracer_of(tracer) -> int | None:
    """Through what the kernels trace just what ``tracer`` does, None where they do not."""
    return getattr(tracer, "kernel", None) if kernels.is_available() else None


def texel_points(tables: LayoutTables, numbers: np.ndarray, shifts: np.ndarray, slots: np.ndarray,
                 accepted: np.ndarray | None = None, seeds=None, located: bool = True) -> tuple[np.ndarray, ...]:
    """Points of texels with ``slots`` (n,), as primitive, u, v (m·n,), by ``numbers`` (m, 2) shifted on the torus by ``shifts``
    (n, 2): the first of all, then the second, and so on; where ``accepted`` (n, k) is False their ``seeds`` (n,). Then where they
    are, and the normals of their sides (m·n, 3), unless not ``located``."""
    m, n = len(numbers), len(slots)
    if shifts.shape != (n, 2) or numbers.shape != (m, 2) or (accepted is not None and (
            len(accepted) != n or accepted.shape[1] < m or len(seeds.primitive) != n)):
        raise ValueError(f"{numbers.shape} numbers and {shifts.shape} shifts of {n} texels")
    primitive, (u, v) = np.empty(m * n, np.int32), np.empty((2, m * n), np.float32)
    points, faces = np.empty((2, m * n, 3), np.float32) if located else (None, None)
    kept = (0, None, None, None, None)
    if accepted is not None:
        accepted = np.ascontiguousarray(accepted)
        kept = (accepted.shape[1], accepted, np.ascontiguousarray(seeds.primitive, np.int32),
                np.ascontiguousarray(seeds.u, np.float32), np.ascontiguousarray(seeds.v, np.float32))
    kernels.call("texel_points", tables.address, m, np.ascontiguousarray(numbers, np.float32), n,
                 np.ascontiguousarray(shifts, np.float32), np.ascontiguousarray(slots, np.int32), *kept, primitive, u, v, points,
                 faces)
    return (primitive, u, v, points, faces) if located else (primitive, u, v)


def texel_rays(tracer: int, tables: LayoutTables, numbers: np.ndarray, shifts: np.ndarray, points: np.ndarray,
               shading: np.ndarray, face: np.ndarray) -> TexelRays:
    """Cosine-distributed rays of n texels, by ``numbers`` (R, 2) shifted on the torus by ``shifts`` (n, 2): those of one number
    in a row, each from one of the texel's ``points`` with ``shading`` and ``face`` normals (p·n, 3), in turn."""
    r, n = len(numbers), len(shifts)
    per_texel = len(points) // max(n, 1)
    if any(part.shape != (per_texel * n, 3) for part in (points, shading, face)) or per_texel == 0:
        raise ValueError(f"{points.shape} points, {shading.shape} and {face.shape} normals of {n} texels")
    directions, density = np.empty((r * n, 3), np.float32), np.empty(r * n, np.float32)
    found, escaped = np.empty((2, r * n), np.int64)
    primitive, slots = np.empty((2, r * n), np.int32)
    u, v, cosine = np.empty((3, r * n), np.float32)
    counts = np.zeros(3, np.int64)
    kernels.call("texel_rays", tracer, tables.address, r, np.ascontiguousarray(numbers, np.float32), n,
                 np.ascontiguousarray(shifts, np.float32), per_texel,
                 *(np.ascontiguousarray(part) for part in (points, shading, face)), directions, density, found, primitive, u, v,
                 slots, cosine, escaped, counts)
    hit, missed, traced = counts.tolist()
    record(traced)
    # Copies: what is held until all chunks are there is most of the memory.
    met = (part[:hit].copy() for part in (found, primitive, u, v, slots, cosine))
    return TexelRays(directions, density, *met, escaped[:missed])


def look_up(first: np.ndarray, mixed: np.ndarray, slots: np.ndarray) -> tuple[np.ndarray, np.ndarray, int]:
    """The texel (h,) int32 of each of ``slots`` (h,), −1 where ``first`` (slots,) has none; the rows (k,) of those that are
    ``mixed`` (texels,); and how many have none."""
    h = len(slots)
    texel, rows, missing = np.empty(h, np.int32), np.empty(h, np.int64), np.zeros(1, np.int64)
    count = kernels.call("look_up", len(first), first, len(mixed), mixed, h, np.ascontiguousarray(slots, np.int32), texel, rows,
                         missing)
    return texel, rows[:count].copy(), int(missing[0])


def covered(tracer: int, tables: LayoutTables, reach: tuple[float, float], material: np.ndarray, emissive: np.ndarray | None,
            hits: HitTable, rows: np.ndarray | None) -> np.ndarray:
    """(k,) bool: whether anything is close above the ``rows`` (k,) of ``hits`` (None: all): within the first ``reach`` of a
    texel's side, or an emitter within the second, if ``emissive`` tells which of the materials are, by the ``material`` (t,) of
    triangles."""
    count = hits.count if rows is None else len(rows)
    result = np.empty(count, bool)
    record(count)
    kernels.call("covered", tracer, tables.address, np.array(reach, np.float32), material, 0 if emissive is None else len(emissive),
                 emissive, hits.address, count, rows, result)
    return result


def apart(tracer: int, tables: LayoutTables, hits: HitTable, rows: np.ndarray | None, is_covered: np.ndarray, texel: np.ndarray,
          seeds: HitTable, seeds_covered: np.ndarray, from_seed: bool) -> np.ndarray:
    """(k,) bool: which of ``rows`` (k,) of ``hits`` (None: all), ``is_covered`` (k,) or not, are hidden from the seed of their
    ``texel`` (h,), or covered otherwise than it (texels,). Rays go ``from_seed`` or to it."""
    count = hits.count if rows is None else len(rows)
    if len(is_covered) != count or len(texel) != hits.count or len(seeds_covered) != seeds.count:
        raise ValueError(f"{len(is_covered)} of {count} hits, and {len(texel)} texels of {hits.count}")
    result = np.empty(count, bool)
    record(kernels.call("apart", tracer, tables.address, tables.lifts, float(SEGMENT), hits.address, count, rows, is_covered,
                        np.ascontiguousarray(texel, np.int32), seeds.address, seeds_covered, from_seed, result))
    return result
