"""Many paths traced side by side: what is under way, and where it met surfaces, each a record that is filtered as a whole."""

from dataclasses import dataclass, fields, replace

import numpy as np

from ..context import LightContext
from ..rays.tracer import Hits, offset_origins
from ..vectors import dot, sides_met
from .numbers import SIDE, PathNumbers


@dataclass(frozen=True, eq=False)
class Wavefront:
    """Paths under way: ``rows`` (n,) tell which, ``origins`` and unit ``directions`` (n, 3) are the rays that they follow,
    ``throughput`` (n, 3) what they carry, ``numbers`` where they take theirs from; ``density`` (n,) [1/sr] that of their
    directions, None where nothing competes with them; ``instance`` (n,) what they left, None in free space."""

    rows: np.ndarray
    origins: np.ndarray
    directions: np.ndarray
    throughput: np.ndarray
    numbers: PathNumbers
    density: np.ndarray | None = None
    instance: np.ndarray | None = None

    def take(self, chosen: np.ndarray) -> "Wavefront":
        """The paths ``chosen`` (indices)."""
        parts = {item.name: getattr(self, item.name) for item in fields(self)}
        parts["numbers"] = self.numbers.take(chosen)
        return Wavefront(**{name: part[chosen] if isinstance(part, np.ndarray) else part for name, part in parts.items()})

    @staticmethod
    def join(parts: "list[Wavefront]", like: "Wavefront") -> "Wavefront":
        """Several, one after the other; none of ``like`` where there are none."""
        parts = [part for part in parts if part.rows.size]
        if len(parts) < 2:
            return parts[0] if parts else like.take(np.zeros(0, np.intp))
        joined = {item.name: [getattr(part, item.name) for part in parts] for item in fields(Wavefront)}
        return Wavefront(**{name: PathNumbers.join(values) if name == "numbers" else np.concatenate(values)
                            for name, values in joined.items()})

    def carrying(self, throughput: np.ndarray) -> "Wavefront":
        """The same paths with another ``throughput`` (n, 3)."""
        return replace(self, throughput=throughput)


@dataclass(frozen=True, eq=False)
class Vertices:
    """Where rays along ``directions`` (n, 3) met surfaces, no miss among them: ``primitive`` (n,) int32, ``u``, ``v`` and ``t``
    (n,) as in Hits."""

    primitive: np.ndarray
    u: np.ndarray
    v: np.ndarray
    t: np.ndarray
    directions: np.ndarray

    @staticmethod
    def of(hits: Hits, directions: np.ndarray) -> tuple[np.ndarray, "Vertices"]:
        """Which rays (m,) of those along ``directions`` (n, 3) met a surface, and where."""
        found = np.flatnonzero(hits.primitive >= 0)
        return found, Vertices(hits.primitive[found], hits.u[found], hits.v[found], hits.t[found], directions[found])

    def take(self, chosen: np.ndarray) -> "Vertices":
        """The ``chosen`` (indices) alone."""
        return Vertices(*(getattr(self, item.name)[chosen] for item in fields(self)))

    def choose_side(self, context: LightContext, reflected: np.ndarray, leaving: np.ndarray, numbers: PathNumbers,
                    depth: int) -> tuple[np.ndarray, np.ndarray | None]:
        """What each path carries on (n, 3), and which of them go through the surface (n,) bool (None: none can), by a coin where it
        is translucent: of what is ``reflected`` (n, 3), or passed to the side that ``leaving`` (n,), a cosine, tells."""
        surfaces = context.surfaces
        if not surfaces.has_translucency:
            return reflected, None
        rows = np.flatnonzero(surfaces.translucent[context.geometry.material[self.primitive]])
        through = np.zeros(len(self.primitive), bool)
        if rows.size == 0:
            return reflected, through
        passed = surfaces.translucency(self.primitive[rows], self.u[rows], self.v[rows], leaving[rows])
        strength = passed.max(axis=1)
        chance = strength / np.maximum(strength + reflected[rows].max(axis=1), np.float32(1e-20))
        through[rows] = numbers.draw(depth, SIDE, 1)[rows, 0] < chance
        carried = reflected.copy()
        carried[rows] = np.where(through[rows, None], passed / np.maximum(chance, np.float32(1e-20))[:, None],
                                 reflected[rows] / np.maximum(1.0 - chance, np.float32(1e-20))[:, None])
        return carried, through

    def normals(self, context: LightContext) -> np.ndarray:
        """Geometric normals (n, 3) on the front of their meshes."""
        return context.geometry.normals_world[self.primitive]

    def cosine(self, context: LightContext) -> np.ndarray:
        """Cosine (n,) between the front's geometric normal and the way back along the ray: negative on the back."""
        return -dot(self.normals(context), self.directions)

    def facing(self, context: LightContext, through: np.ndarray | None = None) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Points (n, 3), moved off the surface to the side that the rays came from, and there the geometric and the shading normals
        (n, 3); of those that go ``through`` (n,) bool, on the other side. The side is the geometric normal's for both, as in
        Cycles."""
        normals = self.normals(context)
        side = sides_met(normals, self.directions)
        if through is not None:
            side = np.where(through[:, None], -side, side)
        geometric, shading = normals * side, context.surfaces.shading_normal(self.primitive, self.u, self.v) * side
        points = context.geometry.points(self.primitive, self.u, self.v)
        return offset_origins(points, geometric, geometric, self.t), geometric, shading
