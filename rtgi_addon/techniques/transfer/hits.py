"""What probes' rays find, without any light: how much of the sky, and which texels, as matrices.

M_sky = Σ w·V·YᵢYⱼ over a probe's rays and G = Σ w·Yᵢ/π over those that meet a texel, the two parts of
Mᵢⱼ = ∫ Yᵢ(ω)·[V·Yⱼ(ω) + (1 − V)·Bⱼ(x(ω))/π] dω (Sloan, Kautz and Snyder, "Precomputed Radiance Transfer", SIGGRAPH 2002, §5;
the split is that of Far Cry 3: Stefanov, "Deferred Radiance Transfer Volumes", GDC 2012).
"""

from dataclasses import dataclass

import numpy as np

from ...numerics import sh
from ...transport.cache.columns import leaving_columns
from ...transport.cache.surface_cache import SurfaceCache
from ...transport.parallel import CHUNK, chunks
from ..probes.gather import Gatherer, Traced
from ..probes.items import Item

# Columns that are gathered together. OpenBLAS starts threads of its own for products of 2^18 multiplications or more, which under
# our threads only wait for each other.
_AT_ONCE, _MULTIPLICATIONS = 96, (1 << 18) - 1


@dataclass(frozen=True, eq=False)
class ProbeHits:
    """What the rays of one probe found: the ``sky`` (k, S) of M_sky, what coloured glass makes of it beyond its brightness,
    ``tinted`` (k, S, 3) or None, and for the ``texels`` (u,) that were hit the ``weights`` (k, u, 3 or 1) of what they reflect,
    and ``passing`` (k, u, 3 or 1) of what light from their other sides adds, or None where ``weights`` take what leaves them as a
    whole."""

    sky: np.ndarray
    tinted: np.ndarray | None
    texels: np.ndarray
    weights: np.ndarray
    passing: np.ndarray | None


def hits_of(gatherer: Gatherer, item: Item, traced: Traced, texel: np.ndarray | None, albedo: np.ndarray | None, order: int,
            sky_order: int) -> list[list[ProbeHits]]:
    """Of every probe of an ``item`` of as many blocks as groups, by block. ``texel`` (h,) of each hit, None if nothing is
    reflected; ``albedo`` (h, 3) there where that varies within triangles."""
    (g, n, m), most = item.shape, max(order, sky_order)
    basis = np.ascontiguousarray(sh.evaluate(traced.directions, most)).reshape(g, n, -1)
    k, columns, scale = sh.coefficient_count(order), sh.coefficient_count(sky_order), np.float32(4.0 * np.pi / n)
    hit = np.full(item.ray_count, -1, np.int64)
    hit[traced.rows] = np.arange(len(traced.rows))
    hit = hit.reshape(g, n, m)
    tint = None if traced.tint is None else traced.tint.reshape(g, n, m, 3)
    result = []
    for block in range(g):
        fix = _balance(basis[block], scale)
        row = []
        for probe in range(m):
            of_probe, filter_ = hit[block, :, probe], None if tint is None else tint[block, :, probe]
            out = np.flatnonzero(of_probe < 0)
            seen = basis[block][out]
            grey = seen if filter_ is None else seen * filter_[out].mean(axis=1, keepdims=True)
            sky = (fix @ (scale * np.einsum("ri,rj->ij", grey, seen)) @ fix)[:k, :columns]
            tinted = None
            if filter_ is not None:
                rest = filter_[out] - filter_[out].mean(axis=1, keepdims=True)
                tinted = scale * np.einsum("ri,rj,rc->ijc", seen[:, :k], seen[:, :columns], rest)
            rays = np.flatnonzero(of_probe >= 0)
            found = of_probe[rays]
            if texel is None or not len(rays):
                row.append(ProbeHits(sky, tinted, np.zeros(0, np.int64), np.zeros((k, 0, 1), np.float32), None))
                continue
            weight = (basis[block][rays, :k] * scale)[:, :, None]
            if filter_ is not None:
                weight = weight * filter_[rays][:, None]
            of_albedo = weight if albedo is None else weight * albedo[found][:, None]
            row.append(ProbeHits(sky, tinted, *_by_texel(texel[found], of_albedo, None if albedo is None else weight)))
        result.append(row)
    return result


