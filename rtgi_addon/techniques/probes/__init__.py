"""SH irradiance probes on a lattice, baked by rays against a surface radiosity cache.

Papers: Greger et al., "The Irradiance Volume", IEEE CG&A 18(2), 1998 (probes on a lattice); Ramamoorthi and Hanrahan, "An
Efficient Representation for Irradiance Environment Maps", SIGGRAPH 2001 (SH of incident radiance, eq. 7–12); Majercik et al.,
"Dynamic Diffuse Global Illumination with Ray-Traced Irradiance Fields", JCGT 8(2), 2019 (distances, weights, relocation).

What it is not: a lattice knows nothing of what happens between its points; see `lookup` for what visibility and normal
weights make of that. Glossy reflection is treated as diffuse of the same albedo.
"""

from dataclasses import asdict

import numpy as np

from ...progress import Progress
from ...scene import ProbeVolume, Scene
from ...scene.capture import captured_light
from ...transport.context import LightContext
from ..base import Checkpoint, Field, Technique, begin_bake, volumes_by_settings
from ..lamp_light import LampLight
from ..lattice.dilation import dilate
from ..lattice.field import ProbeField
from ..lattice.near_notes import near_glow, notes_on
from .bake import Begun, ProbeBake
from .blocks import PROBE_BLOCKS
from .captured import LAMP_SAMPLES, capturing, lamp_light_of
from .fit import SurfaceFit
from .relight import relight
from .settings import ProbeSettings
from .surface_error import error_on_surfaces

# How far a bake that is fitted is when its rays are traced, and any when only its error on surfaces is left to find.
RAYS_SHARE, CHECKED_FROM = 0.6, 0.95

# A finished bake and its fit, if it has one.
_Made = tuple[ProbeBake, SurfaceFit | None]


class Probes(Technique):
    """Bakes SH probes; see the module's docstring."""

    name = "probes"
    label = "Irradiance Probes"
    description = "Spherical harmonics of incident light on a lattice, the form that engines read"
    Settings = ProbeSettings
    lattices = (0.5, 2.0)
    follows_media = True
    blocks = PROBE_BLOCKS
    presets = {"draft": {"error": 0.1, "max_rays": 1 << 12}, "preview": {"error": 0.03, "max_rays": 1 << 14},
               "final": {"error": 0.01, "max_rays": 1 << 15}}

    def bake(self, scene: Scene, settings: ProbeSettings, rng: np.random.Generator, progress: Progress, *,
             threads: int | None = None, checkpoint: Checkpoint | None = None, begun: Begun | None = None) -> Field:
        """See Technique.bake. ``begun`` is what other work on this very scene has done of it already; the volumes may differ."""
        context, seed = begin_bake(scene, settings, rng, progress, threads, begun.context if begun else None)
        if begun is not None and begun.finished is not None and begun.finished.is_of(scene.volumes, settings, seed):
            return begun.finished.field
        bakes, start, probes = [], 0, sum(int(np.prod(volume.resolution)) for volume in scene.volumes)
        for number, (group_settings, volumes) in enumerate(volumes_by_settings(scene.volumes, settings)):
            count = sum(int(np.prod(volume.resolution)) for volume in volumes)
            first, last = CHECKED_FROM * start / probes, CHECKED_FROM * (start + count) / probes
            traced = first + (last - first) * (RAYS_SHARE if group_settings.fit else 1.0)
            span, fitting = progress.span(first, traced), (traced, last)
            captured = capturing(context, captured_light(context.scene, volumes[0]))
            bake = ProbeBake(captured, volumes, group_settings, seed, span, checkpoint or Checkpoint(), f"probes-{number}",
                             lamp_light_of(context, volumes[0], group_settings, seed), begun)
            bake.run()
            fit = None
            # Without bounces nothing is known of surfaces.
            if group_settings.fit and group_settings.bounces != 0:
                progress.stage("fit")
                fit = SurfaceFit(bake, progress.span(*fitting))
            bakes.append((bake, fit))
            start += count
        progress.stage("field")
        grids = [bake.grids() if fit is None else fit.grids for bake, fit in bakes]
        field = _field(context, settings, seed, scene.volumes, bakes, grids)
        error = error_on_surfaces([bake for bake, _ in bakes], field, progress.span(CHECKED_FROM, 1.0))
        field.stats["error_on_surfaces"] = None if error is None else error.to_json()
        glow = near_glow(context, scene.volumes, any(grid.fitted for grid in field.grids()))
        field.notes = notes_on(glow)
        if field.notes:
            field.stats["near_emitters"] = glow.to_json()
        return field

    def sweep(self) -> tuple[ProbeSettings, ...]:
        """Target errors, SH of order 1, which engines with small probes store, and probes fitted to surfaces."""
        return (ProbeSettings(error=0.1), ProbeSettings(error=0.03), ProbeSettings(order=1), ProbeSettings(),
                ProbeSettings(fit=True), ProbeSettings(error=0.004))


def _field(context: LightContext, settings: ProbeSettings, seed: int, volumes: tuple[ProbeVolume, ...], bakes: list[_Made],
           grids) -> ProbeField:
    """The field of all bakes, in the order of ``volumes``, with what it takes to relight it."""
    by_volume = {id(grid.volume): dilate(grid) for group in grids for grid in group}

    def relit(other: Scene, progress: Progress) -> ProbeField:
        lit = context.relit(other)
        made = []
        for bake, fit in bakes:
            light = relight(bake, captured_light(lit.scene, bake.volumes[0]),
                            lamp_light_of(lit, bake.volumes[0], bake.settings, seed), progress.span(0.0, 0.5 if fit else 1.0))
            made.append(light.grids if fit is None else fit.relit(light, progress.span(0.5, 1.0)))
        return _field(lit, settings, seed, volumes, bakes, made)

    fits = [fit for _, fit in bakes if fit is not None]
    rays = sum(bake.ray_count + bake.cache.count * bake.cache.rays for bake, _ in bakes) + sum(fit.rays for fit in fits)
    stats = {"rays": int(rays),
             "probe_rays": int(sum(bake.ray_count for bake, _ in bakes)), "texels": int(sum(bake.cache.count for bake, _ in bakes)),
             "texel_size": float(min(bake.cache.layout.size for bake, _ in bakes))}
    if fits:
        stats["fits"] = [fit.stats for fit in fits]
    held = LampLight(context, settings.direct, LAMP_SAMPLES, seed).names
    return ProbeField(tuple(by_volume[id(volume)] for volume in volumes), direct_lamps=held,
                      params=asdict(settings), stats=stats, relit=relit)


TECHNIQUE = Probes()
