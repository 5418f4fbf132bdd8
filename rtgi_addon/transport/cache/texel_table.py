"""The texels in use: every slot that a ray has met, split wherever a wall stands across it.

A floor runs on under the walls of two rooms: one value for a cell that both rooms share would carry light from one into the
other, and a mean over the hidden strip beneath the wall would darken both. So a texel is what can be seen, just above the
surface, from one point of the slot that a ray really reached (its seed). Where a slot's rim or interior is obstructed, each hit
in it is tested against the seed, and those that do not see it make further texels with seeds of their own.

What hangs close above a surface parts it just as well, though the two sides see each other through the gap: the floor beside a
crate that stands a few millimetres above it must not share the darkness beneath, nor the ceiling beside a lamp's panel the
light behind it, which no one sees. So points close under anything make one texel, points beside it another.
"""

from dataclasses import dataclass

import numpy as np

from ... import kernels
from ..context import LightContext
from ..parallel import CHUNK, parallel_for
from ..rays.tracer import SEGMENT, offset_origins
from ..vectors import dot
from . import texel_kernels
from .texel_kernels import HitTable, tracer_of
from .texel_numbers import PLACE, TexelNumbers
from .texels import TexelLayout, side_of

# A slot is split into at most this many texels; what none of their seeds sees joins the last.
MAX_PARTS = 4
# A point is covered by what is less than this share of a texel's side above it, or by an emitter less than that. Things higher up
# have soft edges of shadow and light, which texels hold well enough.
COVER, EMITTER_COVER = np.float32(0.25), np.float32(0.5)
# Sides of a cell's rim and diagonals, as pairs of corners.
_RIM = np.array([(0, 1), (1, 2), (2, 3), (3, 4), (4, 0), (0, 2), (0, 3), (1, 4)])


@dataclass(eq=False)
class SurfaceHits:
    """Hits on surfaces: ``primitive`` (n,) int32, ``u``, ``v`` (n,), their ``slots`` (n,) int32."""

    primitive: np.ndarray
    u: np.ndarray
    v: np.ndarray
    slots: np.ndarray

    @property
    def side(self) -> np.ndarray:
        """(n,) float32: 1 for hits on the front, -1 for hits on the back."""
        return side_of(self.slots)[:, 0]

    def take(self, rows) -> "SurfaceHits":
        """The given rows only."""
        return SurfaceHits(self.primitive[rows], self.u[rows], self.v[rows], self.slots[rows])

    @staticmethod
    def join(parts: list["SurfaceHits"]) -> "SurfaceHits":
        """Several sets end to end."""
        names = ("primitive", "u", "v", "slots")
        return SurfaceHits(*(np.concatenate([getattr(part, name) for part in parts]) for name in names))


