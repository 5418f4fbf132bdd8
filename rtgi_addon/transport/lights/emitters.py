"""Emissive triangles as light sources: chosen by power, sampled by area, with the density that balances them against hits."""

from dataclasses import replace
from typing import NamedTuple

import numpy as np

from ...numerics.sampling import r2
from ...scene import Channel
from ..parallel import chunks
from ..surfaces.geometry import Geometry
from ..surfaces.materials import Surfaces
from ..vectors import dot, luminance
from .emission_cells import MAX_DEPTH, Cells, by_emission, by_texture, cell_key, joined
from .texture_power import TexturePower

# Points at which a triangle's mean emission is estimated, and how many evaluations all triangles may share.
MAX_POINTS, EVALUATIONS = 64, 1 << 20


class EmitterSamples(NamedTuple):
    """Points on emissive surfaces, each with ``normals`` (n, 3), the geometric ones on the mesh's front side, their density
    ``pdf_area`` (n,) [m⁻²], and where they are: ``primitive`` (n,) int32 and Embree's ``u`` and ``v`` (n,)."""

    points: np.ndarray
    normals: np.ndarray
    pdf_area: np.ndarray
    primitive: np.ndarray
    u: np.ndarray
    v: np.ndarray

    def repeated(self, times: int) -> "EmitterSamples":
        """Every sample ``times`` over, copies side by side."""
        return EmitterSamples(*(np.repeat(part, times, axis=0) for part in self))


