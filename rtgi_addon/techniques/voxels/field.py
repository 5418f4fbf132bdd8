"""What every field that is gathered from voxels does alike: the sky beyond the grid, lamps, probes, relighting."""

import json
from abc import abstractmethod
from collections.abc import Iterator
from dataclasses import asdict
from functools import partial

import numpy as np

from ...numerics import sh
from ...numerics.sampling import about, fibonacci_sphere
from ...progress import Progress
from ...scene import Omission, Scene
from ...transport.context import LightContext
from ...transport.parallel import chunks, parallel_for
from ...transport.paths.sources import Sources
from ...transport.voxels import Voxels, holds_geometry, voxelize
from ...transport.voxels.cascades import by_cascade, nested_hierarchies
from ...transport.voxels.hierarchy import Hierarchy
from ...transport.voxels.rays import box_span
from ..base import Field, ProbeGrid, all_captured
from ..kernels import Kernels
from ..lamp_light import LampLight
from ..lattice.resample import resample
from ..lpv.leaks import causes_of_cells
from ..unfollowed import quoted, surfaces_of_maps
from .beyond import goes_on
from .bounces import light_voxels
from .memory import require_voxels
from .place import beyond_grid, place_grids, thin_walls
from .settings import MAPS, SURFACES, VoxelSettings
from .shipped import ShippedVoxels, shipped

# Samples of lamps of some extent, and of the bright sky.
LAMP_SAMPLES = 16
# Receivers that are gathered at once, and directions about free points.
RECEIVERS, AROUND = 1024, 64
# Looks at the sky within a cone: its axis, and a ring that halves its area.
RING = 6
# How far a bake is when triangles are in cells.
_VOXELIZED = 0.1


