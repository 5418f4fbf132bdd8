"""Light propagation volumes."""

import numpy as np

from ...errors import BakeError
from ...progress import Progress
from ...scene import Scene
from ...transport.context import LightContext
from ..base import Checkpoint, Field, Technique, validate_settings
from ..kernels import NUMPY, Kernels
from .bake import LpvBake
from .settings import LpvSettings


class LightPropagationVolumes(Technique):
    """Light propagation volumes; see the module's docstring."""

    name = "lpv"
    label = "Light Propagation Volumes"
    description = "Light flows from cell to cell of a lattice: fast, smooth, leaks and spreads"
    Settings = LpvSettings
    tolerance = 0.65
    devices = ("cpu", "gpu")

    def bake(self, scene: Scene, settings: LpvSettings, rng: np.random.Generator, progress: Progress, *,
             threads: int | None = None, checkpoint: Checkpoint | None = None, kernels: Kernels | None = None) -> Field:
        """See Technique.bake."""
        validate_settings(settings)
        if not scene.volumes:
            raise BakeError("the scene has no probe volume", "add a Light Probe Volume")
        seed = int(rng.integers(1 << 32))
        progress.stage("ray tracer")
        progress.step(0.0, "building the ray tracer")
        context = LightContext(scene, threads)
        progress.stage("geometry volume")
        bake = LpvBake(context, settings, seed, kernels or NUMPY, progress.span(0.0, 0.4))
        progress.stage("propagation")
        return bake.light(progress.span(0.4, 1.0))


TECHNIQUE = LightPropagationVolumes()
