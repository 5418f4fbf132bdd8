"""Pixels as surfaces that rays leave from, chunk by chunk, all of them or a few in each sample of the picture."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from ...numerics.sampling import hash_u32
from ...transport.paths.direct import Receiver
from ...transport.paths.numbers import PathNumbers
from ...transport.rays.tracer import offset_origins
from ..frame import Frame
from ..lit import SeenSurfaces
from .lamps import Mirror

# Tells the numbers of pixels apart from all others of a picture.
_STREAM = 0x6A7
_DIFFUSE, _GLOSSY = 0, 1
# A step of this share of a circle leads to places far from all before.
_GOLDEN = 0.618034


@dataclass(frozen=True, eq=False)
class Pixels:
    """The n pixels ``chosen`` (indices into those of ``frame`` that show a surface), with ``rays`` each in this sample of the
    picture: ray k of pixel i is number i·rays + k. ``surfaces`` are those that the n pixels show."""

    frame: Frame
    surfaces: SeenSurfaces
    rays: int
    chosen: np.ndarray

    @staticmethod
    def of(frame: Frame, surfaces: SeenSurfaces, rays: int, spacing: int = 1) -> "Pixels":
        """One pixel of every ``spacing``² of all that show ``surfaces``, others in each sample of the picture."""
        if spacing == 1:
            return Pixels(frame, surfaces, rays, np.arange(len(surfaces.points)))
        rows, columns = np.divmod(frame.gbuffer.shown(frame.pixel), frame.size[0])
        turn = _in_turn(spacing)[frame.gbuffer.shown(frame.turn) % spacing**2]
        chosen = np.flatnonzero((rows % spacing == turn // spacing) & (columns % spacing == turn % spacing))
        return Pixels(frame, surfaces.take(chosen), rays, chosen)

    def part(self, rows: np.ndarray) -> "Pixels":
        """Those of the pixels alone."""
        return Pixels(self.frame, self.surfaces.take(rows), self.rays, self.chosen[rows])

    @property
    def count(self) -> int:
        """Number of pixels."""
        return len(self.surfaces.points)

    def pixel(self, span: slice) -> np.ndarray:
        """The pixel (m,) of each ray of ``span``."""
        return np.arange(span.start, span.stop) // self.rays

    def numbers(self, span: slice, glossy: bool = False) -> PathNumbers:
        """Numbers for the rays of ``span``: those of a pixel go on from sample to sample of the picture."""
        first, last = span.start // self.rays, -(-span.stop // self.rays)
        held = slice(span.start - first * self.rays, span.stop - first * self.rays)
        key = hash_u32(_STREAM, _GLOSSY if glossy else _DIFFUSE, self._shown[0][first:last])
        index = self._shown[1][first:last, None] * self.rays + np.arange(self.rays)
        return PathNumbers(np.repeat(key, self.rays)[held], index.astype(np.uint32).reshape(-1)[held])

    @cached_property
    def _shown(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """The number of every pixel, which of its samples this is, and the triangle that it shows (n,) each."""
        gbuffer = self.frame.gbuffer
        return tuple(gbuffer.shown(part)[self.chosen] for part in (self.frame.pixel, self.frame.turn, gbuffer.primitive))

    def receiver(self, pixel: np.ndarray) -> Receiver:
        """The surfaces of ``pixel`` (m,) as light reaches them."""
        return Receiver(self.surfaces.normals[pixel], self.surfaces.faces[pixel], self._shown[2][pixel])

    def mirror(self, pixel: np.ndarray) -> Mirror:
        """The surfaces of ``pixel`` (m,) as they reflect."""
        surfaces = self.surfaces.take(pixel)
        return Mirror(surfaces.points, surfaces.normals, surfaces.faces, surfaces.towards_eye, surfaces.look,
                      self.receiver(pixel).primitive)

    def start(self, pixel: np.ndarray, directions: np.ndarray) -> np.ndarray:
        """Where rays along ``directions`` (m, 3) leave the surfaces of ``pixel`` (m,)."""
        return offset_origins(self.surfaces.points[pixel], self.surfaces.faces[pixel], directions)


def _in_turn(spacing: int) -> np.ndarray:
    """The pixels (spacing²,) of a block in an order in which those that follow each other lie apart."""
    count = spacing**2
    step = next(step for step in range(max(1, round(count * _GOLDEN)), 2 * count + 1) if np.gcd(step, count) == 1)
    return np.arange(count) * step % count
