"""Baked probes under other lamps: the rays' hits are kept, so a moved or recoloured light costs no probe or form-factor ray."""

from dataclasses import dataclass

import numpy as np

from ...errors import BakeError
from ...progress import Progress
from ...scene import Scene
from ...transport.parallel import parallel_for
from ..base import ProbeGrid
from .gather import project

# Hits of this many rays are kept: 4 bytes each, 1.5 to 12 for the direction that neighbouring probes share, 4 more if they escaped
# and 6 more where albedo varies within triangles.
MAX_KEPT_RAYS = 1 << 25


@dataclass(frozen=True, eq=False)
class _Kept:
    """An item's memory: the shared directions (g·n, 3), the texel (g, n, m) of each ray, which rays ``escaped`` (e,) int32, and the
    albedo at the hits (g, n, m, 3) float16 or None where the texel's will do."""

    item: object
    directions: np.ndarray
    texel: np.ndarray
    escaped: np.ndarray
    albedo: np.ndarray | None


class HitMemory:
    """What a bake's rays hit, for as long as it stays within MAX_KEPT_RAYS; beyond, or after a resume, nothing is kept."""

    def __init__(self):
        self.items: list[_Kept] | None = []
        self._rays = 0

    def forget(self) -> None:
        """Drop everything: this bake cannot be relit."""
        self.items = None

    def keep(self, item, traced, texel: np.ndarray | None, gathered) -> None:
        """Remember one shaded item."""
        self._rays += item.ray_count
        if self.items is None or texel is None or self._rays > MAX_KEPT_RAYS:
            self.forget()
            return
        whole = np.full(item.ray_count, -1, np.int32)
        whole[traced.rows] = texel
        albedo = None
        if gathered.albedo is not None:
            albedo = np.zeros((item.ray_count, 3), np.float16)
            albedo[traced.rows] = gathered.albedo
            albedo = albedo.reshape(*item.shape, 3)
        escaped = np.flatnonzero(whole < 0).astype(np.int32)
        self.items.append(_Kept(item, traced.directions, whole.reshape(item.shape), escaped, albedo))


def relight(bake, scene: Scene, progress: Progress) -> tuple[ProbeGrid, ...]:
    """Grids of ``bake`` (a finished ProbeBake) under the lamps and world of ``scene``.

    Direct light is taken as the mean over each texel instead of at every hit, so edges of shadows are as sharp as texels are;
    their size followed the old lamps. Raises BakeError if geometry or materials changed, or the hits were not kept.
    """
    if bake.memory.items is None:
        raise BakeError("this bake kept no hits to relight",
                        "bake again (hits are kept for up to 33 million rays, and not by a resumed bake)")
    context = bake.context.relit(scene)
    cache = bake.cache.relight(context, progress.span(0.0, 0.5))
    cache.solve(bake.settings.bounces, 0.1 * bake.settings.target, progress.span(0.5, 0.7), bright=False)
    irradiance = cache.irradiance_rest + cache.irradiance_direct
    # Rows of four floats: numpy copies 16-byte rows with a single instruction.
    reflected = np.zeros((len(irradiance), 4), np.float32)
    reflected[:, :3] = irradiance * np.float32(1.0 / np.pi)
    by_texel = reflected.copy()
    by_texel[:, :3] *= cache.albedo
    gatherer = bake.gatherer.under(context, cache)
    sums = np.zeros_like(bake.model.total)

    def work(i):
        kept = bake.memory.items[i]
        radiance = np.take(reflected if kept.albedo is not None else by_texel, kept.texel, axis=0, mode="wrap")
        if kept.albedo is not None:
            radiance[..., :3] *= kept.albedo
        if kept.escaped.size and not context.environment.is_black:
            radiance.reshape(-1, 4)[kept.escaped, :3] = _sky(context, kept)
        projected = project(gatherer.basis(kept.item, kept.directions), radiance)[..., :3] * np.float32(4.0 * np.pi)
        if context.environment.bright.count:
            projected = projected + gatherer.bright_sky(kept.item)
        return kept.item.merged(projected)

    parts = parallel_for(work, len(bake.memory.items), context.threads, progress.span(0.7, 1.0), "relighting probes")
    for kept, part in zip(bake.memory.items, parts, strict=True):
        sums[kept.item.merged_probes] += part
    if bake.emitted is not None:
        sums += bake.emitted
    coefficients = sums / np.maximum(bake.model.rays, 1)[:, None, None]
    probes = np.flatnonzero(bake.model.rays > 0)
    if bake.settings.direct:
        coefficients[probes] += gatherer.lamps(probes)
    return bake.cut(coefficients.astype(np.float32), np.full(len(coefficients), np.nan, np.float32))


def _sky(context, kept: _Kept) -> np.ndarray:
    """Radiance (e, 3) of the world, without its bright patches, along the rays that escaped."""
    shared = kept.escaped // kept.item.shape[2]
    if len(shared) < len(kept.directions):
        return context.environment.base_radiance(kept.directions[shared])
    return np.take(context.environment.base_radiance(kept.directions), shared, axis=0)
