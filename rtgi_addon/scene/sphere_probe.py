"""Blender's Light Probe Spheres: where radiance from all around is baked, and for which points it stands."""

from dataclasses import dataclass

import numpy as np

# The shapes of influence and parallax volumes.
SPHERE, BOX = "sphere", "box"
# More of them shaders do not look at, in engines or here.
MOST_SPHERES = 32


@dataclass(frozen=True, eq=False)
class SphereProbe:
    """A Light Probe Sphere at the origin of ``world_from_local`` (4, 4) float64.

    Its influence is the local sphere or box [−d, d]³ of the distance d = ``influence_distance``, over the last share ``falloff`` of
    which it fades. What it saw is taken to lie on its parallax volume, likewise. Surfaces nearer than ``clip_start`` or farther
    than ``clip_end`` [m] are not seen. Names and meanings are those of Blender's own settings; where no custom parallax is asked
    for, its volume is the influence's.
    """

    name: str
    world_from_local: np.ndarray
    influence_shape: str = SPHERE
    influence_distance: float = 2.5
    falloff: float = 0.2
    parallax_shape: str = SPHERE
    parallax_distance: float = 2.5
    clip_start: float = 0.0
    clip_end: float = np.inf

    @property
    def centre_world(self) -> np.ndarray:
        """(3,) float64."""
        return np.asarray(self.world_from_local, np.float64)[:3, 3]

    @property
    def unit_from_world(self) -> np.ndarray:
        """(4, 4) float64: turns the influence volume into the unit sphere or the box [−1, 1]³."""
        return _unit(self.world_from_local, self.influence_distance)

    @property
    def parallax_from_world(self) -> np.ndarray:
        """(4, 4) float64: the same of the parallax volume."""
        return _unit(self.world_from_local, self.parallax_distance)

    @property
    def extent(self) -> float:
        """Volume [m³] of the box around the influence: of probes about a point the smaller one counts first."""
        return float(abs(np.linalg.det(np.asarray(self.world_from_local, np.float64)[:3, :3])) * (2 * self.influence_distance)**3)

    @property
    def is_regular(self) -> bool:
        """Whether its transform and distances are finite and make volumes of it."""
        matrix = np.asarray(self.world_from_local, np.float64)
        if not np.isfinite(matrix).all() or not np.isfinite([self.influence_distance, self.parallax_distance]).all():
            return False
        axes = np.linalg.svd(matrix[:3, :3], compute_uv=False)
        return bool(axes[2] > 1e-7 * axes[0] and min(self.influence_distance, self.parallax_distance) > 0)


def _unit(world_from_local: np.ndarray, distance: float) -> np.ndarray:
    return np.linalg.inv(np.asarray(world_from_local, np.float64) @ np.diag([distance, distance, distance, 1.0]))
