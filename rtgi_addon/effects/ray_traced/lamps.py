"""Lamps as the glossy layers of surfaces show them: by points on the lamps and by the mirrored rays that meet them, weighted by the
balance heuristic (Veach and Guibas 1995). Wide lobes find lamps by the first, smooth ones by the second, without a limit between
them."""

from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from ...scene.lights import lamps_to_add
from ...transport.context import LightContext
from ...transport.paths.direct import Receiver, choose_lamp, unshadowed
from ...transport.paths.numbers import LAMP, PathNumbers
from ...transport.rays.tracer import offset_origins, short_of
from ...transport.surfaces.ggx import SurfaceLook, reflectance, reflection_density
from ...transport.vectors import dot, largest


class Mirror(NamedTuple):
    """Points that reflect: ``points``, unit shading and triangles' normals ``normals``, ``faces`` and ``towards_eye`` (n, 3), how
    they ``look``, and the triangles ``primitive`` (n,) they lie on."""

    points: np.ndarray
    normals: np.ndarray
    faces: np.ndarray
    towards_eye: np.ndarray
    look: SurfaceLook
    primitive: np.ndarray

    def take(self, rows: np.ndarray) -> "Mirror":
        """The given ones only."""
        return Mirror(*(part.take(rows) if isinstance(part, SurfaceLook) else np.take(part, rows, axis=0) for part in self))

    def layer(self, towards_light: np.ndarray) -> np.ndarray:
        """What (n, 3) [1/sr] the layers reflect of irradiance from unit ``towards_light`` (n, 3)."""
        return reflectance(replace(self.look, diffuse=np.float32(0.0)), self.normals, self.towards_eye, towards_light)

    def density(self, towards_light: np.ndarray) -> np.ndarray:
        """Density (n,) [1/sr] with which mirrored rays go that way."""
        return reflection_density(self.look, self.normals, self.towards_eye, towards_light)


@dataclass(frozen=True)
class MirroredLamps:
    """The lamps of ``context`` whose indices are ``every``, as mirrors show them."""

    context: LightContext
    every: tuple[int, ...]

    @staticmethod
    def of(context: LightContext, held: frozenset[str] | None) -> "MirroredLamps":
        """All lamps but those whose light a bake holds (``held`` as ``Field.direct_lamps``)."""
        added = {id(light) for light in lamps_to_add(context.scene.lights, held)}
        return MirroredLamps(context, tuple(number for number, light in enumerate(context.scene.lights) if id(light) in added))

    @property
    def wide(self) -> tuple[int, ...]:
        """Those that rays can meet."""
        return tuple(lamp for lamp in self.every if not self.context.lamps.is_delta[lamp])

    def sampled_share(self, lamp: int, mirror: Mirror, towards_light: np.ndarray) -> np.ndarray:
        """Share (n,) of the layer's reflection of ``lamp`` that its samples in unit ``towards_light`` (n, 3) stand for; the rest is
        for rays to ``meet``."""
        density = self.context.lamps.meet(lamp, mirror.points, towards_light).density
        by_ray = mirror.density(towards_light)
        return np.where(density > 0, density / np.maximum(density + by_ray, np.float32(1e-30)), np.float32(1.0))

    def met(self, mirror: Mirror, directions: np.ndarray, depth: int) -> np.ndarray:
        """Radiance (n, 3) that lamps send against mirrored rays along unit ``directions`` (n, 3), by the share that is theirs; the
        paths have met ``depth`` surfaces before the mirror."""
        context, total = self.context, np.zeros(directions.shape, np.float32)
        for lamp in self.wide:
            if context.lamps.max_bounces[lamp] < depth:
                continue
            met = context.lamps.meet(lamp, mirror.points, directions)
            lit = met.density > 0
            if context.links.has_receivers:
                lit &= context.links.lamp_lights(lamp, context.geometry.instance[mirror.primitive])
            rows = np.flatnonzero(lit)
            if not rows.size:
                continue
            by_ray, density = mirror.take(rows).density(directions[rows]), met.density[rows]
            share = by_ray / np.maximum(by_ray + density, np.float32(1e-30))
            total[rows] += self._arriving(lamp, mirror.take(rows), directions[rows], met.distance[rows],
                                          met.radiance[rows] * share[:, None])
        return total

    def sampled(self, mirror: Mirror, numbers: PathNumbers, depth: int) -> np.ndarray:
        """Radiance (n, 3) that the layers reflect of lamps, a point on one of them each, by the share that is its."""
        total = np.zeros(mirror.points.shape, np.float32)
        if not self.every or not len(total):
            return total
        context, u = self.context, numbers.draw(depth, LAMP, 3)
        receiver = Receiver(mirror.normals, mirror.faces, mirror.primitive)
        chosen, chance = choose_lamp(context, mirror.points, receiver, u[:, 0], depth + 1, self.every)
        sample = context.lamps.sample(chosen, mirror.points, u[:, 1:], even=True)
        cosine = dot(mirror.normals, sample.direction)
        lit = (cosine > 0) & (dot(mirror.faces, sample.direction) > 0) & (chance > 0) & (largest(sample.irradiance) > 0)
        for lamp in np.unique(chosen[lit]).tolist():
            rows = np.flatnonzero(lit & (chosen == lamp))
            part, directions = mirror.take(rows), sample.direction[rows]
            share = self.sampled_share(lamp, part, directions) * cosine[rows] / chance[rows]
            arriving = sample.irradiance[rows] * share[:, None] * part.layer(directions)
            total[rows] = self._arriving(lamp, part, directions, sample.distance[rows], arriving)
        return total

    def _arriving(self, lamp: int, mirror: Mirror, directions, distance, light) -> np.ndarray:
        """What is left of ``light`` (n, 3) that ``lamp`` sends from ``distance`` (n,) away."""
        context = self.context
        starts, every = offset_origins(mirror.points, mirror.faces, directions), np.ones(len(directions), bool)
        blockers = int(context.links.lamp_blockers(lamp)) if context.links.has_blockers else 0
        shadowless = None if context.lamps.casts_shadow[lamp] else every
        return unshadowed(context, starts, directions, short_of(distance), light.astype(np.float32), every, shadowless,
                          np.broadcast_to(context.lamps.is_delta[lamp], every.shape), blockers)
