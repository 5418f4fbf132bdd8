"""Mirrored rays as lines on the screen: where they are is linear there, and so are depth and all else over clip w (McGuire and Mara
2014, "Efficient GPU Screen-Space Ray Tracing")."""

from dataclasses import dataclass, fields

import numpy as np

from ...numerics.sampling import hash_u32, sobol_owen, unit_interval, wrapped
from ...transport.vectors import dot
from ..frame import Frame

# Numbers of a picture's rays; every pixel shifts them by a hash of where it is.
_SEED = 0x55E7
# Rays towards the eye end so much before the near plane.
_BEFORE_NEAR = 0.999


@dataclass(frozen=True, eq=False)
class ScreenRays:
    """Rays from s = 0 to 1: ``origins`` and ``along`` (n, 2) [pixels], at both ends ``depths`` over clip w and ``inverse`` clip w
    (n, 2), lengths ``reach`` (n,) [m], and where they leave the picture, ``end`` (n,) ≤ 1; 0 for those that do not move in it."""

    origins: np.ndarray
    along: np.ndarray
    depths: np.ndarray
    inverse: np.ndarray
    reach: np.ndarray
    end: np.ndarray

    def take(self, rows: np.ndarray) -> "ScreenRays":
        """Some of the rays."""
        return ScreenRays(*(getattr(self, item.name)[rows] for item in fields(self)))

    def depth(self, s: np.ndarray) -> np.ndarray:
        """Depths (n,) [m] along the middle of the view at ``s`` (n,)."""
        (first, last), (one, other) = self.depths.T, self.inverse.T
        return (first + (last - first) * s) / (one + (other - one) * s)

    def at_depth(self, depth: np.ndarray) -> np.ndarray:
        """Where (n,) the rays are ``depth`` (n,) deep; anywhere for rays that keep theirs."""
        (first, last), (one, other) = self.depths.T, self.inverse.T
        slope = last - first - depth * (other - one)
        return (depth * one - first) / np.where(np.abs(slope) > 1e-20, slope, 1e-20)

    def distance(self, s: np.ndarray) -> np.ndarray:
        """Way (n,) [m] that the rays have gone at ``s`` (n,)."""
        one, other = self.inverse.T
        return s * other * self.reach / (one + (other - one) * s)

    def pixels(self, s: np.ndarray) -> np.ndarray:
        """Where (n, 2) they are at ``s`` (n,) [pixels]."""
        return self.origins + self.along * s[:, None]


def screen_rays(frame: Frame, points: np.ndarray, directions: np.ndarray, reach: float) -> ScreenRays:
    """Rays from ``points`` along unit ``directions`` (n, 3), ``reach`` [m] at most, up to the near plane and the picture's edge."""
    view, size = frame.view, np.array(frame.size, np.float64)
    clip_from_world = view.drawn(frame.size, frame.offset).clip_from_world
    near = view.depths[0]
    start, turn = (points - view.position) @ view.forward, directions @ view.forward
    with np.errstate(divide="ignore", invalid="ignore"):
        length = np.where(turn < 0, np.minimum(reach, (near - start) / turn * _BEFORE_NEAR), reach)
    length = np.maximum(length, 0.0)
    ends, depths, inverse = [], [], []
    for travelled in (np.zeros_like(length), length):
        clip = (points + directions * travelled[:, None]) @ clip_from_world[:, :3].T + clip_from_world[:, 3]
        one = 1.0 / np.maximum(clip[:, 3], 1e-12)
        ends.append((clip[:, :2] * one[:, None] * 0.5 + 0.5) * size)
        depths.append((start + turn * travelled) * one)
        inverse.append(one)
    along = ends[1] - ends[0]
    with np.errstate(divide="ignore", invalid="ignore"):
        border = np.where(along > 0, (size - ends[0]) / along, np.where(along < 0, -ends[0] / along, np.inf))
    end = np.clip(border.min(axis=1), 0.0, 1.0)
    # A ray straight at the eye or away from it stays where it is.
    end = np.where(np.abs(along).max(axis=1) * end < 1.0, 0.0, end)
    return ScreenRays(ends[0], along, np.stack(depths, axis=1), np.stack(inverse, axis=1), length, end)


def pixel_numbers(frame: Frame, ray: int, rays: int) -> np.ndarray:
    """(n, 2) float32 in [0, 1) of the n pixels that show a surface, for ray number ``ray`` of ``rays`` in this sample."""
    row, column = np.nonzero(frame.gbuffer.seen)
    shifts = np.stack([unit_interval(hash_u32(column, row, axis)) for axis in range(2)], axis=1)
    return wrapped(shift_of(frame.index, ray, rays) + shifts)


def shift_of(index: int, ray: int, rays: int) -> np.ndarray:
    """What (2,) float32 all pixels' numbers are shifted by for a ray of sample ``index``."""
    return sobol_owen(1, 2, _SEED, start=index * rays + ray, shuffle=True)[0]


def facing(normals: np.ndarray, directions: np.ndarray) -> np.ndarray:
    """Which (n,) bool surfaces of ``normals`` are met on their front along ``directions`` (n, 3)."""
    return dot(normals, directions) < 0
