"""Surface elements for the geometry volume: from every surface in it, or from what lamps and cameras see."""

from dataclasses import fields

import numpy as np

from ...transport.context import LightContext
from ...transport.lights.shadow_view import ShadowView
from ...transport.rays.tracer import SELF_INTERSECTION
from ...transport.vectors import dot, faced
from ...transport.views.reflective_shadow_map import ReflectiveShadowMap
from .geometry_volume import Surfels
from .grid import LpvGrid, lattice_across

# Rays through a cell along each axis and side, and how many surfaces one behind the other they find.
RAYS_PER_CELL, MAX_LAYERS = 4, 128
# A ray goes on behind a surface by this share of a cell, and by what its coordinates may be rounded by.
ADVANCE, ROUNDING = 1e-4, np.float32(2.0) * SELF_INTERSECTION
# The axis that a normal is closest to has a cosine of 1/√3 with it, or more: less comes from rounding alone.
LEAST_COSINE = np.float32(0.5)
# A texel that sees a surface at grazing incidence stands for at most this many times its own cross-section.
MAX_STRETCH = 20.0
# Texels along a side of what a camera sees, and how near that begins, as a share of how far it reaches.
CAMERA_RESOLUTION, CAMERA_NEAR_SHARE = 256, 1e-5


def peel(context: LightContext, grid: LpvGrid) -> Surfels:
    """Every surface in ``grid`` by rays along the three axes, one layer after another; a surface counts along the axis that its
    normal is closest to, so that it is met no more obliquely than under 55 degrees."""
    return joined([_peel_axis(context, grid, axis) for axis in range(3)])


def joined(parts: list[Surfels]) -> Surfels:
    """All surfels of ``parts`` in order; no parts give no surfels."""
    none = Surfels(*(np.zeros(shape, np.float32) for shape in ((0, 3), (0, 3), 0, (0, 3))))
    return Surfels(*(np.concatenate([getattr(part, item.name) for part in (none, *parts)]) for item in fields(Surfels)))


def _peel_axis(context, grid, axis) -> Surfels:
    low, high = np.asarray(grid.corner) - 0.5 * grid.cell, grid.high + 0.5 * grid.cell
    spacing = grid.cell / RAYS_PER_CELL
    count = (np.asarray(grid.resolution) + 1) * RAYS_PER_CELL
    origins = lattice_across(axis, low, spacing, count).astype(np.float32)
    origins[:, axis] = low[axis]
    direction = np.zeros((1, 3), np.float32)
    direction[0, axis] = 1.0
    length = np.float32(high[axis] - low[axis])
    advance = np.float32(ADVANCE * grid.cell) + ROUNDING * np.float32(max(np.abs(low).max(), np.abs(high).max()))
    travelled = np.zeros(len(origins), np.float32)
    layers = []
    for _ in range(MAX_LAYERS):
        start = origins + direction * travelled[:, None]
        hits = context.tracers.diffuse.intersect(start, np.repeat(direction, len(start), axis=0), length - travelled)
        rows = np.flatnonzero(hits.primitive >= 0)
        if not rows.size:
            break
        primitive, u, v = hits.primitive[rows], hits.u[rows], hits.v[rows]
        normals = context.geometry.normals_world[primitive]
        chosen = np.flatnonzero(np.argmax(np.abs(normals), axis=1) == axis)
        primitive, u, v, normals = primitive[chosen], u[chosen], v[chosen], normals[chosen]
        area = np.float32(spacing**2) / np.maximum(np.abs(normals[:, axis]), LEAST_COSINE)
        layers.append(Surfels(context.geometry.points(primitive, u, v), normals, area, _mean_albedo(context, primitive, u, v)))
        origins, travelled = origins[rows], travelled[rows] + hits.t[rows] + advance
    return joined(layers)


def of_map(context: LightContext, captured: ReflectiveShadowMap) -> Surfels:
    """The surfels of a reflective shadow map, lit or not; their normals face the lamp."""
    rows = np.flatnonzero(captured.primitive.ravel() >= 0)
    return _seen(context, captured.view, rows, captured.position.reshape(-1, 3)[rows], captured.primitive.ravel()[rows])


def of_camera(context: LightContext, camera, resolution: int = CAMERA_RESOLUTION) -> Surfels:
    """The surfels that ``camera`` (scene.Camera) sees: they block and reflect what is propagated, and add no light."""
    projection = np.asarray(camera.clip_from_camera, np.float64)
    bounds = np.array(context.geometry.bounds(), np.float64)
    eye = np.asarray(camera.world_from_camera, np.float64)[:3, 3]
    far = 2.0 * float(np.linalg.norm(np.abs(bounds - eye).max(axis=0)))
    view = ShadowView(-1, 0, np.asarray(camera.world_from_camera, np.float64), projection, bool(projection[3, 3] == 1.0),
                      resolution, CAMERA_NEAR_SHARE * far, far)
    origins, directions = view.rays()
    directions = directions / np.linalg.norm(directions, axis=1, keepdims=True)
    hits = context.tracers.diffuse.intersect(origins, np.ascontiguousarray(directions, np.float32))
    rows = np.flatnonzero(hits.primitive >= 0)
    primitive = hits.primitive[rows]
    return _seen(context, view, rows, context.geometry.points(primitive, hits.u[rows], hits.v[rows]), primitive)


def _seen(context, view: ShadowView, rows, positions, primitive) -> Surfels:
    """Surfels at the texels ``rows`` of ``view``: as much surface as each texel covers."""
    directions = view.directions()[rows].astype(np.float32)
    normals = context.geometry.normals_world[primitive]
    cosine = dot(normals, directions)
    normals = faced(normals, directions)
    measure = view.texel_measure().ravel()[rows]
    if not view.orthographic:
        measure = measure * np.square(positions - view.position_world).sum(axis=1)
    area = (measure / np.maximum(np.abs(cosine), 1.0 / MAX_STRETCH)).astype(np.float32)
    # Barycentrics are not kept in a map: a triangle's albedo is looked up at the point itself.
    u, v = _barycentrics(context.geometry.triangles_world[primitive], positions)
    return Surfels(positions, normals, area, context.surfaces.albedo_of_side(primitive, u, v, -cosine))


def _mean_albedo(context, primitive, u, v) -> np.ndarray:
    """(n, 3): a cell's block of geometry reflects alike to both sides."""
    sides = [context.surfaces.albedo_of_side(primitive, u, v, np.full(len(u), side, np.float32)) for side in (1, -1)]
    return np.mean(sides, axis=0, dtype=np.float32)


def _barycentrics(triangles: np.ndarray, points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Embree's (u, v) (n,) of ``points`` (n, 3) on ``triangles`` (n, 3, 3)."""
    edge_u, edge_v, offset = triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0], points - triangles[:, 0]
    uu, uv, vv = dot(edge_u, edge_u), dot(edge_u, edge_v), dot(edge_v, edge_v)
    ou, ov = dot(offset, edge_u), dot(offset, edge_v)
    scale = 1.0 / np.maximum(uu * vv - uv * uv, np.finfo(np.float32).tiny)
    return np.clip((vv * ou - uv * ov) * scale, 0, 1), np.clip((uu * ov - uv * ou) * scale, 0, 1)
