"""Indirect light that the first samples of a picture gathered, for those that refine it.

What a picture needs more samples for are edges, and what mirrors show; light that surfaces scatter is smooth, and known by then
from all rays of a pixel and its neighbours. So it is gathered at fewer places than surfaces are looked at, as shading is decoupled
from visibility (Ragan-Kelley, Lehtinen, Chen, Doggett and Durand 2011, "Decoupled Sampling for Graphics Pipelines"): a sample has
it from the first samples of its pixel that show the same surface, unless none does or what these know is too noisy.
"""

import numpy as np

from .. import kernels
from .film import around
from .frame import GATHERED, Frame, KnownLight

# Normals that differ by 8° share half, as do surfaces that lie off the plane by half a pixel's width (ray_traced/smoothing.py).
_NORMAL_POWER = 72.0
# A place is known from samples that are together worth so many of the same surface.
_LEAST_WEIGHT = 0.5
# A pixel's light is good enough if the square that it is off by is no more than so many times what pixels are allowed in the mean;
# that of all together, if theirs is no more than this part of it.
_MOST, _PART = 4.0, 0.3
# What samples may take beyond the first few [bytes]: twelve of two megapixels.
_MOST_BYTES = 1 << 30
_TINY = np.float32(1e-20)


class KeptLight(KnownLight):
    """What the first samples of a picture gathered, pixel by pixel."""

    def __init__(self):
        # Of each: points, normals, irradiance and albedo (h·w, 3), halves where they are as good.
        self._samples: list[tuple[np.ndarray, ...]] = []
        # By how much each counts.
        self._weights: list[float] = []
        self._enough: np.ndarray | None = None

    def add(self, frame: Frame, weight: float = 1.0) -> None:
        """Keep what a sample of the whole picture gathered, if any effect did; it counts by ``weight``, as the number of its rays
        is."""
        if GATHERED in frame.kept:
            self._weights.append(weight)
            gbuffer = frame.gbuffer
            parts = ((gbuffer.position, np.float32), (gbuffer.normal, np.float16), (frame.kept[GATHERED], np.float32),
                     (gbuffer.albedo, np.float16))
            self._samples.append(tuple(np.ascontiguousarray(part[..., :3].reshape(-1, 3), dtype) for part, dtype in parts))

    def fits(self, count: int) -> bool:
        """Whether there is memory for ``count`` samples like the first."""
        return count * sum(part.nbytes for part in (self._samples or [()])[0]) <= _MOST_BYTES

    def settle(self, frame: Frame, allowed: float) -> tuple[np.ndarray, bool]:
        """Decide of which pixels of ``frame``, the last that was added, the light is good enough where they may be off by the
        square ``allowed`` [(W·sr⁻¹·m⁻²)²] in the mean: the square (h, w) by which these are thought to be off by it, and whether
        all together are good enough."""
        pixel, width, shape = np.arange(frame.pixel.size), frame.footprint.reshape(-1), frame.footprint.shape
        squares, known, count = np.zeros(pixel.size), np.zeros(pixel.size), len(self._samples)
        for number, (points, normals, light, albedo) in enumerate(self._samples):
            others = [other for other in range(count) if (other < count // 2) != (number < count // 2)]
            expected, found = self._mean(others, pixel, points, normals, width)
            # One sample against the mean of others that know the place as well: the square of what weight 1 is off by.
            worth = 1.0 / self._weights[number] + 1.0 / max(sum(self._weights[other] for other in others), _TINY)
            off = np.square((light - expected) * albedo * np.float32(1.0 / np.pi)).mean(axis=1) / worth
            squares += np.where(found, off, 0.0)
            known += found
        squares = (squares / np.maximum(known, 1.0) / max(sum(self._weights), _TINY)).reshape(shape)
        enough = (around(squares) <= _MOST * allowed) & (known.reshape(shape) > 0)
        self._enough, squares = enough.reshape(-1), np.where(enough, squares, 0.0)
        return squares, bool(squares.mean() <= _PART * allowed)

    def at(self, pixel: np.ndarray, points: np.ndarray, normals: np.ndarray, width: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """See KnownLight.at."""
        light, found = self._mean(range(len(self._samples)), pixel, points, normals, width)
        return light, found & self._enough[pixel]

    def _mean(self, numbers, pixel, points, normals, width) -> tuple[np.ndarray, np.ndarray]:
        """As ``at``, from some of the samples."""
        total, inverse = np.zeros(points.shape, np.float32), np.float32(1.0) / width
        weight, found = np.zeros((2, len(points)), np.float32)
        if kernels.is_available():
            asked = (np.ascontiguousarray(part, dtype) for part, dtype in (
                (pixel, np.int64), (points, np.float32), (normals, np.float32), (inverse, np.float32)))
            self._add_kept(numbers, *asked, total, weight, found)
            return total / np.maximum(weight, _TINY)[:, None], found >= _LEAST_WEIGHT
        for number in numbers:
            kept_points, kept_normals, light, _ = (np.take(part, pixel, axis=0) for part in self._samples[number])
            off = sum(normals[:, axis] * (kept_points[:, axis] - points[:, axis]) for axis in range(3)) * inverse
            alike = sum(normals[:, axis] * kept_normals[:, axis] for axis in range(3))
            counts = np.exp2(np.float32(_NORMAL_POWER) * np.log2(np.maximum(alike, _TINY)) - np.float32(4.0) * off * off)
            found += counts
            counts *= np.float32(self._weights[number])
            total += light * counts[:, None]
            weight += counts
        return total / np.maximum(weight, _TINY)[:, None], found >= _LEAST_WEIGHT

    def _add_kept(self, numbers, pixel, points, normals, inverse, total, weight, found) -> None:
        """See _mean: in one pass over each of the samples."""
        for number in numbers:
            kept_points, kept_normals, light, _ = self._samples[number]
            kernels.call("kept_light", len(light), kept_points, kept_normals, light, self._weights[number], len(pixel), pixel,
                         points, normals, inverse, total, weight, found)
