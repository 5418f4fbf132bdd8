"""Points on texels: the same ones whenever they are asked for, on any thread."""

from dataclasses import dataclass, fields, replace

import numpy as np

from ... import kernels
from ..context import LightContext
from .texel_kernels import texel_points
from .texel_numbers import PLACE, TexelNumbers
from .texel_table import TexelTable
from .texels import TexelLayout, side_of


@dataclass(frozen=True, eq=False)
class SurfacePoints:
    """Points on the sides of texels: ``primitive`` (n,) int32 with Embree's ``u``, ``v`` (n,), world ``points`` (n, 3), and unit
    ``shading`` and ``face`` normals (n, 3), both turned to the texel's side."""

    primitive: np.ndarray
    u: np.ndarray
    v: np.ndarray
    points: np.ndarray
    shading: np.ndarray
    face: np.ndarray

    def take(self, rows: np.ndarray) -> "SurfacePoints":
        """The given rows alone."""
        return SurfacePoints(*(getattr(self, item.name)[rows] for item in fields(self)))

    def turned(self) -> "SurfacePoints":
        """The same points on the other side."""
        return replace(self, shading=-self.shading, face=-self.face)

    def first(self, count: int) -> "SurfacePoints":
        """The first ``count`` of them."""
        return SurfacePoints(*(getattr(self, item.name)[:count] for item in fields(self)))


class TexelSampler:
    """Places points on the texels of ``table``."""

    def __init__(self, context: LightContext, layout: TexelLayout, table: TexelTable, numbers: TexelNumbers):
        self._context, self._layout, self._table, self._numbers = context, layout, table, numbers

    def on_texels(self, texels: np.ndarray, count: int) -> SurfacePoints:
        """``count`` points on the visible part of each of ``texels`` (n,): the first of all, then the second of all, and so on."""
        table = self._table
        slots, seeds = table.slots[texels], table.seeds.take(texels)
        if kernels.is_available():
            primitive, u, v, points, face = texel_points(
                self._layout.tables, self._numbers.shared(PLACE, count), self._numbers.shifts(slots, PLACE), slots,
                table.accepted[texels], seeds)
            shading = face
            if self._context.surfaces.has_smooth_normals:
                shading = self._context.surfaces.shading_normal(primitive, u, v) * np.tile(side_of(slots), (count, 1))
            return SurfacePoints(primitive, u, v, points, shading, face)
        primitive, u, v = self._layout.sample(slots, self._numbers.of(slots, PLACE, count))
        accepted = table.accepted[texels, :count].T
        primitive, u, v = (np.where(accepted, part, seed).reshape(-1) for part, seed in
                           ((primitive, seeds.primitive), (u, seeds.u), (v, seeds.v)))
        return self.at(np.tile(slots, count), primitive, u, v)

    def at(self, slots: np.ndarray, primitive: np.ndarray, u: np.ndarray, v: np.ndarray,
           points: np.ndarray | None = None) -> SurfacePoints:
        """Given points (m,) on the sides of ``slots`` (m,), whose positions (m, 3) may be known."""
        geometry, surfaces = self._context.geometry, self._context.surfaces
        side = side_of(slots)
        face = geometry.normals_world[primitive] * side
        shading = surfaces.shading_normal(primitive, u, v) * side if surfaces.has_smooth_normals else face
        return SurfacePoints(primitive, u, v, geometry.points(primitive, u, v) if points is None else points, shading, face)
