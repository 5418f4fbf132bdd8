"""What techniques that see the scene in voxels do alike as techniques."""

from typing import ClassVar

import numpy as np

from ...progress import Progress
from ...scene import Scene
from ..base import Checkpoint, Technique, begin_bake
from ..kernels import Kernels
from .field import VoxelField
from .settings import VoxelSettings


class VoxelTechnique(Technique):
    """A technique whose bakes are of the type ``baked``."""

    baked: ClassVar[type[VoxelField]]
    not_weighed = "probes for the same light, which is exact and quicker"

    def bake(self, scene: Scene, settings: VoxelSettings, rng: np.random.Generator, progress: Progress, *,
             threads: int | None = None, checkpoint: Checkpoint | None = None, kernels: Kernels | None = None) -> VoxelField:
        """See Technique.bake. ``kernels`` put triangles into voxels elsewhere than on the CPU."""
        self.check(settings)
        context, seed = begin_bake(scene, settings, rng, progress, threads)
        return self.baked.bake(context, settings, seed, progress, kernels)

    def check(self, settings: VoxelSettings) -> None:
        """Raise UsageError for ``settings`` that no bake can have."""
