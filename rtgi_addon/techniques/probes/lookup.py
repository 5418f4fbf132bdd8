"""What one probe lattice says about a point on a surface: eight neighbours, weighted by what they can know of it.

The weight of a neighbour is trilinear × ((n·d + 1)/2)² + 0.2 (d towards the probe: probes behind the surface count little) × the
Chebyshev bound (σ²/(σ² + (r − μ)²))³ that the probe sees the point at distance r, from the mean μ and variance σ² of the
distances it stored in that direction; weights below 0.2 are crushed to w³/0.2². Probes inside geometry weigh nothing.

Where DDGI keeps a visibility of at least 0.05, which leaves 0.3 % of a lit room in the black one behind a thin wall, all
weights here share a floor of 1e-4 of the plain trilinear weight: it decides only where no neighbour sees the point, and makes
the answer there the trilinear one over the live probes. Where none of the eight is live, dilated coefficients take over.

Source: Z. Majercik et al., "Dynamic Diffuse Global Illumination with Ray-Traced Irradiance Fields", JCGT 8(2), 2019, and NVIDIA's
RTXGI-DDGI SDK, Irradiance.hlsl (DDGIGetVolumeIrradiance).
"""

from dataclasses import dataclass

import numpy as np

from ...numerics import grid as lattice
from ...numerics import octahedral
from ..base import ProbeGrid
from .dilation import dilate, live_probes
from .reconstruction import RECONSTRUCTIONS, dering, reconstruct

_CHUNK = 1 << 14
_CRUSH_BELOW = np.float32(0.2)
_UNSEEN_FLOOR = np.float32(1e-4)
_DILATED_FLOOR = np.float32(1e-12)


@dataclass(frozen=True)
class LookupSettings:
    """How a field of probes is read.

    ``reconstruction`` is one of RECONSTRUCTIONS; ``visibility`` turns the Chebyshev weight on, ``normal_weight`` the one by the
    side of the surface (both off: plain trilinear, as most engines do). ``normal_bias`` moves the point that must be seen along
    its normal, in shares of the smallest cell side: large enough that a surface does not hide itself, small against a room.
    """

    reconstruction: str = "deringed"
    visibility: bool = True
    normal_weight: bool = True
    normal_bias: float = 0.3

    def __post_init__(self):
        if self.reconstruction not in RECONSTRUCTIONS:
            raise ValueError(f"reconstruction {self.reconstruction!r} is none of {', '.join(RECONSTRUCTIONS)}")


