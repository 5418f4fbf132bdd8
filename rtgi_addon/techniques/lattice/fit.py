"""A probe volume for a scene that has none: where it reaches and how many probes it has."""

from dataclasses import replace

import numpy as np

from ...errors import BakeError
from ...numerics.blocks import blocks, extent
from ...numerics.grid import box_corners, transform_points
from ...scene import ProbeVolume, Scene
from ...transport.rays.choose import make_tracer
from ...transport.surfaces.geometry import flatten
from ...transport.surfaces.materials import Surfaces
from ...transport.surfaces.solids import Solids
from ...transport.vectors import dot

# A fitted lattice keeps to these counts: enough to see light vary, few enough to bake while one waits.
FEWEST_PROBES, MOST_PROBES = 64, 4096
_TARGET_PROBES = 1024
# How much further than everything else a flat object, or any object, reaches before the fit ignores it.
_GROUND_REACH, _DOME_REACH = 4.0, 50.0
# A scene lower than this share of its reach is ground without anything on it: the fit adds as much air above.
_AIR = 0.1
# Meshes placed more often than this are bounded by their boxes: cheap for forests, exact for rooms.
_EXACT_USES = 4
# How far a volume reaches beyond objects that stand by themselves, as a share of their size.
_MARGIN = 0.5
# A box counts as having no inside if less than this share of it is air, or if from its air nothing is met in these shares of the
# six directions and of those down. It is looked at from a lattice of _LOOKS points along each axis.
_LEAST_AIR, _OPEN, _FLOORLESS, _LOOKS = 0.05, 0.4, 0.3, 7
# The least sides of a volume, as a share of its longest and in metres: a flat scene has a volume as well.
_LEAST_SHARE, _LEAST_SIDE = 0.01, 1e-3
# An object thinner than this share of its longest side is flat.
_FLAT = 0.02
# What an object's reach is compared with is at least this share of the others' longest side along every axis, for they may be flat.
_REST_SHARE = 0.1
# Probes along an axis, and how many sizes of cells are tried between the two; what unevenness of a cell's sides weighs against
# a number of probes that is off.
_FEWEST_ALONG, _MOST_ALONG, _CELL_SIZES, _UNEVEN = 2, 128, 400, 0.5
_DOWN = 5
_SIDES = np.concatenate([np.eye(3), -np.eye(3)]).astype(np.float32)


def fit_volume(scene: Scene) -> ProbeVolume:
    """A volume around the scene's geometry: between 64 and 4,096 probes in near-cubic cells.

    Ground planes and sky domes are not followed to their edges: see ``fit_bounds``; bare ground gets some of the air above it.
    A scene without an inside (an object by itself, which fills its own box) is lit from around: there the volume reaches outwards
    by half its size. Cell-centred samples keep half a cell from the box's sides, so none lies on an outer wall. Raises BakeError
    where there is no geometry to fit to.
    """
    boxes = _world_boxes(scene.meshes, scene.instances)
    if not len(boxes):
        raise BakeError(f"scene {scene.name!r} has no Light Probe Volume and no visible geometry to fit one to",
                        "add a mesh or a Light Probe Volume, and check that it is not hidden from render")
    low, high = fit_bounds(boxes)
    reach = float(np.max(high[:2] - low[:2]))
    if high[2] - low[2] < _AIR * reach:
        high = high + np.array([0.0, 0.0, _AIR * reach])
    elif not _has_inside(scene, low, high):
        margin = _MARGIN * float(np.max(high - low))
        low, high = low - margin, high + margin
    size = np.maximum(high - low, max(_LEAST_SHARE * float(np.max(high - low)), _LEAST_SIDE))
    world_from_local = np.diag([*(size / 2.0), 1.0])
    world_from_local[:3, 3] = (low + high) / 2.0
    return ProbeVolume("fitted", world_from_local, fit_resolution(size), fitted=True)


