"""One bake of light propagation volumes: geometry once, light as often as it changes."""

from dataclasses import asdict, replace

import numpy as np

from ...errors import BakeError
from ...progress import Progress
from ...scene import Scene
from ...transport.context import LightContext
from ..resample import resample
from . import sources, surfels
from .cascades import place_cascades
from .field import LpvField
from .gather import gather
from .geometry_volume import Blocking, GeometryVolume, combine, face_blocking, inject_surfels, vacuum
from .grid import LpvGrid
from .settings import LpvSettings


class LpvBake:
    """The cascades of a scene with what blocks light in them; ``light`` fills them for the context's lamps and world."""

    def __init__(self, context: LightContext, settings: LpvSettings, seed: int, kernels, progress: Progress):
        self.context, self.settings, self.seed, self.kernels = context, settings, seed, kernels
        self.grids = place_cascades(context.scene, settings, np.array(context.geometry.bounds()))
        self._maps = sources.capture_maps(context, kernels, self.grids, settings.map_resolution, progress.span(0.0, 0.5))
        progress.step(0.5, "filling geometry volumes")
        self.blocking = self._blocking()

    def _blocking(self) -> list[Blocking]:
        views = None
        if self.settings.occluders == "views":
            views = self._seen()
        blocking = []
        for level, grid in enumerate(self.grids):
            volume = _geometry_volume(grid, views if views is not None else [[surfels.peel(self.context, grid)]])
            if volume.is_empty:
                raise BakeError(f"cascade {level} of the light propagation volumes ({_box(grid)}) holds no geometry",
                                "move its center, raise cell_size, or bake the technique 'probes' there")
            blocking.append(face_blocking(volume, self.settings.further_bounces) if self.settings.blocking else vacuum(grid))
        return blocking

    def _seen(self) -> list[list[surfels.Surfels]]:
        """Surfels by eye: the views of one lamp see different surfaces, those of different lamps and cameras often the same."""
        eyes = {}
        for captured in self._maps:
            origin = (captured.view.lamp, tuple(np.round(captured.view.position_world, 9)))
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
            part = progress.span((count - 1 - level) / count, (count - level) / count)
            world = sources.world_volume(context, grid, self.seed, part.span(0.0, 0.4))
            rows = sources.joined([lights, _crossing(grid, coarser, tuple(propagated))]) if coarser else lights
            volume = self.kernels.lpv_inject(grid, *rows)
            if not coarser and np.any(lights.flux > 0) and not np.any(volume[0] > 0):
                raise BakeError("no virtual light lies inside the light propagation volumes", "raise cell_size or add cascades")
            if world.any() and blocking.reflectance is not None:
                volume = volume + reflected(world, blocking, self.kernels, context.threads)
            propagated.insert(0, self.kernels.lpv_propagate(volume, blocking, self.settings.steps, threads=context.threads,
                                                            progress=part.span(0.4, 1.0)))
            seen.insert(0, world)
        volumes = tuple(volume + world for volume, world in zip(propagated, seen, strict=True))
        stats = {"rays": 0, "virtual_lights": len(lights.flux), "cells": sum(grid.count for grid in self.grids),
                 "injected_flux": [float(value) for value in lights.flux.sum(axis=0, dtype=np.float64)]}
        return LpvField(self.grids, volumes, params=asdict(self.settings), stats=stats, resampled=self._resample,
                        relit=self.relight, kernels=self.kernels, bake=self, world_volumes=tuple(seen))

    def _resample(self, field: LpvField):
        order = self.settings.order
        return resample(field, self.context, self.context.scene.volumes, order, Progress(), seed=self.seed,
                        threads=self.context.threads, radiance_sh=lambda points: field.radiance_sh(points, order))

    def relight(self, scene: Scene, progress: Progress, kernels=None) -> LpvField:
        """The field under another scene's lamps and world, by ``kernels`` (None: those of the bake). Raises BakeError if geometry
        or materials differ."""
        other = object.__new__(LpvBake)
        other.__dict__.update(self.__dict__)
        other.context, other.kernels = self.context.relit(scene), kernels or self.kernels
        other._maps = sources.capture_maps(other.context, other.kernels, self.grids, self.settings.map_resolution,
                                           progress.span(0.0, 0.4))
        return other.light(progress.span(0.4, 1.0))


def reflected(world: np.ndarray, blocking: Blocking, kernels, threads: int | None) -> np.ndarray:
    """What surfaces send back of the light of ``world`` (4, 3, nz, ny, nx): a step through faces that let nothing through."""
    closed = replace(blocking, through=np.zeros_like(blocking.through))
    return kernels.lpv_propagate(world, closed, 1, threads=threads) - world


def _geometry_volume(grid: LpvGrid, eyes: list[list[surfels.Surfels]]) -> GeometryVolume:
    """Each eye's surfels add up; of several eyes the one that sees most of a place counts there."""
    volumes = []
    for seen in eyes:
        columns = zip(*((part.positions, part.normals, part.area, part.albedo) for part in seen), strict=True)
        volumes.append(inject_surfels(grid, surfels.Surfels(*(np.concatenate(column) for column in columns))))
    return combine(volumes or [inject_surfels(grid, surfels.Surfels(*(np.zeros(shape) for shape in ((0, 3), (0, 3), 0, (0, 3)))))])


def _crossing(grid: LpvGrid, coarser: tuple[LpvGrid, ...], volumes: tuple[np.ndarray, ...]) -> sources.Lights:
    """What a coarser cascade sends in through the border of ``grid``."""
    positions, inward = sources.border(grid)
    irradiance = gather(coarser, volumes, positions, -inward, False)
    return sources.entering(grid, positions, inward, irradiance * np.float32(grid.cell**2))


def _box(grid: LpvGrid) -> str:
    low, high = (", ".join(f"{value:.3g}" for value in corner) for corner in (grid.corner, grid.high))
    return f"from ({low}) to ({high})"
