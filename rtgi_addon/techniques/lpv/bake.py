"""One bake of light propagation volumes: geometry once, light as often as it changes."""

from dataclasses import asdict, replace

import numpy as np

from ...errors import BakeError
from ...progress import Progress
from ...scene import Omission, Scene
from ...transport.context import LightContext
from ..base import all_captured
from ..lamp_light import LampLight
from ..lattice.resample import resample
from ..unfollowed import quoted, surfaces_of_maps
from . import sources, surfels
from .cascades import place_cascades
from .crossings import trace_faces
from .field import LpvField
from .gather import gather
from .geometry_volume import Blocking, GeometryVolume, combine, face_blocking, inject_surfels, vacuum
from .grid import LpvGrid
from .media_cells import kept_in_media
from .settings import LpvSettings

# How far a bake is when maps and geometry volumes are made; the former of that; a cascade when the world is traced to its cells.
_PREPARED, _CAPTURED, _WORLD_TRACED = 0.4, 0.5, 0.4
# Decimals [m] to which two views' places must agree to count as one eye: both are computed.
_DECIMALS = 9
# Samples of each lamp that has an extent, where its direct light is wanted.
LAMP_SAMPLES = 16


def bake_field(context: LightContext, settings: LpvSettings, seed: int, kernels, progress: Progress) -> LpvField:
    """The field of the scene of ``context``. Raises BakeError, Cancelled."""
    progress.stage("geometry volume")
    bake = LpvBake(context, settings, seed, kernels, progress.span(0.0, _PREPARED))
    progress.stage("propagation")
    return bake.light(progress.span(_PREPARED, 1.0))


class LpvBake:
    """The cascades of a scene with what blocks light in them; ``light`` fills them for the context's lamps and world."""

    def __init__(self, context: LightContext, settings: LpvSettings, seed: int, kernels, progress: Progress,
                 same_surfaces: "LpvBake | None" = None):
        """``same_surfaces``: a bake of the same geometry and materials, whose cascades serve again."""
        self.context, self.settings, self.seed, self.kernels = context, settings, seed, kernels
        before = same_surfaces
        self.grids = before.grids if before else place_cascades(context.scene, settings, np.array(context.geometry.bounds()))
        self._maps = sources.capture_maps(context, kernels, self.grids, settings.map_resolution, progress.span(0.0, _CAPTURED))
        progress.step(_CAPTURED, "filling geometry volumes")
        self.blocking = before.blocking if before else self._blocking()

    def _blocking(self) -> list[Blocking]:
        views = None
        if self.settings.occluders == "views":
            views = self._seen()
        blocking = []
        for level, grid in enumerate(self.grids):
            volume = (_seen_volume(grid, views) if views is not None
                      else trace_faces(self.context, grid, surfels.peel(self.context, grid)))
            if volume.is_empty:
                raise BakeError(f"cascade {level} of the light propagation volumes ({_box(grid)}) holds no geometry",
                                "move its center, raise cell_size, or bake the technique 'probes' there")
            faces = face_blocking(volume, self.settings.further_bounces) if self.settings.blocking else vacuum(grid)
            blocking.append(replace(faces, kept=kept_in_media(grid, self.context.media)))
        return blocking

    def _seen(self) -> list[list[surfels.Surfels]]:
        """Surfels by eye: the views of one lamp see different surfaces, those of different lamps and cameras often the same."""
        eyes = {}
        for captured in self._maps:
            origin = (captured.view.lamp, tuple(np.round(captured.view.position_world, _DECIMALS)))
            eyes.setdefault(origin, []).append(surfels.of_map(self.context, captured))
        return [*eyes.values(), *([surfels.of_camera(self.context, camera)] for camera in self.context.scene.cameras)]

    def light(self, progress: Progress) -> LpvField:
        """Inject, propagate and accumulate, coarsest cascade first: what it holds at a finer one's border shines into that."""
        context, count = self.context, len(self.grids)
        lights = sources.joined([sources.lamp_lights(self._maps), sources.emissive_lights(context, self.seed)])
        propagated: list[np.ndarray] = []
        seen: list[np.ndarray] = []
        for level in reversed(range(count)):
            grid, blocking, coarser = self.grids[level], self.blocking[level], self.grids[level + 1:]
            beyond = tuple(blocking.faces for blocking in self.blocking[level + 1:])
            of_level = progress.span((count - 1 - level) / count, (count - level) / count)
            world = sources.world_volume(context, grid, self.seed, of_level.span(0.0, _WORLD_TRACED))
            rows = sources.joined([lights, _crossing(grid, coarser, tuple(propagated), beyond)]) if coarser else lights
            volume = self.kernels.lpv_inject(grid, *rows, blocking.faces)
            if not coarser and np.any(lights.flux > 0) and not np.any(volume[0] > 0):
                raise BakeError("no virtual light lies inside the light propagation volumes", "raise cell_size or add cascades")
            if world.any() and blocking.reflectance is not None:
                volume = volume + reflected(world, blocking, self.kernels, context.threads)
            propagated.insert(0, self.kernels.lpv_propagate(volume, blocking, self.settings.steps, threads=context.threads,
                                                            progress=of_level.span(_WORLD_TRACED, 1.0)))
            seen.insert(0, world)
        volumes = tuple(volume + world for volume, world in zip(propagated, seen, strict=True))
        stats = {"rays": 0, "virtual_lights": len(lights.flux), "cells": sum(grid.count for grid in self.grids),
                 "injected_flux": [float(value) for value in lights.flux.sum(axis=0, dtype=np.float64)]}
        faces = tuple(blocking.faces for blocking in self.blocking)
        field = LpvField(self.grids, volumes, faces, params=asdict(self.settings), stats=stats, resampled=self._resample,
                         relit=self.relight, kernels=self.kernels, bake=self, world_volumes=tuple(seen),
                         lamp_light=LampLight(context, False, LAMP_SAMPLES, self.seed))
        field.omissions = tuple(_omissions(context, self.settings))
        return field

    def _resample(self, field: LpvField):
        order = self.settings.order
        return resample(field, self.context, self.context.scene.volumes, order, Progress(), seed=self.seed,
                        threads=self.context.threads, radiance_sh=lambda points: field.radiance_sh(points, order))

    def relight(self, scene: Scene, progress: Progress, kernels=None) -> LpvField:
        """The field under another scene's lamps and world, by ``kernels`` (None: those of the bake). Raises BakeError if geometry
        or materials differ."""
        capturing = progress.span(0.0, _PREPARED)
        other = LpvBake(self.context.relit(scene), self.settings, self.seed, kernels or self.kernels, capturing, self)
        return other.light(progress.span(_PREPARED, 1.0))


