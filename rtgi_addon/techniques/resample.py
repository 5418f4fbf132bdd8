"""Any field as probe grids: what the bundle stores for techniques that know no lattice of their own.

Probes stand where those of the probe bake do (validity, virtual offset). Their coefficients come from the field's own projection
of radiance where it has one, else from irradiance over many normals: convolution with the cosine lobe multiplies each band by A_l
(Ramamoorthi and Hanrahan, SIGGRAPH 2001, eq. 7), so L_lm = E_lm / A_l wherever A_l is not 0, that is up to order 2.
"""

from collections.abc import Callable

import numpy as np

from ..errors import UsageError
from ..numerics import octahedral, sh
from ..numerics.sampling import fibonacci_sphere, hash_u32, random_rotations
from ..progress import Progress
from ..scene import ProbeVolume
from ..transport.context import LightContext
from ..transport.parallel import CHUNK, chunks, parallel_for
from .base import Field, ProbeGrid
from .probes.dilation import dilate
from .probes.placement import Placement, place

# Probes that the field is asked about at once: enough work for every core, little enough that Cancel is felt.
BLOCK = 512
# Irradiance is integrated exactly against SH of order 2 up to its own band 8: 66 normals.
QUADRATURE_DEGREE = 10
MAX_QUADRATURE_ORDER = 2
VISIBILITY_RAYS = 512
VISIBILITY_RESOLUTION = 8


def resample(field: Field, context: LightContext, volumes: tuple[ProbeVolume, ...], order: int, progress: Progress, *,
             seed: int = 0, threads: int | None = None,
             radiance_sh: Callable[[np.ndarray], np.ndarray] | None = None) -> tuple[ProbeGrid, ...]:
    """``field`` on the lattices of ``volumes``, one grid each; ``standard_error`` is NaN, probes inside geometry are dilated.

    ``radiance_sh`` maps free points (n, 3) to SH coefficients of incident radiance (n, (order + 1)², 3); without it they are
    taken from ``field.irradiance``, for ``order`` up to 2. ``seed`` turns the rays that measure distances. Raises UsageError
    for an order beyond that, Cancelled when asked to stop.
    """
    if radiance_sh is None:
        if order > MAX_QUADRATURE_ORDER:
            raise UsageError(f"order is {order}", f"{field.technique} knows irradiance only: choose an order from 0 to "
                                                  f"{MAX_QUADRATURE_ORDER}")
        radiance_sh = _from_irradiance(field, order)
    placement = place(context, volumes, True, progress.span(0.0, 0.05))
    visibility = _visibility(context, placement, seed, threads, progress.span(0.05, 0.2))
    coefficients = np.zeros((len(placement.positions), sh.coefficient_count(order), 3), np.float32)
    probes = np.flatnonzero(placement.measured)
    for span in chunks(len(probes), BLOCK):
        progress.step(0.2 + 0.8 * span.start / len(probes), "resampling to probes")
        coefficients[probes[span]] = radiance_sh(placement.positions[probes[span]])
    return tuple(dilate(grid) for grid in _cut(placement, volumes, coefficients, visibility))


def _from_irradiance(field: Field, order: int) -> Callable[[np.ndarray], np.ndarray]:
    normals, solid_angles = sh.quadrature(QUADRATURE_DEGREE)
    deconvolved = sh.evaluate(normals, order) * (solid_angles[:, None] / sh.cosine_coefficients(order))
    normals = normals.astype(np.float32)

    def radiance_sh(points):
        irradiance = field.irradiance(np.repeat(points, len(normals), axis=0), np.tile(normals, (len(points), 1)))
        return np.einsum("pnc,nk->pkc", irradiance.reshape(len(points), len(normals), 3), deconvolved)

    return radiance_sh


def _visibility(context: LightContext, placement: Placement, seed: int, threads: int | None, progress: Progress) -> np.ndarray:
    """Octahedral tiles (p, T², 2) of mean and mean squared distance, clamped to each probe's reach."""
    rotation = random_rotations(1, np.random.default_rng(int(hash_u32(seed, 0x7669))))[0]
    directions = (fibonacci_sphere(VISIBILITY_RAYS) @ rotation.T).astype(np.float32)
    cell = octahedral.texel_index(directions, VISIBILITY_RESOLUTION)
    order = np.argsort(cell, kind="stable")
    directions, cell = directions[order], cell[order]
    cells, first, count = np.unique(cell, return_index=True, return_counts=True)
    spans = chunks(len(placement.positions), CHUNK // VISIBILITY_RAYS)

    def trace(i):
        origins, reach = placement.positions[spans[i]], placement.reach[spans[i]]
        hits = context.tracer.intersect(np.repeat(origins, VISIBILITY_RAYS, axis=0), np.tile(directions, (len(origins), 1)))
        t = np.minimum(hits.t.reshape(len(origins), VISIBILITY_RAYS), reach[:, None])
        moments = np.stack([np.add.reduceat(t, first, axis=1), np.add.reduceat(t * t, first, axis=1)], axis=-1)
        return moments / count[None, :, None].astype(np.float32)

    assert len(cells) == VISIBILITY_RESOLUTION**2
    parts = parallel_for(trace, len(spans), threads, progress, "distances of probes")
    return np.concatenate(parts)


def _cut(placement: Placement, volumes, coefficients: np.ndarray, visibility: np.ndarray):
    """One grid per volume from arrays over all probes."""
    start = 0
    for volume in volumes:
        shape = tuple(int(count) for count in reversed(volume.resolution))
        span = slice(start, start + int(np.prod(shape)))
        start = span.stop
        tile = (VISIBILITY_RESOLUTION, VISIBILITY_RESOLUTION, 2)
        yield ProbeGrid(volume, coefficients[span].reshape(*shape, -1, 3), placement.validity[span].reshape(shape),
                        visibility[span].reshape(*shape, *tile), placement.offset[span].reshape(*shape, 3),
                        np.full(shape, np.nan, np.float32))
