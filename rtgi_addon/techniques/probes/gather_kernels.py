"""What ``gather`` leaves to the compiled kernels where they can follow."""

import numpy as np

from ... import kernels
from ...transport.cache.texel_table import SurfaceHits
from ...transport.cache.texels import TexelLayout
from ...transport.rays.ray_counter import record
from ...transport.rays.tracer import Tracer

# As in kernels/src/gather.c: SH of order 8.
_MOST_COEFFICIENTS = 81


def follows(tracer: Tracer) -> bool:
    """Whether the kernels trace just what ``tracer`` does: no surface lets rays through, and none is hidden from some of them."""
    return kernels.is_available() and getattr(tracer, "kernel", None) is not None


def traced(tracer: Tracer, layout: TexelLayout, positions: np.ndarray, directions: np.ndarray):
    """What rays from ``positions`` (g, m, 3) along ``directions`` (g·n, 3) hit: SurfaceHits (h,), their rows (h,) int32 in the
    order (g, n, m), distances (h,) and cosines (h,) as ``Traced`` has them."""
    g, m = positions.shape[:2]
    n, rays = len(directions) // max(g, 1), len(directions) * m
    record(rays)
    rows, primitive, slots = np.empty((3, rays), np.int32)
    u, v, t, cosine = np.empty((4, rays), np.float32)
    # Held while the kernel reads it: threads that ask for it first may each make one, of which one stays.
    cells = layout.cells
    count = kernels.call("trace", tracer.kernel, len(cells), cells.ctypes.data, g, n, m,
                         np.ascontiguousarray(positions, np.float32), np.ascontiguousarray(directions, np.float32), rows, primitive,
                         u, v, t, slots, cosine)
    # Copies where that frees much: what is held until it is shaded is most of a batch's memory.
    rows, primitive, slots, u, v, t, cosine = (part[:count].copy() for part in (rows, primitive, slots, u, v, t, cosine))
    return SurfaceHits(primitive, u, v, slots), rows, t, cosine


def ray_points(shape: tuple[int, int, int], normals: np.ndarray, positions: np.ndarray, traced,
               rows: np.ndarray) -> tuple[np.ndarray, np.ndarray] | None:
    """Where the hits ``rows`` (c,) of an item of ``shape`` (g, n, m) that ``traced`` holds lie, by ``positions`` (g, m, 3) of its
    probes, and the ``normals`` (t, 3) of their triangles on the side that was met: (c, 3) each. None without the kernels."""
    if not kernels.is_available():
        return None
    (g, n, m), hits, count = shape, traced.surface, len(traced.rows)
    if positions.shape != (g, m, 3) or traced.directions.shape != (g * n, 3) or len(hits.slots) != count:
        raise ValueError(f"{positions.shape} positions and {traced.directions.shape} directions of rays {shape}")
    points, faces = np.empty((2, len(rows), 3), np.float32)
    kernels.call("ray_points", len(rows), np.ascontiguousarray(rows, np.int64), count, traced.rows, g, n, m,
                 np.ascontiguousarray(positions, np.float32), np.ascontiguousarray(traced.directions, np.float32), traced.t,
                 len(normals), normals, hits.primitive, hits.slots, points, faces)
    return points, faces


def shifted(shape: tuple[int, int, int], numbers: np.ndarray, probes: np.ndarray, rows: np.ndarray,
            shifts: np.ndarray) -> np.ndarray:
    """``numbers`` (g, n, d) of directions for the rays ``rows`` (h,) int32 of ``shape`` (g, n, m), shifted on the torus by the
    ``shifts`` (p, d) of their probes, which are ``probes`` (g, m): (h, d)."""
    dimensions, result = numbers.shape[2], np.empty((len(rows), numbers.shape[2]), np.float32)
    kernels.call("shifted", len(rows), np.ascontiguousarray(rows, np.int32), *shape, numbers, dimensions,
                 np.ascontiguousarray(probes, np.int64), len(shifts), shifts, result)
    return result


