"""Blender's own lines, by its Line Art modifier, as points of a picture; and how well others agree. Needs the bpy module."""

import bpy
import numpy as np

# Points along a stroke lie this far apart [pixels].
_SPACING = 0.5


def line_art(view, size, crease=45.0, materials=True):
    """(n, 2) points [pixels from the lower left corner] along the lines that Line Art sees in the open scene through its camera,
    which is ``view``: contours, creases of more than ``crease`` degrees, intersections, borders of materials, marked edges."""
    scene = bpy.context.scene
    scene.render.resolution_x, scene.render.resolution_y = size
    bpy.ops.object.grease_pencil_add(type="LINEART_SCENE")
    drawn = bpy.context.object
    modifier = drawn.modifiers[0]
    modifier.crease_threshold = np.radians(180.0 - crease)
    for kind in ("contour", "crease", "intersection", "edge_mark", "crease_on_sharp"):
        setattr(modifier, f"use_{kind}", True)
    modifier.use_material, modifier.use_loose = materials, False
    modifier.overscan, modifier.chaining_image_threshold, modifier.smooth_tolerance = 0.0, 0.0, 0.0
    graph = bpy.context.evaluated_depsgraph_get()
    found = [np.zeros((0, 2))]
    for layer in drawn.evaluated_get(graph).data.layers:
        for frame in layer.frames:
            for stroke in frame.drawing.strokes:
                points = np.array([tuple(drawn.matrix_world @ point.position) for point in stroke.points])
                place, w = view.project(points)
                if np.all(w > 0):
                    found += [_dense(one, other) for one, other in zip(place[:-1] * size, place[1:] * size, strict=True)]
    bpy.data.objects.remove(drawn)
    points = np.concatenate(found)
    return points[np.all((points > 0) & (points < size), axis=1)]


def _dense(one, other):
    count = max(int(np.ceil(np.hypot(*(other - one)) / _SPACING)), 1)
    return one + (other - one) * np.linspace(0, 1, count, endpoint=False)[:, None]


def border_points(borders):
    """(n, 2) points in the middle of each line between two pixels that `find_borders` found."""
    right, above = (np.nonzero(part.half_width)[::-1] for part in borders)
    return np.concatenate([np.stack(right, axis=1) + np.array([1.0, 0.5]), np.stack(above, axis=1) + np.array([0.5, 1.0])])


def near_ones(points, others, reach):
    """Which (n,) of ``points`` (n, 2) one of ``others`` (m, 2) is within ``reach`` pixels of."""
    near = np.zeros(len(points), bool)
    cells = {}
    for index, cell in enumerate(map(tuple, np.floor(others / reach).astype(int))):
        cells.setdefault(cell, []).append(index)
    for row, (point, cell) in enumerate(zip(points, np.floor(points / reach).astype(int), strict=True)):
        around = [index for dy in (-1, 0, 1) for dx in (-1, 0, 1) for index in cells.get((cell[0] + dx, cell[1] + dy), ())]
        near[row] = bool(around) and np.min(np.sum((others[around] - point) ** 2, axis=1)) <= reach**2
    return near
