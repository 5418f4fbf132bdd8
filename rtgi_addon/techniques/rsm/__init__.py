"""The first bounce of lamps, gathered from reflective shadow maps.

Paper: C. Dachsbacher and M. Stamminger, "Reflective Shadow Maps", I3D 2005. Each lamp is captured into maps of position, normal and
reflected flux (`transport/views/reflective_shadow_map.py`); a receiver sums a few hundred of their texels (`gather.py`, with the
formulas and what differs from the paper).

What it is not: the light that it knows is one bounce of lamps. World, emissive surfaces and further bounces are not in it. The
paper's gather has no visibility: bounced light goes through walls (set ``visibility`` for a shadow ray per sample). Lamps with a
radius are captured from their centre, area lamps from a few points, and a texel has one normal and albedo for all it covers.

Measured at default settings against the path reference, at points on surfaces of cornell_box, two_rooms, sun_window and
corridor_door_ajar (`benchmarks/technique_errors.py`): of all indirect light it errs by 46, 63, 72 and 57 %, almost all of it the
bounces that it lacks (bias −43, −57, −74, −52 %). Of the first bounce of lamps it errs by 17 to 22 % and is 12 to 18 % too bright,
since nothing is in the way; the dark one of the two rooms, where the exact answer is 0, gets 14 % of the light of the lit one. With
``visibility`` these are 6 to 15 %, within 2 % of the right sum, and exactly 0; 8,192 samples take the 6 to 15 % to 1 to 2 %.
"""

import numpy as np

from ...progress import Progress
from ...scene import Scene
from ..base import Checkpoint, Field, Technique, begin_bake
from ..kernels import NUMPY, Kernels
from .field import Capture
from .settings import RsmSettings


class ReflectiveShadowMaps(Technique):
    """Bakes one bounce from reflective shadow maps; see the module's docstring."""

    name = "rsm"
    label = "Reflective Shadow Maps"
    description = "One bounce of the lamps, gathered from what each of them lights first; without occlusion, as in the paper"
    Settings = RsmSettings
    devices = ("cpu", "gpu")
    tolerance = 0.05
    knows = frozenset({"lamps"})
    presets = {"draft": {"resolution": 128, "samples": 64, "visibility": False},
               "preview": {"resolution": 256, "samples": 256, "visibility": True},
               "final": {"resolution": 512, "samples": 1600, "visibility": True}}

    def bake(self, scene: Scene, settings: RsmSettings, rng: np.random.Generator, progress: Progress, *,
             threads: int | None = None, checkpoint: Checkpoint | None = None, kernels: Kernels | None = None) -> Field:
        """See Technique.bake. ``kernels`` captures and gathers elsewhere than on the CPU."""
        context, seed = begin_bake(scene, settings, rng, progress, threads)
        return Capture(context, settings, seed, kernels or NUMPY).field(progress)

    def sweep(self) -> tuple[RsmSettings, ...]:
        """Samples, without occlusion as in the paper, and with shadow rays."""
        return (RsmSettings(resolution=128, samples=64), RsmSettings(), RsmSettings(visibility=True),
                RsmSettings(samples=1600, visibility=True))


TECHNIQUE = ReflectiveShadowMaps()
