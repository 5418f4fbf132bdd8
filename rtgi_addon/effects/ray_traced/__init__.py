"""Ray-traced light: what reaches every pixel's surface from other surfaces, emission and the world, by rays of its own.

Diffuse light by a final gather: rays over the hemisphere look at surfaces whose light the surface cache knows, any number of
bounces at once (Jensen 1996; the cache is that of the bakes). Glossy light by rays drawn by the layer's visible normals, from
mirror to mirror. Lamps stay as the frame has them, each with rays of its own. What it is not: a path tracer for everything.
Caustics, and highlights of lamps in what a mirror shows, are as the surface cache has them, spread over all directions.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from ...transport.context import LightContext
from ...transport.views.camera import CameraView
from ...transport.views.gbuffer import GBuffer
from ..base import Effect, setting
from ..cached import cached_scene
from ..frame import GATHERED, Frame
from ..lit import SeenSurfaces, direct_light, lamps_on, seen_surfaces
from ..media.along import MediaAlong
from ..media.lighting import Surroundings
from .diffuse import diffuse_looks, irradiance
from .glossy import glossy_paths, has_layer, highlights, is_smooth, mirrored
from .lamps import Mirror, MirroredLamps
from .receivers import Pixels
from .smoothing import smoothed

# Pixels with rays of their own are no further apart.
_MOST_APART = 8
# The most rays of a pixel in a sample.
_MOST_RAYS = 1024


@dataclass(frozen=True)
class RayTracedSettings:
    """What a user may set."""

    diffuse_rays: int = setting(4, "Diffuse Rays", "Rays over the hemisphere of a pixel in each sample of the picture; 0 leaves "
                                "diffuse light as the bake has it", "", 0, _MOST_RAYS)
    glossy_rays: int = setting(1, "Glossy Rays", "Rays that a pixel's glossy layer reflects in each sample of the picture; 0 shows "
                               "no reflections but those of lamps", "", 0, 1024)
    budget: float = setting(0.5, "Ray Budget", "Most diffuse rays in each sample of the picture, in millions: of large pictures "
                            "some of the pixels have rays, in turn, and the others take from them", "", 0.001, 1000.0)
    share: bool = setting(True, "Share Between Pixels", "Pixels take part of their diffuse light from like neighbours, less from "
                          "sample to sample: much less noise for a little blur where light changes fast")
    reflections: int = setting(3, "Reflections", "From mirror to mirror so often", "", 1, 16)


class RayTracedEffect(Effect):
    """See the module's docstring."""

    name, label = "ray_traced", "Ray-Traced Light"
    description = "Indirect and mirrored light by rays from every pixel: exact, not fast"
    stage = "light"
    local = True
    Settings = RayTracedSettings

    def mirrors(self, settings: RayTracedSettings) -> bool:
        """See Effect.mirrors."""
        return settings.glossy_rays > 0

    def lamps(self, settings: RayTracedSettings) -> Callable | None:
        """See Effect.lamps."""
        return _lamps if settings.glossy_rays and settings.diffuse_rays else None

    def gathering(self, settings: RayTracedSettings, times: float) -> RayTracedSettings:
        """See Effect.gathering."""
        rays = settings.diffuse_rays
        return settings if not rays else replace(settings, diffuse_rays=min(max(1, round(rays * times)), _MOST_RAYS))

    def sweep(self, pixels: int) -> tuple[RayTracedSettings, ...]:
        """Rays, and pixels that have some: one in four of those that the defaults give rays to."""
        fourth = round(max(min(RayTracedSettings.diffuse_rays * pixels / 1e6, RayTracedSettings.budget) / 4.0, 0.001), 3)
        return (RayTracedSettings(budget=fourth), RayTracedSettings(diffuse_rays=1), RayTracedSettings(share=False),
                RayTracedSettings(), RayTracedSettings(glossy_rays=4), RayTracedSettings(diffuse_rays=16))

    def apply(self, frame: Frame, field, settings: RayTracedSettings) -> np.ndarray:
        """See Effect.apply."""
        context, seen = frame.context, frame.gbuffer.seen
        if context is None or not seen.any() or settings.diffuse_rays == settings.glossy_rays == 0:
            return frame.light
        scene, surfaces, threads = cached_scene(context, frame), seen_surfaces(frame.gbuffer, frame.view), context.threads
        known, unknown = _known_light(frame, surfaces, settings)
        # Samples that refine a picture gather what the others do not know, few of them, for themselves alone.
        spacing = spacing_of(len(surfaces.points) * settings.diffuse_rays, settings) if known is None else 1
        diffuse = Pixels.of(frame, surfaces, max(1, settings.diffuse_rays), spacing)
        diffuse = diffuse if known is None else diffuse.part(unknown)
        glossy = Pixels.of(frame, surfaces, max(1, settings.glossy_rays))
        media = None if context.media.is_empty else MediaAlong(Surroundings.of(frame.scene, context, field))
        looks = diffuse_looks(scene, diffuse, threads) if settings.diffuse_rays else []
        held = frozenset() if settings.diffuse_rays or field is None else field.direct_lamps
        lamps = MirroredLamps.of(context, held)
        paths = glossy_paths(scene, glossy, settings.reflections, lamps, media, threads) if settings.glossy_rays else []
        texels = scene.settle([*looks, *(end.looks for part in paths for end in part.ends)])
        gbuffer = frame.gbuffer
        gathered, direct = gbuffer.shown(frame.irradiance)[:, :3], gbuffer.shown(frame.direct)
        if settings.diffuse_rays:
            gathered = irradiance(scene, diffuse, looks, texels[:len(looks)], media, threads)
            if known is not None:
                known[unknown] = gathered[:, :3]
                gathered = known
            else:
                gathered = _shared(diffuse, gathered, spacing) if settings.share else gathered[:, :3]
            frame.kept[GATHERED] = np.zeros_like(frame.irradiance)
            frame.kept[GATHERED].reshape(-1, 4)[gbuffer.rows, :3] = gathered
            if field is not None and field.includes_direct:
                direct = direct_light(context, gbuffer, frame.view, gbuffer.shown(frame.turn))
        albedo = gbuffer.shown(gbuffer.albedo)[:, :3]
        if settings.glossy_rays and lamps.wide and not frame.bare:
            direct = _less_what_rays_meet(direct, gbuffer, surfaces, gbuffer.shown(frame.turn), lamps, held)
        shown = direct[:, :3] + gbuffer.shown(gbuffer.emission)[:, :3]
        if settings.glossy_rays:
            # A layer that is too faint for rays reflects as what is below it does.
            albedo = surfaces.look.diffuse + np.where(has_layer(surfaces)[:, None], np.float32(0.0), surfaces.look.layer)
            shown = shown + mirrored(scene, glossy, paths, texels[len(looks):], threads) + highlights(scene, glossy, threads)
        light = frame.light.copy()
        light.reshape(-1, 4)[gbuffer.rows, :3] = shown + albedo * gathered * np.float32(1.0 / np.pi)
        return light


