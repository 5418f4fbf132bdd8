"""The bake of what texels of a light atlas make of any light (matrices.py), by the columns of the technique `transfer`.

Numbers are exact for the texel's normal, filled and joined at seams light by light, which is the same as under all light together,
since all of that is linear.
"""

from dataclasses import dataclass, replace

import numpy as np

from ...numerics import dome, sh
from ...progress import Progress
from ...scene import Scene, SunLight, baked_part
from ...scene.memory import require_memory
from ...techniques.base import Field
from ...techniques.transfer.columns import dark_context, light_columns
from ...techniques.transfer.hits import radiance_of, small_products
from ...transport.cache.columns import sky_columns, solve_columns, source_columns
from ...transport.cache.look import TOLERANCE, Looks
from ...transport.context import LightContext
from ...transport.lights.links import LightLinks
from ...transport.parallel import parallel_for
from ...transport.rays.tracer import offset_origins
from ...transport.vectors import dot
from .borders import Borders
from .coefficients import COUNT, LEAST_COSINE, ORDER, exact_for
from .gather import TexelGather
from .matrices import LEAST_SIDE, NUMBERS, AtlasTransfer
from .settings import AtlasSettings
from .sheet import LightAtlas, light_atlas
from .unwrapped import Places

# Points of a texel of the surface cache at which a sun is sampled.
_SUN_SAMPLES = 4


@dataclass(frozen=True, eq=False)
class BakedTransfer:
    """An ``atlas`` with its transfer; ``texels`` (n,) that have places and which of them are ``known`` (n,) bool; number of
    ``rays``."""

    atlas: LightAtlas
    texels: np.ndarray
    known: np.ndarray
    rays: int


def bake_transfer(scene: Scene, field: Field, settings: AtlasSettings, places: Places, borders: Borders, seed: int,
                  threads: int | None, progress: Progress) -> BakedTransfer:
    """The light atlas of ``places``, and what it makes of any light, beside the transfer of ``field``. Raises BakeError where there
    is not the memory, Cancelled."""
    transfer, dark = field.transfer, dark_context(scene, threads)
    side = settings.suns if settings.suns >= LEAST_SIDE else 0
    gather = TexelGather(dark, None, settings, places, seed, LightLinks(baked_part(scene)))
    texels, columns = gather.reach(progress.span(0.0, 0.2)), list(light_columns(scene, dark))
    lights, rays = [], 2 * gather.rays
    for number, column in enumerate(columns):
        part = progress.span(0.2 + 0.3 * number / len(columns), 0.2 + 0.3 * (number + 1) / len(columns))
        _, _, light = gather.under(column.context, field, part.span(0.0, 0.5)).run(part.span(0.5, 1.0))
        lights.append(light.reshape(len(light), NUMBERS, 3))
        rays += gather.rays
    towards = dome.directions(side, transfer.sun_below) if side else np.zeros((0, 3))
    found = _Columns(gather, texels, transfer.sky_order, towards, progress.span(0.5, 0.95)).run()
    progress.step(0.95, "Joining the seams of the light atlas")

    def closed(values: np.ndarray) -> np.ndarray:
        """(height, width, NUMBERS, C) of (n, NUMBERS, C), or with colours (3, height, width, NUMBERS, C) of (n, NUMBERS, C, 3)."""
        image, _ = borders.closed(gather.texels, found.known, values.reshape(len(values), -1), gather.covered)
        image = image.reshape(*borders.size, *values.shape[1:])
        return np.ascontiguousarray(np.moveaxis(image, -1, 0)) if values.ndim == 4 else image

    skies = sh.coefficient_count(transfer.sky_order)
    of_lights = closed(np.stack(lights, axis=2) if lights else np.zeros((len(found.known), NUMBERS, 0, 3), np.float32))
    matrices = AtlasTransfer(transfer.sky_order, side, transfer.sun_below, closed(found.seen[..., :skies]),
                             closed(found.bounced[..., :skies, :]), closed(found.bounced[..., skies:, :]),
                             closed(found.seen[..., skies:]), of_lights)
    total = np.ascontiguousarray(np.moveaxis(of_lights.sum(axis=-1), 0, -1)).reshape(*borders.size, -1)
    known = np.zeros(borders.size[0] * borders.size[1], bool)
    known[gather.texels] = found.known
    atlas = light_atlas(borders.sheet, total, known.reshape(borders.size), matrices)
    return BakedTransfer(atlas, gather.texels, found.known, rays)


@dataclass(frozen=True, eq=False)
class _Found:
    """Of texels (n,): which are ``known``, what is ``seen`` (n, NUMBERS, S + K) of skies and suns and ``bounced`` (n, NUMBERS,
    S + K, 3)."""

    known: np.ndarray
    seen: np.ndarray
    bounced: np.ndarray