class GridLookup:
    """One ``ProbeGrid`` made ready for reading: dilated, deringed if asked for, positions and distances laid out flat.

    ``centre`` (3,) float64 is the volume's [m], and ``positions`` (p, 3) float32 the probes' from there, moved as ``offset_world``
    (nz, ny, nx, 3) says; ``live`` (p,) bool tells which hold light; ``coefficients`` (p, k, 3) float32 are SH of radiance;
    ``moments`` (p·(T + 2)², 2) float32 mean and mean squared distance [m] in bordered octahedral tiles of ``tile`` T; ``bias`` [m]
    is the one along normals.
    """

    def __init__(self, grid: ProbeGrid, settings: LookupSettings):
        self.settings = settings
        self.volume = grid.volume
        self.cell_volume = lattice.cell_volume(grid.volume.world_from_local, grid.volume.resolution)
        self.bias = settings.normal_bias * lattice.cell_size(grid.volume.world_from_local, grid.volume.resolution).min()
        # Positions count from the volume's centre, so that float32 keeps its digits far from the world's origin.
        self.centre = np.asarray(grid.volume.world_from_local, np.float64)[:3, 3]
        points = lattice.lattice_points(grid.volume.world_from_local, grid.volume.resolution) - self.centre
        self.positions = (points + grid.offset_world).reshape(-1, 3).astype(np.float32)
        self.offset_world = grid.offset_world
        self.live = live_probes(grid).ravel()
        sh = dilate(grid).sh
        self.coefficients = (dering(sh) if settings.reconstruction == "deringed" else sh).reshape(-1, *sh.shape[3:])
        self.tile = grid.visibility.shape[3]
        self.moments = octahedral.add_border(np.asarray(grid.visibility, np.float32)).reshape(-1, 2)

    def coverage(self, points: np.ndarray) -> np.ndarray:
        """(n,) float32: 1 inside the volume, falling to 0 over its outermost cell, 0 outside."""
        resolution = np.asarray(self.volume.resolution, np.float64)
        position = lattice.lattice_from_world(self.volume.world_from_local, resolution, points)
        depth = np.minimum(position + 0.5, resolution - 0.5 - position) / np.minimum(resolution / 2.0, 1.0)
        return np.clip(depth.min(axis=-1), 0.0, 1.0).astype(np.float32)

    def distance(self, points: np.ndarray) -> np.ndarray:
        """(n,) float64: from ``points`` to the point of the box with the nearest local coordinates [m]; 0 inside."""
        local = lattice.local_from_world(self.volume.world_from_local, points)
        nearest = lattice.transform_points(self.volume.world_from_local, np.clip(local, -1.0, 1.0))
        return np.linalg.norm(nearest - points, axis=-1)

    def irradiance(self, points: np.ndarray, normals: np.ndarray) -> np.ndarray:
        """Irradiance (n, 3) float32, never negative, at ``points`` with unit ``normals`` (n, 3), world space.

        Points outside take the outermost probes.
        """
        result = np.empty((len(points), self.coefficients.shape[-1]), np.float32)
        for start in range(0, len(points), _CHUNK):
            part = slice(start, start + _CHUNK)
            unit = np.asarray(normals[part], np.float32)
            result[part] = reconstruct(self.settings.reconstruction, self._blended(points[part], unit), unit)
        return result

    def weights(self, points: np.ndarray, normals: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Flat probe indices (n, 8) and their weights (n, 8) float32, which sum to 1."""
        index, trilinear = self.neighbours(points)
        normals = np.asarray(normals, np.float32)
        relative = (np.asarray(points, np.float64) - self.centre).astype(np.float32)
        seen = np.ones_like(trilinear)
        if self.settings.normal_weight:
            seen *= _normal_weight(self.positions[index] - relative[:, None], normals)
        if self.settings.visibility:
            biased = relative + np.float32(self.bias) * normals
            seen *= self._chebyshev(index, biased[:, None] - self.positions[index])
        seen = np.where(seen < _CRUSH_BELOW, seen**3 / _CRUSH_BELOW**2, seen)
        weight = trilinear * (np.where(self.live[index], seen + _UNSEEN_FLOOR, np.float32(0.0)) + _DILATED_FLOOR)
        return index, weight / weight.sum(axis=1, keepdims=True)

    def neighbours(self, points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Rows (n, 8) of the probes about each of ``points`` (n, 3) in this lookup's arrays, and their trilinear weights (n, 8)."""
        position = lattice.lattice_from_world(self.volume.world_from_local, self.volume.resolution, points)
        return lattice.trilinear(position, self.volume.resolution)

    def _blended(self, points: np.ndarray, normals: np.ndarray) -> np.ndarray:
        index, weight = self.weights(points, normals)
        total = np.zeros((len(points), *self.coefficients.shape[1:]), np.float32)
        for corner in range(8):
            total += weight[:, corner, None, None] * self.coefficients[index[:, corner]]
        return total

    def _chebyshev(self, index: np.ndarray, offset: np.ndarray) -> np.ndarray:
        """(n, 8): how surely probe ``index`` sees the point at ``offset`` (n, 8, 3) from it (one-sided Chebyshev, cubed)."""
        distance = np.linalg.norm(offset, axis=-1)
        at_probe = (distance <= 1e-6 * self.bias)[..., None]
        texel, fraction = octahedral.bilinear(np.where(at_probe, np.float32([0, 0, 1]), offset), self.tile)
        width = self.tile + 2
        texel = texel + index * (width * width)
        x, y = fraction[..., :1], fraction[..., 1:]
        lower = (1.0 - x) * self.moments[texel] + x * self.moments[texel + 1]
        upper = (1.0 - x) * self.moments[texel + width] + x * self.moments[texel + width + 1]
        moments = lower + y * (upper - lower)
        mean = moments[..., 0]
        variance = np.abs(moments[..., 1] - mean * mean)
        behind = np.maximum(distance - mean, 0.0)
        bound = variance / np.maximum(variance + behind * behind, np.finfo(np.float32).tiny)
        return np.where(behind > 0.0, bound**3, np.float32(1.0))


def _normal_weight(towards_probe: np.ndarray, normals: np.ndarray) -> np.ndarray:
    """(n, 8): ((n·d + 1)/2)² + 0.2 for the directions to the probes (n, 8, 3); a probe at the point itself counts in full."""
    length = np.linalg.norm(towards_probe, axis=-1)
    cosine = np.einsum("nkc,nc->nk", towards_probe, normals) / np.maximum(length, np.finfo(np.float32).tiny)
    wrapped = 0.5 * (np.where(length > 0.0, cosine, np.float32(1.0)) + 1.0)
    return wrapped * wrapped + np.float32(0.2)
