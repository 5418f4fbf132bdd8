"""Parallel light from afar: where its rays begin."""

import numpy as np

from ...numerics.sampling import disk_from_square, frame

# Beams from afar are sampled in nested disks about the focus, each so many times as wide as the one before.
DISK_RATIO = 3.0


class Beam:
    """Parallel light from afar over a scene with ``bounds`` (2, 3), denser about the sphere of ``centre`` (3,) and ``radius``.

    The density over the area across a direction is a mixture of uniform disks, from the focus to what covers the scene, so that a
    ground plane of kilometres leaves rays for a lawn, and none of the plane is left out.
    """

    def __init__(self, bounds: np.ndarray, centre: np.ndarray, radius: float):
        bounds = np.asarray(bounds, np.float64)
        self.centre = np.asarray(centre, np.float64)
        farthest = np.maximum(np.abs(bounds - self.centre).max(axis=0), 1e-9)
        self.radius = 1.0001 * float(np.linalg.norm(farthest))
        count = 1 + max(0, int(np.ceil(np.log(self.radius / min(max(radius, 1e-6), self.radius)) / np.log(DISK_RATIO) - 1e-6)))
        squared = (self.radius * DISK_RATIO ** -np.arange(count, dtype=np.float64)[::-1]) ** 2
        self._squared = np.concatenate([[0.0], squared])
        self._density = np.array([np.sum(1.0 / squared[k:]) for k in range(count)]) / (np.pi * count)
        self._cdf = np.concatenate([[0.0], np.cumsum(self._density * np.pi * np.diff(self._squared))])

    def origins(self, directions: np.ndarray, u: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Starting points (n, 3) before the scene of rays along ``directions`` (n, 3), and the inverse density (n,) [m²]."""
        disk = disk_from_square(u.astype(np.float64))
        share = (disk**2).sum(axis=1)
        squared = np.interp(share, self._cdf, self._squared)
        level = np.clip(np.searchsorted(self._squared, squared, side="right") - 1, 0, len(self._density) - 1)
        offset = disk * np.sqrt(squared / np.maximum(share, 1e-300))[:, None]
        tangent, bitangent = frame(directions.astype(np.float64))
        start = self.centre - directions * self.radius + tangent * offset[:, :1] + bitangent * offset[:, 1:]
        return start.astype(np.float32), (1.0 / self._density[level]).astype(np.float32)

    def domain(self, directions: np.ndarray, points: np.ndarray) -> np.ndarray:
        """Where (n, 3) ``points`` lie in the beam along ``directions``: across it, with radii such that the density is uniform."""
        offset = points - self.centre
        offset = offset - directions * np.einsum("ij,ij->i", offset, directions)[:, None]
        squared = np.einsum("ij,ij->i", offset, offset)
        share = np.interp(squared, self._squared, self._cdf)
        return (offset * np.sqrt(share / np.maximum(squared, 1e-300))[:, None]).astype(np.float32)
