"""The numbers that place points on texels and draw their rays: the same ones whenever they are asked for, on any thread."""

import numpy as np

from ...numerics.sampling import hash_u32, sobol_owen, unit_interval, wrapped

# What the dimensions of a texel's numbers are for, as [first, last): the place of a point, the direction of a ray from it, what it
# samples of a light. Choosing an emissive triangle takes one more than a place on a light: the directions' second, shifted alike.
PLACE, DIRECTION, LIGHT = (0, 2), (2, 4), (4, 6)
EMITTER_CHOICE, BRIGHT_CHOICE = (3, 4), (4, 5)
_DIMENSIONS = 6
# Tells the texels' numbers apart from all others of a seed.
_STREAM = 0x7E8E1


class TexelNumbers:
    """Shared Sobol points of ``count`` samples, shifted on the torus by a hash of each texel's slot."""

    def __init__(self, seed: int, count: int):
        self.seed = int(seed)
        self._sobol = sobol_owen(count, _DIMENSIONS, hash_u32(seed, _STREAM))

    def of(self, slots: np.ndarray, dimensions: tuple[int, int], count: int) -> np.ndarray:
        """(count, n, last − first) float32 in [0, 1) for ``slots`` (n,), of the ``dimensions`` [first, last)."""
        return wrapped(self.shared(dimensions, count)[:, None] + self.shifts(slots, dimensions))

    def shared(self, dimensions: tuple[int, int], count: int) -> np.ndarray:
        """(count, last − first): those of all slots, before they are shifted."""
        first, last = dimensions
        return self._sobol[:count, first:last]

    def shifts(self, slots: np.ndarray, dimensions: tuple[int, int]) -> np.ndarray:
        """(n, last − first): by how much those of each of ``slots`` (n,) are shifted on the torus."""
        return unit_interval(np.stack([hash_u32(slots, d, self.seed) for d in range(*dimensions)], axis=-1))