class TexelTable:
    """Grows by ``resolve``; rows are never moved. ``slots`` (n,) int32, ``seeds`` their SurfaceHits, ``mixed`` (n,) bool: the
    slot is obstructed; ``covered`` (n,) bool: something is close above the seed; ``accepted`` (n, points) bool: which
    of the slot's sample points see the seed and are covered like it.

    ``numbers`` place the ``points`` sample points of a slot.
    """

    def __init__(self, context: LightContext, layout: TexelLayout, numbers: TexelNumbers, points: int):
        self._context, self._layout, self._numbers, self._point_count = context, layout, numbers, points
        self._first = np.full(layout.slot_count, -1, np.int32)
        empty = np.zeros(0, np.int32)
        self.seeds = SurfaceHits(empty, np.zeros(0, np.float32), np.zeros(0, np.float32), empty)
        self._next = empty
        self.mixed = np.zeros(0, bool)
        self.covered = np.zeros(0, bool)
        self.accepted = np.zeros((0, points), bool)

    @property
    def count(self) -> int:
        """Number of texels."""
        return len(self.mixed)

    @property
    def slots(self) -> np.ndarray:
        """Slot (n,) of each texel."""
        return self.seeds.slots

    def state(self) -> dict[str, np.ndarray]:
        """Everything in it, for a checkpoint."""
        return {"primitive": self.seeds.primitive, "u": self.seeds.u, "v": self.seeds.v, "slots": self.seeds.slots,
                "next": self._next, "mixed": self.mixed, "covered": self.covered, "accepted": self.accepted}

    def restore(self, arrays: dict[str, np.ndarray]) -> None:
        """Take up from ``state``."""
        self.seeds = SurfaceHits(*(arrays[name] for name in ("primitive", "u", "v", "slots")))
        self._next, self.mixed = arrays["next"], arrays["mixed"]
        self.covered, self.accepted = arrays["covered"], arrays["accepted"]
        # Of the texels of one slot the first made stays.
        self._first[self.slots[::-1]] = np.arange(self.count, dtype=np.int32)[::-1]

    def resolve(self, parts: list[SurfaceHits]) -> list[np.ndarray]:
        """The texel (n,) int32 of each hit of each part, making texels that do not exist yet.

        The result depends on the parts and their order alone, not on the number of threads.
        """
        threads = self._context.threads
        looked = parallel_for(lambda i: self._look_up(parts[i].slots), len(parts), threads)
        if any(missing for _, _, missing in looked):
            fresh = [np.flatnonzero(texel < 0) for texel, _, _ in looked]
            self._create(SurfaceHits.join([part.take(rows) for part, rows in zip(parts, fresh, strict=True)]), None)
            looked = parallel_for(lambda i: self._look_up(parts[i].slots), len(parts), threads)
        texels, open_rows = [texel for texel, _, _ in looked], [rows for _, rows, _ in looked]
        covered = parallel_for(lambda i: self._covered(parts[i], open_rows[i]), len(parts), threads)
        for _ in range(1, MAX_PARTS):
            apart = parallel_for(lambda i: self._apart(parts[i], open_rows[i], texels[i], covered[i]),  # noqa: B023
                                 len(parts), threads)
            open_rows = [rows[parted] for rows, parted in zip(open_rows, apart, strict=True)]
            covered = [cover[parted] for cover, parted in zip(covered, apart, strict=True)]
            if not any(rows.size for rows in open_rows):
                break
            missing = [rows[self._next[texel[rows]] < 0] for rows, texel in zip(open_rows, texels, strict=True)]
            if any(rows.size for rows in missing):
                hits = SurfaceHits.join([part.take(rows) for part, rows in zip(parts, missing, strict=True)])
                self._create(hits, np.concatenate([texel[rows] for texel, rows in zip(texels, missing, strict=True)]))
            for texel, rows in zip(texels, open_rows, strict=True):
                texel[rows] = self._next[texel[rows]]
        return texels

    def _look_up(self, slots: np.ndarray) -> tuple[np.ndarray, np.ndarray, int]:
        """The first texel (n,) int32 of each of ``slots`` (n,), −1 where there is none; the rows (k,) that other texels of the same
        slots may have, if there are any; how many have none."""
        if kernels.is_available():
            return texel_kernels.look_up(self._first, self.mixed, slots)
        texel = self._first[slots]
        missing = int(np.count_nonzero(texel < 0))
        return texel, np.flatnonzero(self.mixed[texel]) if missing < len(texel) else np.zeros(0, np.int64), missing

    def _create(self, hits: SurfaceHits, after: np.ndarray | None) -> None:
        """Make one texel for each distinct slot of ``hits`` (or each distinct texel that they come ``after``)."""
        key = hits.slots if after is None else after
        size = self._layout.slot_count if after is None else self.count
        chosen = np.full(size, -1, np.int64)
        # Backwards, so that of several hits with one key the first stays.
        chosen[key[::-1]] = np.arange(len(key))[::-1]
        keys = np.flatnonzero(chosen >= 0)
        seeds = hits.take(chosen[keys])
        texels = np.arange(self.count, self.count + len(keys), dtype=np.int32)
        if after is None:
            self._first[keys] = texels
        else:
            self._next[keys] = texels
        spans = [slice(i, min(i + (CHUNK >> 4), len(keys))) for i in range(0, len(keys), CHUNK >> 4)]
        surveys = parallel_for(lambda i: self._survey(seeds.take(spans[i])), len(spans), self._context.threads)
        mixed = np.concatenate([part[0] for part in surveys])
        self.seeds = SurfaceHits.join([self.seeds, seeds])
        self._next = np.concatenate([self._next, np.full(len(keys), -1, np.int32)])
        self.mixed = np.concatenate([self.mixed, mixed if after is None else np.ones(len(keys), bool)])
        self.covered = np.concatenate([self.covered, *(part[1] for part in surveys)])
        self.accepted = np.concatenate([self.accepted, *(part[2] for part in surveys)])

    def _survey(self, seeds: SurfaceHits) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Whether each slot is obstructed, whether its seed is covered, which of its sample points (n, points) belong to it."""
        n, count = len(seeds.slots), self._point_count
        if kernels.is_available():
            primitive, u, v = texel_kernels.texel_points(self._layout.tables, self._numbers.shared(PLACE, count),
                                                         self._numbers.shifts(seeds.slots, PLACE), seeds.slots, located=False)
        else:
            xi = self._numbers.of(seeds.slots, PLACE, count)
            primitive, u, v = (part.reshape(-1) for part in self._layout.sample(seeds.slots, xi))
        samples = SurfaceHits(primitive, u, v, np.tile(seeds.slots, count))
        covered = self._covered(seeds)
        of_seed = np.tile(np.arange(n, dtype=np.int32), count)
        apart = self._hidden(samples, None, self._covered(samples), of_seed, seeds, covered, True)
        accepted = ~apart.reshape(self._point_count, n).T
        mixed = ~accepted.all(axis=1)
        rows, _, corners = self._layout.rim(seeds.slots)
        if rows.size:
            _, normal, lift = self._lifted(seeds)
            corners = corners + (normal[rows] * lift[rows, None])[:, None, :]
            start, end = (np.swapaxes(corners[:, side], 0, 1).reshape(-1, 3) for side in _RIM.T)
            mixed[rows] |= self._segment(start, end).reshape(len(_RIM), len(rows)).any(axis=0)
        return mixed, covered, accepted

    def _apart(self, hits: SurfaceHits, rows: np.ndarray, texel: np.ndarray, covered: np.ndarray) -> np.ndarray:
        """(k,) bool: which ``rows`` (k,) of ``hits`` (n,), ``covered`` (k,) or not, do not belong to their ``texel`` (n,)."""
        return self._hidden(hits, rows, covered, texel, self.seeds, self.covered, False) if rows.size else np.zeros(0, bool)

    def _hidden(self, hits: SurfaceHits, rows: np.ndarray | None, covered: np.ndarray, texel: np.ndarray, seeds: SurfaceHits,
                seeds_covered: np.ndarray, from_seed: bool) -> np.ndarray:
        """(k,) bool: which ``rows`` (k,) of ``hits`` (n,) (None: all), ``covered`` (k,) or not, are covered otherwise than the
        one of ``seeds`` (m,) that ``texel`` (n,) names, or hidden from it: by rays ``from_seed``, or to it."""
        tracer = tracer_of(self._context.tracer)
        if tracer:
            return texel_kernels.apart(tracer, self._layout.tables, HitTable(hits), rows, covered, texel, HitTable(seeds),
                                       seeds_covered, from_seed)
        rows = np.arange(len(texel)) if rows is None else rows
        result = covered != seeds_covered[texel[rows]]
        alike = np.flatnonzero(~result)
        if alike.size:
            ends = [self._lifted(hits.take(rows[alike]))[0], self._lifted(seeds.take(texel[rows[alike]]))[0]]
            result[alike] = self._segment(*(reversed(ends) if from_seed else ends))
        return result

    def _covered(self, hits: SurfaceHits, rows: np.ndarray | None = None) -> np.ndarray:
        """(k,) bool: whether anything is close above the surface at ``rows`` (k,) of ``hits`` (None: all)."""
        geometry, surfaces = self._context.geometry, self._context.surfaces
        emissive, tracer = surfaces.emissive if surfaces.has_emission else None, tracer_of(self._context.tracer)
        if tracer:
            return texel_kernels.covered(tracer, self._layout.tables, (COVER, EMITTER_COVER), geometry.material, emissive,
                                         HitTable(hits), rows)
        hits = hits if rows is None else hits.take(rows)
        normal = geometry.normals_world[hits.primitive] * side_of(hits.slots)
        points = offset_origins(geometry.points(hits.primitive, hits.u, hits.v), normal, normal)
        size = self._layout.sizes(hits.primitive)
        if emissive is None:
            return self._context.tracer.occluded(points, normal, COVER * size)
        above = self._context.tracer.intersect(points, normal, EMITTER_COVER * size)
        result = above.primitive >= 0
        rows = np.flatnonzero(result & (above.t > COVER * size))
        result[rows] = emissive[geometry.material[above.primitive[rows]]]
        return result

    def _lifted(self, hits: SurfaceHits):
        geometry = self._context.geometry
        normal = geometry.normals_world[hits.primitive] * side_of(hits.slots)
        lift = self._layout.lift(hits.slots, hits.primitive)
        return geometry.points(hits.primitive, hits.u, hits.v) + normal * lift[:, None], normal, lift

    def _segment(self, start: np.ndarray, end: np.ndarray) -> np.ndarray:
        direction = end - start
        hidden = self._context.tracer.occluded(start, direction, SEGMENT)
        return hidden & (dot(direction, direction) > 0)