def project(basis: np.ndarray, radiance: np.ndarray) -> np.ndarray:
    """Sum over directions of ``basis`` (g, n, k) times ``radiance`` (g, n, m, c): (g, m, k, c)."""
    g, n, m, channels = radiance.shape
    # OpenBLAS starts threads of its own for products of 2^18 multiplications or more, which under our threads only wait for each
    # other; a block of rays stays below.
    products = np.matmul(basis.transpose(0, 2, 1), radiance.reshape(g, n, m * channels))
    return products.reshape(g, -1, m, channels).transpose(0, 2, 1, 3)


def can_project(basis: np.ndarray) -> bool:
    """Whether ``projected`` takes ``basis`` (g, n, k)."""
    return kernels.is_available() and basis.shape[2] <= _MOST_COEFFICIENTS


def projected(shape: tuple[int, int, int], basis: np.ndarray, rows: np.ndarray, radiance: np.ndarray,
              sky: np.ndarray | None) -> np.ndarray:
    """Sums (g, m, k, 3) over the rays of ``shape`` (g, n, m) of ``basis`` (g, n, k) times ``radiance`` (h, 3), of the ``rows`` (h,)
    int32, ascending, and ``sky`` (g·n, 3) of all others (None: 0)."""
    (g, n, m), k = shape, basis.shape[2]
    if basis.shape[:2] != (g, n) or len(rows) != len(radiance) or (sky is not None and sky.shape != (g * n, 3)):
        raise ValueError(f"basis {basis.shape}, {len(rows)} rows and {radiance.shape} radiance of rays {shape}")
    sums = np.empty((g, m, k, 3), np.float32)
    kernels.call("project", g, n, m, k, np.ascontiguousarray(basis, np.float32), len(rows), rows,
                 np.ascontiguousarray(radiance, np.float32), None if sky is None else np.ascontiguousarray(sky, np.float32), sums)
    return sums


def projected_texels(shape: tuple[int, int, int], basis: np.ndarray, radiance: np.ndarray, texel: np.ndarray,
                     sky: np.ndarray | None) -> np.ndarray:
    """Sums (g, m, k, 3) over the rays of ``shape`` (g, n, m) of ``basis`` (g, n, k) times the ``radiance`` (texels, 4) of the
    ``texel`` (g, n, m) int32 that each hit, and ``sky`` (g·n, 3) of all others (None: 0)."""
    (g, n, m), k = shape, basis.shape[2]
    if basis.shape[:2] != (g, n) or texel.shape != shape or radiance.shape[1:] != (4,) or (
            sky is not None and sky.shape != (g * n, 3)):
        raise ValueError(f"basis {basis.shape}, {texel.shape} texels and {radiance.shape} radiance of rays {shape}")
    sums = np.empty((g, m, k, 3), np.float32)
    kernels.call("project_texels", g, n, m, k, np.ascontiguousarray(basis, np.float32), len(radiance),
                 np.ascontiguousarray(radiance, np.float32), np.ascontiguousarray(texel, np.int32),
                 None if sky is None else np.ascontiguousarray(sky, np.float32), sums)
    return sums


def visibility(shape: tuple[int, int, int], early: np.ndarray, cell: np.ndarray, cells: int, reach: np.ndarray, rows: np.ndarray,
               t: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Sums (g, m, cells, 2) of distance and squared distance over the rays of ``shape`` (g, n, m) in each ``cell`` (g·n,) of a tile
    of ``cells``, and their numbers (g, 1, cells), of the blocks that are ``early`` (g,) bool: hits ``rows`` (h,) int32 are ``t``
    (h,) away, and nothing is further than ``reach`` (g, m)."""
    g, n, m = shape
    sums, weights = np.zeros((g, m, cells, 2), np.float32), np.zeros((g, 1, cells), np.float32)
    kernels.call("visibility", g, n, m, cells, early, np.ascontiguousarray(cell, np.int32), np.ascontiguousarray(reach, np.float32),
                 len(rows), rows, t, sums, weights)
    return sums, weights
