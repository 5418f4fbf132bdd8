"""Rays through a grid of lit voxels, from receivers or from the grid's own cells.

Source: the lecture's volume-based global illumination (G. Papaioannou, "Real-Time Dynamic Global Illumination", 2020), after P.
Mavridis and G. Papaioannou, "Global Illumination Using Imperfect Volumes", GRAPP 2011, and S. Thiedemann et al., "Voxel-based
Global Illumination", I3D 2011. Its pseudo-code takes what a ray finds times cosines over r², which is right where surfaces are
drawn by area and not where directions are: over an endless plane it gives L/(5h²). Here rays are drawn in proportion to the cosine,
E = π/N·ΣL. From cells, light is carried slice by slice in fixed directions, and receivers read the cells before them: quicker and
cruder.

What it is not: quick on a CPU, where rays among triangles are a hundred times quicker and exact. It shows what an engine's voxels
would.
"""

from dataclasses import dataclass

import numpy as np

from ..errors import UsageError
from ..numerics import sh
from ..numerics.sampling import about, cosine_hemisphere, hash_u32, sobol_owen, unit_interval, wrapped
from ..progress import Progress
from ..transport.voxels.between import between
from ..transport.voxels.cascades import by_cascade
from ..transport.voxels.rays import march_on
from ..transport.voxels.sweeps import irradiance_of_cells, sample_cells, sweep
from .base import setting
from .voxels.field import VoxelField
from .voxels.settings import VOXELS, VoxelSettings
from .voxels.technique import VoxelTechnique

RECEIVERS, CELLS = "receivers", "voxels"
COMPOSITING, FIRST_HIT = "compositing", "first hit"
# A voxel that blocks more than this ends a ray that goes to the first hit: the lecture's threshold.
OCCUPIED = 0.5
# SH order of what arrives in cells.
_ORDER = 2
# Tells the shifts of rays apart from all other numbers of a seed: the letters vm.
STREAM = 0x766D


@dataclass(frozen=True)
class MarchSettings(VoxelSettings):
    """What a user may set."""

    rays: int = setting(64, "Rays", "Rays from every receiver, or directions in which cells hand light on", "", 8, 4096)
    gather: str = setting(RECEIVERS, "Gather", "Rays from receivers, or what arrives in the voxels before them",
                          choices=(RECEIVERS, CELLS))
    opacity: str = setting(COMPOSITING, "Opacity", "All voxels count for what they cover, or the first that is half covered counts "
                           "whole", choices=(COMPOSITING, FIRST_HIT))

    @property
    def hands_on(self) -> bool:
        """See VoxelSettings."""
        return super().hands_on or self.gather == CELLS


class MarchField(VoxelField):
    """Irradiance by rays through the voxels; ``arriving`` (nz, ny, nx, 9, 3): what arrives in cells, where those are asked."""

    technique = "voxel_march"

    def __init__(self, context, settings: MarchSettings, seed: int, voxels, progress: Progress):
        super().__init__(context, settings, seed, voxels, progress)
        self.arriving = None
        if settings.gather == CELLS:
            self._standing = between(self.voxels, context.geometry)
            self.arriving = sweep(self._standing, self.voxels.opacity, self.voxels.by_face(self.leaving[0]), settings.rays, _ORDER,
                                  self._sky, context.threads, progress.span(0.9, 1.0))

    def gather(self, points: np.ndarray, normals: np.ndarray) -> np.ndarray:
        """See VoxelField."""
        if self.arriving is not None:
            return irradiance_of_cells(self._standing, self.arriving, points, normals)
        rays = self.settings.rays
        # The same rays for the same place, whoever else is asked about.
        bits = np.ascontiguousarray(np.concatenate([points, normals], axis=1)).view(np.uint32)
        shift = unit_interval(np.stack([hash_u32(*bits.T, d, self.seed, STREAM) for d in range(2)], axis=1))
        numbers = wrapped(sobol_owen(rays, 2, self.seed)[None] + shift[:, None]).reshape(-1, 2)
        upward = np.repeat(normals, rays, axis=0)
        radiance = self._along(np.repeat(points, rays, axis=0), about(upward, cosine_hemisphere(numbers)), upward)
        return radiance.reshape(len(points), rays, 3).mean(axis=1) * np.float32(np.pi)

    def look(self, points: np.ndarray, directions: np.ndarray) -> np.ndarray:
        """See VoxelField."""
        return self._along(points, directions, None)

    def radiance_sh(self, points: np.ndarray, order: int = 2) -> np.ndarray:
        """See Field."""
        if self.arriving is None or order > _ORDER or self._bright or self._lamp_light:
            return super().radiance_sh(points, order)
        return sample_cells(self.voxels.grid, self.arriving, points)[:, :sh.coefficient_count(order)]

    def _along(self, points: np.ndarray, directions: np.ndarray, normals: np.ndarray | None) -> np.ndarray:
        first_hit = OCCUPIED if self.settings.opacity == FIRST_HIT else None

        def seen_by(hierarchy, chosen):
            from_here, way = points[chosen], directions[chosen]
            through = self.hierarchies[self.hierarchies.index(hierarchy):]
            seen = march_on(through, from_here, way, None if normals is None else normals[chosen], first_hit)
            radiance, rows = seen.radiance, np.flatnonzero(seen.passed)
            if rows.size:
                radiance[rows] += seen.passed[rows, None] * self.beyond(from_here[rows], way[rows], np.zeros(len(rows)))
            return radiance

        return by_cascade(self.hierarchies, points, seen_by)


class VoxelMarch(VoxelTechnique):
    """See the module's docstring."""

    name, label = "voxel_march", "Voxel Ray Marching"
    description = "Rays through a grid of lit voxels: what voxel engines show, slower here than rays among triangles"
    Settings, baked = MarchSettings, MarchField
    devices = ("cpu", "gpu")
    tolerance = 0.1
    presets = {"draft": {"resolution": 32, "rays": 16}, "preview": {"resolution": 64, "rays": 64},
               "final": {"resolution": 128, "rays": 256}}

    def check(self, settings: MarchSettings) -> None:
        """See VoxelTechnique."""
        if settings.cascades > 1 and settings.gather == CELLS:
            raise UsageError(f"gather is {CELLS} and cascades is {settings.cascades}", "gather from receivers, or use one grid")

    def sweep(self) -> tuple[MarchSettings, ...]:
        """Resolutions, from cells, and light that the voxels send each other."""
        return (MarchSettings(resolution=32, rays=16), MarchSettings(gather=CELLS), MarchSettings(light=VOXELS), MarchSettings(),
                MarchSettings(resolution=128))


TECHNIQUE = VoxelMarch()
