"""What a lamp's shader nodes make of its light, as tables: over directions (IES profiles, gobos), over places on the lamp (textured
area lamps) and over the distance (Light Falloff). A lamp shines with its strength times the product of those it has.
"""

from dataclasses import dataclass, field

import numpy as np

# The first and the last distance [m] of ``by_distance``; nearer and farther ones count as these.
NEAREST, FARTHEST = 1e-3, 1e4


@dataclass(frozen=True, eq=False)
class LampProfile:
    """Factors on a lamp's strength, linear between the middles of cells, (…, 3) float32 each, or None where they are all 1.

    ``by_direction`` (h, w, 3): row i is that of directions of travel at the angle (i + ½)/h·``reach`` [rad] from −Z of the frame
    ``world_from_profile`` (3, 3), column j at the azimuth (j + ½)/w·2π from +X towards +Y; beyond ``reach`` as at it. With
    ``of_normals`` they are over the outward normal where light leaves the lamp's sphere, instead of over where it travels.
    ``by_place`` (h, w, 3): over an area lamp, rows along its half axis v and columns along u, both from −1 to 1. ``by_distance``
    (k, 3): over the distance from where light leaves the lamp, even steps of its logarithm from NEAREST to FARTHEST.
    """

    world_from_profile: np.ndarray = field(default_factory=lambda: np.eye(3))
    by_direction: np.ndarray | None = None
    reach: float = float(np.pi)
    of_normals: bool = False
    by_place: np.ndarray | None = None
    by_distance: np.ndarray | None = None


def directions(profile: LampProfile) -> np.ndarray:
    """(h, w, 3) float64: unit directions in world space at the middles of the cells of ``by_direction``."""
    height, width = profile.by_direction.shape[:2]
    angle = ((np.arange(height) + 0.5) / height * profile.reach)[:, None]
    azimuth = ((np.arange(width) + 0.5) / width * 2.0 * np.pi)[None, :]
    return from_angles(angle, azimuth) @ np.asarray(profile.world_from_profile, np.float64).T


def from_angles(angle: np.ndarray, azimuth: np.ndarray) -> np.ndarray:
    """(…, 3): unit directions in a profile's frame at an ``angle`` from −Z and an ``azimuth`` from +X towards +Y [rad]."""
    return np.stack(np.broadcast_arrays(np.sin(angle) * np.cos(azimuth), np.sin(angle) * np.sin(azimuth), -np.cos(angle)), axis=-1)


def solid_angles(profile: LampProfile) -> np.ndarray:
    """(h,) float64 [sr]: the solid angle of a cell of each row of ``by_direction``."""
    height, width = profile.by_direction.shape[:2]
    edges = np.cos(np.linspace(0.0, profile.reach, height + 1))
    return -np.diff(edges) * (2.0 * np.pi / width)


def distances(count: int) -> np.ndarray:
    """The distances (count,) float64 [m] of the entries of a ``by_distance``."""
    return np.geomspace(NEAREST, FARTHEST, count)
