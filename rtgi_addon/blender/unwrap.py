"""A UV map for the light atlas: every object's faces without overlaps, islands far enough apart for its texels."""

import bpy
import numpy as np

from ..effects.atlas.unwrapped import USUAL

# How far islands are apart [texels].
_APART = 2.0
# Faces that meet at a smaller angle [radians] share an island.
_ANGLE = 1.15
# Room between what is projected one way and another: faces about an edge that touch there would be packed as one island.
_BETWEEN = 0.01


def unwrap(context, obj, density: float) -> str:
    """Give the mesh ``obj``, in the view layer of ``context``, a UV map called USUAL (in the place of one that has the name) for an
    atlas of ``density`` texels a metre, and return its name. The map for renders stays as it was. Object mode only."""
    mesh = obj.data
    layers = mesh.uv_layers
    active, for_renders = layers.active_index, next((layer.name for layer in layers if layer.active_render), None)
    layers.active = layers.get(USUAL) or layers.new(name=USUAL)
    shown = context.view_layer.objects.active
    chosen = [other for other in context.view_layer.objects if other.select_get()]
    for other in chosen:
        other.select_set(False)
    obj.select_set(True)
    context.view_layer.objects.active = obj
    try:
        bpy.ops.object.mode_set(mode="EDIT")
        bpy.ops.mesh.select_all(action="SELECT")
        bpy.ops.uv.smart_project(angle_limit=_ANGLE, island_margin=_BETWEEN)
        bpy.ops.uv.select_all(action="SELECT")
        bpy.ops.uv.average_islands_scale()
        # What is added is scaled with the islands: so many texels, whatever room there is. For a share of the map's width, as
        # Blender has it too, it searches, and does not end where that is large.
        bpy.ops.object.mode_set(mode="OBJECT")
        margin = _APART / density * _per_metre(obj)
        bpy.ops.object.mode_set(mode="EDIT")
        bpy.ops.uv.pack_islands(margin_method="ADD", margin=margin, rotate=False)
    finally:
        bpy.ops.object.mode_set(mode="OBJECT")
        obj.select_set(False)
        for other in chosen:
            other.select_set(True)
        context.view_layer.objects.active = shown
    layers = obj.data.uv_layers
    if for_renders is not None:
        layers[for_renders].active_render, layers.active_index = True, active
    return USUAL


def _per_metre(obj) -> float:
    """How long a metre of the surface of ``obj``, in object mode, is on its active UV map."""
    mesh = obj.data
    mesh.calc_loop_triangles()
    corners, uv, area = np.empty(3 * len(mesh.loop_triangles), np.int32), np.empty(2 * len(mesh.loops), np.float32), np.empty(
        len(mesh.loop_triangles), np.float32)
    mesh.loop_triangles.foreach_get("loops", corners)
    mesh.loop_triangles.foreach_get("area", area)
    mesh.uv_layers.active.uv.foreach_get("vector", uv)
    uv = uv.astype(np.float64).reshape(-1, 2)[corners.reshape(-1, 3)]
    first, second = uv[:, 1] - uv[:, 0], uv[:, 2] - uv[:, 0]
    covered = 0.5 * np.abs(first[:, 0] * second[:, 1] - first[:, 1] * second[:, 0]).sum()
    world = float(area.sum()) * abs(obj.matrix_world.to_3x3().determinant()) ** (2 / 3)
    return float(np.sqrt(covered / max(world, 1e-12)))
