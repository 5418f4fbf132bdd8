"""A volume that is aligned with the view: columns of a few pixels each, cut into slices that grow with the distance from the eye.

Slices lie between distances along the columns' own rays, so that they are shells about the eye (planes for a parallel projection).
Arrays over the volume are indexed [slice, row, column]. The limit of slice k is start + bend·((1 + (far − start)/bend)^(k/n) − 1):
even near the eye, exponential further away. In every sample of a picture the columns' rays go through other points of their pixels,
and what is in a slice is asked at other points of it, so that the mean over samples shows no slices.

Sources: B. Wronski, "Volumetric Fog: Unified Compute Shader-Based Solution to Atmospheric Scattering", SIGGRAPH 2014; S. Hillaire,
"Physically Based and Unified Volumetric Rendering in Frostbite", SIGGRAPH 2015.
"""

from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np

from ...numerics.grid import box_corners, transform_points
from ...numerics.sampling import hash_u32, sobol_owen, unit_interval
from ...scene import Scene
from ...transport.media.table import Filling
from ...transport.views.camera import CameraView

# How far from the eye slices begin to grow, as a share of what they cover.
BEND = 1.0 / 32.0
# A medium that is everywhere is followed to this optical depth, and to so many times the scene's reach.
DEEP, FURTHER = 7.0, 10.0
# How far about a lamp its light is too narrow for columns, in their width there.
NEAR = 4.0
# Sequences of points within a column's pixels, and of numbers within slices.
_COLUMN_SEED, _SLICE_SEED = 0x6D65, 0x736C


