"""Baked probes under other lamps: the rays' hits are kept, so a moved or recoloured light costs no probe or form-factor ray."""

from dataclasses import dataclass
from functools import cache
from typing import NamedTuple

import numpy as np

from ...errors import BakeError
from ...progress import Progress
from ...scene import Scene
from ...transport.cache.relighting import relit_cache, thought_to_receive
from ...transport.cache.surface_cache import SurfaceCache
from ...transport.context import LightContext
from ...transport.parallel import parallel_for
from ..base import ProbeGrid
from ..lamp_light import LampLight
from .gather import FULL_SPHERE, Gatherer, project
from .gather_kernels import can_project, projected_texels

# Hits of this many rays are kept: 4 bytes each, 2 to 17 for the direction that neighbouring probes share, 4 more if they escaped
# and 6 more where albedo varies within triangles.
MAX_KEPT_RAYS = 1 << 25
# The cache's solution may be off by this share of the target: ten times as much as a bake's, for it is made while one waits.
SOLVER_SHARE = 0.1
# How far relighting is when the cache has its direct light, and when it is solved.
CACHE_LIT, CACHE_SOLVED = 0.5, 0.7


@dataclass(frozen=True, eq=False)
class _Kept:
    """An item's memory: the shared directions (g·n, 3), the texel (g, n, m) of each ray, which rays ``escaped`` (e,) int32, and the
    albedo at the hits (g, n, m, 3) float16 or None where the texel's will do; ``tint`` (g, n, m, 3) float16 of what comes along
    each, None where nothing changes it."""

    item: object
    directions: np.ndarray
    texel: np.ndarray
    escaped: np.ndarray
    albedo: np.ndarray | None
    tint: np.ndarray | None


class HitMemory:
    """What a bake's rays hit, for as long as it stays within MAX_KEPT_RAYS; beyond, or after a resume, nothing is kept."""

    def __init__(self):
        self.items: list[_Kept] | None = []
        self._rays = 0

    def forget(self) -> None:
        """Drop everything: this bake cannot be relit."""
        self.items = None

    def take_over(self, other: "HitMemory") -> None:
        """Remember what ``other`` does as well."""
        self._rays += other._rays
        if self.items is None or other.items is None or self._rays > MAX_KEPT_RAYS:
            self.forget()
            return
        self.items += other.items

    def require(self) -> None:
        """Raises BakeError if nothing was kept."""
        if self.items is None:
            limit = MAX_KEPT_RAYS // 1_000_000
            raise BakeError("this bake kept no hits to relight",
                            f"bake again (hits are kept for up to {limit} million rays, and not by a resumed bake)")

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
        tint = None if traced.tint is None else traced.tint.reshape(*item.shape, 3).astype(np.float16)
        self.items.append(_Kept(item, traced.directions, whole.reshape(item.shape), escaped, albedo, tint))


class Relit(NamedTuple):
    """The ``grids`` of a bake in another ``context``, whose light is in ``cache``; ``lamp_light`` is what lamps give directly."""

    grids: tuple[ProbeGrid, ...]
    context: LightContext
    cache: SurfaceCache
    lamp_light: LampLight


def relight(bake, scene: Scene, lamp_light: LampLight, progress: Progress) -> Relit:
    """``bake`` (a finished ProbeBake) under the lamps and world of ``scene``, with ``lamp_light`` from lamps directly.

    Direct light is taken as the mean over each texel instead of at every hit, so edges of shadows are as sharp as texels are;
    their size followed the old lamps. Raises BakeError if geometry or materials changed, or the hits were not kept.
    """
    if bake.context.media.scatters:
        raise BakeError("what media scatter cannot be relit", "bake again")
    bake.memory.require()
    context = bake.context.relit(scene)
    cache = relit_cache(bake.cache, context, progress.span(0.0, CACHE_LIT))
    start = thought_to_receive(cache, bake.cache) if bake.cache.solved == cache.count else None
    cache.solve(bake.settings.bounces, SOLVER_SHARE * bake.settings.target, progress.span(CACHE_LIT, CACHE_SOLVED), bright=False,
                start=start)
    gatherer = bake.gatherer.under(context, cache)
    sums = relit_sums(bake.memory, gatherer, np.zeros_like(bake.model.total), bake.emitted, progress.span(CACHE_SOLVED, 1.0))
    # Rays of probes that nobody wants may be remembered as well.
    traced = bake.model.rays > 0
    coefficients = np.where(traced[:, None, None], sums / np.maximum(bake.model.rays, 1)[:, None, None], 0.0)
    probes = np.flatnonzero(traced)
    if lamp_light and probes.size:
        coefficients[probes] += lamp_light.coefficients(bake.placement.positions[probes], bake.settings.order)
    grids = bake.cut(coefficients.astype(np.float32), np.full(len(coefficients), np.nan, np.float32))
    return Relit(grids, context, cache, lamp_light)


