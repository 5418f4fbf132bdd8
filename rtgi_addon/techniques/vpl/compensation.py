"""What a bound on the geometry term takes away, found again by short rays.

Source: T. Kollig and A. Keller, "Illumination in the Presence of Weak Singularities", MCQMC 2004: the part max(0, G − b) of the
light between two surfaces is cut from every virtual light, so it is sampled from the receiver instead, where its 1/r² cancels. It
differs from 0 only where r² < cosθ/b, so the rays are short and few of them hit anything.

The radiance found at their ends is emission plus what lamps and a subset of the virtual lights send there. That subset is bounded
too, so that none of its lights gives more than the mean irradiance, and what this takes away is not looked for again.
"""

from dataclasses import replace

import numpy as np

from ...numerics import sh
from ...numerics.sampling import about, cosine_hemisphere, hash_u32, sobol_owen_at, sphere_from_square, unit_interval
from ...transport.context import LightContext
from ...transport.parallel import CHUNK, chunks, parallel_for
from ...transport.paths.direct import Receiver, lamp_irradiance
from ...transport.paths.wavefront import Vertices
from ...transport.rays.tracer import offset_origins
from ...transport.vectors import dot, normalized
from .gather import gather
from .virtual_lights import VirtualLights

# Virtual lights asked about the light at a ray's end, and how many different subsets of them there are.
SUBSET, SUBSETS = 512, 8


