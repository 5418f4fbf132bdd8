"""Screen-space reflections: glossy layers show what the picture itself shows where their mirrored rays meet it, and elsewhere what
the bake says of the light from there.

Rays by visible normals (Heitz 2018), followed over a pyramid of least depths or by even steps (`search`). What they meet counts by
a confidence that is a weight between it and the fallback, never an addition, and the mean over rays is weighted by what each
carries (the ratio estimator of Stachowiak 2015, "Stochastic Screen-Space Reflections"). What it is not: what is beside the picture,
behind something in it or seen from behind is not there; `ray_traced` has all of it.
"""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from ...numerics.sampling import hash_u32, unit_interval
from ...techniques.base import Field
from ...transport.lights.world_sh import unshadowed_irradiance
from ...transport.surfaces.ggx import sample_reflection
from ...transport.vectors import dot
from ..base import Effect, setting
from ..frame import Frame
from ..lit import seen_surfaces
from ..media.along import NUMBERS, MediaAlong
from ..media.lighting import Surroundings
from ..spheres.maps import RAY_SHARE
from .pyramid import min_pyramid
from .rays import ScreenRays, pixel_numbers, screen_rays, shift_of
from .search import Found, Screen, march, search

# Reflections fade over the last part of the roughness that they are drawn up to.
FADE_FROM = 0.75
SEARCHES = ("hierarchical", "linear")
# What a ray weighs at least.
LEAST_WEIGHT = np.float32(1e-6)
# Tells what is drawn along rays in media apart from all else.
_IN_MEDIA = 0x736D
# Confidences below this are none where they divide.
_SMALL = np.float32(1e-6)


@dataclass(frozen=True)
class ScreenReflectionSettings:
    """What a user may set."""

    rays: int = setting(2, "Rays", "Mirrored rays of a pixel in each sample of the picture", "", 1, 16)
    search: str = setting("hierarchical", "Search", "How rays are followed: pixel by pixel with blocks stepped over, or by even "
                          "steps", choices=SEARCHES)
    steps: int = setting(128, "Steps", "Pixels or blocks that a ray looks at before the fallback takes its place", "", 4, 1024)
    thickness: float = setting(0.25, "Thickness", "How far behind a surface a ray still meets it: more smears, less leaves holes",
                               "m", 0.001, 100.0)
    max_roughness: float = setting(0.6, "Max Roughness", "Rougher surfaces show the fallback alone; reflections fade from three "
                                   "quarters of it on", "", 0.0, 1.0)
    border: float = setting(0.05, "Border", "Share of the picture at its edges over which reflections of it fade", "", 0.0, 0.5)
    distance: float = setting(100.0, "Distance", "How far rays go", "m", 0.01, 1e6)


class Mirrors(NamedTuple):
    """What one ray of each of n pixels brings: radiance ``light`` and ``weight`` (n, 3), ``confidence`` (n,) and ``distance`` (n,)
    [m] to what it met, 0 where it met nothing."""

    light: np.ndarray
    weight: np.ndarray
    confidence: np.ndarray
    distance: np.ndarray


class ScreenReflections(Effect):
    """See the module's docstring."""

    name, label = "screen_reflections", "Screen-Space Reflections"
    description = "Reflections of what the picture shows, and of the bake elsewhere: fast, not exact"
    stage = "reflections"
    passes = ("mirror_confidence", "mirror_distance")
    reads_spheres = True
    Settings = ScreenReflectionSettings

    def mirrors(self, settings: ScreenReflectionSettings) -> bool:
        """See Effect.mirrors."""
        return True

    def sweep(self, pixels: int) -> tuple[ScreenReflectionSettings, ...]:
        """Steps, rays, and the search by even steps. Rays start at every pixel: there is no resolution to choose."""
        return (ScreenReflectionSettings(rays=1), ScreenReflectionSettings(steps=16), ScreenReflectionSettings(steps=32),
                ScreenReflectionSettings(search="linear", steps=32), ScreenReflectionSettings(),
                ScreenReflectionSettings(rays=8))

    def apply(self, frame: Frame, field: Field | None, settings: ScreenReflectionSettings) -> np.ndarray:
        """See Effect.apply."""
        seen = frame.gbuffer.seen
        if not seen.any():
            return frame.light
        surfaces = seen_surfaces(frame.gbuffer, frame.view)
        mirrors = [self.mirrored(frame, field, settings, ray) for ray in range(settings.rays)]
        total = sum(part.weight for part in mirrors)
        shown = sum(part.light * part.weight for part in mirrors) / total
        albedo, gathered = frame.gbuffer.albedo[seen][:, :3], frame.irradiance[seen][:, :3]
        light = frame.light.copy()
        # What the layer reflects does not get below it.
        light[seen, :3] += surfaces.look.layer * shown - (albedo - surfaces.look.diffuse) * gathered / np.pi
        light[seen, :3] = np.maximum(light[seen, :3], 0.0)
        confidence = sum(part.confidence for part in mirrors)
        distance = sum(part.confidence * part.distance for part in mirrors) / np.maximum(confidence, _SMALL)
        for name, values in zip(self.passes, (confidence / settings.rays, distance), strict=True):
            picture = np.zeros_like(light)
            picture[seen, :3], picture[..., 3] = values[:, None], 1.0
            frame.passes[name] = picture
        return light

    def mirrored(self, frame: Frame, field: Field | None, settings: ScreenReflectionSettings, ray: int) -> Mirrors:
        """What ray number ``ray`` of every pixel that shows a surface brings."""
        surfaces = seen_surfaces(frame.gbuffer, frame.view)
        directions, weight = sample_reflection(surfaces.look, surfaces.normals, surfaces.towards_eye,
                                               pixel_numbers(frame, ray, settings.rays))
        # Where all rays go below the surface their fallback is all that there is.
        weight = np.where((dot(surfaces.faces, directions) > 0)[:, None], np.maximum(weight, LEAST_WEIGHT), LEAST_WEIGHT)
        fallback = _fallback(frame, field, surfaces.points, directions, surfaces.look.alpha)
        roughness = np.sqrt(surfaces.look.alpha)
        fade = roughness_fade(roughness, settings.max_roughness)
        traced = np.flatnonzero((fade > 0) & np.any(weight > LEAST_WEIGHT, axis=1))
        screen = Screen(min_pyramid(frame.depth), frame.gbuffer.geometry[..., :3])
        rays = screen_rays(frame, surfaces.points[traced], directions[traced], settings.distance)
        found = follow(screen, rays, directions[traced], settings, shift_of(frame.index, ray, settings.rays))
        met = np.flatnonzero(found.hit)
        confidence, distance = np.zeros(len(weight), np.float32), np.zeros(len(weight), np.float32)
        rows = traced[met]
        confidence[rows] = fade[rows] * confidence_of(found, rays, frame.size, settings)[met]
        distance[rows] = rays.distance(found.s)[met]
        x, y = found.pixel[met].T
        shown = _through_media(frame, field, surfaces.points[rows], directions[rows], distance[rows], frame.light[y, x, :3], ray)
        light = fallback.copy()
        light[rows] += (shown - fallback[rows]) * confidence[rows, None]
        return Mirrors(light, weight, confidence, distance)


