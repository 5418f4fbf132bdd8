"""Light propagation volumes: light flows from cell to cell of a lattice.

Papers: A. Kaplanyan, "Light Propagation Volumes in CryEngine 3", SIGGRAPH 2009; A. Kaplanyan and C. Dachsbacher, "Cascaded Light
Propagation Volumes for Real-Time Indirect Illumination", I3D 2010. What lamps light first (the texels of reflective shadow maps)
and emissive surfaces go into cells as cosine lobes in SH of order 1 (`injection`, `sources`); surfaces go into a geometry volume
half a cell off (`surfels`, `geometry_volume`); steps carry light through the cells' faces, past or back from what blocks
(`propagation`); the sum over steps is what is gathered (`gather`), from nested volumes (`cascades`).

Apart from the papers: flux is never clamped, so it is conserved; blocking is two-sided and tight for walls along the cells;
blocked light is always reflected by the blocker's own albedo, so bounces do not end with a camera's view; a finer cascade is
lit through its border by the coarser one; the world is traced to each cell, and only what surfaces reflect of it is
propagated; a surface takes its light from the second cell before it.

What it is not: exact. A step re-emits light as if it came from the cell's middle, so light spreads as by diffusion, turns corners
and comes back to the surface it left: finer cells do not converge. Slanted walls leak, and a closed room loses what is
reflected often (a sphere of albedo 0.9 keeps 36 %); light that surfaces outside the coarsest volume reflect is not known; a bright
spot of the sky is as soft as SH of order 1. Against the path reference, at points on surfaces, with 16 cells and 256 steps
(benchmarks/technique_errors.py):

    relative RMSE, bias    cornell_box 45 %, +15 %    two_rooms 36 %, -15 % (0.5 % of the lit room's light in the dark one)
                           sun_window 42 %, +3 %      corridor_door_ajar 30 %, -27 %

The 8 steps of games leave out four fifths of what lamps give a room 16 cells wide; 32 cells and 256 steps have 94 % on
cornell_box, 63 % on two_rooms. Without damping against self-lighting cornell_box has 64 %, without further bounces 56 %.
"""

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
    presets = {"draft": {"resolution": 8, "steps": 64}, "preview": {"resolution": 16, "steps": 64},
               "final": {"resolution": 16, "steps": 256}}

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

    def sweep(self) -> tuple[LpvSettings, ...]:
        """Resolutions, and the few steps that games take."""
        return (LpvSettings(resolution=8), LpvSettings(steps=8), LpvSettings(), LpvSettings(resolution=32))


TECHNIQUE = LightPropagationVolumes()
