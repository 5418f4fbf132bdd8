"""What media send along rays that do not begin at the eye: those that mirrors and surfaces gather light by.

One point a ray, drawn in proportion to what would reach its origin from there were the light the same everywhere: unbiased, and as
noisy as one sample is. Light comes to it as it comes to slices (`lighting`).
"""

from dataclasses import dataclass

import numpy as np

from ...transport.media.grid import Coefficients
from ...transport.media.phase import phase_moments, phase_value
from ...transport.media.table import CHUNK
from ...transport.parallel import chunks
from ...transport.vectors import dot
from .ambient import ORDER, scattered
from .lighting import Surroundings

# Lamps that every ray meets; of more, it meets one by chance.
ALL_LAMPS = 4
# How many numbers in [0, 1) a ray needs.
NUMBERS = 8


@dataclass(frozen=True, eq=False)
class MediaAlong:
    """The light that the media of ``around`` send along rays; ``around.context`` is not None."""

    around: Surroundings

    def light(self, origins: np.ndarray, directions: np.ndarray, limits: np.ndarray, u: np.ndarray) -> np.ndarray:
        """Radiance (n, 3) float32 [W·sr⁻¹·m⁻²] that comes to ``origins`` (n, 3) along unit ``directions`` (n, 3) from before
        ``limits`` (n,) [m], which may be infinite, by ``u`` (n, NUMBERS) in [0, 1)."""
        parts = [self._light(origins[rows], directions[rows], limits[rows], u[rows]) for rows in chunks(len(origins), CHUNK)]
        return np.concatenate(parts) if parts else np.zeros((0, 3), np.float32)

    def _light(self, origins, directions, limits, u) -> np.ndarray:
        media = self.around.media
        passage = media.passage(origins, directions, limits)
        result = passage.emitted()
        point = passage.scatter(u[:, :2])
        rows = np.flatnonzero(point.weight.max(axis=1) > 0)
        if rows.size:
            here = (origins[rows] + directions[rows] * point.distance[rows, None]).astype(np.float32)
            found = media.at(here)
            result[rows] += point.weight[rows] * self._arriving(found, here, directions[rows], u[rows])
        return result.astype(np.float32)

    def _arriving(self, found: list[Coefficients], points, directions, u) -> np.ndarray:
        """Light (n, 3) that turns into ``-directions`` at ``points``, per σ_s of all media together."""
        around = self.around
        shares = [one.scattering for one in found]
        phases = [filling.medium.phase for filling in around.media.fillings]
        coefficients = around.ambient.at(points, u[:, 2:5])
        result = sum(share * scattered(coefficients, directions, phase_moments(phase, ORDER))
                     for share, phase in zip(shares, phases, strict=True))
        lamps = np.array(around.added, np.intp)
        every = len(lamps) <= ALL_LAMPS
        for turn in range(len(lamps) if every else 1):
            chosen = lamps[turn] if every else lamps[np.minimum((u[:, 5] * len(lamps)).astype(np.intp), len(lamps) - 1)]
            sample = around.lamps.sample(chosen, points, (u[:, 6:8] + np.float32(0.381966 * turn)) % 1)
            arriving = sample.irradiance * (1.0 if every else len(lamps)) * around.reaching(
                chosen, points, sample.direction, sample.distance)
            arriving = arriving * np.reshape(around.lamps.scattered[chosen], (-1, 1))
            cosine = dot(directions, sample.direction)
            result = result + sum(share * phase_value(phase, cosine)[:, None] for share, phase in zip(
                shares, phases, strict=True)) * arriving
        return result / np.maximum(sum(shares), 1e-300)
