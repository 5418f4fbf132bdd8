"""What the glossy layer of every pixel's surface mirrors, by rays drawn by visible normals (Heitz 2018), from mirror to mirror
until something diffuse, or the last reflection, ends the path on the surface cache."""

from dataclasses import replace
from typing import NamedTuple

import numpy as np

from ...transport.cache.look import CachedScene, Looks
from ...transport.parallel import chunks, parallel_for
from ...transport.paths.numbers import ROULETTE, SCATTER, PathNumbers
from ...transport.rays.tracer import offset_origins
from ...transport.surfaces.ggx import SurfaceLook, reflectance, sample_reflection, surface_look
from ...transport.surfaces.materials import MAX_ALBEDO
from ...transport.vectors import dot, largest, normalized
from ..lit import SeenSurfaces
from ..media.along import MediaAlong
from .diffuse import sent_along
from .lamps import Mirror, MirroredLamps
from .receivers import Pixels

# A layer that reflects less than this share of the light is no mirror: at a pixel and at what a mirror shows it counts as part of
# the diffuse colour.
FAINT = 0.02
# Lobes of a larger α find lights by samples of these, narrower ones by their own rays.
ROUGH = 0.1
# In lobes of an α below this mirrored rays meet lamps, too; wider ones find all lamps well enough by points on them.
SMOOTH = 0.3
# What a lobe mirrors of a narrower one is mirrored by one of this share of its α: it is blurred far more by the first, and what
# smooth things gather of lamps is found there by points on these, where rays would by luck alone (path space regularization;
# Kaplanyan and Dachsbacher 2013).
_BLUR = 0.5
# What is diffuse, too, is taken for a mirror no more often than this.
_MOST_MIRROR = 0.95


class Paths(NamedTuple):
    """Paths under way: the ``rays`` (m,) they began as, numbered as chunks number them, what share of the radiance that comes along
    ``directions`` (m, 3) to ``origins`` (m, 3) reaches the pixel (``weights`` (m, 3)), their ``numbers``, and the ``alpha`` (m,) of
    the lobes that they left by, 0 where they left none."""

    rays: np.ndarray
    origins: np.ndarray
    directions: np.ndarray
    weights: np.ndarray
    numbers: PathNumbers
    alpha: np.ndarray


class Ends(NamedTuple):
    """Paths that ended: the ``rays`` (m,) they began as, their last ``looks``, their ``weights`` (m, 3), the ``albedo`` (h, 3) that
    counts at the hits (None: the mean over all directions)."""

    rays: np.ndarray
    looks: Looks
    weights: np.ndarray
    albedo: np.ndarray | None


class Mirrored(NamedTuple):
    """Paths of one chunk: the ``ends`` of each length, and what (rays, 3) of ``lamps`` and media [W·sr⁻¹·m⁻²] came along
    them."""

    ends: list[Ends]
    lamps: np.ndarray


def glossy_paths(scene: CachedScene, pixels: Pixels, reflections: int, lamps: MirroredLamps,
                 media: MediaAlong | None, threads: int | None) -> list[Mirrored]:
    """Paths of up to so many ``reflections`` from every pixel whose layer reflects, traced, in chunks."""
    reflects, smooth, spans = has_layer(pixels.surfaces), is_smooth(pixels.surfaces.look), chunks(pixels.count * pixels.rays)

    def work(i: int) -> Mirrored:
        paths, mirror, ends = *_first(pixels, spans[i], reflects), []
        lit = np.zeros((spans[i].stop - spans[i].start, 3), np.float32)
        if lamps.wide:
            # Of others the picture has all that their layers reflect of lamps.
            rows = np.flatnonzero(smooth[pixels.pixel(spans[i])[paths.rays]])
            lit[paths.rays[rows]] = lamps.met(mirror.take(rows), paths.directions[rows], 0) * paths.weights[rows]
        for depth in range(1, reflections + 1):
            looks = scene.look(paths.origins, paths.directions, paths.numbers, depth=depth)
            if media is not None:
                lit[paths.rays] += sent_along(media, looks) * paths.weights
            if depth == reflections:
                ends.append(Ends(paths.rays, looks, paths.weights, None))
                break
            ended, (rays, mirror, weights, numbers) = at_hits(scene, paths, looks)
            ends.append(ended)
            lit[rays] += lamps.sampled(mirror, numbers, depth) * weights
            paths, mirror = onward(rays, mirror, weights, numbers, depth)
            if not len(paths.rays):
                break
            if lamps.wide:
                lit[paths.rays] += lamps.met(mirror, paths.directions, depth) * paths.weights
        return Mirrored(ends, lit)

    return parallel_for(work, len(spans), threads)