class _Columns:
    """Skies and suns ``towards`` (K, 3) at the texels of ``gather``, whose scene is dark and whose rays meet the ``texels`` of the
    cache (``TexelGather.reach``): they are traced again, to weigh what those send."""

    def __init__(self, gather: TexelGather, texels: list[np.ndarray], sky_order: int, towards: np.ndarray, progress: Progress):
        self._gather, self._texels, self._order, self._towards, self._progress = gather, texels, sky_order, towards, progress
        self._context, self._cache = gather.context, gather.cached.cache

    def run(self) -> _Found:
        """All of it. Raises Cancelled."""
        gather, context, progress, texels = self._gather, self._context, self._progress, self._texels
        spans = [span for batch in gather.batches() for span in gather.chunks(batch)]
        columns = sh.coefficient_count(self._order) + len(self._towards)
        require_memory({"columns": 3 * 12 * columns * self._cache.count, "atlas": 3 * 16 * NUMBERS * columns * len(gather.texels)})
        sources = [sky_columns(self._cache, self._order, progress.span(0.0, 0.05))]
        if len(self._towards):
            suns = tuple(SunLight(f"sun {number}", -way, np.ones(3, np.float32)) for number, way in enumerate(self._towards))
            lit = LightContext(replace(context.scene, lights=suns), context.threads, same_surfaces=context)
            sources.append(source_columns(self._cache, lit, _SUN_SAMPLES, progress.span(0.05, 0.3)))
        solved = solve_columns(self._cache, np.concatenate(sources, axis=1), None, TOLERANCE, progress.span(0.3, 0.8))
        by_hit = context.surfaces.albedo_by_triangle() is None
        radiance, passed = radiance_of(self._cache, solved, by_hit)
        parts = parallel_for(lambda i: self._weigh(spans[i], texels[i], radiance, passed, by_hit), len(spans), context.threads,
                             progress.span(0.8, 1.0), "Lighting the light atlas")
        return _Found(*(np.concatenate(part) for part in zip(*parts, strict=True)))

    def _weigh(self, span: slice, texel, radiance, passed, by_hit: bool) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        gather, rows = self._gather, self._gather.rows(span)
        look, (points, receiver) = gather.trace(span, rows), gather.surface(rows)
        known, weight, normals = gather.weights(rows, look, receiver)
        cosine = np.maximum(dot(receiver.shading, look.directions), np.float32(LEAST_COSINE))
        counts = weight.reshape(-1) * (dot(receiver.face, look.directions) > 0) * np.pi
        # What each ray adds to each number: those of coefficients, and to irradiance.
        share = np.concatenate([sh.evaluate(look.directions, ORDER) / cosine[:, None], np.ones((len(rows), 1))], axis=1)
        share = (share * counts[:, None]).astype(np.float32)
        tint = np.broadcast_to(np.ones(3, np.float32) if look.tint is None else look.tint, (len(rows), 3))
        bounced = self._reflected(look, texel, share, tint, radiance, passed, by_hit, len(known))
        seen, coloured = self._sky(look, share, tint, len(known))
        bounced[:, :, :seen.shape[2]] += coloured
        seen = np.concatenate([seen, self._suns(points, receiver, normals)], axis=2)
        seen[:, :COUNT] = exact_for(seen[:, :COUNT], normals, seen[:, COUNT])
        flat = bounced.reshape(len(known), NUMBERS, -1)
        flat[:, :COUNT] = exact_for(flat[:, :COUNT], normals, flat[:, COUNT])
        return known, seen.astype(np.float32), flat.reshape(bounced.shape)

    def _reflected(self, look: Looks, texel, share, tint, radiance, passed, by_hit: bool, count: int) -> np.ndarray:
        """(m, NUMBERS, C, 3) float32 of what surfaces send along the rays."""
        hits, filters = look.hits, tint[look.rows]
        of_albedo = filters
        if by_hit:
            of_albedo = filters * self._context.surfaces.albedo(hits.primitive, hits.u, hits.v, look.cosine)
        result = np.zeros((count, NUMBERS, radiance.shape[1], 3), np.float32)
        first = np.searchsorted(look.rows, np.arange(count + 1) * (len(share) // count))
        for row in range(count):
            part = slice(first[row], first[row + 1])
            if part.start == part.stop:
                continue
            left, light = share[look.rows[part]], radiance[texel[part]] * of_albedo[part][:, None]
            if passed is not None:
                light = light + passed[texel[part]] * filters[part][:, None]
            result[row] = small_products(left.T, light.reshape(len(left), -1)).reshape(NUMBERS, -1, 3)
        return result

    def _sky(self, look: Looks, share, tint, count: int) -> tuple[np.ndarray, np.ndarray]:
        """(m, NUMBERS, S) of what is seen of skies, and (m, NUMBERS, S, 3) of what coloured glass makes of it beyond that."""
        missed = np.ones(len(share), np.float32)
        missed[look.rows] = 0.0
        basis = sh.evaluate(look.directions, self._order).reshape(count, len(share) // count, -1)
        left = (share * missed[:, None]).reshape(count, -1, NUMBERS)
        grey = tint.mean(axis=1).reshape(count, -1)
        seen = np.einsum("mrn,mrs,mr->mns", left, basis, grey)
        rest = tint.reshape(count, -1, 3) - grey[..., None]
        if not np.any(rest):
            return seen, np.zeros((*seen.shape, 3), np.float32)
        return seen, np.einsum("mrn,mrs,mrc->mnsc", left, basis, rest).astype(np.float32)

    def _suns(self, points: np.ndarray, receiver, normals: np.ndarray) -> np.ndarray:
        """(m, NUMBERS, K) of suns themselves, each as it is seen from one place of a texel."""
        towards, count = self._towards.astype(np.float32), len(normals)
        if not len(towards):
            return np.zeros((count, NUMBERS, 0))
        rays = len(points) // count
        # Another place for each direction.
        place = (np.arange(count)[:, None] * rays + np.arange(len(towards)) * 7 % rays).reshape(-1)
        ways = np.tile(towards, (count, 1))
        faces, left = receiver.face[place], np.zeros(len(place), np.float32)
        lit = np.flatnonzero((dot(faces, ways) > 0) & (dot(receiver.shading[place], ways) > 0))
        origins = offset_origins(points[place[lit]], faces[lit], ways[lit])
        left[lit] = self._context.tracer.transmittance(origins, ways[lit]).reshape(len(lit), -1).mean(axis=1)
        left = left.reshape(count, -1)
        irradiance = left * np.maximum(normals @ towards.T, 0.0)
        return np.concatenate([left[:, None] * sh.evaluate(towards, ORDER).T, irradiance[:, None]], axis=1)