@dataclass(frozen=True)
class Shape:
    """How a view is divided: ``tile`` pixels of a picture of ``size`` (width, height) to a column, ``slices`` from ``start`` to
    ``far`` [m] from the eye."""

    size: tuple[int, int]
    tile: int
    slices: int
    start: float
    far: float

    @property
    def columns(self) -> tuple[int, int]:
        """How many columns there are across and up."""
        return tuple(-(-side // self.tile) for side in self.size)

    @property
    def bend(self) -> float:
        """The distance [m] over which slices are about even."""
        return (self.far - self.start) * BEND

    @cached_property
    def limits(self) -> np.ndarray:
        """Distances (slices + 1,) float32 [m] between which the slices lie."""
        share = np.arange(self.slices + 1) / self.slices
        return (self.start + self.bend * np.expm1(share * np.log1p(1.0 / BEND))).astype(np.float32)

    def slice_of(self, distance: np.ndarray) -> np.ndarray:
        """Where ``distance`` (…) [m] lies among the slices: float32 from 0 to ``slices``, k at limit k."""
        along = np.clip((np.asarray(distance, np.float32) - np.float32(self.start)) / np.float32(self.bend), 0.0, 1.0 / BEND)
        return np.minimum(np.log1p(along) * np.float32(self.slices / np.log1p(1.0 / BEND)), np.float32(self.slices))


def shape_of(scene: Scene, view: CameraView, size: tuple[int, int], tile: int, slices: int, reach: float | None) -> Shape | None:
    """The volume of a picture in which media of ``scene`` are seen, to ``reach`` [m] (None: as far as there is any); None where no
    medium is seen from there."""
    media = [medium for medium in scene.media if medium.visible_camera]
    everywhere = [medium for medium in media if medium.fills_space]
    bounded = [medium_bounds(medium) for medium in media if not medium.fills_space]
    boxes = bounded + ([scene_bounds(scene)] if everywhere else [])
    if not boxes:
        return None
    spans = np.array([_distances(view, box) for box in boxes])
    start, far = 0.0 if everywhere else float(spans[:, 0].min()), float(spans[:, 1].max())
    if everywhere:
        extinction = sum(np.asarray(medium.extinction) for medium in everywhere)
        thinnest = float(extinction[extinction > 0].min(initial=np.inf))
        far = max(far, min(DEEP / thinnest, FURTHER * far))
    if reach is not None:
        far = min(far, reach)
    return Shape(tuple(size), tile, slices, start, far) if far > start else None


def medium_bounds(medium) -> np.ndarray:
    """Lowest and highest corner (2, 3) float64 of a box around a medium that is not everywhere."""
    boxes = []
    if medium.bounds is not None:
        points = transform_points(medium.bounds.world_from_local, medium.bounds.vertices_local)
        boxes.append([points.min(axis=0), points.max(axis=0)])
    if medium.grid is not None:
        corners = box_corners(medium.grid.world_from_local)
        boxes.append([corners.min(axis=0), corners.max(axis=0)])
    low, high = np.max([box[0] for box in boxes], axis=0), np.min([box[1] for box in boxes], axis=0)
    return np.array([low, np.maximum(low, high)])


def scene_bounds(scene: Scene) -> np.ndarray:
    """Lowest and highest corner (2, 3) float64 of boxes around all instances; a point where there are none."""
    corners = []
    for instance in scene.instances:
        vertices = scene.meshes[instance.mesh].vertices_local
        if len(vertices):
            ends = np.array([vertices.min(axis=0), vertices.max(axis=0)], np.float64)
            corners.append(transform_points(instance.world_from_local, np.stack(np.meshgrid(*ends.T), axis=-1).reshape(-1, 3)))
    points = np.concatenate(corners or [np.zeros((1, 3))])
    return np.array([points.min(axis=0), points.max(axis=0)])


def _distances(view: CameraView, box: np.ndarray) -> tuple[float, float]:
    """How near and far [m] from the eye a box (2, 3) reaches; for a parallel projection, along it."""
    if view.orthographic:
        corners = np.stack(np.meshgrid(*box.T), axis=-1).reshape(-1, 3)
        depth = (corners - view.position) @ view.forward
        return max(float(depth.min()), 0.0), max(float(depth.max()), 1e-6)
    outside = np.maximum(np.maximum(box[0] - view.position, view.position - box[1]), 0.0)
    furthest = np.maximum(np.abs(box[0] - view.position), np.abs(box[1] - view.position))
    return float(np.linalg.norm(outside)), max(float(np.linalg.norm(furthest)), 1e-6)


@dataclass(frozen=True, eq=False)
class Columns:
    """The rays of one sample's columns: ``origins`` and unit ``directions`` (n, 3) float64, row by row, through the point
    ``jitter`` (2,) in [0, 1)² of each column's pixels; distances along them are from the eye."""

    shape: Shape
    origins: np.ndarray
    directions: np.ndarray
    jitter: np.ndarray

    @staticmethod
    def of(shape: Shape, view: CameraView, index: int, offset) -> "Columns":
        """Those of sample number ``index``, whose pixels are shifted by ``offset`` (2,) pixels."""
        jitter = sobol_owen(1, 2, _COLUMN_SEED, start=index, shuffle=True)[0]
        across, up = shape.columns
        x, y = ((np.arange(count) + jitter[axis]) * shape.tile / shape.size[axis] for axis, count in enumerate((across, up)))
        x, y = (part.ravel() for part in np.meshgrid(x, y))
        near, directions, _ = view.through(x, y, shape.size, offset)
        if view.orthographic:
            origins = near - directions * view.depths[0]
        else:
            origins = np.broadcast_to(view.position, near.shape)
        return Columns(shape, origins, directions, jitter)


class Near(NamedTuple):
    """A lamp whose light is narrower than columns show about its ``centre`` (3,) float64, to the ``reach`` [m]: see near.py."""

    centre: np.ndarray
    reach: float

    @staticmethod
    def of(shape: Shape, view: CameraView, centre: np.ndarray, extent: float) -> "Near | None":
        """The lamp at ``centre`` that reaches so far [m] from there; None where it is itself as wide as columns show."""
        centre = np.asarray(centre, np.float64)
        away = max(float(np.linalg.norm(centre - view.position)), 1e-6)
        corners = view.corners(away, away)
        sides = np.linalg.norm(corners[2] - corners[0]), np.linalg.norm(corners[1] - corners[0])
        reach = NEAR * shape.tile * float(max(side / count for side, count in zip(sides, shape.size, strict=True)))
        return Near(centre, reach) if 2.0 * extent <= reach else None


@dataclass(frozen=True, eq=False)
class Presence:
    """Where in the volume media are: ``length`` of each filling's part of the slices, (slices, n) float32 [m] by filling, and
    ``enter`` and ``leave`` (slices, n) float32 [m], between which in each slice any of them is."""

    length: list[np.ndarray]
    enter: np.ndarray
    leave: np.ndarray

    @staticmethod
    def of(fillings: list[Filling], columns: Columns) -> "Presence":
        """Exact for every filling, whatever the slices are."""
        limits = columns.shape.limits.astype(np.float64)
        low, high = limits[:-1, None, None], limits[1:, None, None]
        n = len(columns.origins)
        enter = np.broadcast_to(limits[1:, None], (len(limits) - 1, n)).copy()
        leave = np.broadcast_to(limits[:-1, None], enter.shape).copy()
        lengths = []
        for filling in fillings:
            spans = filling.spans(columns.origins, columns.directions, np.full(n, limits[-1]))
            first, last = np.maximum(spans.enter, low), np.minimum(spans.leave, high)
            within = np.maximum(last - first, 0.0)
            lengths.append(within.sum(axis=2).astype(np.float32))
            there = within > 0
            np.minimum(enter, np.where(there, first, np.inf).min(axis=2), out=enter)
            np.maximum(leave, np.where(there, last, -np.inf).max(axis=2), out=leave)
        return Presence(lengths, enter.astype(np.float32), np.maximum(leave, enter).astype(np.float32))


def numbers(shape: Shape, index: int, froxels: np.ndarray, dims: int) -> np.ndarray:
    """``dims`` numbers in [0, 1) for each of the flat ``froxels`` (n,) in sample number ``index``: (n, dims) float32."""
    return unit_interval(np.stack([hash_u32(_SLICE_SEED, index, froxels, d) for d in range(dims)], axis=1))