def _lamps(context: LightContext, gbuffer: GBuffer, view: CameraView, index: int | np.ndarray) -> np.ndarray:
    """See Effect.lamps: what rays that smooth layers reflect meet of wide lamps is not in it."""
    lamps, surfaces = MirroredLamps.of(context, frozenset()), seen_surfaces(gbuffer, view)
    smooth = is_smooth(surfaces.look) & has_layer(surfaces)
    if not lamps.wide or not smooth.any():
        return direct_light(context, gbuffer, view, index)
    instance, index = gbuffer.shown(gbuffer.instance), np.broadcast_to(index, smooth.shape)
    direct, others = np.zeros((len(smooth), 4), np.float32), np.flatnonzero(~smooth)
    direct[others] = lamps_on(context, surfaces.take(others), instance[others], index[others], 1, frozenset())
    return _less_what_rays_meet(direct, gbuffer, surfaces, index, lamps, frozenset())


def _less_what_rays_meet(direct: np.ndarray, gbuffer: GBuffer, surfaces: SeenSurfaces, index: np.ndarray, lamps: MirroredLamps,
                         held: frozenset[str] | None) -> np.ndarray:
    """The light of lamps ``direct`` (n, 4) on all n ``surfaces`` that are seen in samples number ``index`` (n,); where these are
    smooth without what the rays that they reflect meet of it."""
    rows = np.flatnonzero(is_smooth(surfaces.look) & has_layer(surfaces))
    surfaces, direct = surfaces.take(rows), direct.copy()
    mirror = Mirror(*surfaces, gbuffer.shown(gbuffer.primitive)[rows])
    direct[rows] = lamps_on(lamps.context, surfaces, gbuffer.shown(gbuffer.instance)[rows], index[rows], 1, held,
                            lambda lamp, lit, towards: lamps.sampled_share(lamp, mirror.take(lit), towards))
    return direct


def spacing_of(rays: int, settings: RayTracedSettings) -> int:
    """Of how many pixels across and down one has rays, so that so many ``rays`` become no more than the budget."""
    if not settings.share or rays <= settings.budget * 1e6:
        return 1
    return min(int(np.ceil(np.sqrt(rays / (settings.budget * 1e6)))), _MOST_APART)


def _known_light(frame: Frame, surfaces: SeenSurfaces, settings: RayTracedSettings) -> tuple[np.ndarray | None, np.ndarray | None]:
    """Irradiance (n, 3) of all pixels that are seen which the samples before have gathered, and those (m,) of which they have not;
    None where all are to be gathered."""
    if frame.samples is None or frame.samples.light is None or not settings.diffuse_rays:
        return None, None
    pixel, footprint = (frame.gbuffer.shown(part) for part in (frame.pixel, frame.footprint))
    light, found = frame.samples.light.at(pixel, surfaces.points, surfaces.normals, footprint)
    return light, np.flatnonzero(~found)


def _shared(pixels: Pixels, gathered: np.ndarray, spacing: int) -> np.ndarray:
    """Irradiance (m, 3) of all pixels that are seen, from what (n, 4) the rays of ``pixels`` gathered."""
    seen = pixels.frame.gbuffer.seen
    light, known = np.zeros((seen.size, 4), np.float32), np.zeros(seen.size, bool)
    where = pixels.frame.gbuffer.rows[pixels.chosen]
    light[where], known[where] = gathered, True
    return smoothed(pixels.frame, light.reshape(*seen.shape, 4), known.reshape(seen.shape), spacing)


EFFECT = RayTracedEffect()
