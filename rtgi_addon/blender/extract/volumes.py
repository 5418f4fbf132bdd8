"""Probe volumes: Blender's own Light Probe Volume objects, or one fitted to a scene that has none."""

import numpy as np

from ...errors import BakeError, UsageError
from ...scene import ProbeVolume

# A fitted lattice keeps to these counts: enough to see light vary, few enough to bake while one waits.
FEWEST_PROBES, MOST_PROBES = 64, 4096
_TARGET_PROBES = 1024
# How much further than everything else a flat object, or any object, reaches before the fit ignores it.
_GROUND_REACH, _DOME_REACH = 4.0, 50.0
# A scene lower than this share of its reach is ground without anything on it: the fit adds as much air above.
_AIR = 0.1
# Meshes placed more often than this are bounded by their boxes: cheap for forests, exact for rooms.
_EXACT_USES = 4


def is_volume(obj) -> bool:
    """True for a Light Probe Volume object (data type 'VOLUME', 'GRID' in older files)."""
    return obj.type == "LIGHT_PROBE" and obj.data.type in {"VOLUME", "GRID"}


def read_volume(obj, matrix_world) -> ProbeVolume:
    """An evaluated Light Probe Volume as ``ProbeVolume``. ``settings``: what the data's ``rtgi`` property group overrides."""
    probe = obj.data
    overrides = getattr(getattr(probe.original, "rtgi", None), "overrides", None)
    return ProbeVolume(obj.name, np.array(matrix_world, np.float64),
                       (probe.resolution_x, probe.resolution_y, probe.resolution_z),
                       settings=dict(overrides()) if callable(overrides) else {})


def select_volumes(found: list[ProbeVolume], names: list[str] | None) -> list[ProbeVolume]:
    """The volumes called ``names`` in that order (None = all). Raises UsageError with the known names."""
    if not names:
        return found
    by_name = {volume.name: volume for volume in found}
    for name in names:
        if name not in by_name:
            known = f"choose one of {', '.join(by_name)}" if by_name else "the file has no visible Light Probe Volume: add one"
            raise UsageError(f"unknown probe volume {name!r}", known)
    return [by_name[name] for name in dict.fromkeys(names)]


def fit_volume(meshes, instances, scene_name: str) -> ProbeVolume:
    """A volume around the scene's geometry: between 64 and 4,096 probes in near-cubic cells.

    Ground planes and sky domes are not followed to their edges: see ``fit_bounds``; bare ground gets some of the air above it.
    Cell-centred samples keep half a cell from the box's sides, so none lies on an outer wall. Raises BakeError where there is no
    geometry to fit to.
    """
    boxes = _world_boxes(meshes, instances)
    if not len(boxes):
        raise BakeError(f"scene {scene_name!r} has no Light Probe Volume and no visible geometry to fit one to",
                        "add a mesh or a Light Probe Volume, and check that it is not hidden from render")
    low, high = fit_bounds(boxes)
    reach = float(np.max(high[:2] - low[:2]))
    if high[2] - low[2] < _AIR * reach:
        high = high + np.array([0.0, 0.0, _AIR * reach])
    size = np.maximum(high - low, max(0.01 * float(np.max(high - low)), 1e-3))
    world_from_local = np.diag([*(size / 2.0), 1.0])
    world_from_local[:3, 3] = (low + high) / 2.0
    return ProbeVolume("fitted", world_from_local, fit_resolution(size), fitted=True)


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
        reach = np.max(extent / np.maximum(rest, max(0.1 * rest.max(), 1e-6)))
        is_flat = extent.min() < 0.02 * extent.max()
        if not (reach > _DOME_REACH or (is_flat and reach > _GROUND_REACH)):
            break
        dropped += 1
    if not dropped:
        return everything
    low, high = lows[dropped], highs[dropped]
    margin = 0.5 * float(np.max(high - low))
    return np.maximum(low - margin, everything[0]), np.minimum(high + margin, everything[1])


def fit_resolution(size) -> tuple[int, int, int]:
    """Probes along each axis of a box of ``size`` (3,): near-cubic cells, at least 2 each, 64 to 4,096 in all, about 1,024."""
    size = np.asarray(size, np.float64)
    best = None
    for cell in np.geomspace(size.max() / 128.0, size.max() / 2.0, 400):
        resolution = np.clip(np.round(size / cell), 2, 128).astype(int)
        count = int(np.prod(resolution))
        if not FEWEST_PROBES <= count <= MOST_PROBES:
            continue
        cells = size / resolution
        unevenness = float(np.log(cells.max() / cells.min()))
        cost = abs(np.log(count / _TARGET_PROBES)) + 0.5 * unevenness
        if best is None or cost < best[0]:
            best = cost, resolution
    return tuple(int(n) for n in best[1])


def describe(volume: ProbeVolume) -> str:
    """The note for the user about a fitted volume."""
    size = 2.0 * np.diag(volume.world_from_local)[:3]
    nx, ny, nz = volume.resolution
    return (f"no Light Probe Volume in the scene: one of {size[0]:.3g} × {size[1]:.3g} × {size[2]:.3g} m with "
            f"{nx} × {ny} × {nz} = {nx * ny * nz} probes was fitted to it")


def _world_boxes(meshes, instances) -> np.ndarray:
    """World-space boxes (n, 2, 3) of all instances, without vertices and matrices that are not finite."""
    uses = np.bincount([instance.mesh for instance in instances], minlength=len(meshes))
    points_of, boxes = {}, []
    for instance in instances:
        if instance.mesh not in points_of:
            points_of[instance.mesh] = _outline(meshes[instance.mesh].vertices_local, exact=uses[instance.mesh] <= _EXACT_USES)
        points = points_of[instance.mesh]
        if len(points) and np.isfinite(instance.world_from_local).all():
            world = points @ instance.world_from_local[:3, :3].T + instance.world_from_local[:3, 3]
            boxes.append((world.min(axis=0), world.max(axis=0)))
    return np.array(boxes).reshape(-1, 2, 3)


def _outline(vertices, exact):
    """Points (n, 3) whose world bounds are the mesh's (``exact``), or at least contain it: its local box's corners."""
    vertices = vertices[np.isfinite(vertices).all(axis=1)]
    if exact or not len(vertices):
        return vertices
    low, high = vertices.min(axis=0), vertices.max(axis=0)
    return np.array([[(low, high)[i >> k & 1][k] for k in range(3)] for i in range(8)], np.float64)