def reflected(world: np.ndarray, blocking: Blocking, kernels, threads: int | None) -> np.ndarray:
    """What surfaces send back of the light of ``world`` (4, 3, nz, ny, nx): a step through faces that let nothing through.

    The world lights the surfaces themselves, not their stairs: it is divided by what accumulated light is multiplied by.
    """
    closed = replace(blocking, through=np.zeros_like(blocking.through), faces=np.zeros_like(blocking.faces), area=None)
    sent = kernels.lpv_propagate(world, closed, 1, threads=threads) - world
    return sent if blocking.area is None else sent / blocking.area.reshape(world.shape[2:])


def _seen_volume(grid: LpvGrid, eyes: list[list[surfels.Surfels]]) -> GeometryVolume:
    """Each eye's surfels add up; of several eyes the one that sees most of a place counts there."""
    volumes = []
    for seen in eyes:
        volumes.append(inject_surfels(grid, surfels.joined(seen)))
    return combine(volumes or [inject_surfels(grid, surfels.joined([]))])


def _crossing(grid: LpvGrid, coarser: tuple[LpvGrid, ...], volumes: tuple[np.ndarray, ...], faces) -> sources.Lights:
    """What a coarser cascade sends in through the border of ``grid``."""
    positions, inward = sources.border(grid)
    irradiance = gather(coarser, volumes, positions, -inward, False, faces)
    return sources.entering(grid, positions, inward, irradiance * np.float32(grid.cell**2))


def _omissions(context: LightContext, settings: LpvSettings):
    """What of the scene's lights and surfaces the volumes do not follow."""
    yield from surfaces_of_maps("lpv", context)
    limited = tuple(light.name for light in context.scene.lights if light.max_bounces is not None)
    if limited and settings.further_bounces:
        yield Omission(f"lpv reflects the light of {quoted(limited)} on, beyond the bounces that it is limited to", objects=limited)
    emitters = np.unique(context.geometry.instance[context.emitters.primitive])
    linked = tuple(dict.fromkeys(context.scene.instances[index].name for index in emitters
                                 if context.scene.instances[index].linking is not None))
    if linked:
        yield Omission(f"lpv lets {quoted(linked)} light everything, whatever is linked", objects=linked)
    yield from all_captured("lpv", context.scene.volumes)


def _box(grid: LpvGrid) -> str:
    low, high = (", ".join(f"{value:.3g}" for value in corner) for corner in (grid.corner, grid.high))
    return f"from ({low}) to ({high})"
