"""Lines along edges that were marked by hand, wherever nothing stands in front of them.

Edges become segments of the picture, clipped and in perspective; every pixel near one has a distance to it. One is seen where, by
the G-buffer, something at its own depth or beyond is seen within a pixel: an edge lies on surfaces, and at a contour only on one
side.
"""

from typing import NamedTuple

import numpy as np

from ...numerics.grid import transform_points
from ...scene import Mesh, Scene
from ...transport.views.camera import CameraView
from ..frame import Frame
from .edges import line_widths
from .shading import left_by_media

# How far behind a surface an edge counts as on it: metres a metre of depth.
TOLERANCE = 2e-3


class Segments(NamedTuple):
    """Marked edges in a picture: ``ends`` (n, 4) x, y of both [pixels from the lower left corner], ``depths`` (n, 2) along the view
    [m], ``half_width`` (n,) [pixels] and the ``material`` (n,) whose lines they are."""

    ends: np.ndarray
    depths: np.ndarray
    half_width: np.ndarray
    material: np.ndarray


def has_marked(scene: Scene) -> bool:
    """Whether any mesh that is placed in ``scene`` has marked edges."""
    return any(scene.meshes[item.mesh].marked_edges is not None for item in scene.instances)


def segments(scene: Scene, view: CameraView, size: tuple[int, int], offset, values: dict) -> Segments:
    """The marked edges of ``scene`` in a picture of ``size`` (width, height) pixels seen by ``view``, shifted by ``offset``."""
    points, materials = [np.zeros((0, 2, 3))], [np.zeros(0, np.int64)]
    for instance, left_out in zip(scene.instances, values["instance_excluded"], strict=False):
        mesh = scene.meshes[instance.mesh]
        if mesh.marked_edges is None or left_out or not instance.visible_camera:
            continue
        ends_local = mesh.vertices_local[mesh.marked_edges].reshape(-1, 3)
        points.append(transform_points(np.asarray(instance.world_from_local, np.float64), ends_local).reshape(-1, 2, 3))
        own = edge_materials(mesh)
        override = instance.material_override or {}
        materials.append(np.array([override.get(int(index), int(index)) for index in own], np.int64))
    ends, material = np.concatenate(points), np.concatenate(materials)
    kept = ~values["material_excluded"][material] if len(material) else np.zeros(0, bool)
    ends, material = _in_front(ends[kept], view), material[kept]
    ends, material = ends[0], material[ends[1]]
    place, _ = view.project(ends.reshape(-1, 3), size, offset)
    place = (place * size).reshape(-1, 4)
    depth = ((ends - view.position) @ view.forward).astype(np.float32)
    margin = 0.5 * values["line_widest"] + 1.0
    low, high = np.minimum(place[:, :2], place[:, 2:]), np.maximum(place[:, :2], place[:, 2:])
    near = np.all((high > -margin) & (low < np.array(size) + margin), axis=1)
    place, depth, material = place[near].astype(np.float32), depth[near], material[near]
    middle = depth.mean(axis=1)
    width = np.float32(2.0 / (abs(view.clip_from_camera[0, 0]) * size[0]))
    footprint = np.full_like(middle, width) if view.orthographic else middle * width
    return Segments(place, depth, 0.5 * line_widths(middle, footprint, values), material.astype(np.int32))


def edge_materials(mesh: Mesh) -> np.ndarray:
    """(e,) index of the material of a triangle at each of ``mesh.marked_edges``, 0 for an edge without a face."""
    count = len(mesh.vertices_local)
    result = np.zeros(len(mesh.marked_edges), np.int64)
    if not len(mesh.triangles):
        return result
    sides = np.sort(np.concatenate([mesh.triangles[:, [0, 1]], mesh.triangles[:, [1, 2]], mesh.triangles[:, [2, 0]]]), axis=1)
    keys = sides[:, 0].astype(np.int64) * count + sides[:, 1]
    order = np.argsort(keys, kind="stable")
    marked = np.sort(mesh.marked_edges, axis=1)
    wanted = marked[:, 0].astype(np.int64) * count + marked[:, 1]
    found = np.minimum(np.searchsorted(keys[order], wanted), len(order) - 1)
    has_face = keys[order][found] == wanted
    result[has_face] = np.tile(mesh.triangle_material, 3)[order[found[has_face]]]
    return result


def draw_marked(frame: Frame, found: Segments) -> tuple[np.ndarray, np.ndarray]:
    """How far (h, w) each pixel is inside the marked line that it is deepest in, below −1/2 for none, and that line's material."""
    width, height = frame.size
    inside, material = np.full(height * width, -1.0, np.float32), np.zeros(height * width, np.int32)
    segment, pixel = _candidates(found, (width, height))
    if segment.size:
        depth_in, visible = _inside(frame, found, segment, pixel)
        rows = np.flatnonzero(visible & (depth_in > -0.5))
        rows = rows[np.argsort(depth_in[rows], kind="stable")]
        # The last one written stays: the deepest.
        inside[pixel[rows]], material[pixel[rows]] = depth_in[rows], found.material[segment[rows]]
    return inside.reshape(height, width), material.reshape(height, width)