def _by_texel(texel, weight, passing):
    """Texels (u,) of those of hits (h,), and the sums over each of ``weight`` and ``passing`` (h, k, c): (k, u, c)."""
    order = np.argsort(texel, kind="stable")
    texels, first = np.unique(texel[order], return_index=True)
    sums = [None if part is None else np.ascontiguousarray(np.add.reduceat(part[order], first, axis=0).swapaxes(0, 1), np.float32)
            for part in (weight, passing)]
    return texels, *sums


def _balance(basis: np.ndarray, scale) -> np.ndarray:
    """S^(−½) (j, j) of S = Σ w·YYᵀ over all rays of a block, which would be 1 for infinitely many: with it what is seen as a
    whole is transferred exactly, eigenvalues stay within 0 and 1, and the matrix symmetric."""
    values, vectors = np.linalg.eigh(scale * np.einsum("ri,rj->ij", basis, basis, dtype=np.float64))
    # Of fewer rays than functions some are not told apart.
    inverse = np.where(values > 1e-3, 1.0 / np.sqrt(np.maximum(values, 1e-3)), 1.0)
    return (vectors * inverse) @ vectors.T


def gathered(hits: ProbeHits, reflected: np.ndarray, passed: np.ndarray | None) -> np.ndarray:
    """What comes to a probe (k, C, 3) float32 of texels whose ``reflected`` radiance is (n, C, 3), by itself where ``hits`` know
    the albedo, with ``passed`` (n, C, 3) from their other sides."""
    k, columns = hits.weights.shape[0], reflected.shape[1]
    result = np.zeros((k, columns, 3), np.float32)
    for part in chunks(columns, _AT_ONCE):
        seen = reflected[hits.texels, part]
        result[:, part] = _product(hits.weights, seen)
        if hits.passing is not None and passed is not None:
            result[:, part] += _product(hits.passing, passed[hits.texels, part])
    return result


def _product(weights: np.ndarray, radiance: np.ndarray) -> np.ndarray:
    if weights.shape[2] == 1:
        return small_products(weights[:, :, 0], radiance.reshape(len(radiance), -1)).reshape(len(weights), -1, 3)
    return np.stack([small_products(weights[:, :, c], radiance[:, :, c]) for c in range(3)], axis=2)


def small_products(left: np.ndarray, right: np.ndarray) -> np.ndarray:
    """``left`` (k, u) times ``right`` (u, c), float32: in pieces for which OpenBLAS starts no threads of its own."""
    result = np.zeros((len(left), right.shape[1]), np.float32)
    for part in chunks(len(right), max(1, _MULTIPLICATIONS // result.size)):
        result += left[:, part] @ right[part]
    return result


def sun_seen(gatherer: Gatherer, positions: np.ndarray, towards: np.ndarray) -> np.ndarray:
    """How much (p, K) float32 of suns ``towards`` (K, 3) is seen from ``positions`` (p, 3): the brightness of what is left."""
    result = np.empty((len(positions), len(towards)), np.float32)
    for part in chunks(len(positions), max(1, CHUNK // len(towards))):
        origins = np.repeat(positions[part], len(towards), axis=0)
        rays = np.tile(towards.astype(np.float32), (len(origins) // len(towards), 1))
        passed = gatherer.context.tracer.transmittance(origins, rays)
        result[part] = passed.reshape(len(origins), -1).mean(axis=1).reshape(-1, len(towards))
    return result


def radiance_of(cache: SurfaceCache, irradiance: np.ndarray, by_hit: bool) -> tuple[np.ndarray, np.ndarray | None]:
    """What texels with ``irradiance`` (n + 1, C, 3) send to probes, and apart from it what passes them, as ``gathered`` takes them:
    without their albedo if that is known ``by_hit``."""
    leaving = leaving_columns(cache, irradiance)
    if not by_hit:
        return leaving, None
    white = irradiance * np.float32(1.0 / np.pi)
    passed = leaving - white * cache.rows.albedo[:, None] if cache.rows.passing.size else None
    return white, passed
