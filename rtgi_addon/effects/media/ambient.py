"""The light that a bake knows in the air, on a lattice of its own where media are: SH of radiance, looked up once for all views.

It is read without interpolation, at a point that is shifted by up to half a cell at random: the mean over samples is the trilinear
one, for an eighth of its cost.
"""

from dataclasses import dataclass

import numpy as np

from ...numerics import sh
from ...numerics.grid import lattice_from_world, lattice_points
from ...scene import Scene
from ...techniques.base import Field
from ...transport.lights.world_sh import world_sh
from .froxels import medium_bounds, scene_bounds

ORDER = 2
# Points along the longest side of the lattice, and in all.
_ALONG, _MOST = 32, 1 << 15


@dataclass(frozen=True, eq=False)
class Ambient:
    """``coefficients`` (nz·ny·nx, 9, 3) float32 of radiance [W·sr⁻¹·m⁻²] over the box ``world_from_local``, cell-centred samples of
    ``resolution`` (x, y, z), as numerics/grid.py has them."""

    world_from_local: np.ndarray
    resolution: tuple[int, int, int]
    coefficients: np.ndarray

    @staticmethod
    def of(scene: Scene, field: Field | None) -> "Ambient":
        """What ``field`` knows where the media of ``scene`` are. None: the world's own light, unshadowed; of which none is left in
        a medium that is everywhere."""
        media = [medium for medium in scene.media if medium.visible_camera]
        if field is None:
            coefficients = world_sh(scene.world, ORDER) * (not any(medium.fills_space for medium in scene.media))
            return Ambient(np.eye(4), (1, 1, 1), coefficients[None].astype(np.float32))
        boxes = [scene_bounds(scene) if medium.fills_space else medium_bounds(medium) for medium in media]
        low, high = np.min([box[0] for box in boxes], axis=0), np.max([box[1] for box in boxes], axis=0)
        half = np.maximum(0.5 * (high - low), 1e-6)
        world_from_local = np.diag([*half, 1.0])
        world_from_local[:3, 3] = 0.5 * (low + high)
        resolution = _resolution(half)
        points = lattice_points(world_from_local, resolution).reshape(-1, 3).astype(np.float32)
        return Ambient(world_from_local, resolution, np.ascontiguousarray(field.radiance_sh(points, ORDER), np.float32))

    def at(self, points: np.ndarray, u: np.ndarray) -> np.ndarray:
        """Coefficients (n, 9, 3) at ``points`` (n, 3), shifted by ``u`` (n, 3) in [0, 1)."""
        if len(self.coefficients) == 1:
            return np.broadcast_to(self.coefficients, (len(points), *self.coefficients.shape[1:]))
        place = lattice_from_world(self.world_from_local, self.resolution, points).astype(np.float32)
        last = np.array(self.resolution) - 1
        x, y, z = np.clip(np.floor(np.clip(place, 0, last) + u), 0, last).astype(np.intp).T
        return self.coefficients[(z * self.resolution[1] + y) * self.resolution[0] + x]


def scattered(coefficients: np.ndarray, directions: np.ndarray, moments: np.ndarray) -> np.ndarray:
    """Light (n, 3) that comes towards the eye per σ_s, of radiance with SH ``coefficients`` (n, 9, 3) about points that are seen
    along ``directions`` (n, 3): Σ a_l·L_lm·Y_lm(d), with the phase function's ``moments`` (3,) a_l."""
    weights = sh.evaluate(directions, ORDER) * moments.astype(np.float32)[sh.bands(ORDER)]
    # What order 2 cannot hold may come out below 0.
    return np.maximum(np.einsum("nk,nkc->nc", weights, coefficients), 0.0)


def _resolution(half: np.ndarray) -> tuple[int, int, int]:
    """Samples along each side, in cells that are nearly cubes."""
    cell = 2.0 * half.max() / _ALONG
    while np.prod(np.ceil(2.0 * half / cell - 1e-9)) > _MOST:
        cell *= 1.1
    return tuple(int(max(count, 1)) for count in np.ceil(2.0 * half / cell - 1e-9))
