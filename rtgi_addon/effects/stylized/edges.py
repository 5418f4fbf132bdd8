"""Where lines are: borders between pixels side by side, or one above the other, and how wide the line on each is.

A step in depth is measured from planes: how far the one pixel's point is from the tangent plane of the other, in pixels at that
distance, so that a floor which runs to the horizon has no line and a scene of twice the size has the same. The second difference
of 1/depth, which is 0 on planes as well, and the two gradients of G. Papaioannou's lecture (2020), e₁ = max(|∂z/∂x|, |∂z/∂y|) and
e₂ = the largest change of a normal's component, are there beside it. Plane distance as in Malt (BNPR).
"""

from typing import NamedTuple

import numpy as np

from ...transport.vectors import dot
from ..frame import Frame
from .curvature import bent, turning
from .shading import left_by_media

# Which way the second of the two pixels lies: one to the right, one above. Row 0 is at the bottom.
AXES = (1, 0)


class Borders(NamedTuple):
    """Lines between each pixel and the next along one axis: half their width (h, w) [pixels], 0 where there is none, and the
    material of the nearer of the two, whose line it is."""

    half_width: np.ndarray
    material: np.ndarray


def find_borders(frame: Frame, values: dict) -> tuple[Borders, Borders]:
    """The lines to the right of and above every pixel."""
    turn = turning(frame) if values["curvature_edges"] else None
    return tuple(_along(frame, values, axis, turn) for axis in AXES)


def _along(frame: Frame, values: dict, axis: int, turn) -> Borders:
    gbuffer = frame.gbuffer
    here, there = _pair(axis)
    seen, instance, material = gbuffer.seen, gbuffer.instance, gbuffer.material
    both = seen[here] & seen[there]
    border = np.zeros_like(both)
    if values["object_edges"]:
        border |= (seen[here] != seen[there]) | (both & (instance[here] != instance[there]))
    if values["material_edges"]:
        border |= both & (material[here] != material[there])
    nearer = frame.depth[here] <= frame.depth[there]
    footprint = np.minimum(frame.footprint[here], frame.footprint[there])
    if values["depth_edges"] < 3:
        border |= depth_step(frame, values["depth_edges"], axis) > np.float32(values["depth_threshold"]) * footprint
    if values["normal_edges"] == 0:
        border |= both & (dot(gbuffer.normal[here][..., :3], gbuffer.normal[there][..., :3]) < np.float32(values["crease_cosine"]))
    elif values["normal_edges"] == 1:
        change = np.abs(gbuffer.normal[here][..., :3] - gbuffer.normal[there][..., :3]).max(axis=-1)
        border |= both & (change > np.float32(values["normal_threshold"]))
    if turn is not None:
        border |= both & bent(turn, instance, values, axis)
    return _with_widths(frame, values, border, here, there, nearer, footprint)


def _with_widths(frame: Frame, values: dict, border, here, there, nearer, footprint) -> Borders:
    gbuffer = frame.gbuffer
    shape = gbuffer.seen.shape
    half, owner = np.zeros(shape, np.float32), np.zeros(shape, np.int32)
    rows = np.nonzero(border)
    if rows[0].size:
        first = nearer[rows]
        instance = np.where(first, gbuffer.instance[here][rows], gbuffer.instance[there][rows])
        material = np.where(first, gbuffer.material[here][rows], gbuffer.material[there][rows])
        depth = np.minimum(frame.depth[here][rows], frame.depth[there][rows])
        wide = 0.5 * line_widths(depth, footprint[rows], values)
        left = left_by_media(frame)
        if left is not None:
            left = left.mean(axis=-1)
            wide *= np.where(first, left[here][rows], left[there][rows])
        wide[values["instance_excluded"][instance] | values["material_excluded"][material]] = 0.0
        half[here][rows], owner[here][rows] = wide, material
    return Borders(half, owner)


def line_widths(depth: np.ndarray, footprint: np.ndarray, values: dict) -> np.ndarray:
    """Width (n,) [pixels] of lines at ``depth`` [m], where a pixel is ``footprint`` wide [m]."""
    width = np.full_like(depth, values["line_width"])
    if values["line_world_width"] > 0:
        width = np.float32(values["line_world_width"]) / np.maximum(footprint, np.float32(1e-12))
    if values["line_thinning"] > 0:
        width = width * np.minimum(np.float32(values["line_thinning"]) / np.maximum(depth, np.float32(1e-12)), 1.0)
    return np.clip(width, values["line_least"], values["line_widest"]).astype(np.float32)


def depth_step(frame: Frame, mode: int, axis: int) -> np.ndarray:
    """How far [m] the surface steps between each pixel and the next along ``axis``, by ``mode`` of DEPTH_EDGES; an array one
    shorter along ``axis``. 0 where one of the two shows nothing."""
    gbuffer = frame.gbuffer
    here, there = _pair(axis)
    both = gbuffer.seen[here] & gbuffer.seen[there]
    if mode == 0:
        way = gbuffer.position[there][..., :3] - gbuffer.position[here][..., :3]
        step = np.maximum(np.abs(dot(gbuffer.geometry[here][..., :3], way)), np.abs(dot(gbuffer.geometry[there][..., :3], way)))
        return np.where(both, step, np.float32(0.0))
    depth = frame.depth
    if mode == 2:
        return np.where(both, np.abs(depth[there] - depth[here]), np.float32(0.0))
    flat = depth if frame.view.orthographic else 1 / depth
    second = _second_difference(flat, gbuffer.seen, axis)
    step = np.minimum(second[here], second[there])
    if not frame.view.orthographic:
        step = step * depth[here] * depth[there]
    # Where neither pixel has two neighbours nothing is known.
    return np.where(both & np.isfinite(step), step, np.float32(0.0))


def _second_difference(values: np.ndarray, seen: np.ndarray, axis: int) -> np.ndarray:
    """|v₋ − 2v + v₊| of every pixel, infinite where a neighbour is missing or shows nothing: there the other pixel decides."""
    result = np.full(values.shape, np.inf, np.float32)
    middle, before, after = _triple(axis)
    found = np.abs(values[before] - 2 * values[middle] + values[after])
    result[middle] = np.where(seen[before] & seen[after], found, np.float32(np.inf))
    return result


def _pair(axis: int) -> tuple[tuple, tuple]:
    here, there = [slice(None)] * 2, [slice(None)] * 2
    here[axis], there[axis] = slice(None, -1), slice(1, None)
    return tuple(here), tuple(there)


def _triple(axis: int) -> tuple[tuple, tuple, tuple]:
    parts = [[slice(None)] * 2 for _ in range(3)]
    for part, span in zip(parts, (slice(1, -1), slice(None, -2), slice(2, None)), strict=True):
        part[axis] = span
    return tuple(tuple(part) for part in parts)
