"""SH irradiance probes on a lattice, baked by rays against a surface radiosity cache.

Papers: Greger et al., "The Irradiance Volume", IEEE CG&A 18(2), 1998 (probes on a lattice); Ramamoorthi and Hanrahan, "An
Efficient Representation for Irradiance Environment Maps", SIGGRAPH 2001 (SH of incident radiance, eq. 7–12); Majercik et al.,
"Dynamic Diffuse Global Illumination with Ray-Traced Irradiance Fields", JCGT 8(2), 2019 (distances, weights, relocation).

What it is not: a lattice knows nothing of what happens between its points; see `lookup` for what visibility and normal
weights make of that. Glossy reflection is treated as diffuse of the same albedo.
"""

from dataclasses import asdict

import numpy as np

from ...errors import BakeError
from ...progress import Progress
from ...scene import Scene
from ...transport.context import LightContext
from ..base import Checkpoint, Field, Technique, validate_settings, volumes_by_settings
from .bake import ProbeBake
from .dilation import dilate
from .field import ProbeField
from .relight import relight
from .settings import ProbeSettings


class Probes(Technique):
    """Bakes SH probes; see the module's docstring."""

    name = "probes"
    label = "Irradiance Probes"
    description = "Spherical harmonics of incident light on a lattice, the form that engines read"
    Settings = ProbeSettings
    lattices = (0.5, 2.0)
    presets = {"draft": {"error": 0.1, "max_rays": 1 << 12}, "preview": {"error": 0.03, "max_rays": 1 << 14},
               "final": {"error": 0.01, "max_rays": 1 << 15}}

    def bake(self, scene: Scene, settings: ProbeSettings, rng: np.random.Generator, progress: Progress, *,
             threads: int | None = None, checkpoint: Checkpoint | None = None) -> Field:
        """See Technique.bake."""
        validate_settings(settings)
        if not scene.volumes:
            raise BakeError("the scene has no probe volume", "add a Light Probe Volume")
        seed = int(rng.integers(1 << 32))
        progress.stage("ray tracer")
        progress.step(0.0, "building the ray tracer")
        context = LightContext(scene, threads)
        bakes, start, probes = [], 0, sum(int(np.prod(volume.resolution)) for volume in scene.volumes)
        for number, (own, volumes) in enumerate(volumes_by_settings(scene.volumes, settings)):
            count = sum(int(np.prod(volume.resolution)) for volume in volumes)
            span = progress.span(start / probes, (start + count) / probes)
            bake = ProbeBake(context, volumes, own, seed, span, checkpoint or Checkpoint(), f"probes-{number}")
            bake.run()
            bakes.append(bake)
            start += count
        progress.stage("field")
        return _field(scene, settings, bakes, [bake.grids() for bake in bakes])

    def sweep(self) -> tuple[ProbeSettings, ...]:
        """Target errors, and SH of order 1, which engines with small probes store."""
        return (ProbeSettings(error=0.1), ProbeSettings(error=0.03), ProbeSettings(order=1), ProbeSettings(),
                ProbeSettings(error=0.004))


def _field(scene: Scene, settings: ProbeSettings, bakes: list[ProbeBake], grids) -> ProbeField:
    """The field of all bakes, in the order of the scene's volumes, with what it takes to relight it."""
    by_volume = {id(grid.volume): dilate(grid) for group in grids for grid in group}

    def relit(other: Scene, progress: Progress) -> ProbeField:
        return _field(scene, settings, bakes, [relight(bake, other, progress) for bake in bakes])

    stats = {"rays": int(sum(bake.ray_count + bake.cache.count * bake.cache.rays for bake in bakes)),
             "probe_rays": int(sum(bake.ray_count for bake in bakes)), "texels": int(sum(bake.cache.count for bake in bakes)),
             "texel_size": float(min(bake.cache.layout.size for bake in bakes))}
    return ProbeField(tuple(by_volume[id(volume)] for volume in scene.volumes), includes_direct=settings.direct,
                      params=asdict(settings), stats=stats, relit=relit)


TECHNIQUE = Probes()
