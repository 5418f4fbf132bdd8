"""Light propagation volumes: light flows from cell to cell of a lattice.

Papers: A. Kaplanyan, "Light Propagation Volumes in CryEngine 3", SIGGRAPH 2009; A. Kaplanyan and C. Dachsbacher, "Cascaded Light
Propagation Volumes for Real-Time Indirect Illumination", I3D 2010. What lamps light first (the texels of reflective shadow maps)
and emissive surfaces go into cells as cosine lobes in SH of order 1 (`injection`, `sources`, `standing`); what surfaces do at the
faces between cells is found by rays (`crossings`, `geometry_volume`) or from what views see of them (`surfels`); steps carry light
through the faces, past or back from what blocks (`propagation`); the sum over steps is what is gathered (`gather`), from
nested volumes (`cascades`).

Apart from the papers: light keeps its direction from cell to cell, over a mean free path in metres; nothing is clamped and every
face is open or closed by itself, so a closed room's surfaces receive what its lights give, at any resolution, and closed surfaces
let nothing through; blocked light is always reflected by the blocker's own albedo, so bounces do not end with a camera's view; a
finer cascade is lit through its border by the coarser one; the world is traced to each cell, and only what surfaces reflect of it
is propagated; a surface takes just the light that it stops.

What it is not: exact. A cell knows one direction, so light turns corners, and what comes from two sides is held for light from all
around; light that surfaces outside the coarsest volume reflect is not known; a bright spot of the sky is as soft as SH of order 1.

The sum over surfaces is within a fifth of the path reference at 8, 16 and 32 cells on ten samples and in the rooms of
tests/techniques/lpv/test_rooms.py, and light in place 1 to 30 % off with 16 cells (benchmarks/README.md, which has a house whose
lit outside makes its inside a quarter too bright). A step is a cell: a room wants ten times its cells.
"""

import numpy as np

from ...progress import Progress
from ...scene import Scene
from ..base import Checkpoint, Field, Technique, begin_bake
from ..kernels import NUMPY, Kernels
from .bake import bake_field
from .settings import LpvSettings


class LightPropagationVolumes(Technique):
    """Light propagation volumes; see the module's docstring."""

    name = "lpv"
    label = "Light Propagation Volumes"
    description = "Light flows from cell to cell of a lattice: fast, smooth, leaks and spreads"
    Settings = LpvSettings
    tolerance = 0.4
    devices = ("cpu", "gpu")
    presets = {"draft": {"resolution": 8, "steps": 64}, "preview": {"resolution": 16, "steps": 64},
               "final": {"resolution": 16, "steps": 256}}

    def bake(self, scene: Scene, settings: LpvSettings, rng: np.random.Generator, progress: Progress, *,
             threads: int | None = None, checkpoint: Checkpoint | None = None, kernels: Kernels | None = None) -> Field:
        """See Technique.bake."""
        context, seed = begin_bake(scene, settings, rng, progress, threads)
        return bake_field(context, settings, seed, kernels or NUMPY, progress)

    def sweep(self) -> tuple[LpvSettings, ...]:
        """Resolutions, and the few steps that games take."""
        return (LpvSettings(resolution=8), LpvSettings(steps=8), LpvSettings(), LpvSettings(resolution=32))


TECHNIQUE = LightPropagationVolumes()