def has_layer(surfaces: SeenSurfaces) -> np.ndarray:
    """Which surfaces (n,) bool reflect enough for rays."""
    return largest(surfaces.look.layer) > FAINT


def is_smooth(look: SurfaceLook) -> np.ndarray:
    """Which layers (n,) bool reflect into a lobe so narrow that rays are to meet wide lamps."""
    return look.alpha < SMOOTH


def mirrored(scene: CachedScene, pixels: Pixels, paths: list[Mirrored], texels: list[np.ndarray],
             threads: int | None) -> np.ndarray:
    """Radiance (n, 3) [W·sr⁻¹·m⁻²] that the pixels' layers reflect of all that ``paths`` met; ``texels`` are those of the looks of
    all their ends, one after the other."""
    spans, rough = chunks(pixels.count * pixels.rays), is_rough(pixels.surfaces.look)
    first = np.cumsum([0, *(len(part.ends) for part in paths)])

    def work(i: int) -> np.ndarray:
        total = paths[i].lamps.copy()
        for end, texel in zip(paths[i].ends, texels[first[i]:first[i + 1]], strict=True):
            unlit = rough[pixels.pixel(spans[i])[end.rays]] if end.looks.depth == 1 else None
            total[end.rays] += scene.radiance(end.looks, texel, end.albedo, unlit) * end.weights
        return total

    parts = parallel_for(work, len(spans), threads)
    if not parts:
        return np.zeros((0, 3), np.float32)
    return np.concatenate(parts).reshape(pixels.count, pixels.rays, 3).mean(axis=1)


def highlights(scene: CachedScene, pixels: Pixels, threads: int | None) -> np.ndarray:
    """Radiance (n, 3) that rough layers reflect of emissive surfaces and bright patches of the world, one sample a ray: wide lobes
    meet them by luck alone."""
    surfaces, spans = pixels.surfaces, chunks(pixels.count * pixels.rays)
    rough = is_rough(surfaces.look)

    def work(i: int) -> np.ndarray:
        pixel, total = pixels.pixel(spans[i]), np.zeros((spans[i].stop - spans[i].start, 3), np.float32)
        rays = np.flatnonzero(rough[pixel])
        pixel, numbers = pixel[rays], pixels.numbers(spans[i], glossy=True).take(rays)
        receiver, look = pixels.receiver(pixel), replace(surfaces.look.take(pixel), diffuse=np.float32(0.0))
        for directions, irradiance in scene.light_samples(surfaces.points[pixel], receiver, numbers, 0.0):
            total[rays] += reflectance(look, receiver.shading, surfaces.towards_eye[pixel], directions) * irradiance
        return total

    parts = np.concatenate(parallel_for(work, len(spans), threads) or [np.zeros((0, 3), np.float32)])
    return parts.reshape(pixels.count, pixels.rays, 3).mean(axis=1)


def is_rough(look: SurfaceLook) -> np.ndarray:
    """Which layers (n,) bool reflect into a lobe so wide that lights are sampled for it."""
    return look.alpha > ROUGH


def _first(pixels: Pixels, span: slice, reflects: np.ndarray) -> tuple[Paths, Mirror]:
    """The first pieces of paths, and the surfaces that they leave."""
    pixel = pixels.pixel(span)
    rays = np.flatnonzero(reflects[pixel])
    pixel, numbers, surfaces = pixel[rays], pixels.numbers(span, glossy=True).take(rays), pixels.surfaces
    directions, weights = sample_reflection(surfaces.look.take(pixel), surfaces.normals[pixel], surfaces.towards_eye[pixel],
                                            numbers.draw(0, SCATTER, 2))
    kept = np.flatnonzero((dot(surfaces.faces[pixel], directions) > 0) & (largest(weights) > 0))
    directions = directions[kept]
    mirror, origins = pixels.mirror(pixel[kept]), pixels.start(pixel[kept], directions)
    return Paths(rays[kept], origins, directions, weights[kept], numbers.take(kept), mirror.look.alpha), mirror


