"""The light that enters a light propagation volume: what lamps light first, emissive surfaces, the world, a coarser cascade."""

from typing import NamedTuple

import numpy as np

from ...errors import BakeError
from ...numerics import sh
from ...numerics.grid import lattice_points
from ...numerics.sampling import fibonacci_sphere, r2, sobol_owen
from ...progress import Progress
from ...scene import Scene
from ...scene.memory import require_memory
from ...transport.context import LightContext
from ...transport.lights.shadow_view import ShadowView
from ...transport.parallel import CHUNK, chunks, parallel_for
from ...transport.views.reflective_shadow_map import ReflectiveShadowMap
from ...transport.views.shadow_views import lit_views
from ..lattice.resample import thread_bytes
from .gather import intensity_of_radiance
from .grid import LpvGrid, lattice_across

# Texels of all shadow maps together: with very many lamps each gets smaller ones.
MAX_TEXELS, MIN_RESOLUTION = 1 << 21, 16
# A texel of a map with the light that it becomes, and a cell of a cascade, at the peak; measured with up to two million texels and
# a quarter of a million cells.
BYTES_PER_TEXEL, BYTES_PER_CELL = 165, 390
# Points on emissive surfaces, and rays from each cell to the world and to its bright patches.
EMITTER_POINTS, WORLD_RAYS, BRIGHT_RAYS = 1 << 15, 96, 32


class Lights(NamedTuple):
    """Rows of what `injection.inject` takes: ``positions`` (n, 3), ``normals`` (n, 3), ``flux`` (n, 3) [W]."""

    positions: np.ndarray
    normals: np.ndarray
    flux: np.ndarray


def map_views(scene: Scene, bounds: np.ndarray, grids: tuple[LpvGrid, ...], resolution: int) -> list[tuple[ShadowView, ...]]:
    """Each lamp's views of ``scene``, whose geometry has ``bounds`` (2, 3), ``resolution`` texels a side or fewer if they are many;
    a sun's is fitted to the coarsest volume."""
    outermost = grids[-1]
    box = np.stack([np.asarray(outermost.corner) - outermost.cell, outermost.high + outermost.cell])
    focus = np.stack([np.maximum(box[0], bounds[0]), np.minimum(box[1], bounds[1])])
    if np.any(focus[0] > focus[1]):
        focus = box
    views = [lit_views(light, bounds, resolution, lamp, focus=focus) for lamp, light in enumerate(scene.lights)]
    fitting = np.sqrt(MAX_TEXELS / max(sum(map(len, views)), 1))
    fewer = int(np.clip(fitting, min(resolution, MIN_RESOLUTION), resolution))
    if fewer == resolution:
        return views
    return [lit_views(light, bounds, fewer, lamp, focus=focus) for lamp, light in enumerate(scene.lights)]


def capture_maps(context: LightContext, kernels, grids: tuple[LpvGrid, ...], resolution: int,
                 progress: Progress) -> list[ReflectiveShadowMap]:
    """The reflective shadow maps of every lamp (see ``map_views``).

    Raises BakeError naming a lamp that lights surfaces, but none within the volumes, and if no lamp lights any and nothing else
    shines.
    """
    outermost, bounds = grids[-1], np.array(context.geometry.bounds(), np.float64)
    maps, views_of = [], map_views(context.scene, bounds, grids, resolution)
    texels = sum(view.resolution**2 for views in views_of for view in views)
    # Points on emissive surfaces become light as texels do, on both sides.
    glowing = 2 * EMITTER_POINTS * BYTES_PER_TEXEL if context.emitters.count else 0
    require_memory({"shadow maps": texels * BYTES_PER_TEXEL, "cells": sum(grid.count for grid in grids) * BYTES_PER_CELL,
                    "emissive surfaces": glowing, "threads": thread_bytes(context, gathers=False)})
    for lamp, views in enumerate(views_of):
        progress.step(lamp / context.lamps.count, "capturing reflective shadow maps")
        of_lamp = [kernels.capture(context, view) for view in views]
        lit = [captured.lights() for captured in of_lamp]
        if any(len(texels.flux) for texels in lit) and not any(outermost.inside(texels.positions).any() for texels in lit):
            name = context.scene.lights[lamp].name
            raise BakeError(f"lamp {name!r} lights nothing inside the light propagation volumes",
                            "add cascades, raise cell_size, or hide the lamp from renders")
        maps += of_lamp
    dark = context.environment.is_black and not context.emitters.count
    if maps and dark and not any(np.any(captured.primitive >= 0) for captured in maps):
        raise BakeError("no lamp lights any surface", "turn a lamp towards the scene, or add light")
    return maps