class Compensation:
    """Compensates a bound ``clamp`` [m⁻²] with ``rays`` short rays per receiver; ``bounces`` as in the bake.

    ``natural`` [m⁻²] is the bound at which one of ``lights`` gives the mean irradiance, None for none (see ``mean_bound``).
    """

    def __init__(self, context: LightContext, lights: VirtualLights, clamp: float, natural: float | None, rays: int,
                 bounces: int | None, seed: int):
        self._context, self._clamp, self._rays, self._bounces, self._seed = context, np.float32(clamp), rays, bounces, seed
        # Light that arrives at a ray's end is reflected once more there.
        again = lights if bounces is None else lights.take(np.flatnonzero(lights.bounce < bounces))
        stride = max(1, again.count // SUBSET)
        self._subsets, self._subset_clamp = [], []
        for offset in range(min(stride, SUBSETS)):
            subset = again.take(slice(offset * stride // min(stride, SUBSETS), None, stride))
            gain = np.float32(max(again.count, 1) / max(subset.count, 1))
            # Fewer, brighter lights have larger bright spots.
            self._subset_clamp.append(None if natural is None else natural / float(gain))
            self._subsets.append(replace(subset, flux=subset.flux * gain))

    def irradiance(self, points: np.ndarray, normals: np.ndarray) -> np.ndarray:
        """What ``gather`` with this clamp lacks: (n, 3) float32."""
        normals = np.ascontiguousarray(normals, np.float32)
        origins = offset_origins(np.ascontiguousarray(points, np.float32), normals, normals)

        def directions(rows, u):
            local = cosine_hemisphere(u)
            return normalized(about(normals[rows], local)), np.maximum(local[:, 2], 0)

        def total(receivers, _along, values, count):
            sums = np.stack([np.bincount(receivers, values[:, channel], count) for channel in range(3)], axis=1)
            return sums * (np.pi / self._rays)

        return self._sampled(origins, directions, total, (3,))

    def coefficients(self, points: np.ndarray, order: int) -> np.ndarray:
        """What ``gather_sh`` with this clamp lacks: (n, (order + 1)², 3) float32."""
        def directions(rows, u):
            return sphere_from_square(u), np.ones(len(u), np.float32)

        def total(receivers, along, values, count):
            products = sh.evaluate(along, order)[:, :, None] * values[:, None]
            result = np.zeros((count, *products.shape[1:]))
            np.add.at(result, receivers, products)
            return result * (4.0 * np.pi / self._rays)

        return self._sampled(np.ascontiguousarray(points, np.float32), directions, total, (sh.coefficient_count(order), 3))

    def _sampled(self, origins, directions, total, shape) -> np.ndarray:
        """Sums of the residual radiance over each receiver's rays, in chunks over the threads."""
        spans = chunks(len(origins), max(1, CHUNK // self._rays))
        result = np.zeros((len(origins), *shape), np.float32)

        def work(i):
            span = spans[i]
            count = span.stop - span.start
            rows = np.repeat(np.arange(span.start, span.stop), self._rays)
            index = np.tile(np.arange(self._rays), count)
            along, cosine = directions(rows, sobol_owen_at(index, 2, hash_u32(self._seed, rows)))
            hits = self._context.tracer.intersect(origins[rows], along, np.sqrt(cosine / self._clamp))
            close = np.flatnonzero(hits.primitive >= 0)
            if close.size == 0:
                return
            primitive = hits.primitive[close]
            facing = np.abs(dot(self._context.geometry.normals_world[primitive], along[close]))
            geometry_term = cosine[close] * facing / np.maximum(hits.t[close] ** 2, np.float32(1e-30))
            residual = 1.0 - self._clamp / np.maximum(geometry_term, np.float32(1e-30))
            cut = np.flatnonzero(residual > 0)
            close, residual = close[cut], residual[cut]
            met = Vertices(primitive[cut], hits.u[close], hits.v[close], hits.t[close], along[close])
            radiance = self._radiance(met, rows[close])
            if hits.tint is not None:
                radiance = radiance * hits.tint[close]
            result[span] = total(rows[close] - span.start, along[close], radiance * residual[:, None], count)

        parallel_for(work, len(spans), self._context.threads)
        return result

    def _radiance(self, met: Vertices, rows: np.ndarray) -> np.ndarray:
        """Radiance (h, 3) that leaves where the rays of receivers ``rows`` (h,) ``met`` surfaces, against them."""
        context, surfaces, primitive = self._context, self._context.surfaces, met.primitive
        cosine = met.cosine(context)
        radiance = np.zeros((len(primitive), 3), np.float32)
        if surfaces.has_emission:
            radiance = surfaces.emission(primitive, met.u, met.v, cosine)
        if self._bounces == 0 or len(primitive) == 0:
            return radiance
        scattered = surfaces.albedo(primitive, met.u, met.v, cosine) * self._irradiance(*met.facing(context), primitive, rows)
        if surfaces.has_translucency:
            chosen = np.flatnonzero(surfaces.translucent[context.geometry.material[primitive]])
            through = met.take(chosen)
            passed = surfaces.translucency(through.primitive, through.u, through.v, cosine[chosen])
            behind = through.facing(context, np.ones(len(chosen), bool))
            scattered[chosen] += passed * self._irradiance(*behind, through.primitive, rows[chosen])
        return radiance + scattered * np.float32(1.0 / np.pi)

    def _irradiance(self, points: np.ndarray, geometric: np.ndarray, shading: np.ndarray, primitive: np.ndarray,
                    rows: np.ndarray) -> np.ndarray:
        """Irradiance (h, 3) at ``points`` (h, 3) on triangles ``primitive`` (h,) with two normals, found by rays of the receivers
        ``rows`` (h,)."""
        context, irradiance = self._context, np.zeros((len(points), 3), np.float32)
        if context.lamps.count:
            numbers = np.stack([hash_u32(self._seed, rows, np.arange(len(rows)), d) for d in range(3)], axis=1)
            irradiance += lamp_irradiance(context, points, Receiver(shading, geometric, primitive), unit_interval(numbers))
        for number, lights in enumerate(self._subsets):
            chosen = np.flatnonzero(rows % len(self._subsets) == number)
            if chosen.size:
                irradiance[chosen] += gather(context, lights, points[chosen], shading[chosen], clamp=self._subset_clamp[number],
                                             threads=1)
        return irradiance
