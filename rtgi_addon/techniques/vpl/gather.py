"""The light of virtual lights at receivers: every pair of a receiver and a light, with one shadow ray wherever it could count.

E = Σ Φ/π·G·V with G = cosθ·cosθ'/r² (Keller 1997), G cut at a bound b where one is given (Kollig and Keller, "Illumination in
the Presence of Weak Singularities", MCQMC 2004). Vectors stay unnormalized, so a pair costs no square root: a shadow ray runs from
the receiver at t = 0 to the light at t = 1, both of which lie off their surfaces by what a float ray needs.
"""

from collections.abc import Callable
from itertools import product

import numpy as np

from ... import kernels
from ...numerics import sh
from ...transport.context import LightContext
from ...transport.parallel import chunks, parallel_for
from ...transport.rays.ray_counter import record
from ...transport.rays.tracer import attenuate, offset_origins
from .virtual_lights import VirtualLights

# Pairs worked on at once: small enough that a dozen arrays of them stay in cache, and large enough to hide Python's overhead.
BLOCK_PAIRS = 1 << 15
# Lights of one block: few receivers share a block with them, so that rays of one start close together.
BLOCK_LIGHTS = 1 << 11
INVERSE_PI = np.float32(1.0 / np.pi)
_TINY = np.float32(1e-30)
# Vectors to lights are not normalized: a shadow ray ends at 1 of them.
_WHOLE_WAY = np.float32(1.0)


def gather(context: LightContext, lights: VirtualLights, points: np.ndarray, normals: np.ndarray, *, clamp: float | None = None,
           shadows: bool = True, threads: int | None = None) -> np.ndarray:
    """Irradiance (n, 3) float32 [W·m⁻²] at surface ``points`` (n, 3) with unit ``normals`` (n, 3) of all ``lights``.

    ``clamp`` [m⁻²] bounds G; ``shadows`` False leaves out the shadow rays (of VPLs and distant lights alike).
    """
    normals = np.ascontiguousarray(normals, np.float32)
    points = offset_origins(np.ascontiguousarray(points, np.float32), normals, normals)
    tracer = getattr(context.tracer, "kernel", None)

    def block(rows, some):
        if kernels.is_available() and (tracer or not shadows):
            return _by_kernel(tracer if shadows else None, some, points[rows], normals[rows], clamp)
        towards, transfer = transfer_of(points[rows], normals[rows], some, clamp)
        tint = cast_shadows(context, points[rows], towards, transfer) if shadows else None
        return _coloured_sum(transfer, tint, some.flux * INVERSE_PI)

    def distant(rows):
        cosine = np.maximum(normals[rows] @ lights.directions.T, 0)
        tint = _shadow_distant(context, points[rows], lights.directions, cosine) if shadows else None
        return _coloured_sum(cosine, tint, lights.irradiance)

    return _over_blocks(lights, len(points), (3,), block, distant, threads)


def _by_kernel(tracer: int | None, lights: VirtualLights, points: np.ndarray, normals: np.ndarray,
               clamp: float | None) -> np.ndarray:
    """Irradiance (n, 3) of all ``lights`` but the distant ones, with shadows through ``tracer`` unless that is None."""
    n, irradiance = len(points), np.empty((len(points), 3), np.float32)
    arrays = (lights.positions, lights.normals, lights.flux * INVERSE_PI)
    if any(array.shape != (lights.count, 3) for array in arrays) or points.shape != (n, 3) or normals.shape != (n, 3):
        raise ValueError(f"{lights.count} lights with {[array.shape for array in arrays]}, {points.shape}, {normals.shape}")
    record(kernels.call("virtual_lights", tracer, lights.count, *(np.ascontiguousarray(array, np.float32) for array in arrays), n,
                        points, normals, -1.0 if clamp is None else clamp, irradiance))
    return irradiance


def gather_visible(lights: VirtualLights, points: np.ndarray, normals: np.ndarray, visibility: np.ndarray | None,
                   clamp: float | None) -> np.ndarray:
    """As ``gather`` for the VPLs alone, with ``visibility`` (n, m) bool known (None: everything sees everything)."""
    points, normals = np.asarray(points, np.float32), np.asarray(normals, np.float32)
    result = np.zeros((len(points), 3), np.float32)
    for rows, columns in _blocks(len(points), lights.count):
        some = lights.take(columns)
        _, transfer = transfer_of(points[rows], normals[rows], some, clamp)
        if visibility is not None:
            transfer *= visibility[rows, columns]
        result[rows] += transfer @ (some.flux * INVERSE_PI)
    return result


def visibility(context: LightContext, lights: VirtualLights, points: np.ndarray, normals: np.ndarray) -> np.ndarray:
    """(n, m) bool: which VPLs light which receivers at all, by shadow rays on the CPU; for kernels that cannot trace."""
    normals = np.ascontiguousarray(normals, np.float32)
    points = offset_origins(np.ascontiguousarray(points, np.float32), normals, normals)
    result = np.zeros((len(points), lights.count), bool)
    blocks = _blocks(len(points), lights.count)

    def work(i):
        rows, columns = blocks[i]
        towards, transfer = transfer_of(points[rows], normals[rows], lights.take(columns), None)
        tint = cast_shadows(context, points[rows], towards, transfer)
        result[rows, columns] = (transfer > 0) & (True if tint is None else tint.any(axis=2))

    parallel_for(work, len(blocks), context.threads)
    return result


