"""Emissive triangles as light sources: chosen by power, sampled by area, with the density that balances them against hits."""

import numpy as np

from ..numerics.sampling import r2
from .geometry import Geometry
from .parallel import chunks
from .surfaces import Surfaces
from .vectors import luminance

# Points at which a triangle's mean emission is estimated, and how many evaluations all triangles may share.
MAX_POINTS, EVALUATIONS = 64, 1 << 20
# A textured triangle on which every estimate was black still gets this share of its material's mean: it may hold a light.
FLOOR = np.float32(0.02)


class EmitterTable:
    """Every triangle whose material emits, with probability proportional to area × luminance of its mean emission.

    ``count`` triangles, ``primitive`` (count,) int32 their indices; ``total_power`` [W] their luminous flux. Emission leaves
    both faces, as in Cycles, so a receiver takes the absolute cosine at the emitter and the flux is 2π·A·L.
    """

    def __init__(self, geometry: Geometry, surfaces: Surfaces):
        self._geometry, self._surfaces = geometry, surfaces
        emissive = np.asarray(surfaces.emissive, bool)
        self.primitive = np.flatnonzero(emissive[geometry.material] & (geometry.areas > 0)).astype(np.int32)
        weight = self._mean_luminance().astype(np.float64) * geometry.areas[self.primitive]
        self.primitive, weight = self.primitive[weight > 0], weight[weight > 0]
        self.count = len(self.primitive)
        total = float(weight.sum())
        self.total_power = 2.0 * np.pi * total
        self._cdf = np.cumsum(weight) / max(total, 1e-300)
        self._pdf_area = np.zeros(geometry.count, np.float32)
        self._pdf_area[self.primitive] = weight / max(total, 1e-300) / geometry.areas[self.primitive]

    def sample(self, u: np.ndarray):
        """Points on emitters for ``u`` (n, 3) in [0, 1): ``points`` (n, 3), geometric ``normals`` (n, 3) on the mesh's front
        side, ``radiance`` (n, 3) [W·sr⁻¹·m⁻²] including the surface's coverage, ``pdf_area`` (n,) [m⁻²] and
        ``primitive`` (n,) int32."""
        chosen = np.minimum(np.searchsorted(self._cdf, u[:, 0], side="right"), self.count - 1)
        primitive = self.primitive[chosen]
        bu, bv = _barycentrics(u[:, 1:])
        points = self._geometry.points(primitive, bu, bv)
        return (points, self._geometry.normals_world[primitive], self._radiance(primitive, bu, bv), self._pdf_area[primitive],
                primitive)

    def pdf_area(self, primitive: np.ndarray) -> np.ndarray:
        """Density (n,) [m⁻²] with which ``sample`` finds a point of ``primitive`` (n,); 0 for what does not emit and for −1."""
        return np.where(primitive >= 0, self._pdf_area[primitive], np.float32(0.0))

    def _radiance(self, primitive, u, v) -> np.ndarray:
        radiance = self._surfaces.emission(primitive, u, v)
        material = self._geometry.material[primitive]
        rows = np.flatnonzero(self._surfaces.transparent[material])
        if rows.size:
            alpha = self._surfaces.alpha(primitive[rows], u[rows], v[rows])
            threshold = self._surfaces.alpha_threshold[material[rows]]
            coverage = np.where(np.isnan(threshold), alpha, alpha >= threshold)
            radiance[rows] *= coverage[:, None].astype(np.float32)
        return radiance

    def _mean_luminance(self) -> np.ndarray:
        """Luminance of each candidate's mean emission, estimated at a fixed set of its points."""
        n = len(self.primitive)
        mean = np.zeros(n, np.float32)
        if n == 0:
            return mean
        count = int(np.clip(EVALUATIONS // n, 1, MAX_POINTS))
        bu, bv = _barycentrics(r2(count, 0))
        for span in chunks(n, max(1, (1 << 18) // count)):
            primitive = np.repeat(self.primitive[span], count)
            repeats = len(primitive) // count
            radiance = self._radiance(primitive, np.tile(bu, repeats), np.tile(bv, repeats))
            mean[span] = luminance(radiance).reshape(repeats, count).mean(axis=1)
        material = self._geometry.material[self.primitive]
        areas = self._geometry.areas[self.primitive]
        material_area = np.bincount(material, areas)
        material_mean = np.bincount(material, areas * mean) / np.maximum(material_area, 1e-30)
        return np.maximum(mean, FLOOR * material_mean[material].astype(np.float32))


def _barycentrics(u: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    root = np.sqrt(u[:, 0])
    return root * (1.0 - u[:, 1]), root * u[:, 1]
