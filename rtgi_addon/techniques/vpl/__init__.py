"""Instant radiosity: all bounced light from a few thousand virtual point lights, each with its shadows.

Papers: A. Keller, "Instant Radiosity", SIGGRAPH 1997; I. Georgiev and P. Slusallek, Eurographics 2010 (which lights to keep, see
``sampling``); T. Kollig and A. Keller, MCQMC 2004 (clamp and compensation); S. Laine et al., EGSR 2007 (moving lamps, see
``incremental``). Light paths leave lamps, emissive surfaces and the world in low-discrepancy order, shared out by power, and leave
a virtual light of flux Φ wherever they are reflected: E = Σ Φ/π·cosθ·cosθ'/r²·V. Emissive surfaces are virtual lights themselves,
the world is a set of distant ones.

What it is not: smooth near surfaces. Without a clamp the estimate is unbiased but every virtual light is a bright spot within about
the distance between lights; with one, corners are too dark unless compensated. Light from the world through small openings needs
many distant lights. Glossy reflection is treated as diffuse of the same albedo.

Measured with 4,096 lights at surface points of the samples, against the path reference (benchmarks/vpl.py): relative RMSE 3 to
7 % (cornell_box, sun_window, two_rooms), 1 to 5 % at the middle receiver, bias within 3.2 % in sun_window and 1.6 % elsewhere;
light in the dark one of two_rooms: none. SH of probes: 4 to 9 %, with many lamps 25 %; the error falls somewhat faster than the
square root of the number of lights.
"""

import numpy as np

from ...progress import Progress
from ...scene import Scene
from ...transport.context import LightContext
from ...transport.vectors import luminance
from ..base import Checkpoint, Field, Technique, begin_bake
from ..kernels import Kernels
from ..lattice.focus import focus
from .field import VplField, require_lights
from .gather import gather
from .sampling import LightSet, sample_lights
from .settings import VplSettings

# How far a bake is when the ray tracer is built, and when the virtual lights are chosen.
_READY, _LIGHTS_KEPT = 0.02, 0.2


class VirtualPointLights(Technique):
    """Bakes instant radiosity; see the module's docstring."""

    name = "vpl"
    label = "Virtual Point Lights"
    description = "Instant radiosity: bounced light from virtual lights that can follow a moving lamp"
    Settings = VplSettings
    tolerance = 0.05
    devices = ("cpu", "gpu")
    presets = {"draft": {"lights": 256}, "preview": {"lights": 1024}, "final": {"lights": 16384}}

    def bake(self, scene: Scene, settings: VplSettings, rng: np.random.Generator, progress: Progress, *,
             threads: int | None = None, checkpoint: Checkpoint | None = None, kernels: Kernels | None = None) -> Field:
        """See Technique.bake. ``kernels`` take over the gather at surface points. Raises BakeError if no virtual light survives."""
        context, seed = begin_bake(scene, settings, rng, progress, threads)
        progress.stage("virtual lights")
        lights = sample_lights(context, scene.volumes, settings, seed, focus(scene.volumes), progress.span(_READY, _LIGHTS_KEPT))
        natural = mean_bound(context, lights)
        clamp = _chosen_bound(natural, settings) if settings.clamp is None else settings.clamp or None
        field = VplField(context, lights, settings, seed, clamp, natural, kernels=kernels)
        require_lights(field)
        if clamp is not None:
            field.stats["clamp_loss"] = clamp_loss(context, lights, clamp)
        progress.stage("probes")
        probes = sum(int(np.prod(volume.resolution)) for volume in scene.volumes)
        field.grids(progress.span(_LIGHTS_KEPT, 1.0))
        field.stats["rays"] = probes * (field.lights.count + field.lights.distant_count)
        return field

    def sweep(self) -> tuple[VplSettings, ...]:
        """Numbers of virtual lights, to which time is proportional."""
        return (VplSettings(lights=64), VplSettings(lights=256), VplSettings(lights=1024), VplSettings())


# What compensation gives back need not come as a bright spot: with it, no light gives a receiver more than this share of the mean
# irradiance. Where no ray finds again what is cut, the bound stays at the mean itself and costs less light.
COMPENSATED_SHARE = 0.1


def _chosen_bound(natural: float | None, settings: VplSettings) -> float | None:
    return natural if natural is None or not settings.compensation else COMPENSATED_SHARE * natural


def mean_bound(context: LightContext, lights: LightSet) -> float | None:
    """The bound [m⁻²] at which a middling virtual light gives a receiver the mean irradiance of surfaces seen from the volumes, so
    that its bright spot is about as large as the distance between lights; None where no virtual light reaches them."""
    flux = float(np.median(luminance(lights.paths.flux))) if len(lights.paths.path) else 0.0
    mean = _irradiance(context, lights, lights.pilots.bound)
    return float(np.pi * mean / flux) if mean > 0 and flux > 0 else None


def clamp_loss(context: LightContext, lights: LightSet, clamp: float) -> float:
    """Share of the irradiance by virtual lights, of surfaces seen from the volumes, that the bound ``clamp`` [m⁻²] takes away,
    before compensation."""
    whole = _irradiance(context, lights, None)
    return 1.0 - _irradiance(context, lights, clamp) / whole if whole > 0 else 0.0


def _irradiance(context: LightContext, lights: LightSet, clamp: float | None) -> float:
    """Mean luminance of the irradiance of the pilots' surface points by virtual lights that are not distant."""
    pilots, near = lights.pilots, lights.lights().with_distant(*np.zeros((2, 0, 3)))
    return float(luminance(gather(context, near, pilots.surface, pilots.normals, clamp=clamp)).mean(dtype=np.float64)) \
        if len(pilots.surface) else 0.0


TECHNIQUE = VirtualPointLights()
