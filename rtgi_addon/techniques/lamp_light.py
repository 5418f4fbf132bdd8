"""The direct light of the lamps that a bake holds: those that are set to it, or with ``every`` all of them.

Sources of light without a size take one shadow ray, others a low-discrepancy set of them, the same for every receiver.
"""

import numpy as np

from ..scene.lights import held_directly
from ..transport.context import LightContext
from ..transport.paths.sources import Sources


class LampLight:
    """Direct light in the scene of ``context``, from ``samples`` points of each lamp that has an extent.

    ``lamps`` are the indices of the lamps and ``names`` (frozenset) their names; false where there are none. ``seed`` chooses the
    points.
    """

    def __init__(self, context: LightContext, every: bool, samples: int, seed: int):
        self.lamps = held_directly(context.scene.lights, every)
        self.names = frozenset(context.scene.lights[lamp].name for lamp in self.lamps)
        self._sources, self._samples, self._seed = Sources(context), samples, seed

    def __bool__(self) -> bool:
        return bool(self.lamps)

    def irradiance(self, points: np.ndarray, normals: np.ndarray) -> np.ndarray:
        """Irradiance (n, 3) float32 [W·m⁻²] at ``points`` (n, 3) with unit ``normals`` (n, 3), which all light reaches: linking of
        receivers is for who knows the object."""
        total, reach = np.zeros((len(points), 3), np.float32), np.zeros(len(points), np.float32)
        for lamp, count, numbers in self._sources.lamp_samples(self.lamps, self._seed, self._samples):
            uv = np.tile(numbers, (len(points), 1))
            total += self._sources.irradiance(lamp, points, normals, normals, reach, uv) / count
        return total

    def coefficients(self, points: np.ndarray, order: int) -> np.ndarray:
        """SH coefficients (n, (order + 1)², 3) float64 of what arrives at free ``points`` (n, 3)."""
        return self._sources.lamp_coefficients(self.lamps, points, order, self._seed, self._samples)
