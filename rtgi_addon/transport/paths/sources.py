"""Direct light at surface points: lamps and the bright patches of the world, with shadow rays."""

from collections.abc import Iterator, Sequence
from functools import cached_property
from typing import NamedTuple

import numpy as np

from ...numerics import sh
from ...numerics.sampling import hash_u32, sobol_owen, wrapped
from ...scene import PointLight
from ..context import LightContext
from ..lights.kinds import kind_of
from ..lights.lamps import UNLIMITED
from ..rays.ray_counter import record
from ..rays.tracer import Tracer, offset_origins, short_of
from ..vectors import dot, luminance
from .direct import choose_among

# Tells the numbers for samples of lamps apart from all others of a seed.
_LAMP_STREAM = 6


class Standing(NamedTuple):
    """A lamp that stands at a ``position`` (3,), world, and reaches ``extent`` [m] from it; ``power`` [W] of its luminance;
    ``directed``: it does not shine the same to all sides."""

    position: np.ndarray
    extent: float
    power: float
    directed: bool


class Sources:
    """All light that is sampled rather than hit: the scene's lamps, then the world's bright patches as one more source.

    ``count`` sources; ``casts_shadow`` and ``is_delta`` (count,) bool and ``scattered`` (count,) float32 as in LampTable.
    """

    def __init__(self, context: LightContext):
        self._context = context
        self._lamps = context.lamps
        self._bright = context.environment.bright
        self._bright_index = self._lamps.count
        self.count = self._lamps.count + (1 if self._bright.count else 0)
        self.casts_shadow = np.append(self._lamps.casts_shadow, True)[: self.count]
        self.is_delta = np.append(self._lamps.is_delta, False)[: self.count]
        self.scattered = np.append(self._lamps.scattered, np.float32(1.0))[: self.count]

    def irradiance(self, source, points, normals, geometric, reach, uv, primitive=None, turn: float = 0.0) -> np.ndarray:
        """One unbiased sample (n, 3) [W·m⁻²] of the shadowed irradiance that ``source`` (an index, or (n,) indices) gives.

        ``points`` (n, 3); ``normals`` and ``geometric`` (n, 3): unit shading and face normals turned to the receiving side;
        ``reach`` (n,): how far the rays travelled that found the points, for the offset; ``uv`` (n, 2) in [0, 1); ``primitive``
        (n,): the triangles that they lie on, for light linking. ``turn``: what to shift ``uv`` by on the torus.
        """
        tracer = self._kernel_tracer(source, primitive)
        if tracer is not None:
            light, rays = self._lamps.records.light(tracer.kernel, source, points, normals, geometric, reach, uv, turn)
            record(rays)
            return light
        if turn:
            uv = wrapped(uv + np.float32(turn))
        direction, distance, irradiance = self._sample(source, points, uv)
        cosine = dot(normals, direction)
        lit = (cosine > 0) & (dot(geometric, direction) > 0) & (irradiance[:, 0] + irradiance[:, 1] + irradiance[:, 2] > 0)
        context = self._context
        if context.links.has_receivers and primitive is not None:
            lit &= context.links.lamp_lights(source, context.geometry.instance[primitive])
        shadowed = lit & self.casts_shadow[source]
        rows = np.flatnonzero(shadowed)
        arriving = irradiance * np.where(lit, cosine, 0)[:, None]
        if rows.size:
            origins = offset_origins(points[rows], geometric[rows], direction[rows], reach[rows])
            delta = self.is_delta[source] if np.ndim(source) == 0 else self.is_delta[source[rows]]
            arriving[rows] *= context.lamp_transmittance(delta, origins, direction[rows], short_of(distance[rows]),
                                                         self._blockers(source, rows))
        return arriving

    def _kernel_tracer(self, source, primitive) -> Tracer | None:
        """What the kernels trace shadow rays to ``source`` through, None where numpy must: there is a profile, linking, a medium,
        something that lets light through in the way, or sky among the sources."""
        context = self._context
        if self._lamps.records is None or (np.any(np.asarray(source) >= self._bright_index) if self._bright.count else False):
            return None
        if (context.links.has_receivers and primitive is not None) or context.links.has_blockers:
            return None
        if not context.media_in_shadow.is_empty:
            return None
        tracer = context.shadows.tracer(0, False)
        # Lamps without a size are told apart where surfaces are glass alone, which no tracer with a kernel knows.
        return tracer if getattr(tracer, "kernel", None) and tracer is context.shadows.tracer(0, True) else None

    def facing_irradiance(self, source: int, points, uv) -> tuple[np.ndarray, np.ndarray]:
        """Direction (n, 3) of one source seen from points in free space, and its shadowed irradiance (n, 3) on a plane that
        faces that direction."""
        direction, distance, irradiance = self._sample(source, points, uv)
        if self.casts_shadow[source]:
            irradiance = irradiance * self._context.lamp_transmittance(
                self.is_delta[source], points, direction, short_of(distance), self._blockers(source))
        return direction, irradiance

    def lamp_samples(self, lamps: Sequence[int], seed: int, samples: int) -> Iterator[tuple[int, np.float32, np.ndarray]]:
        """(lamp, how many samples it has, numbers (2,) in [0, 1)) of every sample of ``lamps`` (indices): ``samples`` of each with
        an extent, a single one of others."""
        for lamp in lamps:
            count = 1 if self.is_delta[lamp] else samples
            for numbers in sobol_owen(count, 2, hash_u32(seed, lamp, _LAMP_STREAM)):
                yield lamp, np.float32(count), numbers

    def lamp_coefficients(self, lamps: Sequence[int], points, order: int, seed: int, samples: int) -> np.ndarray:
        """The direct light of ``lamps`` (indices) at free ``points`` (n, 3), from ``samples`` of each that has an extent: SH
        coefficients (n, (order + 1)², 3) float64 of radiance."""
        result = np.zeros((len(points), sh.coefficient_count(order), 3))
        for lamp, count, numbers in self.lamp_samples(lamps, seed, samples):
            directions, irradiance = self.facing_irradiance(lamp, points, np.tile(numbers, (len(points), 1)))
            result += sh.evaluate(directions, order)[:, :, None] * (irradiance / count)[:, None, :]
        return result

    def importances(self, points, normals) -> np.ndarray:
        """Luminance (count, n) of the unshadowed irradiance of every source: what to choose sources by, and nothing else."""
        lamps = self._lamps.luminance_unshadowed(points, normals)
        if self.count == self._lamps.count:
            return lamps
        return np.concatenate([lamps, np.full((1, len(points)), luminance(self._bright.irradiance_estimate), np.float32)])

    def weights_in_space(self, points: np.ndarray) -> np.ndarray:
        """What to choose sources by (count, n) at each of ``points`` (n, 3) in free space, never 0: their unshadowed light on a
        small cube there."""
        return 1e-30 + sum(self.importances(points, np.broadcast_to(np.float32(side), points.shape)).astype(np.float64)
                           for side in np.concatenate([np.eye(3), -np.eye(3)]))

    def choose_in_space(self, points: np.ndarray, u: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """One source (n,) for each of ``points`` (n, 3) in free space by ``u`` (n,) in [0, 1), and how likely it was (n,)."""
        return choose_among(self.weights_in_space(points), u)

    @cached_property
    def standing(self) -> dict[int, Standing]:
        """The lamps that stand somewhere and whose light media scatter, by their numbers."""
        found = np.flatnonzero(~self._lamps.is_distant & (self._lamps.scattered > 0)).tolist()
        lights = {lamp: self._context.scene.lights[lamp] for lamp in found}
        return {lamp: Standing(light.position_world, kind_of(light).extent(light), float(self._lamps.power_estimate[lamp]),
                               not isinstance(light, PointLight) or light.profile is not None)
                for lamp, light in lights.items()}

    def limited(self) -> dict[int, list[int]]:
        """The lamps whose light may be reflected so often alone (see ``Lamp.max_bounces``), by how often, ascending."""
        limits = self._lamps.max_bounces
        return {int(limit): np.flatnonzero(limits == limit).tolist() for limit in np.unique(limits) if limit < UNLIMITED}

    def _blockers(self, source, rows=slice(None)):
        if not self._context.links.has_blockers:
            return 0
        return self._context.links.lamp_blockers(source if np.ndim(source) == 0 else source[rows])

    def _sample(self, source, points, uv):
        if np.ndim(source) == 0:
            return self._sample_bright(uv) if source == self._bright_index else self._sample_lamps(int(source), points, uv)
        bright = source == self._bright_index
        if not bright.any():
            return self._sample_lamps(source, points, uv)
        parts = np.empty((len(points), 3), np.float32), np.empty(len(points), np.float32), np.empty((len(points), 3), np.float32)
        for rows, sampled in ((np.flatnonzero(~bright), False), (np.flatnonzero(bright), True)):
            if rows.size:
                values = self._sample_bright(uv[rows]) if sampled else self._sample_lamps(source[rows], points[rows], uv[rows])
                for part, value in zip(parts, values, strict=True):
                    part[rows] = value
        return parts

    def _sample_lamps(self, source, points, uv):
        sample = self._lamps.sample(source, points, uv)
        return sample.direction, sample.distance, sample.irradiance

    def _sample_bright(self, uv):
        direction, weight = self._bright.sample(uv)
        return direction, np.full(len(uv), np.inf, np.float32), weight
