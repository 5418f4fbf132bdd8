"""Irradiance at every pixel by rays: a final gather (Reichert 1992; Jensen 1996, "Global Illumination using Photon Maps")."""

import numpy as np

from ... import kernels
from ...transport.cache.look import CachedScene, Looks
from ...transport.parallel import CHUNK, chunks, parallel_for
from ...transport.vectors import dot
from ..media.along import NUMBERS, MediaAlong
from .receivers import Pixels

# What numbers a ray draws beside those of transport.paths.numbers and transport.cache.look.
_IN_MEDIA = 18


def diffuse_looks(scene: CachedScene, pixels: Pixels, threads: int | None) -> list[Looks]:
    """Cosine-distributed rays from all pixels, traced, in chunks."""
    spans, surfaces = _spans(pixels), pixels.surfaces

    def work(i: int) -> Looks:
        return scene.look_about(*(part[spans[i]] for part in (surfaces.points, surfaces.normals, surfaces.faces)),
                                pixels.numbers(_rays(pixels, spans[i])), pixels.rays)

    return parallel_for(work, len(spans), threads)


def irradiance(scene: CachedScene, pixels: Pixels, looks: list[Looks], texels: list[np.ndarray],
               media: MediaAlong | None, threads: int | None) -> np.ndarray:
    """(n, 4): irradiance [W·m⁻²] at the pixels of everything but lamps, the mean over their rays, and the mean inverse distance
    [1/m] to what these met; ``media`` (None: there are none) send light along the rays as well."""
    spans = _spans(pixels)

    def work(i: int) -> np.ndarray:
        look = looks[i]
        radiance = scene.radiance(look, texels[i])
        if media is not None:
            radiance += sent_along(media, look)
        result = _means(look, radiance, pixels.surfaces.faces[spans[i]], pixels.rays)
        result[:, :3] *= np.float32(np.pi)
        if scene.has_samples:
            pixel = pixels.pixel(_rays(pixels, spans[i]))
            sampled = scene.sampled_irradiance(pixels.surfaces.points[pixel], pixels.receiver(pixel), look.numbers)
            result[:, :3] += sampled.reshape(len(result), pixels.rays, 3).mean(axis=1)
        return result

    return np.concatenate(parallel_for(work, len(spans), threads) or [np.zeros((0, 4), np.float32)])


def _spans(pixels: Pixels) -> list[slice]:
    """The pixels of each chunk of rays."""
    return chunks(pixels.count, max(1, CHUNK // pixels.rays))


def _rays(pixels: Pixels, span: slice) -> slice:
    """The rays of the pixels of ``span``."""
    return slice(span.start * pixels.rays, span.stop * pixels.rays)


def _means(look: Looks, radiance: np.ndarray, faces: np.ndarray, rays: int) -> np.ndarray:
    """(n, 4): means over the ``rays`` of ``look`` of each of n pixels, of ``radiance`` (n · rays, 3) that arrives above ``faces``
    (n, 3), for interpolated normals send some rays into the surface itself, and of one over the distance [1/m]."""
    n = len(faces)
    if kernels.is_available():
        mean = np.empty((n, 4), np.float32)
        kernels.call("gathered", n, rays, np.ascontiguousarray(faces, np.float32), look.directions, radiance, len(look.rows),
                     np.ascontiguousarray(look.rows, np.int64), np.ascontiguousarray(look.t, np.float32), mean)
        return mean
    result = np.zeros((n * rays, 4), np.float32)
    result[:, :3] = np.where((dot(np.repeat(faces, rays, axis=0), look.directions) > 0)[:, None], radiance, np.float32(0.0))
    result[look.rows, 3] = 1.0 / np.maximum(look.t, np.float32(1e-6))
    return result.reshape(n, rays, 4).mean(axis=1)


def sent_along(media: MediaAlong, look: Looks) -> np.ndarray:
    """Light (n, 3) that ``media`` send along the rays of ``look``, before what these met."""
    limits = np.full(len(look.directions), np.inf)
    limits[look.rows] = look.t
    return media.light(look.origins, look.directions, limits, look.numbers.draw(look.depth, _IN_MEDIA, NUMBERS))
