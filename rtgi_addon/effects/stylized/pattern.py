"""Stipple and strokes for darkness, anchored to objects: they stay where they are on a surface, whatever moves.

A surface has coordinates in metres in its object's axes, on the plane of the two axes that its normal is least along. Their scale
is a power of two metres that keeps dots and strokes near the spacing asked for on screen, and the next power fades in before it
takes over. Ordered dots after B. Bayer, "An Optimum Method for Two-Level Rendition of Continuous-Tone Pictures", 1973.
"""

import numpy as np

from ...scene import Scene
from ...transport.vectors import dot
from ..frame import Frame
from .tone import smooth_step

_SIDE = 8


def bayer() -> np.ndarray:
    """(8, 8) float32 thresholds in (0, 1), each 64th once: [i, j] by the bits of i and j."""
    i, j = np.indices((_SIDE, _SIDE))
    order = sum((2 * ((i ^ j) >> bit & 1) + (i >> bit & 1)) << 2 * (2 - bit) for bit in range(3))
    return ((order + 0.5) / _SIDE**2).astype(np.float32)


def anchors(scene: Scene) -> np.ndarray:
    """(n, 4, 3) float32 of the scene's instances: the object's axes as rows, unit, and where it is. Axes that are no frame (an
    object scaled to nothing) are the world's."""
    result = np.empty((len(scene.instances), 4, 3), np.float32)
    for row, instance in enumerate(scene.instances):
        matrix = np.asarray(instance.world_from_local, np.float64)
        axes = matrix[:3, :3].T
        length = np.linalg.norm(axes, axis=1)
        result[row, :3] = axes / length[:, None] if np.all(length > 1e-12) else np.eye(3)
        result[row, 3] = matrix[:3, 3]
    return result


def ink(frame: Frame, values: dict, darkness: np.ndarray) -> np.ndarray:
    """How much of each of the n pixels in ``frame.gbuffer.seen`` is ink for ``darkness`` (n,) in [0, 1]."""
    seen = frame.gbuffer.seen
    u, v = surface_coordinates(frame, values["anchors"])
    footprint = frame.footprint[seen]
    level = np.log2(np.maximum(footprint * np.float32(values["pattern_spacing"]), np.float32(1e-12)))
    octave = np.floor(level)
    cell, next_share = np.exp2(octave), smooth_step(2 * (level - octave) - 1)
    draw = _dots if values["pattern"] == 1 else _strokes
    result = draw(u, v, cell, footprint, darkness)
    fading = np.flatnonzero(next_share > 0)
    coarse = draw(u[fading], v[fading], 2 * cell[fading], footprint[fading], darkness[fading])
    result[fading] += (coarse - result[fading]) * next_share[fading]
    return result


def surface_coordinates(frame: Frame, anchored: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Coordinates u, v (n,) [m] in their objects' axes of the n pixels in ``frame.gbuffer.seen``."""
    gbuffer, seen = frame.gbuffer, frame.gbuffer.seen
    place = anchored[gbuffer.instance[seen]]
    offset = gbuffer.position[seen][:, :3] - place[:, 3]
    local = np.stack([dot(place[:, axis], offset) for axis in range(3)], axis=1)
    normal = np.abs(np.stack([dot(place[:, axis], gbuffer.geometry[seen][:, :3]) for axis in range(3)], axis=1))
    # Ties go to the later axis: floors and walls along the axes have none.
    along_x = (normal[:, 0] > normal[:, 1]) & (normal[:, 0] > normal[:, 2])
    along_y = ~along_x & (normal[:, 1] > normal[:, 2])
    return np.where(along_x, local[:, 1], local[:, 0]), np.where(along_x | along_y, local[:, 2], local[:, 1])


def _dots(u, v, cell, _footprint, darkness) -> np.ndarray:
    column, row = (np.floor(place / cell).astype(np.int64) % _SIDE for place in (u, v))
    return (darkness > bayer()[row, column]).astype(np.float32)


def _strokes(u, v, cell, footprint, darkness) -> np.ndarray:
    """One family of strokes as wide as half the darkness asks for, then a second across it: together they cover ``darkness``."""
    scale, blur = np.float32(np.sqrt(0.5)) / cell, footprint / cell

    def family(place, width):
        off = np.abs(place - np.floor(place) - np.float32(0.5))
        return np.clip((0.5 * width - off) / np.maximum(blur, np.float32(1e-6)) + 0.5, 0.0, 1.0) * (width > 0)

    first = family((u + v) * scale, np.minimum(darkness, np.float32(0.5)))
    second = family((u - v) * scale, np.clip(2 * darkness - 1, 0.0, 1.0))
    return (1 - (1 - first) * (1 - second)).astype(np.float32)
