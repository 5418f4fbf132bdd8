"""Irradiance at every pixel by rays: a final gather (Reichert 1992; Jensen 1996, "Global Illumination using Photon Maps")."""

import numpy as np

from ...numerics.sampling import about, cosine_hemisphere
from ...transport.cache.look import CachedScene, Looks
from ...transport.parallel import chunks, parallel_for
from ...transport.paths.numbers import SCATTER
from ...transport.vectors import dot
from ..media.along import NUMBERS, MediaAlong
from .receivers import Pixels

# What numbers a ray draws beside those of transport.paths.numbers and transport.cache.look.
_IN_MEDIA = 18


def diffuse_looks(scene: CachedScene, pixels: Pixels, threads: int | None) -> list[Looks]:
    """Cosine-distributed rays from all pixels, traced, in chunks."""
    spans = chunks(pixels.count * pixels.rays)

    def work(i: int) -> Looks:
        numbers, pixel = pixels.numbers(spans[i]), pixels.pixel(spans[i])
        local = cosine_hemisphere(numbers.draw(0, SCATTER, 2))
        directions = about(pixels.surfaces.normals[pixel], local)
        density = local[:, 2] * np.float32(1.0 / np.pi)
        return scene.look(pixels.start(pixel, directions), directions, numbers, density)

    return parallel_for(work, len(spans), threads)


def irradiance(scene: CachedScene, pixels: Pixels, looks: list[Looks], texels: list[np.ndarray],
               media: MediaAlong | None, threads: int | None) -> np.ndarray:
    """(n, 4): irradiance [W·m⁻²] at the pixels of everything but lamps, the mean over their rays, and the mean inverse distance
    [1/m] to what these met; ``media`` (None: there are none) send light along the rays as well."""
    spans = chunks(pixels.count * pixels.rays)

    def work(i: int) -> np.ndarray:
        look, pixel = looks[i], pixels.pixel(spans[i])
        receiver = pixels.receiver(pixel)
        result = np.zeros((len(pixel), 4), np.float32)
        result[:, :3] = scene.radiance(look, texels[i])
        if media is not None:
            result[:, :3] += sent_along(media, look)
        result[:, :3] *= np.float32(np.pi)
        # Interpolated normals send some rays into the surface itself.
        result[dot(receiver.face, look.directions) <= 0, :3] = 0.0
        result[:, :3] += scene.sampled_irradiance(pixels.surfaces.points[pixel], receiver, look.numbers)
        result[look.rows, 3] = 1.0 / np.maximum(look.t, np.float32(1e-6))
        return result

    parts = np.concatenate(parallel_for(work, len(spans), threads) or [np.zeros((0, 4), np.float32)])
    return parts.reshape(pixels.count, pixels.rays, 4).mean(axis=1)


def sent_along(media: MediaAlong, look: Looks) -> np.ndarray:
    """Light (n, 3) that ``media`` send along the rays of ``look``, before what these met."""
    limits = np.full(len(look.directions), np.inf)
    limits[look.rows] = look.t
    return media.light(look.origins, look.directions, limits, look.numbers.draw(look.depth, _IN_MEDIA, NUMBERS))
