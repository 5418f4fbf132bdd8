"""Any field as probe grids: what the bundle stores for techniques that know no lattice of their own.

Probes stand where those of the probe bake do (validity, virtual offset). Their coefficients come from the field's own projection
of radiance where it has one, else from irradiance over many normals: convolution with the cosine lobe multiplies each band by A_l
(Ramamoorthi and Hanrahan, SIGGRAPH 2001, eq. 7), so L_lm = E_lm / A_l wherever A_l is not 0, that is up to order 2.
"""

from collections.abc import Callable
from functools import partial

import numpy as np

from ...numerics import octahedral, sh
from ...numerics.sampling import fibonacci_sphere, hash_u32, random_rotations
from ...progress import Progress
from ...scene import ProbeVolume
from ...scene.memory import BYTES_PER_THREAD
from ...transport.context import LightContext
from ...transport.parallel import CHUNK, chunks, parallel_for, thread_count
from ..base import Field, ProbeGrid, radiance_from_irradiance, require_order_of_irradiance
from .coverage import require_open
from .dilation import dilate
from .placement import Placement, place

# Probes that the field is asked about at once: enough work for every core, little enough that Cancel is felt.
BLOCK = 512
VISIBILITY_RAYS = 512
# A ray that measures distances, with what comes of it; measured as in scene/memory.py.
BYTES_PER_RAY = 90
VISIBILITY_RESOLUTION = 8
# Tells the turn of the rays that measure distances apart from all other numbers of a seed: the letters vi.
_VISIBILITY = 0x7669
# How far the bake of the grids is when probes are placed, and when their distances are measured.
_PLACED, _MEASURED = 0.05, 0.2


def resample(field: Field, context: LightContext, volumes: tuple[ProbeVolume, ...], order: int, progress: Progress, *,
             seed: int = 0, threads: int | None = None,
             radiance_sh: Callable[[np.ndarray], np.ndarray] | None = None) -> tuple[ProbeGrid, ...]:
    """``field`` on the lattices of ``volumes``, one grid each; ``standard_error`` is NaN, probes inside geometry are dilated.

    ``radiance_sh`` maps free points (n, 3) to SH coefficients of incident radiance (n, (order + 1)², 3); without it they are
    taken from ``field.irradiance``, for ``order`` up to 2. ``seed`` turns the rays that measure distances. Raises UsageError
    for an order beyond that, NoUsableProbe, Cancelled when asked to stop.
    """
    if radiance_sh is None:
        require_order_of_irradiance(field, order)
        radiance_sh = partial(radiance_from_irradiance, field, order=order)
    placement = place(context, volumes, True, progress.span(0.0, _PLACED))
    require_open(volumes, placement.measured)
    visibility = _visibility(context, placement, seed, threads, progress.span(_PLACED, _MEASURED))
    coefficients = np.zeros((len(placement.positions), sh.coefficient_count(order), 3), np.float32)
    probes = np.flatnonzero(placement.measured)
    for span in chunks(len(probes), BLOCK):
        progress.step(_MEASURED + (1.0 - _MEASURED) * span.start / len(probes), "resampling to probes")
        coefficients[probes[span]] = radiance_sh(placement.positions[probes[span]])
    return tuple(dilate(grid) for grid in _cut(placement, volumes, coefficients, visibility))


def thread_bytes(context: LightContext, gathers: bool = True) -> int:
    """Memory [bytes] of all threads together while the volumes of ``context`` are resampled, by a field that ``gathers`` light
    anew at every probe or looks it up."""
    threads = thread_count(context.threads)
    probes = sum(int(np.prod(volume.resolution)) for volume in context.scene.volumes)
    working, measuring = BYTES_PER_THREAD * threads, BYTES_PER_RAY * min(probes * VISIBILITY_RAYS, CHUNK * threads)
    # What was taken for distances is not given back before light is gathered.
    return working + measuring if gathers else max(working, measuring)


def _visibility(context: LightContext, placement: Placement, seed: int, threads: int | None, progress: Progress) -> np.ndarray:
    """Octahedral tiles (p, T², 2) of mean and mean squared distance, clamped to each probe's reach."""
    rotation = random_rotations(1, np.random.default_rng(int(hash_u32(seed, _VISIBILITY))))[0]
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
