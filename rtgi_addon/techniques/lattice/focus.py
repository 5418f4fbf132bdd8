"""What probe volumes are together: their probes, the least distance between two, and the sphere about which bakes spend what they
have."""

import numpy as np

from ...numerics.grid import box_corners, cell_size, lattice_points
from ...scene import ProbeVolume


def probes_of(volumes: tuple[ProbeVolume, ...]) -> np.ndarray:
    """World positions (p, 3) float64 of all lattice points, volume after volume, x fastest; scattered probes are moved from
    there."""
    return np.concatenate([lattice_points(volume.world_from_local, volume.resolution).reshape(-1, 3) for volume in volumes])


def spacing_of(volumes: tuple[ProbeVolume, ...]) -> float:
    """The least distance [m] between neighbours along an axis of any of the lattices, or of the nodes of scattered volumes."""
    return min(float(cell_size(volume.world_from_local, volume.nodes).min()) for volume in volumes)


def box_around(volumes: tuple[ProbeVolume, ...], scale: float, bounds: np.ndarray) -> np.ndarray | None:
    """The box (2, 3) float64 around all volumes, ``scale`` times as large, cut to ``bounds`` (2, 3); None where nothing is left."""
    corners = np.concatenate([box_corners(volume.world_from_local) for volume in volumes])
    low, high = corners.min(axis=0), corners.max(axis=0)
    grown = 0.5 * (low + high) + 0.5 * scale * np.array([low - high, high - low])
    cut = np.stack([np.maximum(grown[0], bounds[0]), np.minimum(grown[1], bounds[1])])
    return cut if np.all(cut[0] <= cut[1]) else None


def focus(volumes: tuple[ProbeVolume, ...]) -> tuple[np.ndarray, float]:
    """Centre (3,) and radius [m] of a sphere around all volumes."""
    corners = np.concatenate([box_corners(volume.world_from_local) for volume in volumes])
    center = 0.5 * (corners.min(axis=0) + corners.max(axis=0))
    return center, float(np.linalg.norm(corners - center, axis=1).max())
