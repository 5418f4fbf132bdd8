"""A UV map for the light atlas: every object's faces without overlaps, islands far enough apart for its texels, and as large as the
light on them asks for.
"""

from collections.abc import Callable, Iterator
from contextlib import contextmanager

import bpy
import numpy as np

from ..effects.atlas.islands import islands_of
from ..effects.atlas.uneven import shares
from ..effects.atlas.unwrapped import USUAL

# How far islands are apart [texels].
_APART = 2.0
# Faces that meet at a smaller angle [radians] share an island.
_ANGLE = 1.15
# Room between what is projected one way and another: faces about an edge that touch there would be packed as one island.
_BETWEEN = 0.01
# Places on a triangle at which light is asked for, and texels of a map on which corners are the same.
_ASKED, _FINE = 64, 4096.0


def unwrap(context, obj, density: float) -> str:
    """Give the mesh ``obj``, in the view layer of ``context``, a UV map called USUAL (in the place of one that has the name) for an
    atlas of ``density`` texels a metre, and return its name. The map for renders stays as it was. Object mode only."""
    with _alone(context, obj):
        bpy.ops.object.mode_set(mode="EDIT")
        bpy.ops.mesh.select_all(action="SELECT")
        bpy.ops.uv.smart_project(angle_limit=_ANGLE, island_margin=_BETWEEN)
        bpy.ops.uv.select_all(action="SELECT")
        bpy.ops.uv.average_islands_scale()
        bpy.ops.object.mode_set(mode="OBJECT")
        _pack(obj, density)
    return USUAL


def fit_islands(context, obj, density: float, need_at: Callable[[np.ndarray], np.ndarray]) -> None:
    """Make islands of the UV map USUAL of the mesh ``obj`` as large as the light on them asks for, which ``need_at`` tells of
    places (n, 2) of the map, (n,) or NaN, and pack them for an atlas of ``density`` texels a metre. The number of texels stays.
    Object mode only."""
    layer = obj.data.uv_layers.get(USUAL)
    uv, (loops, corners) = _uv_of(layer), _triangles(obj)
    places, areas = uv[loops], _areas(corners)
    island = islands_of(corners, places * _FINE)
    count = int(island.max(initial=-1)) + 1
    # The light at places all over each triangle, the same number on each, so they count by its area.
    sides = np.sqrt((np.arange(_ASKED) + 0.5) / _ASKED)
    turns = (np.arange(_ASKED) * 0.6180339887498949) % 1.0
    inside = np.stack([1.0 - sides, sides * (1.0 - turns), sides * turns], axis=1)
    need = need_at(np.einsum("kc,tcx->tkx", inside, places).reshape(-1, 2)).reshape(len(places), _ASKED).astype(np.float64)
    weight = np.where(np.isfinite(need), areas[:, None], 0.0)
    total = np.bincount(island, np.sum(weight * np.nan_to_num(need), axis=1), minlength=count)
    known = np.bincount(island, weight.sum(axis=1), minlength=count)
    area, on_map = np.bincount(island, areas, minlength=count), np.bincount(island, _areas(places), minlength=count)
    finer = shares(np.where(known > 0, total / np.maximum(known, 1e-30), np.nan), area)
    # Islands that cover nothing, on the map or in space, stay as they are.
    real = (area > 0) & (on_map > 0)
    scale = np.where(real, finer * np.sqrt(np.where(real, area, 1.0) / np.where(real, on_map, 1.0)), 1.0)
    of_loop = np.zeros(len(uv), np.int64)
    of_loop[loops] = island[:, None]
    layer.uv.foreach_set("vector", (uv * scale[of_loop, None]).astype(np.float32).reshape(-1))
    with _alone(context, obj):
        _pack(obj, density)


def _pack(obj, density: float) -> None:
    # What is added is scaled with the islands: so many texels, whatever room there is. For a share of the map's width, as Blender
    # has it too, it searches, and does not end where that is large.
    margin = _APART / density * _per_metre(obj)
    bpy.ops.object.mode_set(mode="EDIT")
    bpy.ops.mesh.select_all(action="SELECT")
    bpy.ops.uv.select_all(action="SELECT")
    bpy.ops.uv.pack_islands(margin_method="ADD", margin=margin, rotate=False)


@contextmanager
def _alone(context, obj) -> Iterator[None]:
    """While it lasts only ``obj`` is selected, and its map USUAL the active one; object mode afterwards."""
    layers = obj.data.uv_layers
    active, for_renders = layers.active_index, next((layer.name for layer in layers if layer.active_render), None)
    layers.active = layers.get(USUAL) or layers.new(name=USUAL)
    shown = context.view_layer.objects.active
    chosen = [other for other in context.view_layer.objects if other.select_get()]
    for other in chosen:
        other.select_set(False)
    obj.select_set(True)
    context.view_layer.objects.active = obj
    try:
        yield
    finally:
        bpy.ops.object.mode_set(mode="OBJECT")
        obj.select_set(False)
        for other in chosen:
            other.select_set(True)
        context.view_layer.objects.active = shown
    layers = obj.data.uv_layers
    if for_renders is not None:
        layers[for_renders].active_render, layers.active_index = True, active


def _per_metre(obj) -> float:
    """How long a metre of the surface of ``obj``, in object mode, is on its active UV map."""
    loops, corners = _triangles(obj)
    return float(np.sqrt(_areas(_uv_of(obj.data.uv_layers.active)[loops]).sum() / max(_areas(corners).sum(), 1e-12)))


def _triangles(obj) -> tuple[np.ndarray, np.ndarray]:
    """The loops (t, 3) of the triangles of ``obj`` and their corners (t, 3, 3) in the world."""
    mesh = obj.data
    mesh.calc_loop_triangles()
    loops, points = np.empty(3 * len(mesh.loop_triangles), np.int32), np.empty(3 * len(mesh.vertices), np.float32)
    vertices = np.empty(3 * len(mesh.loop_triangles), np.int32)
    mesh.loop_triangles.foreach_get("loops", loops)
    mesh.loop_triangles.foreach_get("vertices", vertices)
    mesh.vertices.foreach_get("co", points)
    matrix = np.array(obj.matrix_world, np.float64)
    world = points.reshape(-1, 3).astype(np.float64) @ matrix[:3, :3].T + matrix[:3, 3]
    return loops.reshape(-1, 3), world[vertices.reshape(-1, 3)]


def _uv_of(layer) -> np.ndarray:
    uv = np.empty(2 * len(layer.uv), np.float32)
    layer.uv.foreach_get("vector", uv)
    return uv.astype(np.float64).reshape(-1, 2)


def _areas(corners: np.ndarray) -> np.ndarray:
    """(t,) of triangles with ``corners`` (t, 3, 2 or 3)."""
    first, second = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    squares = np.sum(first**2, axis=1) * np.sum(second**2, axis=1) - np.sum(first * second, axis=1) ** 2
    return 0.5 * np.sqrt(np.maximum(squares, 0.0))
