"""The film of a picture: means of samples, how far these are off, and which pixels need more of them.

The error is told from two parts of every pixel's samples (Dammertz, Hanika, Keller and Lensch 2010, "A Hierarchical Automatic
Stopping Condition for Monte Carlo Global Illumination"): those before the last look and those since. Each is a run of a
low-discrepancy sequence, stratified in itself, so that what strata gain is seen. Every other sample would not do: these lie in one
half of the pixel, and edges would seem noise for ever. Samples are given where the square of the
picture's error falls the fastest for them: as many to each pixel as its noise is (Neyman 1934). What this is not: a bound. A light
that no sample has met yet is not in it.
"""

import numpy as np

from .frame import Frame, Samples
from .passes import pass_of

# Samples that every pixel has before the first look at errors, and the most that one look adds to all pixels alike.
FIRST = 4
# Noise of a pixel that is told from so few samples is that of its neighbourhood, so many pixels to every side.
_AROUND = 1
# What one look adds, as a share of all samples so far, if so much is needed: of the pixels that are the farthest from enough, for
# their noise, which is a guess from few samples and falls faster than these grow, sets what all others need.
_ONE_LOOK = 0.08
# Pixels that seem good by chance have no more samples, and light that is shared between pixels is off by more than its noise.
# Against 200 samples everywhere, which are noisy as well, pictures of five scenes at 6 to 2 % were off by 0.8 to 1.4 times what
# pixels seemed to be off together, by 1.0 times in the mean (benchmarks/measured/rays.md).
_LUCK = 1.3
# The part of the square of the allowed error that pixels with room for samples may make up, whatever the others leave of it.
_LEAST_PART = 0.25


class Film:
    """The passes called ``names`` of a picture of ``size`` (width, height) pixels."""

    def __init__(self, size: tuple[int, int], names: tuple[str, ...]):
        self.size = size
        self._totals = {name: np.zeros((size[1], size[0], 4)) for name in names}
        # Sums and numbers of samples before the last look and since.
        self._parts = np.zeros((2, size[1], size[0], 3))
        self._counts = np.zeros((2, size[1], size[0]), np.int64)
        self._held = self._held_at = None

    @property
    def count(self) -> np.ndarray:
        """The number (h, w) of every pixel's samples."""
        return self._counts.sum(axis=0)

    def look(self, pixels: np.ndarray | None = None) -> None:
        """Hold what comes from here on against what there is, of all pixels or those ``pixels`` (h, w) bool."""
        rows = ... if pixels is None else pixels
        for before, since in (self._parts, self._counts):
            before[rows] += since[rows]
            since[rows] = 0

    def hold(self, squares: np.ndarray) -> None:
        """From here on samples share what light was known before, which is off by ``squares`` (h, w) and does not differ between
        them."""
        self._held, self._held_at = squares, self.count

    def add(self, frame: Frame) -> None:
        """Average in a sample of the whole picture, or those of single pixels."""
        if frame.samples is not None:
            self._add_samples(frame, frame.samples)
            return
        for name, total in self._totals.items():
            total += pass_of(frame, name)
        self._parts[1] += frame.light[..., :3]
        self._counts[1] += 1

    def _add_samples(self, frame: Frame, samples: Samples) -> None:
        for name, total in self._totals.items():
            total += _by_pixel(samples.pixel, pass_of(frame, name)[0], total.shape)
        self._parts[1] += _by_pixel(samples.pixel, frame.light[0, :, :3], self._parts[1].shape)
        self._counts[1] += np.bincount(samples.pixel, minlength=self._counts[1].size).reshape(self._counts[1].shape)

    def picture(self, name: str) -> np.ndarray:
        """The mean (h, w, 4) float32 of a pass."""
        return (self._totals[name] / np.maximum(self.count, 1)[..., None]).astype(np.float32)

    def squares(self) -> np.ndarray:
        """The square (h, w) by which each pixel of the lit picture is thought to be off, the mean of its colour channels [(W·sr⁻¹·
        m⁻²)²]; of those that had samples before the last look and since."""
        before, since = self._counts
        first, second = self._parts / np.maximum(self._counts, 1)[..., None]
        # The variance of m and n samples' mean is that of one over m + n; that of the difference of theirs is 1/m + 1/n times it.
        squares = np.square(first - second).mean(axis=-1) * (before * since / np.maximum(before + since, 1) ** 2)
        return squares if self._held is None else squares + np.where(self.count > self._held_at, self._held, 0.0)

    def allowed(self, error: float) -> float:
        """The square by which a pixel may be off in the mean for the picture to be within ``error``."""
        return (error / _LUCK * self.mean()) ** 2

    def mean(self) -> float:
        """The mean of the lit picture over pixels and colour channels [W·sr⁻¹·m⁻²]."""
        return float((self._parts.sum(axis=0) / np.maximum(self.count, 1)[..., None]).mean())

    def error(self) -> float:
        """The root of the mean square by which the lit picture is thought to be off, over its mean; 0 of a black one."""
        mean, chosen = self.mean(), self.count.min() < self.count.max()
        return float(np.sqrt(self.squares().mean()) / mean) * (_LUCK if chosen else 1.0) if mean > 0 else 0.0

    def needing(self, error: float, most: int) -> np.ndarray:
        """Pixels (h, w) bool whose samples are to be doubled for the picture to come within ``error``, of those that ``most``
        samples leave room for. None where that cannot be for the noise of the others."""
        squares, room = around(self.squares()), 2 * self.count <= most
        allowed = self.allowed(error) * squares.size
        # What pixels without room are off by is theirs for good; where it is too much already, others have what they would alone.
        left = allowed - float(squares[~room].sum())
        allowed = max(left if left > 0 else allowed, _LEAST_PART * allowed, 1e-30)
        noise = np.where(room, np.sqrt(squares * self.count), 0.0)
        more = noise * (noise.sum() / allowed) / self.count
        order = np.argsort(-more, axis=None, kind="stable")
        drawn = np.cumsum(self.count.ravel()[order])
        last = min(np.searchsorted(drawn, _ONE_LOOK * self.count.sum()), order.size - 1)
        return more > max(1.0, 0.5 * float(more.ravel()[order[last]]))


def _by_pixel(pixel: np.ndarray, values: np.ndarray, shape: tuple[int, int, int]) -> np.ndarray:
    """The sums of ``values`` (n, c) by the pixels (n,) they belong to, of ``shape`` (h, w, c)."""
    sums = [np.bincount(pixel, channel, minlength=shape[0] * shape[1]) for channel in values.T]
    return np.stack(sums, axis=-1).reshape(shape)


def around(values: np.ndarray) -> np.ndarray:
    """The mean of ``values`` (h, w) over each pixel and those about it that are in the picture."""
    total, weight = np.zeros_like(values), np.zeros_like(values)
    height, width = values.shape
    for down in range(-_AROUND, _AROUND + 1):
        for along in range(-_AROUND, _AROUND + 1):
            here = slice(max(0, -down), height - max(0, down)), slice(max(0, -along), width - max(0, along))
            there = slice(max(0, down), height - max(0, -down)), slice(max(0, along), width - max(0, -along))
            total[here] += values[there]
            weight[here] += 1.0
    return total / weight