def lamp_lights(maps: list[ReflectiveShadowMap]) -> Lights:
    """The first bounce of lamps: every texel that reflects."""
    return joined([Lights(*captured.lights()[:3]) for captured in maps])


def emissive_lights(context: LightContext, seed: int, count: int = EMITTER_POINTS) -> Lights:
    """Emissive surfaces as points by power, each sending to both sides."""
    if not context.emitters.count:
        return joined([])
    emitted = context.emitters.sample(sobol_owen(count, 3, seed))
    scale = (np.pi / (count * np.maximum(emitted.pdf_area, 1e-30)))[:, None]
    flux = [(context.emitters.mean_radiance(emitted, side) * scale).astype(np.float32) for side in (1, -1)]
    return Lights(np.tile(emitted.points, (2, 1)), np.concatenate([emitted.normals, -emitted.normals]), np.concatenate(flux))


def world_volume(context: LightContext, grid: LpvGrid, seed: int, progress: Progress) -> np.ndarray:
    """The world as each cell's centre sees it past the surfaces, as coefficients (4, 3, nz, ny, nx) float32 of intensity.

    It is traced, not propagated: what comes from far away in a straight line is what cells spread most.
    """
    volume = grid.empty()
    if context.environment.is_black:
        return volume
    centers = lattice_points(grid.world_from_local, grid.resolution).reshape(-1, 3).astype(np.float32)
    directions = fibonacci_sphere(WORLD_RAYS).astype(np.float32)
    radiance = context.environment.base_radiance(directions) * np.float32(4.0 * np.pi / WORLD_RAYS)
    if context.environment.bright.count:
        spots, weights = context.environment.bright.sample(r2(BRIGHT_RAYS, seed))
        directions = np.concatenate([directions, spots])
        radiance = np.concatenate([radiance, weights / np.float32(BRIGHT_RAYS)])
    projected = sh.evaluate(directions, 1)[:, :, None] * radiance[:, None]
    projected = (intensity_of_radiance(grid)[:, None] * projected).reshape(len(directions), 12)
    spans = chunks(len(centers), CHUNK // len(directions))

    def work(i):
        origins = np.repeat(centers[spans[i]], len(directions), axis=0)
        passed = context.tracer.transmittance(origins, np.tile(directions, (len(centers[spans[i]]), 1))).astype(np.float32)
        if passed.shape[1] == 1:
            return np.einsum("nd,dk->nk", passed.reshape(-1, len(directions)), projected)
        colours = projected.reshape(len(directions), -1, 3)
        return np.einsum("ndc,dkc->nkc", passed.reshape(-1, len(directions), 3), colours).reshape(-1, projected.shape[1])

    parts = parallel_for(work, len(spans), context.threads, progress, "light of the world")
    return np.ascontiguousarray(np.concatenate(parts).T).reshape(volume.shape)


def border(grid: LpvGrid) -> tuple[np.ndarray, np.ndarray]:
    """Centres (f, 3) float32 of all faces on the border of ``grid``, and the unit normals (f, 3) float32 that point inward."""
    positions, normals = [], []
    corner, cell = np.asarray(grid.corner), grid.cell
    for axis in range(3):
        centres = lattice_across(axis, corner, cell, grid.resolution)
        for end, inward in ((corner[axis], 1.0), (grid.high[axis], -1.0)):
            face = centres.copy()
            face[:, axis] = end
            positions.append(face)
            normals.append(np.tile(np.eye(3)[axis] * inward, (len(face), 1)))
    return np.concatenate(positions).astype(np.float32), np.concatenate(normals).astype(np.float32)


def entering(grid: LpvGrid, positions: np.ndarray, inward: np.ndarray, flux: np.ndarray) -> Lights:
    """Lights for what crosses the border's faces at ``positions`` (f, 3) along ``inward`` (f, 3) with ``flux`` (f, 3) [W]: what
    comes in evenly is a lobe from the face into its cell."""
    return Lights(positions, inward, flux)


def joined(parts: list[Lights]) -> Lights:
    """All rows of ``parts`` in order; no parts give no rows."""
    empty = Lights(*(np.zeros((0, 3), np.float32) for _ in range(3)))
    return Lights(*(np.concatenate(columns) for columns in zip(empty, *parts, strict=True)))