class EmitterTable:
    """Every triangle whose material emits, cut into cells where its emission varies, chosen in proportion to area ×
    luminance of a cell's mean emission.

    ``count`` triangles, ``primitive`` (count,) int32 their indices; ``total_power`` [W] their luminous flux; ``effective_area``
    [m²] what would give as much if all shone alike. Emission leaves both faces, as in Cycles, so a receiver takes the absolute
    cosine at the emitter and the flux is 2π·A·L.
    """

    def __init__(self, geometry: Geometry, surfaces: Surfaces):
        self._geometry, self._surfaces = geometry, surfaces
        emissive = np.asarray(surfaces.emissive, bool)
        shines = emissive[geometry.material] & (geometry.areas > 0) & geometry.visibility.diffuse[geometry.instance]
        candidates = np.flatnonzero(shines).astype(np.int32)
        cells, mean = self._cells_of(candidates)
        weight = mean * cells.share * geometry.areas[candidates[cells.triangle]]
        kept = np.flatnonzero(weight > 0)
        kept = kept[np.argsort(cells.key[kept], kind="stable")]
        cells, weight, mean = cells.take(kept), weight[kept], mean[kept]
        shining, triangle = np.unique(cells.triangle, return_inverse=True)
        self.primitive, self.count = candidates[shining], len(shining)
        self._cells = replace(cells, triangle=triangle.reshape(-1))
        total = float(weight.sum())
        self.total_power = 2.0 * np.pi * total
        self.effective_area = total**2 / max(float((weight * mean).sum()), 1e-300)
        self._cdf = np.cumsum(weight) / max(total, 1e-300)
        self._density = (weight / max(total, 1e-300) / cells.share / geometry.areas[candidates[cells.triangle]]).astype(np.float32)
        self._whole = bool(np.all(cells.level == 0))
        self._keys = self._cells.key
        self._row = np.full(geometry.count, -1, np.int32)
        self._row[self.primitive] = np.arange(self.count, dtype=np.int32)

    def sample(self, u: np.ndarray) -> EmitterSamples:
        """Points on emitters for ``u`` (n, 3) in [0, 1)."""
        chosen = np.minimum(np.searchsorted(self._cdf, u[:, 0], side="right"), len(self._cdf) - 1)
        primitive = self.primitive[self._cells.triangle[chosen]]
        bu, bv = _barycentrics(u[:, 1:])
        if not self._whole:
            rows = np.flatnonzero(self._cells.level[chosen])
            bu[rows], bv[rows] = self._cells.take(chosen[rows]).place(u[rows, 1], u[rows, 2])
        points = self._geometry.points(primitive, bu, bv)
        return EmitterSamples(points, self._geometry.normals_world[primitive], self._density[chosen], primitive, bu, bv)

    def radiance(self, emitted: EmitterSamples, directions: np.ndarray) -> np.ndarray:
        """Radiance (n, 3) [W·sr⁻¹·m⁻²] that leaves ``emitted`` points against ``directions`` (n, 3), coverage included."""
        return self._leaving(emitted, -dot(emitted.normals, directions), self._surfaces.emission)

    def mean_radiance(self, emitted: EmitterSamples, side: int) -> np.ndarray:
        """As ``radiance``, the mean over the cosine-weighted hemisphere on the front (``side`` 1) or the back (−1)."""
        return self._leaving(emitted, np.full(len(emitted.u), side, np.float32), self._surfaces.emission_of_side)

    def _leaving(self, emitted: EmitterSamples, cosine: np.ndarray, emission) -> np.ndarray:
        where = emitted.primitive, emitted.u, emitted.v, cosine
        return emission(*where) * self._surfaces.coverage(*where)[:, None]

    def pdf_area(self, primitive: np.ndarray, u: np.ndarray, v: np.ndarray) -> np.ndarray:
        """Density (n,) [m⁻²] with which ``sample`` finds points at Embree's ``u``, ``v`` (n,) of ``primitive`` (n,); 0 for what
        does not emit and for −1."""
        if self.count == 0:
            return np.zeros(len(primitive), np.float32)
        row = np.where(primitive >= 0, self._row[primitive], -1)
        if self._whole:
            return np.where(row >= 0, self._density[row], np.float32(0.0))
        result, found = np.zeros(len(primitive), np.float32), np.flatnonzero(row >= 0)
        key = cell_key(row[found].astype(np.int64), u[found], v[found])
        cell = np.maximum(np.searchsorted(self._keys, key, side="right") - 1, 0)
        # A cell that is dark for certain is not in the table: what comes before it there does not reach so far.
        beyond = key - self._keys[cell]
        within = (beyond >= 0) & (beyond < (1 << 2 * (MAX_DEPTH - self._cells.level[cell])))
        result[found] = np.where(within, self._density[cell], np.float32(0.0))
        return result

    def _cells_of(self, candidates: np.ndarray) -> tuple[Cells, np.ndarray]:
        """Cells of the ``candidates`` (n,), and the luminance (m,) float64 of each one's mean emission."""
        cells = Cells.whole(len(candidates))
        if len(candidates) == 0:
            return cells, np.zeros(0)
        varies = self._surfaces.emission_varies(self._geometry.material[candidates])
        mean = np.zeros(len(candidates))
        even = np.flatnonzero(~varies)
        mean[even] = self._mean_luminance(candidates[even])
        parts, means = [cells.take(even)], [mean[even]]
        for material in np.unique(self._geometry.material[candidates[varies]]):
            rows = np.flatnonzero(varies & (self._geometry.material[candidates] == material))
            part, mean_of_part = self._cut(candidates, cells.take(rows), material)
            parts.append(part)
            means.append(mean_of_part)
        return joined(parts), np.concatenate(means)

    def _cut(self, candidates: np.ndarray, cells: Cells, material: int) -> tuple[Cells, np.ndarray]:
        """``cells`` of triangles of one ``material`` whose emission varies, split where it does."""
        surfaces, areas = self._surfaces, self._geometry.areas[candidates].astype(np.float64)
        # Cells follow the brighter side's emission; where the other one shines as well, none is dark for certain.
        channel, *others = sorted(surfaces.emission_channels(material), key=_brightness, reverse=True)
        floor = sum(map(_brightness, others), 0.0 if channel.offset is None else luminance(np.maximum(channel.offset, 0.0)))
        tint = np.ones(len(candidates))
        if channel.attribute is not None:
            mesh_triangle = self._geometry.mesh_triangle[candidates[cells.triangle]]
            tint[cells.triangle] = luminance(surfaces.corner_attribute(channel.attribute)[mesh_triangle]).max(axis=1)
        expected = np.full(len(cells.level), luminance(np.maximum(channel.constant, 0.0)))
        if channel.texture is not None:
            uv = np.zeros((len(candidates), 3, 2))
            uv[cells.triangle] = surfaces.texture_corners(channel, candidates[cells.triangle])
            power = TexturePower(channel.texture, channel.texture_channel, channel.constant)
            cells, expected = by_texture(cells, areas * tint, power, uv)

        def emitted(triangle, u, v):
            return luminance(surfaces.mean_emission(candidates[triangle], u, v)).astype(np.float64)

        return by_emission(cells, areas, expected * tint[cells.triangle] + floor, emitted)

    def _mean_luminance(self, primitives: np.ndarray) -> np.ndarray:
        """Luminance (n,) of the mean emission of triangles whose emission is even, by a fixed set of points: coverage may vary."""
        n = len(primitives)
        mean = np.zeros(n, np.float32)
        if n == 0:
            return mean
        count = int(np.clip(EVALUATIONS // n, 1, MAX_POINTS))
        bu, bv = _barycentrics(r2(count, 0))
        for span in chunks(n, max(1, (1 << 18) // count)):
            repeated = np.repeat(primitives[span], count)
            repeats = len(repeated) // count
            radiance = self._surfaces.mean_emission(repeated, np.tile(bu, repeats), np.tile(bv, repeats))
            mean[span] = luminance(radiance).reshape(repeats, count).mean(axis=1)
        return mean


def _brightness(channel: Channel) -> float:
    """Luminance of a channel where its texture and attribute are 1."""
    return float(luminance(np.maximum(channel.constant + (0.0 if channel.offset is None else channel.offset), 0.0)))


def _barycentrics(u: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    root = np.sqrt(u[:, 0])
    return root * (1.0 - u[:, 1]), root * u[:, 1]