def _inside(frame: Frame, found: Segments, segment: np.ndarray, pixel: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """How far inside the line ``segment`` (n,) each ``pixel`` (n,) is, and whether the line is seen there: marked.frag.glsl."""
    width, height = frame.size
    centre = np.stack([pixel % width, pixel // width], axis=1).astype(np.float32) + np.float32(0.5)
    start, along = found.ends[segment, :2], found.ends[segment, 2:] - found.ends[segment, :2]
    length = np.maximum(np.sum(along * along, axis=1), np.float32(1e-12))
    share = np.clip(np.sum((centre - start) * along, axis=1) / length, 0.0, 1.0)
    nearest = start + along * share[:, None]
    away = centre - nearest
    distance = np.sqrt(np.sum(away * away, axis=1))
    first, second = found.depths[segment, 0], found.depths[segment, 1]
    if frame.view.orthographic:
        depth = first + (second - first) * share
    else:
        depth = 1 / (1 / first + (1 / second - 1 / first) * share)
    column, row = (np.clip(np.floor(nearest[:, axis]).astype(np.int64), 0, side - 1) for axis, side in ((0, width), (1, height)))
    behind, left = np.full(len(pixel), -np.inf, np.float32), left_by_media(frame)
    left, share_left = (None, 1.0) if left is None else (left.mean(axis=-1), np.zeros(len(pixel), np.float32))
    for dy in (-1, 0, 1):
        for dx in (-1, 0, 1):
            beside = np.clip(row + dy, 0, height - 1), np.clip(column + dx, 0, width - 1)
            behind = np.maximum(behind, frame.depth[beside])
            share_left = share_left if left is None else np.maximum(share_left, left[beside])
    return found.half_width[segment] * share_left - distance, depth <= behind * np.float32(1 + TOLERANCE)


def _in_front(ends: np.ndarray, view: CameraView) -> tuple[np.ndarray, np.ndarray]:
    """``ends`` (n, 2, 3) cut at the near plane, and the rows that anything is left of."""
    near = max(view.depths[0], 1e-6)
    depth = (ends - view.position) @ view.forward
    rows = np.flatnonzero((depth > near).any(axis=1))
    ends, depth = ends[rows].copy(), depth[rows]
    for end, other in ((0, 1), (1, 0)):
        behind = np.flatnonzero(depth[:, end] < near)
        share = (near - depth[behind, end]) / (depth[behind, other] - depth[behind, end])
        ends[behind, end] += (ends[behind, other] - ends[behind, end]) * share[:, None]
    return ends, rows


def _candidates(found: Segments, size: tuple[int, int]) -> tuple[np.ndarray, np.ndarray]:
    """(segment, pixel) pairs, each once, of all pixels that a line may touch: squares about points a pixel apart along it."""
    width, height = size
    if not len(found.ends):
        return np.zeros(0, np.int64), np.zeros(0, np.int64)
    start, along = found.ends[:, :2].astype(np.float64), (found.ends[:, 2:] - found.ends[:, :2]).astype(np.float64)
    first, last = _within(start, along, size, float(found.half_width.max()) + 2)
    steps = np.maximum(np.ceil(np.abs(along).max(axis=1) * (last - first)), 0).astype(np.int64) + 1
    segment = np.repeat(np.arange(len(steps)), steps)
    step = np.arange(len(segment)) - np.repeat(np.cumsum(steps) - steps, steps)
    share = first[segment] + (last - first)[segment] * (step / np.maximum(steps - 1, 1)[segment])
    middle = np.floor(start[segment] + along[segment] * share[:, None]).astype(np.int64)
    reach = int(np.ceil(found.half_width.max())) + 1
    dy, dx = (part.ravel() for part in np.mgrid[-reach:reach + 1, -reach:reach + 1])
    x, y = middle[:, :1] + dx, middle[:, 1:] + dy
    inside = (x >= 0) & (y >= 0) & (x < width) & (y < height)
    pairs = np.unique(np.repeat(segment[:, None], len(dx), axis=1)[inside] * (width * height) + (y * width + x)[inside])
    return pairs // (width * height), pairs % (width * height)


def _within(start, along, size, margin: float) -> tuple[np.ndarray, np.ndarray]:
    """The shares (n,) of lines from ``start`` (n, 2) along ``along`` between which they are in the picture, ``margin`` wider."""
    step = np.where(np.abs(along) > 1e-9, along, 1e-9)
    one, other = (-margin - start) / step, (np.array(size) + margin - start) / step
    first = np.clip(np.minimum(one, other).max(axis=1), 0.0, 1.0)
    return first, np.clip(np.maximum(one, other).min(axis=1), first, 1.0)