class VoxelField(Field):
    """Light gathered from the lit voxels of the scene of ``context``; subclasses say how. ``cascades`` are those of nested grids,
    finest first; ``voxels`` the first of them, ``hierarchies`` what receivers in each read, ``hierarchy`` the first."""

    def __init__(self, context: LightContext, settings: VoxelSettings, seed: int, cascades: tuple[Voxels, ...], progress: Progress):
        self.context, self.settings, self.seed = context, settings, seed
        self.cascades, voxels = cascades, cascades[0]
        self.voxels = voxels
        self.params, self._grids = asdict(settings), None
        self.goes_on = goes_on(context, cascades[-1].grid)
        self._sources = Sources(context)
        self._bright = [context.lamps.count] if context.environment.bright.count else []
        self._lamp_light = LampLight(context, False, LAMP_SAMPLES, seed)
        self.direct_lamps = self._lamp_light.names
        # Of each grid by point of its ``seen``, so that voxels can be lit anew without some of what is in them.
        self.leaving = light_voxels(context, cascades, settings, seed, self._sky, progress)
        self.hierarchies = hierarchies_of(cascades, self.leaving)
        self.hierarchy: Hierarchy = self.hierarchies[0]
        self.stats = {"rays": 0, "voxels": sum(len(part.cells) for part in cascades), "voxel_size": voxels.grid.cell,
                      "grid": list(voxels.grid.resolution)}
        self.notes = tuple(thin_walls(context, voxels))
        self.omissions = tuple(self._omissions())

    @classmethod
    def bake(cls, context: LightContext, settings: VoxelSettings, seed: int, progress: Progress,
             kernels: Kernels | None = None) -> "VoxelField":
        """The field of the scene of ``context``; ``kernels`` put it into voxels elsewhere than on the CPU. Raises BakeError,
        Cancelled."""
        progress.stage("voxels")
        progress.step(0.0, "putting the scene into voxels")
        grids = place_grids(context.scene, np.array(context.geometry.bounds(), np.float64), settings)
        require_voxels(context, grids, settings)
        meet = None if kernels is None else kernels.voxel_crossings
        # What holds nothing is left out; the outermost, which all others lie in, must hold something.
        held = [grid for grid in grids[:-1] if holds_geometry(context.geometry, grid)]
        cascades = tuple(voxelize(context.geometry, context.surfaces, grid, context.threads, meet=meet)
                         for grid in (*held, grids[-1]))
        return cls(context, settings, seed, cascades, progress.span(_VOXELIZED, 1.0))

    @abstractmethod
    def gather(self, points: np.ndarray, normals: np.ndarray) -> np.ndarray:
        """Irradiance (n, 3) of what surfaces and the smooth sky send to ``points`` (n, 3) under ``normals`` (n, 3)."""

    @abstractmethod
    def look(self, points: np.ndarray, directions: np.ndarray) -> np.ndarray:
        """Radiance (n, 3) of all that a share of AROUND of the sphere about ``directions`` (n, 3) sends to free ``points`` (n,
        3)."""

    def irradiance(self, points: np.ndarray, normals: np.ndarray) -> np.ndarray:
        """See Field."""
        points, normals = np.asarray(points, np.float32), np.asarray(normals, np.float32)
        spans = chunks(len(points), RECEIVERS)
        parts = parallel_for(lambda i: self.gather(points[spans[i]], normals[spans[i]]), len(spans), self.context.threads)
        total = np.concatenate(parts) if parts else np.zeros((0, 3), np.float32)
        if self._bright:
            total += self._bright_sky(points, normals)
        return total + self._lamp_light.irradiance(points, normals) if self._lamp_light else total

    def radiance_sh(self, points: np.ndarray, order: int = 2) -> np.ndarray:
        """See Field; any ``order``, of which high ones are as blurred as AROUND directions are."""
        points = np.asarray(points, np.float32)
        directions = fibonacci_sphere(AROUND)
        basis = sh.evaluate(directions, order) * np.float32(4.0 * np.pi / AROUND)
        spans = chunks(len(points), RECEIVERS)

        def around(i):
            here = points[spans[i]]
            seen = [self.look(here, np.broadcast_to(direction, here.shape)) for direction in directions]
            return np.einsum("dk,dnc->nkc", basis, np.stack(seen))

        parts = parallel_for(around, len(spans), self.context.threads)
        total = np.concatenate(parts) if parts else np.zeros((0, basis.shape[1], 3), np.float32)
        if self._bright:
            total = total + self._sources.lamp_coefficients(self._bright, points, order, self.seed, LAMP_SAMPLES)
        return total + self._lamp_light.coefficients(points, order) if self._lamp_light else total

    def beyond(self, points: np.ndarray, directions: np.ndarray, spread: np.ndarray) -> np.ndarray:
        """Radiance (n, 3) of the sky about ``directions`` (n, 3), ``spread`` (n,) to all sides, where no surface outside the grid
        hides it: what such a surface sends is not known, and nothing."""
        environment = self.context.environment
        if environment.is_black:
            return np.zeros((len(points), 3), np.float32)
        radiance = self._sky(directions)
        if not environment.is_constant and np.any(spread > 0):
            for turn in range(RING):
                angle = 2.0 * np.pi * turn / RING
                tilt = np.float32(0.5**0.5) * spread
                local = np.stack([tilt * np.cos(angle), tilt * np.sin(angle), np.ones(len(tilt))], axis=1).astype(np.float32)
                radiance = radiance + self._sky(about(directions, local))
            radiance = radiance * np.float32(1.0 / (1 + RING))
        if self.goes_on:
            grid = self.cascades[-1].grid
            _, leave = box_span(grid, grid.cells_of(points), np.asarray(directions, np.float64))
            way = np.maximum(np.nan_to_num(leave, posinf=0.0, neginf=0.0), 0.0) * grid.cell
            exits = (points + directions * way[:, None]).astype(np.float32)
            tracer = self.context.tracers.diffuse
            radiance = radiance * tracer.transmittance(exits, np.ascontiguousarray(directions, np.float32), looks=True)
        return radiance

    def _sky(self, directions: np.ndarray) -> np.ndarray:
        return self.context.environment.base_radiance(np.asarray(directions, np.float32))

    def _bright_sky(self, points: np.ndarray, normals: np.ndarray) -> np.ndarray:
        """Irradiance (n, 3) of the sky's bright patches, by shadow rays."""
        total, reach = np.zeros(points.shape, np.float32), np.zeros(len(points), np.float32)
        for source, count, numbers in self._sources.lamp_samples(self._bright, self.seed, LAMP_SAMPLES):
            total += self._sources.irradiance(source, points, normals, normals, reach, np.tile(numbers, (len(points), 1))) / count
        return total

    def leak_causes(self, context, points: np.ndarray, normals: np.ndarray, excess: np.ndarray) -> np.ndarray:
        """See Field."""
        return causes_of_cells(context, self._cells_at(points), points, normals)

    def _cells_at(self, points: np.ndarray) -> np.ndarray:
        """Side (n,) of the voxels that ``points`` (n, 3) lie in."""
        return by_cascade(self.hierarchies, points, lambda hierarchy, rows: np.full(len(rows), hierarchy.grid.cell))

    def grids(self) -> tuple[ProbeGrid, ...]:
        """The field on the scene's volumes, once."""
        if self._grids is None:
            context, order = self.context, self.settings.order
            self._grids = resample(self, context, context.scene.volumes, order, Progress(), seed=self.seed, threads=context.threads,
                                   radiance_sh=partial(self.radiance_sh, order=order))
        return self._grids

    def lit_voxels(self) -> ShippedVoxels | None:
        """See Field."""
        return shipped(self)

    def relight(self, scene: Scene, progress: Progress | None = None) -> "VoxelField":
        """The field under the lamps and world of ``scene``: the voxels stay. Raises BakeError if geometry or materials differ."""
        return type(self)(self.context.relit(scene), self.settings, self.seed, self.cascades, progress or Progress())

    @property
    def live_settings(self) -> VoxelSettings:
        """See Field."""
        return self.settings

    def arrays(self) -> dict[str, np.ndarray]:
        """Of every grid, numbered but for the finest: itself as JSON text, and of the voxels that hold surfaces the flat indices,
        the opacity along the axes, and optical depth with that times radiance by face, as Level has them."""
        result = {}
        for number, (voxels, hierarchy) in enumerate(zip(self.cascades, self.hierarchies, strict=True)):
            grid, finest = voxels.grid, hierarchy.levels[0]
            text = json.dumps({"corner": grid.corner, "cell": grid.cell, "resolution": grid.resolution})
            parts = {"grid": np.array(text), "cells": voxels.cells, "opacity": voxels.opacity, "depth": finest.depth[1:],
                     "glow": finest.glow.reshape(-1, 6, 3)[1:]}
            result.update({name if number == 0 else f"{name}_{number}": array for name, array in parts.items()})
        return result

    def _omissions(self) -> Iterator[Omission]:
        scene = self.context.scene
        yield from beyond_grid(self.technique, self.context, self.cascades[-1].grid)
        limited = tuple(light.name for light in scene.lights if light.max_bounces is not None)
        if limited and self.settings.light != SURFACES:
            yield Omission(f"{self.technique} reflects the light of {quoted(limited)} on, beyond the bounces that it is limited to",
                           objects=limited)
        if self.settings.light == MAPS:
            yield from surfaces_of_maps(self.technique, self.context)
        yield from all_captured(self.technique, scene.volumes)


def hierarchies_of(cascades: tuple[Voxels, ...], leaving: list[np.ndarray]) -> tuple[Hierarchy, ...]:
    """What receivers in each of nested grids read where ``leaving`` (e, 3) leaves what their voxels show."""
    return nested_hierarchies([(voxels, voxels.by_face(light)) for voxels, light in zip(cascades, leaving, strict=True)])