def worth_filling(scene: Scene) -> tuple[np.ndarray, np.ndarray]:
    """``fit_bounds`` of the instances of ``scene``, which has some that are finite."""
    return fit_bounds(_world_boxes(scene.meshes, scene.instances))


def bounds_of(meshes, instances, points=(), volumes=()) -> np.ndarray | None:
    """World bounds (2, 3) of where a scene takes place: what ``fit_bounds`` finds of its geometry, ``points`` (3,) such as where
    its cameras are, and its probe ``volumes``. None where there is none of them."""
    boxes = _world_boxes(meshes, instances)
    corners = [*(fit_bounds(boxes) if len(boxes) else ()), *points,
               *(corner for volume in volumes for corner in box_corners(volume.world_from_local))]
    return np.stack([np.min(corners, axis=0), np.max(corners, axis=0)]).astype(np.float64) if corners else None


def fit_bounds(boxes: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """World bounds (3,), (3,) of what is worth filling with probes, from each instance's world box: ``boxes`` (n, 2, 3).

    The largest object is set aside, again and again, while it is a flat one that reaches more than four times as far as all
    the others together (a ground plane), or any that reaches fifty times as far (a sky dome, a landscape). A room is neither:
    its walls reach as far as its floor. Around the others a margin of half their size remains, within the bounds of everything.
    """
    everything = boxes[:, 0].min(axis=0), boxes[:, 1].max(axis=0)
    kept = boxes[np.argsort(-np.linalg.norm(boxes[:, 1] - boxes[:, 0], axis=1), kind="stable")]
    dropped = 0
    # Suffix bounds: what all smaller objects span together.
    lows = np.minimum.accumulate(kept[::-1, 0], axis=0)[::-1]
    highs = np.maximum.accumulate(kept[::-1, 1], axis=0)[::-1]
    while dropped + 1 < len(kept):
        extent = kept[dropped, 1] - kept[dropped, 0]
        rest = highs[dropped + 1] - lows[dropped + 1]
        reach = np.max(extent / np.maximum(rest, max(_REST_SHARE * rest.max(), 1e-6)))
        is_flat = extent.min() < _FLAT * extent.max()
        if not (reach > _DOME_REACH or (is_flat and reach > _GROUND_REACH)):
            break
        dropped += 1
    if not dropped:
        return everything
    low, high = lows[dropped], highs[dropped]
    margin = _MARGIN * float(np.max(high - low))
    return np.maximum(low - margin, everything[0]), np.minimum(high + margin, everything[1])


def fit_resolution(size) -> tuple[int, int, int]:
    """Probes along each axis of a box of ``size`` (3,): near-cubic cells, at least 2 each, 64 to 4,096 in all, about 1,024."""
    size = np.asarray(size, np.float64)
    best = None
    for cell in np.geomspace(size.max() / _MOST_ALONG, size.max() / _FEWEST_ALONG, _CELL_SIZES):
        resolution = np.clip(np.round(size / cell), _FEWEST_ALONG, _MOST_ALONG).astype(int)
        count = int(np.prod(resolution))
        if not FEWEST_PROBES <= count <= MOST_PROBES:
            continue
        cells = size / resolution
        unevenness = float(np.log(cells.max() / cells.min()))
        cost = abs(np.log(count / _TARGET_PROBES)) + _UNEVEN * unevenness
        if best is None or cost < best[0]:
            best = cost, resolution
    return tuple(int(n) for n in best[1])


def describe(volume: ProbeVolume) -> str:
    """The note for the user about a fitted volume."""
    size = 2.0 * np.diag(volume.world_from_local)[:3]
    nx, ny, nz = volume.resolution
    return (f"no Light Probe Volume in the scene: one of {size[0]:.3g} × {size[1]:.3g} × {size[2]:.3g} m with "
            f"{nx} × {ny} × {nz} = {nx * ny * nz} probes was fitted to it")


def _has_inside(scene: Scene, low: np.ndarray, high: np.ndarray) -> bool:
    """Whether there is air in the box ``low`` to ``high`` that something encloses, or that stands on a floor: False where almost
    everything in it is matter, and where rays from the rest leave the scene to most sides and downwards.

    Matter is the inside of solids (``Solids``), and of shells with holes that are seen from behind nearly all around, unless a lamp
    or a camera in the box says that it is for looking at from within.
    """
    scene = _finite_part(scene)
    if not scene.instances:
        return True
    geometry = flatten(scene)
    surfaces = Surfaces(scene, geometry)
    tracer, solids = make_tracer(geometry, surfaces, None), Solids(scene, geometry, surfaces)
    at = (np.indices((_LOOKS,) * 3).reshape(3, -1).T + 0.5) / _LOOKS
    origins = np.repeat((low + at * (high - low)).astype(np.float32), len(_SIDES), axis=0)
    directions = np.tile(_SIDES, (len(at), 1))
    hits = tracer.intersect(origins, directions)
    leaves = (hits.primitive < 0).reshape(-1, len(_SIDES))
    back = np.flatnonzero(hits.primitive >= 0)
    back = back[dot(geometry.normals_world[hits.primitive[back]], directions[back]) > 0]
    behind, inside = np.zeros((2, len(directions)), bool)
    behind[back] = True
    inside[back] = solids.is_solid(hits.primitive[back])
    air = ~inside.reshape(leaves.shape).any(axis=1)
    if not _is_looked_into(scene, low, high):
        air &= behind.reshape(leaves.shape).sum(axis=1) < len(_SIDES) - 1
    if air.mean() < _LEAST_AIR:
        return False
    share = leaves[air].mean(axis=0)
    return bool(share.mean() < _OPEN or share[_DOWN] < _FLOORLESS)


def _is_looked_into(scene: Scene, low: np.ndarray, high: np.ndarray) -> bool:
    """True if a lamp or a camera is in the box."""
    points = [light.position_world for light in scene.lights if hasattr(light, "position_world")]
    points += [np.asarray(camera.world_from_camera)[:3, 3] for camera in scene.cameras]
    return any(np.all((point > low) & (point < high)) for point in points)


def _finite_part(scene: Scene) -> Scene:
    """``scene`` without the instances whose vertices or matrices are not finite, and without those of empty meshes."""
    good = [len(mesh.triangles) > 0 and bool(np.isfinite(mesh.vertices_local).all()) for mesh in scene.meshes]
    kept = tuple(instance for instance in scene.instances if good[instance.mesh] and np.isfinite(instance.world_from_local).all())
    return replace(scene, instances=kept)


def _world_boxes(meshes, instances) -> np.ndarray:
    """World-space boxes (n, 2, 3) of all instances, without vertices and matrices that are not finite."""
    uses = np.bincount([instance.mesh for instance in instances], minlength=len(meshes))
    points_of, boxes = {}, []
    for instance in instances:
        if instance.mesh not in points_of:
            points_of[instance.mesh] = _outline(meshes[instance.mesh].vertices_local, exact=uses[instance.mesh] <= _EXACT_USES)
        points = points_of[instance.mesh]
        if len(points) and np.isfinite(instance.world_from_local).all():
            boxes.append(_box(instance.world_from_local, points))
    return np.array(boxes).reshape(-1, 2, 3)


def _box(world_from_local, points) -> tuple[np.ndarray, np.ndarray]:
    """Lowest and highest corner (3,) in the world of ``points`` (n, 3), at least one."""
    parts = np.array([extent(transform_points(world_from_local, points[rows])) for rows in blocks(len(points))])
    return parts[:, 0].min(axis=0), parts[:, 1].max(axis=0)


def _outline(vertices, exact):
    """Points (n, 3) whose world bounds are the mesh's (``exact``), or at least contain it: its local box's corners."""
    if not np.isfinite(vertices).all():
        vertices = vertices[np.isfinite(vertices).all(axis=1)]
    if exact or not len(vertices):
        return vertices
    low, high = extent(vertices)
    return np.array([[(low, high)[i >> k & 1][k] for k in range(3)] for i in range(8)], np.float64)
