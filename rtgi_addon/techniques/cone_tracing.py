"""Voxel cone tracing: a few cones through a hierarchy of lit voxels.

Source: C. Crassin, F. Neyret, M. Sainz, S. Green and E. Eisemann, "Interactive Indirect Illumination Using Voxel Cone Tracing",
Computer Graphics Forum 30(7), 2011. The hierarchy is anisotropic (`transport/voxels/hierarchy`), the cones have the cosine lobe's
moments, the way out of a receiver's own surroundings is walked voxel by voxel (`transport/voxels/cones`).

What it is not: exact. Between few cones nothing is seen, within one everything is mixed; far voxels hold both sides of what is
thinner than they are, so light leaks along walls that do not lie along the axes; what stands in one voxel with the receiver is
lost.
"""

from dataclasses import dataclass

import numpy as np

from ..errors import UsageError
from ..transport.voxels.cascades import by_cascade
from ..transport.voxels.cones import FEWEST, cone_set, irradiance, trace_cones
from .base import setting
from .voxels.field import AROUND, VoxelField
from .voxels.settings import VOXELS, VoxelSettings
from .voxels.technique import VoxelTechnique

# Tangent of the half angle of a cone that covers its share of the sphere.
_AROUND_SPREAD = float(np.tan(np.arccos(1.0 - 2.0 / AROUND)))


@dataclass(frozen=True)
class ConeSettings(VoxelSettings):
    """What a user may set."""

    cones: int = setting(16, "Cones", "Cones from every receiver: 6 as games take them, or 12 and more, which see more between "
                         "them", "", 6, 256)
    step: float = setting(0.5, "Step", "Length of a step along a cone, in the voxels that it reads there", "", 0.05, 2.0)
    near: float = setting(3.0, "Near Field", "Voxels from a receiver that are walked one by one before cones widen", "", 0.0, 64.0)


class ConeField(VoxelField):
    """Irradiance by cones."""

    technique = "cone_tracing"

    def gather(self, points: np.ndarray, normals: np.ndarray) -> np.ndarray:
        """See VoxelField."""
        settings, cones = self.settings, cone_set(self.settings.cones)
        return by_cascade(self.hierarchies, points, lambda hierarchy, rows: irradiance(
            hierarchy, points[rows], normals[rows], cones, self.beyond, settings.step, settings.near))

    def look(self, points: np.ndarray, directions: np.ndarray) -> np.ndarray:
        """See VoxelField."""
        def seen_by(hierarchy, rows):
            spread = np.full(len(rows), _AROUND_SPREAD)
            seen = trace_cones(hierarchy, points[rows], directions[rows], spread, None, self.settings.step, self.settings.near)
            return seen.radiance + seen.passed[:, None] * self.beyond(points[rows], directions[rows], spread)

        return by_cascade(self.hierarchies, points, seen_by)


class ConeTracing(VoxelTechnique):
    """See the module's docstring."""

    name, label = "cone_tracing", "Voxel Cone Tracing"
    description = "A few cones through a hierarchy of lit voxels: smooth and quick, leaks through what is thinner than two voxels"
    Settings, baked = ConeSettings, ConeField
    devices = ("cpu", "gpu")
    tolerance = 0.13
    presets = {"draft": {"resolution": 32, "cones": 6}, "preview": {"resolution": 64, "cones": 6},
               "final": {"resolution": 128, "cones": 32}}

    def check(self, settings: ConeSettings) -> None:
        """See VoxelTechnique."""
        if 6 < settings.cones < FEWEST:
            raise UsageError(f"cones is {settings.cones}", f"give 6, or at least {FEWEST}")

    def sweep(self) -> tuple[ConeSettings, ...]:
        """Resolutions, numbers of cones, and light that the voxels send each other."""
        return (ConeSettings(resolution=32, cones=6), ConeSettings(cones=6), ConeSettings(light=VOXELS), ConeSettings(),
                ConeSettings(resolution=128, cones=32))


TECHNIQUE = ConeTracing()
