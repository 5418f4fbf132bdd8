"""The light that enters a light propagation volume: what lamps light first, emissive surfaces, the world, a coarser cascade."""

from typing import NamedTuple

import numpy as np

from ...errors import BakeError
from ...numerics import sh
from ...numerics.grid import lattice_points
from ...numerics.sampling import fibonacci_sphere, r2, sobol_owen
from ...progress import Progress
from ...scene import Scene
from ...transport.context import LightContext
from ...transport.parallel import CHUNK, chunks, parallel_for
from ...transport.reflective_shadow_map import ReflectiveShadowMap
from ...transport.shadow_views import ShadowView, lit_views
from .gather import FACE_TOTAL, intensity_of_radiance
from .grid import FRONT_SOLID_ANGLE, SIDE_SOLID_ANGLE, LpvGrid

# Texels of all shadow maps together: with very many lamps each gets smaller ones.
MAX_TEXELS, MIN_RESOLUTION = 1 << 21, 16
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
    maps = []
    for lamp, views in enumerate(map_views(context.scene, bounds, grids, resolution)):
        progress.step(lamp / context.lamps.count, "capturing reflective shadow maps")
        own = [kernels.capture(context, view) for view in views]
        lit = [captured.lights() for captured in own]
        if any(len(texels.flux) for texels in lit) and not any(outermost.inside(texels.positions).any() for texels in lit):
            name = context.scene.lights[lamp].name
            raise BakeError(f"lamp {name!r} lights nothing inside the light propagation volumes",
                            "add cascades, raise cell_size, or hide the lamp from renders")
        maps += own
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
    positions, normals, radiance, pdf, _ = context.emitters.sample(sobol_owen(count, 3, seed))
    flux = (radiance * (np.pi / (count * np.maximum(pdf, 1e-30)))[:, None]).astype(np.float32)
    return Lights(np.concatenate([positions, positions]), np.concatenate([normals, -normals]), np.concatenate([flux, flux]))


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
        free = ~context.tracer.occluded(origins, np.tile(directions, (len(centers[spans[i]]), 1)))
        return np.einsum("nd,dk->nk", free.reshape(-1, len(directions)).astype(np.float32), projected)

    parts = parallel_for(work, len(spans), context.threads, progress, "light of the world")
    return np.ascontiguousarray(np.concatenate(parts).T).reshape(volume.shape)


def border(grid: LpvGrid) -> tuple[np.ndarray, np.ndarray]:
    """Centres (f, 3) float32 of all faces on the border of ``grid``, and the unit normals (f, 3) float32 that point inward."""
    positions, normals = [], []
    corner, cell = np.asarray(grid.corner), grid.cell
    for axis in range(3):
        others = [(axis + 1) % 3, (axis + 2) % 3]
        u, v = np.meshgrid(*(corner[other] + (np.arange(grid.resolution[other]) + 0.5) * cell for other in others), indexing="ij")
        for end, inward in ((corner[axis], 1.0), (grid.high[axis], -1.0)):
            face = np.empty((u.size, 3))
            face[:, axis], face[:, others[0]], face[:, others[1]] = end, u.ravel(), v.ravel()
            positions.append(face)
            normals.append(np.tile(np.eye(3)[axis] * inward, (u.size, 1)))
    return np.concatenate(positions).astype(np.float32), np.concatenate(normals).astype(np.float32)


def entering(grid: LpvGrid, positions: np.ndarray, inward: np.ndarray, flux: np.ndarray) -> Lights:
    """Lights for what crosses the border's faces at ``positions`` (f, 3) along ``inward`` (f, 3) with ``flux`` (f, 3) [W].

    Light that comes in evenly goes on to the five other faces of its cell by their solid angles; sent straight ahead it would
    get much farther in than propagated light does.
    """
    tangent = np.roll(inward, 1, axis=1)
    bitangent = np.roll(inward, 2, axis=1)
    centers = positions + np.float32(0.5 * grid.cell) * inward
    onward = [(inward, FRONT_SOLID_ANGLE), *((side, SIDE_SOLID_ANGLE) for side in (tangent, -tangent, bitangent, -bitangent))]
    parts = []
    for normals, solid_angle in onward:
        # Injection moves a light by half a cell along its normal: back to the centre.
        parts.append(Lights(centers - np.float32(0.5 * grid.cell) * normals, normals, flux * np.float32(solid_angle / FACE_TOTAL)))
    return joined(parts)


def joined(parts: list[Lights]) -> Lights:
    """All rows of ``parts`` in order; no parts give no rows."""
    empty = Lights(*(np.zeros((0, 3), np.float32) for _ in range(3)))
    return Lights(*(np.concatenate(columns) for columns in zip(empty, *parts, strict=True)))