def relit_sums(memory: HitMemory, gatherer: Gatherer, sums: np.ndarray, emitted: np.ndarray | None,
               progress: Progress) -> np.ndarray:
    """``sums`` (p, k, 3) of 4π·L·Y, and of what surfaces ``emitted``, over the rays in ``memory`` by the light that ``gatherer``
    knows, which is that of the same probes in another context. Raises BakeError if the hits were not kept."""
    memory.require()
    context, cache = gatherer.context, gatherer.cache
    irradiance = cache.irradiance_rest + cache.rows.irradiance_direct
    # Rows of four floats: numpy copies 16-byte rows with a single instruction.
    reflected = np.zeros((len(irradiance), 4), np.float32)
    reflected[:, :3] = irradiance * np.float32(1.0 / np.pi)
    by_texel = reflected.copy()
    by_texel[:, :3] = cache.rows.leaving(reflected[:, :3])
    passed = np.zeros_like(reflected)
    passed[:, :3] = by_texel[:, :3] - cache.rows.albedo * reflected[:, :3]

    def projection(kept: _Kept) -> np.ndarray:
        basis = gatherer.ray_basis(kept.item, kept.directions)
        if kept.albedo is None and kept.tint is None and can_project(basis):
            black = not kept.escaped.size or context.environment.is_black
            sky = None if black else context.environment.base_radiance(kept.directions)
            return projected_texels(kept.item.shape, basis, by_texel, kept.texel, sky)
        radiance = np.take(reflected if kept.albedo is not None else by_texel, kept.texel, axis=0, mode="wrap")
        if kept.albedo is not None:
            _multiply(radiance, kept.albedo)
            if cache.rows.passing.size:
                radiance += np.take(passed, kept.texel, axis=0, mode="wrap")
        if kept.escaped.size and not context.environment.is_black:
            radiance.reshape(-1, 4)[kept.escaped, :3] = _sky(context, kept)
        if kept.tint is not None:
            _multiply(radiance, kept.tint)
        return project(basis, radiance)[..., :3]

    def work(i):
        kept = memory.items[i]
        projected = projection(kept) * FULL_SPHERE
        if context.environment.bright.count:
            projected = projected + gatherer.bright_sky(kept.item)
        return kept.item.merged(projected)

    parts = parallel_for(work, len(memory.items), context.threads, progress, "relighting probes")
    for kept, projected in zip(memory.items, parts, strict=True):
        sums[kept.item.merged_probes] += projected
    return sums if emitted is None else sums + emitted


@cache
def _halves() -> np.ndarray:
    """Every float16 by its bits, (65536,) float32: looked up in half the time that numpy takes to convert them."""
    return np.arange(1 << 16, dtype=np.uint16).view(np.float16).astype(np.float32)


def _multiply(radiance: np.ndarray, factors: np.ndarray) -> None:
    """``radiance`` (…, 4) times ``factors`` (…, 3) float16, in place. Colour by colour: rows of three are slow to go along."""
    rows, factors = radiance.reshape(-1, 4), np.take(_halves(), factors.reshape(-1, 3).view(np.uint16), mode="clip")
    for colour in range(3):
        rows[:, colour] *= factors[:, colour]


def _sky(context, kept: _Kept) -> np.ndarray:
    """Radiance (e, 3) of the world, without its bright patches, along the rays that escaped."""
    shared = kept.escaped // kept.item.shape[2]
    # Rays of one direction follow one another.
    fresh = np.append(True, np.diff(shared) != 0)
    return np.take(context.environment.base_radiance(kept.directions[shared[fresh]]), np.cumsum(fresh) - 1, axis=0)
