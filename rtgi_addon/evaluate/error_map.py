"""Where in the scene a field is wrong: its signed error at every surface that a camera sees, as colours.

A pixel is the signed error of the luminance of irradiance (metrics.py): blue is too dark, red too bright, white right. The
colours are those of ColorBrewer's RdBu, which hold for red-green colour blindness. Shading by the surface's slope only lets
shapes be seen.
"""

from pathlib import Path

import numpy as np

from ..progress import Progress
from ..storage.png import write_png
from ..techniques import Field
from ..transport.context import LightContext
from ..transport.rays.tracer import offset_origins
from ..transport.vectors import dot, faced, luminance
from .metrics import signed_error
from .receivers import Receivers
from .references import PathReference, Truth
from .view import choose_view

# The error [share] that the strongest colour stands for.
FULL_SCALE = 0.5
# Noise of the reference behind a map, and the most paths of all its pixels together.
NOISE, MOST_PATHS = 0.05, 1 << 22
BACKDROP = np.float32([0.25, 0.25, 0.25])
# How much darker a surface is drawn where it is seen at a slant.
SHADED = 0.12
# The reference is exposed so that this quantile of it is white.
_EXPOSED = 0.95
# ColorBrewer RdBu, from dark blue to dark red, sRGB.
COLOURS = np.array([[5, 48, 97], [33, 102, 172], [67, 147, 195], [146, 197, 222], [209, 229, 240], [247, 247, 247], [253, 219, 199],
                    [244, 165, 130], [214, 96, 77], [178, 24, 43], [103, 0, 31]], np.float32) / 255


def error_colours(error: np.ndarray) -> np.ndarray:
    """The colours (n, 3) in 0…1, sRGB, of signed errors (n,)."""
    place = np.clip(0.5 + 0.5 * error / FULL_SCALE, 0.0, 1.0) * (len(COLOURS) - 1)
    return np.stack([np.interp(place, np.arange(len(COLOURS)), channel) for channel in COLOURS.T], axis=1)


class ErrorMap:
    """A camera's view of a scene with the reference's irradiance at every pixel; ``colours`` compares a field with it.

    ``size`` (width, height) bounds the picture in samples; each is ``scale`` pixels wide when it is written.
    """

    def __init__(self, context: LightContext, size: tuple[int, int] = (112, 63), scale: int = 6, progress: Progress | None = None):
        view = choose_view(context.scene, context, size)
        self.width, self.height = view.resolution
        self.scale = scale
        column, row = np.meshgrid(np.arange(self.width) + 0.5, np.arange(self.height) + 0.5)
        origins, directions = view.rays(column.ravel(), row.ravel())
        hits = context.tracer.intersect(origins, directions)
        self.seen = np.flatnonzero((hits.primitive >= 0) & np.any(directions != 0, axis=1))
        primitive, u, v, t = (array[self.seen] for array in (hits.primitive, hits.u, hits.v, hits.t))
        normals = faced(context.geometry.normals_world[primitive], directions[self.seen])
        points = offset_origins(context.geometry.points(primitive, u, v), normals, normals, t)
        self.receivers = Receivers(points.astype(np.float32), normals.astype(np.float32), np.ones(len(points), bool))
        self._slope = 1.0 - SHADED + SHADED * np.abs(dot(normals, directions[self.seen]))
        self.truth: Truth = PathReference(context, NOISE, MOST_PATHS).irradiance(self.receivers, progress)

    def relative_error(self, field: Field) -> np.ndarray:
        """Signed error (m,) of ``field`` at the pixels ``seen``."""
        estimate = np.asarray(field.irradiance(self.receivers.points, self.receivers.normals), np.float64)
        return signed_error(luminance(estimate), luminance(self.truth.mean))

    def colours(self, error: np.ndarray) -> np.ndarray:
        """``error`` (m,) at the pixels ``seen`` as a picture (h, w, 3) in 0…1, sRGB, row 0 at the top."""
        return self._picture(error_colours(error))

    def reference_picture(self) -> np.ndarray:
        """The reference's irradiance as a picture (h, w, 3) in 0…1, sRGB, exposed for its bright parts."""
        bright = float(np.quantile(self.truth.mean.max(axis=1), _EXPOSED)) if len(self.seen) else 0.0
        return self._picture(np.clip(self.truth.mean / (bright or 1.0), 0.0, 1.0) ** (1 / 2.2))

    def write(self, path, picture: np.ndarray) -> Path:
        """Write a picture of this map into the PNG ``path``. Raises BakeError."""
        pixels = np.round(picture * 255).astype(np.uint8)
        return write_png(path, pixels.repeat(self.scale, axis=0).repeat(self.scale, axis=1))

    def _picture(self, shown: np.ndarray) -> np.ndarray:
        picture = np.tile(BACKDROP, (self.height * self.width, 1))
        picture[self.seen] = shown * self._slope[:, None]
        return picture.reshape(self.height, self.width, 3)
