"""An engine's coordinates: points, directions, matrices and spherical harmonics along its axes.

Harmonics are never swizzled by hand: their matrix is the projection of the basis along the new axes onto the basis, which
`numerics.sh.rotation_matrix` integrates exactly, mirrored axes included. Octahedral maps of directions cannot be turned without
resampling, so tiles stay in the bundle's own map, and an engine's shader looks a direction up through ``blender_from_engine``.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from ...numerics import sh


@dataclass(frozen=True)
class Axes:
    """``rows`` are the engine's x, y and z axes in Blender's coordinates; ``scale`` is how many engine units make a metre."""

    rows: tuple[tuple[int, int, int], ...]
    scale: float = 1.0

    @cached_property
    def engine_from_blender(self) -> np.ndarray:
        """(3, 3) float64, orthogonal: directions from Blender's axes to the engine's."""
        return np.array(self.rows, np.float64)

    @property
    def blender_from_engine(self) -> np.ndarray:
        """(3, 3) float64, orthogonal: directions back."""
        return self.engine_from_blender.T

    @property
    def mirrored(self) -> bool:
        """True if the engine is left-handed."""
        return bool(np.linalg.det(self.engine_from_blender) < 0)

    def directions(self, directions_blender: np.ndarray) -> np.ndarray:
        """(…, 3) along the engine's axes, in the dtype that came; lengths stay."""
        directions = np.asarray(directions_blender)
        return directions @ self.engine_from_blender.T.astype(directions.dtype)

    def vectors(self, vectors_blender: np.ndarray) -> np.ndarray:
        """(…, 3) positions or differences of them [m] in the engine's axes and units, in the dtype that came."""
        return self.directions(vectors_blender) * np.asarray(vectors_blender).dtype.type(self.scale)

    def matrix(self, world_from_local: np.ndarray) -> np.ndarray:
        """(4, 4) float64: the engine's world from the same local coordinates that ``world_from_local`` takes."""
        result = np.array(world_from_local, np.float64)
        result[:3] = self.scale * (self.engine_from_blender @ result[:3])
        return result

    def harmonics(self, coefficients: np.ndarray) -> np.ndarray:
        """SH (…, k, c) of a function of directions in Blender's axes → of the same function of directions in the engine's."""
        order = sh.order_of(coefficients.shape[-2])
        matrix = sh.rotation_matrix(self.engine_from_blender, order)
        # What the quadrature leaves of exact zeros and ones.
        matrix = np.where(np.abs(matrix - np.round(matrix)) < 1e-12, np.round(matrix), matrix)
        return np.einsum("ij,...jc->...ic", matrix, np.asarray(coefficients, np.float64)).astype(np.float32)


# glTF, three.js, Godot and Bevy: right-handed, Y up.
Y_UP = Axes(((1, 0, 0), (0, 0, 1), (0, -1, 0)))
# Unity: left-handed, Y up.
UNITY = Axes(((-1, 0, 0), (0, 0, 1), (0, -1, 0)))
# Unreal: left-handed, Z up, centimetres.
UNREAL = Axes(((1, 0, 0), (0, -1, 0), (0, 0, 1)), 100.0)
