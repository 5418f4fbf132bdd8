"""Surface elements for the geometry volume: from every surface in it, or from what lamps and cameras see."""

import numpy as np

from ...transport.context import LightContext
from ...transport.reflective_shadow_map import ReflectiveShadowMap
from ...transport.shadow_views import ShadowView
from ...transport.vectors import dot
from .geometry_volume import Surfels
from .grid import LpvGrid

# Rays through a cell along each axis and side, and how many surfaces one behind the other they find.
RAYS_PER_CELL, MAX_LAYERS = 4, 128
# A texel that sees a surface at grazing incidence stands for at most this many times its own cross-section.
MAX_STRETCH = 20.0
CAMERA_RESOLUTION = 256
CAMERA_NEAR_SHARE = 1e-5


def peel(context: LightContext, grid: LpvGrid) -> Surfels:
    """Every surface in ``grid`` by rays along the three axes, one layer after another; a surface counts along the axis that its
    normal is closest to, so that it is met no more obliquely than under 55 degrees."""
    parts = [_peel_axis(context, grid, axis) for axis in range(3)]
    return Surfels(*(np.concatenate(columns) for columns in zip(*parts, strict=True)))


def _peel_axis(context, grid, axis):
    others = [(axis + 1) % 3, (axis + 2) % 3]
    low, high = np.asarray(grid.corner) - 0.5 * grid.cell, grid.high + 0.5 * grid.cell
    spacing = grid.cell / RAYS_PER_CELL
    count = (np.asarray(grid.resolution) + 1) * RAYS_PER_CELL
    u, v = np.meshgrid(*(low[other] + (np.arange(count[other]) + 0.5) * spacing for other in others), indexing="ij")
    origins = np.empty((u.size, 3), np.float32)
    origins[:, axis], origins[:, others[0]], origins[:, others[1]] = low[axis], u.ravel(), v.ravel()
    direction = np.zeros((1, 3), np.float32)
    direction[0, axis] = 1.0
    length = np.float32(high[axis] - low[axis])
    advance = np.float32(1e-4 * grid.cell) + np.float32(8e-6) * np.float32(max(np.abs(low).max(), np.abs(high).max()))
    travelled = np.zeros(len(origins), np.float32)
    found = []
    for _ in range(MAX_LAYERS):
        start = origins + direction * travelled[:, None]
        hits = context.tracer.intersect(start, np.repeat(direction, len(start), axis=0), length - travelled)
        rows = np.flatnonzero(hits.primitive >= 0)
        if not rows.size:
            break
        primitive, u, v = hits.primitive[rows], hits.u[rows], hits.v[rows]
        normals = context.geometry.normals_world[primitive]
        chosen = np.flatnonzero(np.argmax(np.abs(normals), axis=1) == axis)
        primitive, u, v, normals = primitive[chosen], u[chosen], v[chosen], normals[chosen]
        area = np.float32(spacing**2) / np.maximum(np.abs(normals[:, axis]), np.float32(0.5))
        found.append((context.geometry.points(primitive, u, v), normals, area, context.surfaces.albedo(primitive, u, v)))
        origins, travelled = origins[rows], travelled[rows] + hits.t[rows] + advance
    if not found:
        return np.zeros((0, 3), np.float32), np.zeros((0, 3), np.float32), np.zeros(0, np.float32), np.zeros((0, 3), np.float32)
    return tuple(np.concatenate(columns) for columns in zip(*found, strict=True))


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
    hits = context.tracer.intersect(origins, np.ascontiguousarray(directions, np.float32))
    rows = np.flatnonzero(hits.primitive >= 0)
    primitive = hits.primitive[rows]
    return _seen(context, view, rows, context.geometry.points(primitive, hits.u[rows], hits.v[rows]), primitive)


def _seen(context, view: ShadowView, rows, positions, primitive) -> Surfels:
    """Surfels at the texels ``rows`` of ``view``: as much surface as each texel covers."""
    directions = view.directions()[rows].astype(np.float32)
    normals = context.geometry.normals_world[primitive]
    cosine = dot(normals, directions)
    normals = normals * -np.copysign(np.float32(1.0), cosine)[:, None]
    measure = view.texel_measure().ravel()[rows]
    if not view.orthographic:
        measure = measure * np.square(positions - view.position_world).sum(axis=1)
    area = (measure / np.maximum(np.abs(cosine), 1.0 / MAX_STRETCH)).astype(np.float32)
    # Barycentrics are not kept in a map: a triangle's albedo is looked up at the point itself.
    u, v = _barycentrics(context.geometry.triangles_world[primitive], positions)
    return Surfels(positions, normals, area, context.surfaces.albedo(primitive, u, v))


def _barycentrics(triangles: np.ndarray, points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Embree's (u, v) (n,) of ``points`` (n, 3) on ``triangles`` (n, 3, 3)."""
    edge_u, edge_v, offset = triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0], points - triangles[:, 0]
    uu, uv, vv = dot(edge_u, edge_u), dot(edge_u, edge_v), dot(edge_v, edge_v)
    ou, ov = dot(offset, edge_u), dot(offset, edge_v)
    scale = 1.0 / np.maximum(uu * vv - uv * uv, np.finfo(np.float32).tiny)
    return np.clip((vv * ou - uv * ov) * scale, 0, 1), np.clip((uu * ov - uv * ou) * scale, 0, 1)