def follow(screen: Screen, rays: ScreenRays, directions: np.ndarray, settings: ScreenReflectionSettings, shift) -> Found:
    """Follow ``rays`` as ``settings`` say; ``shift`` (2,) jitters even steps."""
    if settings.search == "linear":
        return march(screen, rays, directions, settings.thickness, settings.steps, 1.0 - float(shift[0]))
    return search(screen, rays, directions, settings.thickness, settings.steps, len(screen.levels))


def confidence_of(found: Found, rays: ScreenRays, size: tuple[int, int], settings: ScreenReflectionSettings) -> np.ndarray:
    """How far (n,) what was found is believed: less near the picture's edges, and less the farther a ray passed behind."""
    place = rays.pixels(found.s) / np.array(size)
    edge = np.minimum(place, 1.0 - place) / max(settings.border, 1e-6)
    inside = np.prod(_smoothstep(edge), axis=1)
    return (inside * np.square(1.0 - _smoothstep(found.behind / settings.thickness)) * found.hit).astype(np.float32)


def roughness_fade(roughness: np.ndarray, limit: float) -> np.ndarray:
    """How much (n,) of reflections is drawn at ``roughness`` (n,): all up to FADE_FROM of ``limit``, nothing from that on."""
    return 1.0 - _smoothstep((roughness - FADE_FROM * limit) / max((1.0 - FADE_FROM) * limit, 1e-6))


def _through_media(frame: Frame, field: Field | None, points, directions, distance, light, ray: int) -> np.ndarray:
    """``light`` (n, 3) of what is met ``distance`` (n,) [m] away as it arrives at ``points`` (n, 3): the picture shows it before
    media are laid over it, and what they take and send between a mirror and what it shows is no part of that either."""
    if frame.context is None or frame.context.all_media.is_empty or not len(points):
        return light
    media = MediaAlong(Surroundings.of(frame.scene, frame.context, field))
    u = unit_interval(np.stack([hash_u32(np.arange(len(points), dtype=np.uint32), frame.index, ray, _IN_MEDIA + number)
                                for number in range(NUMBERS)], axis=1))
    left = frame.context.all_media.transmittance(points, directions, distance)
    return (light * left + media.light(points, directions, distance.astype(np.float64), u)).astype(np.float32)


def _fallback(frame: Frame, field: Field | None, points: np.ndarray, directions: np.ndarray, alpha: np.ndarray) -> np.ndarray:
    """Radiance (n, 3) from ``directions`` that lobes of ``alpha`` (n,) were sampled by, where the picture says nothing: what sphere
    probes saw there, and for the share that they do not know what would light a surface across the ray, over π."""
    light = unshadowed_irradiance(frame.scene.world, directions) if field is None else field.irradiance(points, directions)
    light = (np.maximum(light, 0.0) * np.float32(1.0 / np.pi)).astype(np.float32)
    if field is None or field.spheres is None:
        return light
    seen, share = field.spheres.radiance(points, directions, RAY_SHARE * alpha)
    return seen + light * (1.0 - share)[:, None]


def _smoothstep(x: np.ndarray) -> np.ndarray:
    x = np.clip(x, 0.0, 1.0)
    return x * x * (3.0 - 2.0 * x)


EFFECT = ScreenReflections()
