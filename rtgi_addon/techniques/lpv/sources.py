"""The light that enters a light propagation volume: what lamps light first, emissive surfaces, and what crosses its border."""

from typing import NamedTuple

import numpy as np

from ...errors import BakeError
from ...numerics.sampling import cosine_hemisphere, frame, hash_u32, r2, sobol_owen
from ...progress import Progress
from ...transport.context import LightContext
from ...transport.parallel import chunks, parallel_for
from ...transport.reflective_shadow_map import ReflectiveShadowMap
from ...transport.shadow_views import views_of
from .gather import FACE_TOTAL
from .grid import FRONT_SOLID_ANGLE, SIDE_SOLID_ANGLE, LpvGrid

# Points on emissive surfaces, and rays to the world through each face of the border.
EMITTER_POINTS, WORLD_RAYS = 1 << 15, 64


class Lights(NamedTuple):
    """Rows of what `injection.inject` takes: ``positions`` (n, 3), ``normals`` (n, 3), ``flux`` (n, 3) [W]."""

    positions: np.ndarray
    normals: np.ndarray
    flux: np.ndarray


def capture_maps(context: LightContext, kernels, grids: tuple[LpvGrid, ...], resolution: int,
                 progress: Progress) -> list[ReflectiveShadowMap]:
    """The reflective shadow maps of every lamp; a sun's is fitted to the coarsest volume.

    Raises BakeError naming a lamp that lights surfaces, but none within the volumes.
    """
    outermost = grids[-1]
    box = np.stack([np.asarray(outermost.corner) - outermost.cell, outermost.high + outermost.cell])
    bounds = np.array(context.geometry.bounds(), np.float64)
    focus = np.stack([np.maximum(box[0], bounds[0]), np.minimum(box[1], bounds[1])])
    if np.any(focus[0] > focus[1]):
        focus = box
    maps = []
    for lamp in range(context.lamps.count):
        progress.step(lamp / context.lamps.count, "capturing reflective shadow maps")
        own = [kernels.capture(context, view) for view in views_of(context, lamp, resolution, focus=focus)]
        lit = [captured.lights() for captured in own]
        if any(len(texels.flux) for texels in lit) and not any(outermost.inside(texels.positions).any() for texels in lit):
            name = context.scene.lights[lamp].name
            raise BakeError(f"lamp {name!r} lights nothing inside the light propagation volumes",
                            "add cascades, raise cell_size, or hide the lamp from renders")
        maps += own
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


def world_lights(context: LightContext, grid: LpvGrid, seed: int, progress: Progress) -> Lights:
    """The world as it shines in through the faces of ``grid``'s border, past whatever surfaces stand outside."""
    positions, inward = border(grid)
    if context.environment.is_black:
        return joined([])
    spans = chunks(len(positions), 1024)
    points = cosine_hemisphere(r2(WORLD_RAYS, seed))

    def work(i):
        p, n = positions[spans[i]], -inward[spans[i]]
        tangent, bitangent = frame(n)
        local = points[None]
        directions = (local[..., 0:1] * tangent[:, None] + local[..., 1:2] * bitangent[:, None] + local[..., 2:3] * n[:, None])
        directions = np.ascontiguousarray(directions.reshape(-1, 3), np.float32)
        free = ~context.tracer.occluded(np.repeat(p, WORLD_RAYS, axis=0), directions)
        radiance = np.zeros((len(directions), 3), np.float32)
        radiance[free] = context.environment.base_radiance(directions[free])
        mean = radiance.reshape(len(p), WORLD_RAYS, 3).mean(axis=1)
        return mean * np.float32(np.pi) + _bright(context, p, n, hash_u32(seed, i))

    irradiance = np.concatenate(parallel_for(work, len(spans), context.threads, progress, "light of the world"))
    return entering(grid, positions, inward, irradiance * np.float32(grid.cell**2))


def _bright(context, points, normals, seed) -> np.ndarray:
    """Irradiance (n, 3) that the world's bright patches give facing planes at ``points`` with ``normals``."""
    bright = context.environment.bright
    result = np.zeros((len(points), 3), np.float32)
    if not bright.count:
        return result
    directions, radiance = bright.sample(r2(WORLD_RAYS, int(seed)))
    for direction, weight in zip(directions, radiance, strict=True):
        rows = np.flatnonzero(normals @ direction > 0)
        free = rows[~context.tracer.occluded(points[rows], np.repeat(direction[None], len(rows), axis=0))]
        result[free] += weight * (normals[free] @ direction)[:, None] / np.float32(WORLD_RAYS)
    return result


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
