"""What every texel of the surface cache was found to receive, a row each."""

from dataclasses import dataclass, fields
from functools import cached_property

import numpy as np


@dataclass(frozen=True, eq=False)
class TexelRows:
    """A row per texel; in the cache's own (``none``, ``followed_by``) with a last row of zeros for rays that left the scene (−1).

    Irradiance (n, 3) [W·m⁻²] of the world, of emissive surfaces and, direct, of the sources; ``smooth`` (n, 1) bool: direct light
    varies so little over the texel that its mean will do; ``choices`` (n, CHOICES) int16 of sources and ``choice_weights`` float32,
    one over their probability, (n, 0) where all sources are sampled anyway; mean ``albedo`` (n, 3), and ``translucency`` (n, 3) to
    light from the other side, whose texel is ``opposite`` (n, 1) int32 (−1: none where nothing passes);
    ``irradiance_limited`` (n, g, 3), the part of the direct light that may be reflected so often alone, for each of the
    ``TexelLight.limits``; ``halves`` (n, 3), by how much the first half of the rays says more of world and emission than
    the second.
    """

    irradiance_sky: np.ndarray
    irradiance_emission: np.ndarray
    irradiance_direct: np.ndarray
    smooth: np.ndarray
    choices: np.ndarray
    choice_weights: np.ndarray
    albedo: np.ndarray
    translucency: np.ndarray
    opposite: np.ndarray
    irradiance_limited: np.ndarray
    halves: np.ndarray

    @staticmethod
    def none(limits: int = 0, choices: int = 0) -> "TexelRows":
        """No texel, only the row that stands for none, with so many limits of bounces, and choices of sources for a texel."""
        dark = np.zeros((1, 3), np.float32)
        return TexelRows(dark, dark, dark, np.ones((1, 1), bool), np.zeros((1, choices), np.int16),
                         np.zeros((1, choices), np.float32), dark, dark, np.full((1, 1), -1, np.int32),
                         np.zeros((1, limits, 3), np.float32), dark)

    @property
    def count(self) -> int:
        """Number of texels."""
        return len(self.albedo) - 1

    @cached_property
    def passing(self) -> np.ndarray:
        """Texels (k,) that light from the other side passes."""
        return np.flatnonzero(self.opposite[:, 0] >= 0)

    def leaving(self, irradiance: np.ndarray) -> np.ndarray:
        """π times the radiance (n + 1, 3) that texels send out which receive ``irradiance`` (n + 1, 3)."""
        radiance = self.albedo * irradiance
        if self.passing.size:
            radiance[self.passing] += self.translucency[self.passing] * irradiance[self.opposite[self.passing, 0]]
        return radiance

    def followed_by(self, parts: list["TexelRows"]) -> "TexelRows":
        """These texels and those of ``parts``, which have no last row."""
        return TexelRows(*(np.concatenate([rows[:-1], *(getattr(part, name) for part in parts), rows[-1:]])
                           for name, rows in self.arrays().items()))

    def arrays(self) -> dict[str, np.ndarray]:
        """The columns by name; ``TexelRows(**arrays)`` takes them back."""
        return {item.name: getattr(self, item.name) for item in fields(self)}
