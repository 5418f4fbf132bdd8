"""Probes that are kept up to date while the scene changes (dynamic diffuse global illumination, DDGI).

Whatever updates probes a few rays at a time comes in here; what a frame and a bake have in common (placing, tracing, projecting)
lies above in `probes/` and in `lattice/`. `updates` is what others use: a frame traces a budget of rays, `follow` takes in what has
changed. `lattice` holds the probes' light and blends it, `hits` shades what rays meet by the light of the frame before, `settings`
is what a user may set.
"""

from .settings import LiveSettings
from .updates import LiveFrame, LiveProbes

__all__ = ["LiveFrame", "LiveProbes", "LiveSettings"]
