"""What overlays are made of, as arrays; knows no GPU."""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import combinations

import numpy as np

from ..effects.spheres.maps import SphereProbes
from ..numerics import grid as lattice
from ..numerics import sh
from ..scene import ProbeVolume
from ..techniques.base import BACKFACE_THRESHOLD, ProbeGrid

# Radius of a probe's sphere, in shares of its cell's smallest side.
PROBE_RADIUS = 0.12
# Radius of a sphere probe's mirror ball, in shares of the shortest of its influence's half axes.
MIRROR_RADIUS = 0.1
# How far discs stand above the surface they lie on, in shares of their radius: hardly.
DISC_HEIGHT = 0.02
# How far a probe's colour goes from usable to moved before it counts as inside geometry.
YELLOWEST = 0.5
# Colours of a probe's state, scene-linear: usable, moved out of geometry, inside geometry.
USABLE, MOVED, UNUSABLE = np.float32([[0.08, 0.5, 0.12], [0.9, 0.55, 0.04], [0.75, 0.03, 0.03]])


@dataclass(frozen=True, eq=False)
class Discs:
    """Discs on surfaces: ``points``, unit ``normals`` (n, 3), one ``radius`` [m], ``colors`` (n, 4) scene-linear with alpha."""

    points: np.ndarray
    normals: np.ndarray
    radius: float
    colors: np.ndarray

    @property
    def rows(self) -> np.ndarray:
        """(n, 12) float32: what overlay_disc.vert.glsl reads of each."""
        count = len(self.points)
        rows = np.zeros((count, 12), np.float32)
        rows[:, :3], rows[:, 3] = self.points + DISC_HEIGHT * self.radius * self.normals, self.radius
        rows[:, 4:7], rows[:, 8:] = self.normals, self.colors
        return rows


def probe_rows(grids: Sequence[ProbeGrid], size: float = 1.0) -> tuple[np.ndarray, int]:
    """(p, 8 + 12 blocks) float32, what overlay_probe.vert.glsl reads of the probes of all ``grids``, whose spheres are ``size``
    times as large as usual; and the SH order of their coefficients, which are those of irradiance as it was baked."""
    order = max(grid.order for grid in grids)
    blocks = -(-sh.coefficient_count(order) // 4)
    return np.concatenate([_rows_of(grid, blocks, size) for grid in grids]), order


def _rows_of(grid: ProbeGrid, blocks: int, size: float) -> np.ndarray:
    held = grid.sh.reshape(-1, *grid.sh.shape[3:])
    points = lattice.lattice_points(grid.volume.world_from_local, grid.volume.resolution) + grid.offset_world
    side = lattice.cell_size(grid.volume.world_from_local, grid.volume.nodes).min()
    channels = np.zeros((len(held), 3, 4 * blocks), np.float32)
    channels[:, :, :held.shape[1]] = np.moveaxis(held, 1, 2) * sh.cosine_coefficients(grid.order)
    head = np.zeros((len(held), 8), np.float32)
    head[:, :3], head[:, 3], head[:, 4:7] = points.reshape(-1, 3), PROBE_RADIUS * size * side, state_colors(grid)
    return np.concatenate([head, channels.reshape(len(held), -1)], axis=1)[grid.counts.ravel()]


def state_colors(grid: ProbeGrid) -> np.ndarray:
    """(p, 3) float32: green for probes that are used where they are, yellower the more of their hits were on backs; orange for
    those that were moved; red for those that lie inside geometry."""
    validity = grid.validity.reshape(-1)
    moved = grid.moved.reshape(-1)
    share = np.clip((1.0 - validity) / BACKFACE_THRESHOLD, 0.0, 1.0)[:, None]
    usable = USABLE * (1.0 - YELLOWEST * share) + YELLOWEST * share * MOVED
    return np.where(moved[:, None], MOVED, np.where(share >= 1.0, UNUSABLE, usable)).astype(np.float32)


def mirror_rows(spheres: SphereProbes, size: float = 1.0) -> np.ndarray:
    """(p, 4) float32: centre and radius of the balls of sphere probes, ``size`` times as large as usual."""
    probes = [item.probe for item in spheres.maps]
    axes = [np.linalg.norm(np.asarray(probe.world_from_local)[:3, :3], axis=0).min() for probe in probes]
    radii = [MIRROR_RADIUS * size * axis * probe.influence_distance for axis, probe in zip(axes, probes, strict=True)]
    return np.float32([[*probe.centre_world, radius] for probe, radius in zip(probes, radii, strict=True)])


def sphere_triangles(columns: int = 16, rows: int = 8) -> np.ndarray:
    """(3t, 3) float32: corners of a unit sphere of that many columns and rows of faces."""
    azimuth = np.linspace(0.0, 2.0 * np.pi, columns + 1)
    polar = np.linspace(0.0, np.pi, rows + 1)
    theta, phi = np.meshgrid(polar, azimuth, indexing="ij")
    points = np.stack([np.sin(theta) * np.cos(phi), np.sin(theta) * np.sin(phi), np.cos(theta)], axis=-1)
    low_left, low_right, high_left, high_right = points[:-1, :-1], points[:-1, 1:], points[1:, :-1], points[1:, 1:]
    quads = np.stack([low_left, high_left, high_right, low_left, high_right, low_right], axis=2)
    return quads.reshape(-1, 3).astype(np.float32)


def box_lines(volumes: Sequence[ProbeVolume]) -> np.ndarray:
    """(2e, 3) float32: ends of the twelve edges of every volume's box."""
    corners = lattice.UNIT_BOX
    edges = [pair for pair in combinations(range(len(corners)), 2) if np.count_nonzero(np.diff(corners[list(pair)], axis=0)) == 1]
    boxes = [lattice.transform_points(volume.world_from_local, corners[np.array(edges).ravel()]) for volume in volumes]
    return np.concatenate([np.zeros((0, 3)), *boxes]).astype(np.float32)
