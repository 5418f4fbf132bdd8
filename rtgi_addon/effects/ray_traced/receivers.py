"""Pixels as surfaces that rays leave from, chunk by chunk, all of them or a few in each sample of the picture."""

from dataclasses import dataclass

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
        seen = frame.gbuffer.seen
        if spacing == 1:
            return Pixels(frame, surfaces, rays, np.arange(len(surfaces.points)))
        rows, columns = np.divmod(frame.pixel[seen], frame.size[0])
        turn = _in_turn(spacing)[frame.turn[seen] % spacing**2]
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
        ray = np.arange(span.start, span.stop)
        frame, chosen = self.frame, self.chosen[ray // self.rays]
        index = (frame.turn[frame.gbuffer.seen][chosen] * self.rays + ray % self.rays).astype(np.uint32)
        where = frame.pixel[frame.gbuffer.seen][chosen]
        return PathNumbers(hash_u32(_STREAM, _GLOSSY if glossy else _DIFFUSE, where), index)

    def receiver(self, pixel: np.ndarray) -> Receiver:
        """The surfaces of ``pixel`` (m,) as light reaches them."""
        primitive = self.frame.gbuffer.primitive[self.frame.gbuffer.seen][self.chosen[pixel]]
        return Receiver(self.surfaces.normals[pixel], self.surfaces.faces[pixel], primitive)

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