def at_hits(scene: CachedScene, paths: Paths, looks: Looks) -> tuple[Ends, tuple]:
    """Decide by a coin at every hit whether the path goes on as in a mirror or ends on what is below the layer: the ends, and of
    the others their rays, mirrors, weights and numbers."""
    surfaces, geometry, hits = scene.context.surfaces, scene.context.geometry, looks.hits
    side, where = hits.side, (hits.primitive, hits.u, hits.v)
    normals = normalized(surfaces.shading_normal(*where)) * side[:, None]
    back = -looks.directions[looks.rows]
    cosine = np.clip(dot(normals, back), 0.0, 1.0)
    albedo, base, metallic, roughness, specular = (surfaces.of_side(name, *where, side) for name in (
        "albedo", "base_color", "metallic", "roughness", "specular"))
    roughness = np.maximum(roughness[:, 0], np.sqrt(np.float32(_BLUR) * paths.alpha[looks.rows]))
    look = surface_look(np.clip(albedo, 0.0, MAX_ALBEDO), np.maximum(base, 0.0), *(
        np.clip(part, 0.0, 1.0) for part in (metallic[:, 0], roughness, specular.mean(axis=1))), cosine)
    layer, below = largest(look.layer), largest(look.diffuse)
    emissive = surfaces.emissive[geometry.material[hits.primitive]]
    most = np.where(emissive | (below > 0), np.float32(_MOST_MIRROR), np.float32(1.0))
    chance = np.where(layer > FAINT, np.minimum(layer / np.maximum(layer + below, 1e-6), most), 0.0)
    goes_on = looks.numbers.take(looks.rows).draw(looks.depth, ROULETTE, 1)[:, 0] < chance

    weights, ended = paths.weights.copy(), np.ones(len(paths.rays), bool)
    ended[looks.rows[goes_on]] = False
    stays = ~goes_on
    weights[looks.rows[stays]] /= (1.0 - chance[stays])[:, None]
    mean = surfaces.albedo(*where, looks.cosine)
    shown = np.where((chance > 0)[:, None], look.diffuse, mean).astype(np.float32)
    ends = Ends(paths.rays[ended], looks.of(ended), weights[ended], shown[stays])

    chosen = np.flatnonzero(goes_on)
    row = looks.rows[chosen]
    carried = paths.weights[row] / chance[chosen, None]
    if looks.tint is not None:
        carried = carried * looks.tint[row]
    points = geometry.points(*(part[chosen] for part in where))
    faces = geometry.normals_world[hits.primitive[chosen]] * side[chosen, None]
    mirror = Mirror(points, normals[chosen], faces, back[chosen], look.take(chosen), hits.primitive[chosen])
    return ends, (paths.rays[row], mirror, carried.astype(np.float32), looks.numbers.take(row))


def onward(rays: np.ndarray, mirror: Mirror, weights: np.ndarray, numbers: PathNumbers, depth: int) -> tuple[Paths, Mirror]:
    """Paths from ``mirror`` on, which has them by ``rays``, ``weights`` and ``numbers``; and the mirrors that these leave."""
    directions, gained = sample_reflection(mirror.look, mirror.normals, mirror.towards_eye, numbers.draw(depth, SCATTER, 2))
    carried = weights * gained
    kept = np.flatnonzero((dot(mirror.faces, directions) > 0) & (largest(carried) > 0))
    mirror, directions = mirror.take(kept), directions[kept]
    origins = offset_origins(mirror.points, mirror.faces, directions)
    return Paths(rays[kept], origins, directions, carried[kept].astype(np.float32), numbers.take(kept), mirror.look.alpha), mirror