def gather_sh(context: LightContext, lights: VirtualLights, points: np.ndarray, order: int, *, clamp: float | None = None,
              threads: int | None = None) -> np.ndarray:
    """SH coefficients (n, (order + 1)², 3) float32 of the radiance that ``lights`` send to free ``points`` (n, 3).

    There is no cosine at a free point: ``clamp`` bounds cosθ'/r².
    """
    points = np.ascontiguousarray(points, np.float32)
    count = sh.coefficient_count(order)
    distant_basis = sh.evaluate(lights.directions, order)

    def block(rows, some):
        towards, transfer = transfer_of(points[rows], None, some, clamp)
        tint = cast_shadows(context, points[rows], towards, transfer)
        directions = np.stack(towards, axis=-1)
        directions /= np.sqrt(np.maximum(np.einsum("rmx,rmx->rm", directions, directions), _TINY))[..., None]
        basis = np.moveaxis(sh.evaluate(directions, order), -1, 0) * transfer
        if tint is None:
            return np.moveaxis(basis @ (some.flux * INVERSE_PI), 0, 1)
        return np.einsum("krm,rmc,mc->rkc", basis, tint, some.flux * INVERSE_PI, optimize=True)

    def distant(rows):
        seen = np.ones((rows.stop - rows.start, lights.distant_count), np.float32)
        tint = _shadow_distant(context, points[rows], lights.directions, seen)
        if tint is None:
            return np.einsum("rm,mk,mc->rkc", seen, distant_basis, lights.irradiance, optimize=True)
        return np.einsum("rm,rmc,mk,mc->rkc", seen, tint, distant_basis, lights.irradiance, optimize=True)

    return _over_blocks(lights, len(points), (count, 3), block, distant, threads)


def _blocks(points: int, lights: int) -> list[tuple[slice, slice]]:
    """Pairs of slices that cover receivers and lights; the same for any number of threads."""
    return list(product(chunks(points, _block_rows(lights)), chunks(lights, BLOCK_LIGHTS)))


def _block_rows(lights: int) -> int:
    """Receivers of one block where there are ``lights``."""
    return max(1, BLOCK_PAIRS // min(max(lights, 1), BLOCK_LIGHTS))


def _over_blocks(lights: VirtualLights, count: int, shape: tuple[int, ...], block: Callable, distant: Callable,
                 threads: int | None) -> np.ndarray:
    """Sum of ``block(rows, lights)`` over blocks of VPLs and of ``distant(rows)``: (count, *shape) float32."""
    result = np.zeros((count, *shape), np.float32)
    parts = [lights.take(columns) for columns in chunks(lights.count, BLOCK_LIGHTS)]
    spans = chunks(count, _block_rows(max(lights.count, lights.distant_count)))

    def work(i):
        rows = spans[i]
        for some in parts:
            result[rows] += block(rows, some)
        if lights.distant_count:
            result[rows] += distant(rows)

    parallel_for(work, len(spans), threads)
    return result


def transfer_of(points, normals, lights: VirtualLights, clamp):
    """Vectors to the lights, a component (r, m) each, and G (r, m), 0 where either faces away. ``normals`` None: free points."""
    dx, dy, dz = (lights.positions[:, axis] - points[:, axis, None] for axis in range(3))
    squared, term = dx * dx, dy * dy
    squared += term
    np.multiply(dz, dz, out=term)
    squared += term
    light_normals = -lights.normals
    transfer = dx * light_normals[:, 0]
    for d, axis in ((dy, 1), (dz, 2)):
        np.multiply(d, light_normals[:, axis], out=term)
        transfer += term
    np.maximum(transfer, 0, out=transfer)
    if normals is None:
        # cosθ'/r² = (n'·d)/r³
        np.sqrt(squared, out=term)
        squared *= term
    else:
        cosine = dx * normals[:, :1]
        for d, axis in ((dy, 1), (dz, 2)):
            np.multiply(d, normals[:, axis, None], out=term)
            cosine += term
        np.maximum(cosine, 0, out=cosine)
        transfer *= cosine
        squared *= squared
    np.maximum(squared, _TINY, out=squared)
    transfer /= squared
    if clamp is not None:
        np.minimum(transfer, np.float32(clamp), out=transfer)
    return (dx, dy, dz), transfer


def _coloured_sum(transfer: np.ndarray, tint: np.ndarray | None, colours: np.ndarray) -> np.ndarray:
    """Sums (r, 3) of ``transfer`` (r, m) times the lights' ``colours`` (m, 3), and each pair's ``tint`` (r, m, 3) if any."""
    return transfer @ colours if tint is None else np.einsum("rm,rmc,mc->rc", transfer, tint, colours, optimize=True)


def cast_shadows(context: LightContext, points: np.ndarray, towards, transfer: np.ndarray) -> np.ndarray | None:
    """Multiply ``transfer`` (r, m) by what surfaces in the way let through; where those have colours, these (r, m, 3) are returned
    instead."""
    flat = transfer.reshape(-1)
    lit = flat > 0
    rows = np.flatnonzero(lit)
    if rows.size == 0:
        return None
    per_point = lit.reshape(transfer.shape).sum(axis=1)
    directions = np.empty((rows.size, 3), np.float32)
    for axis, component in enumerate(towards):
        directions[:, axis] = component.reshape(-1).take(rows)
    passed = context.tracer.transmittance(np.repeat(points, per_point, axis=0), directions, _WHOLE_WAY, looks=True)
    tint = attenuate(flat, rows, passed)
    return None if tint is None else tint.reshape(*transfer.shape, 3)


def _shadow_distant(context: LightContext, points: np.ndarray, directions: np.ndarray, weight: np.ndarray) -> np.ndarray | None:
    """As ``cast_shadows``, for ``weight`` (r, m) of lights far away in ``directions`` (m, 3)."""
    row, column = np.nonzero(weight > 0)
    return attenuate(weight, (row, column), context.tracer.transmittance(points[row], directions[column]))
