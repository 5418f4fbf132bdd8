"""SH irradiance probes on a lattice, baked by rays against a surface radiosity cache.

Papers: Greger et al., "The Irradiance Volume", IEEE CG&A 18(2), 1998 (probes on a lattice); Ramamoorthi and Hanrahan, "An
Efficient Representation for Irradiance Environment Maps", SIGGRAPH 2001 (SH of incident radiance, eq. 7–12); Majercik et al.,
"Dynamic Diffuse Global Illumination with Ray-Traced Irradiance Fields", JCGT 8(2), 2019 (distances, weights, relocation).

What it is not: a lattice knows nothing of what happens between its points; see `lookup` for what visibility and normal
weights make of that. Glossy reflection is treated as diffuse of the same albedo.
"""

import numpy as np

from ...errors import BakeError
from ...progress import Progress
from ...scene import Scene
from ..base import Checkpoint, Field, Technique, validate_settings
from .bake import ProbeBake
from .dilation import dilate
from .field import ProbeField
from .settings import ProbeSettings


class Probes(Technique):
    """Bakes SH probes; see the module's docstring."""

    name = "probes"
    label = "Irradiance Probes"
    description = "Spherical harmonics of incident light on a lattice, the form that engines read"
    Settings = ProbeSettings

    def bake(self, scene: Scene, settings: ProbeSettings, rng: np.random.Generator, progress: Progress, *,
             threads: int | None = None, checkpoint: Checkpoint | None = None) -> Field:
        """See Technique.bake."""
        validate_settings(settings)
        if not scene.volumes:
            raise BakeError("the scene has no probe volume", "add a Light Probe Volume")
        seed = int(rng.integers(1 << 32))
        bake = ProbeBake(scene, settings, seed, progress, threads, checkpoint or Checkpoint())
        bake.run()
        progress.stage("field")
        grids = tuple(dilate(grid) for grid in bake.grids())
        return ProbeField(grids)


TECHNIQUE = Probes()
