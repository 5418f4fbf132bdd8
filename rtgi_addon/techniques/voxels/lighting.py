"""The light that leaves what voxels show: of all bounces, read from a surface cache, or of lamps alone and what voxels then send
each other.

Lamps and bright sky light every point that voxels show by shadow rays of its own, or lamps by what their reflective shadow maps put
into voxels; emissive surfaces are lit by themselves. The rest is the surface cache's (rays between surfaces), or comes from sweeps
of the voxels, which is what an engine can do every few frames.
"""

from functools import cached_property

import numpy as np

from ...numerics.sampling import hash_u32, sobol_owen
from ...progress import Progress
from ...transport.cache.surface_cache import SurfaceCache
from ...transport.cache.surface_points import SurfacePoints
from ...transport.cache.texel_table import SurfaceHits
from ...transport.cache.texels import Focus, TexelLayout, size_for
from ...transport.context import LightContext
from ...transport.parallel import CHUNK, chunks, parallel_for
from ...transport.paths.sources import Sources
from ...transport.vectors import dot
from ...transport.views.reflective_shadow_map import capture
from ...transport.voxels import VoxelGrid, Voxels, voxelize
from ...transport.voxels.between import Between, between
from ...transport.voxels.grid import FACES
from ...transport.voxels.injection import inject
from ...transport.voxels.sweeps import irradiance_of_cells, sweep
from ...transport.voxels.unseen import shown_alone, within_solids
from ..lpv.sources import map_views
from .settings import MAPS, VoxelSettings

# Texels about the voxels, rays from each, and by how much the solution may be off: many are seen at once, so their noise averages.
TEXELS, RAYS, TOLERANCE = 12000, 64, 2e-3
# Tells the numbers for lamps of some extent apart from all others of a seed: the letters vx.
_STREAM = 0x7678
# Directions of a sweep between voxels.
SWEEPS = 64
# Share of the light that a bounce may keep for a sum of all to be believed.
_MOST_KEPT = 0.95
# Voxels along the shortest side of a grid that shows rooms.
_FEWEST = 12


def kept_share(weight: np.ndarray, before: np.ndarray, received: np.ndarray, after: np.ndarray) -> np.ndarray:
    """The share (3,) of the radiance ``before`` (e, 3) that a bounce keeps which makes ``after`` (e, 3) leave of the irradiance
    ``received`` (e, 3), by ``weight`` (e,): no more than surfaces reflect where that arrives, should a sweep find more than was
    sent. Of what all others add it makes the sum of a geometric series, as M. Cohen et al., "A Progressive Refinement Approach to
    Fast Radiosity Image Generation", SIGGRAPH 1988, have for all of it."""
    sent, got, left = (np.asarray(weight, np.float64) @ light for light in (before, received / np.float32(np.pi), after))
    return np.minimum(left / np.maximum(np.maximum(sent, got), np.finfo(np.float64).tiny), _MOST_KEPT)


class VoxelLight:
    """The light on ``voxels`` of the scene of ``context``, of one grid."""

    def __init__(self, context: LightContext, voxels: Voxels, settings: VoxelSettings, seed: int):
        self._context, self._voxels, self._settings, self._seed = context, voxels, settings, seed
        self._sources = Sources(context)
        # Sources that shadow rays are sent to: where maps know lamps, what follows them is bright sky.
        self._first = context.lamps.count if settings.light == MAPS else 0

    @cached_property
    def standing(self) -> Between:
        """What stands between the middles of the voxels."""
        return between(self._voxels, self._context.geometry)

    @cached_property
    def _hidden(self) -> np.ndarray:
        """(e,) bool: what is within solids."""
        return within_solids(self._context, self._voxels)

    @property
    def grid(self) -> VoxelGrid:
        """Of the voxels."""
        return self._voxels.grid

    def direct(self, progress: Progress) -> np.ndarray:
        """Radiance (e, 3) that leaves of the light of lamps, bright sky and what is emitted. Raises Cancelled, BakeError."""
        direct = self._by_chunks(self._direct, progress, "lamps on voxels")
        return self._shown(direct + self._mapped(progress) if self._settings.light == MAPS else direct)

    def swept(self, last: np.ndarray, beyond, progress: Progress, around: np.ndarray | None = None) -> np.ndarray:
        """What arrives in the cells (nz, ny, nx, 9, 3) of what leaves what they show, ``last`` (e, 3), and of what lies beyond the
        grid, or, where it lies in another one, of what arrives ``around``, as `sweep` has both. Raises Cancelled."""
        voxels, threads = self._voxels, self._context.threads
        return sweep(self.standing, voxels.opacity, voxels.by_face(last), SWEEPS, 2, beyond, threads, progress, around)

    def reflected(self, part: "VoxelLight", light: np.ndarray) -> np.ndarray:
        """What leaves (e, 3) of the ``light`` (nz, ny, nx, 9, 3) that arrives in the cells of ``part``."""
        return self._shown(self._by_chunks(
            lambda rows: self._leaving(rows, lambda surface, _turn: _received(part, light, surface)), Progress(), ""))

    def kept(self, before: np.ndarray, light: np.ndarray, after: np.ndarray) -> np.ndarray:
        """See kept_share: of what leaves ``before`` and ``after`` (e, 3) ``light`` (nz, ny, nx, 9, 3) has arrived."""
        received = self._by_chunks(lambda rows: _received(self, light, self._surface(rows)), Progress(), "")
        return kept_share(self._voxels.seen.weight, before, received, after)

    def coarser(self) -> "VoxelLight":
        """The same in voxels twice as large, or in these where so few of those are left that they show no rooms."""
        grid, context = self.grid, self._context
        if min(grid.resolution) < 2 * _FEWEST:
            return self
        half = VoxelGrid(grid.corner, 2.0 * grid.cell, tuple(-(-count // 2) for count in grid.resolution))
        return VoxelLight(context, voxelize(context.geometry, context.surfaces, half, context.threads), self._settings, self._seed)

    def _by_chunks(self, work, progress: Progress, label: str) -> np.ndarray:
        """``work``(slice) → (m, 3) of all that voxels show, (e, 3)."""
        spans = chunks(len(self._voxels.seen.face), CHUNK)
        parts = parallel_for(lambda i: work(spans[i]), len(spans), self._context.threads, progress, label)
        return np.concatenate(parts) if parts else np.zeros((0, 3), np.float32)

    def _shown(self, light: np.ndarray) -> np.ndarray:
        """``light`` (e, 3) without what is within solids."""
        return shown_alone(self._voxels, self._hidden, light) if self._hidden.any() else light

    def _surface(self, rows: slice, turn: float = 1.0) -> SurfacePoints:
        """The points that are seen, with normals to the side that is (``turn`` -1: to the other)."""
        seen, context = self._voxels.seen, self._context
        primitive, u, v, side = seen.primitive[rows], seen.u[rows], seen.v[rows], seen.side[rows, None] * np.float32(turn)
        face = context.geometry.normals_world[primitive] * side
        shading = context.surfaces.shading_normal(primitive, u, v) * side if context.surfaces.has_smooth_normals else face
        return SurfacePoints(primitive, u, v, context.geometry.points(primitive, u, v), shading, face)

    def _leaving(self, rows: slice, arriving) -> np.ndarray:
        """Radiance (m, 3) that leaves what is seen of ``arriving``(surface) → irradiance (m, 3) on a side of it."""
        surfaces, side, surface = self._context.surfaces, self._voxels.seen.side[rows], self._surface(rows)
        where = surface.primitive, surface.u, surface.v
        result = surfaces.albedo_of_side(*where, side) * arriving(surface, 1.0)
        if surfaces.has_translucency:
            result += surfaces.translucency(*where, side) * arriving(self._surface(rows, -1.0), -1.0)
        return result * np.float32(1.0 / np.pi)

    def _direct(self, rows: slice) -> np.ndarray:
        """What lamps and bright sky make leave, and what is emitted."""
        seen, surfaces, first = self._voxels.seen, self._context.surfaces, rows.start
        numbers = sobol_owen(rows.stop - first, 2, hash_u32(self._seed, _STREAM), first)

        def arriving(surface, _turn):
            total, reach = np.zeros(surface.points.shape, np.float32), np.zeros(len(surface.points), np.float32)
            for source in range(self._first, self._sources.count):
                total += self._sources.irradiance(source, surface.points, surface.shading, surface.face, reach, numbers,
                                                  surface.primitive, 0.381966 * source)
            return total

        asked = self._sources.count > self._first
        leaving = self._leaving(rows, arriving) if asked else np.zeros((rows.stop - first, 3), np.float32)
        if surfaces.has_emission:
            leaving += surfaces.emission_of_side(seen.primitive[rows], seen.u[rows], seen.v[rows], seen.side[rows])
        return leaving

    def _mapped(self, progress: Progress) -> np.ndarray:
        """What lamps make leave by their maps (e, 3): points of one face share its light alike."""
        context, voxels, grid = self._context, self._voxels, self._voxels.grid
        row = np.full(grid.count, -1, np.int32)
        row[voxels.cells] = np.arange(len(voxels.cells), dtype=np.int32)
        shown = np.zeros((len(voxels.cells), FACES, 3))
        bounds = np.array(context.geometry.bounds(), np.float64)
        for views in map_views(context.scene, bounds, (grid,), self._settings.map_resolution):
            progress.step(0.0, "capturing reflective shadow maps")
            for view in views:
                texels = capture(context, view).lights()
                # What a texel covers lies as its triangle does, however it is shaded.
                face = context.geometry.normals_world[texels.primitive]
                face = face * np.where(dot(face, texels.normals) < 0, np.float32(-1), np.float32(1))[:, None]
                shown += inject(grid, row, texels.positions, face, texels.flux * np.float32(1.0 / np.pi))
        seen = voxels.seen
        share = np.bincount(seen.face, seen.weight, shown.shape[0] * FACES)
        return (shown.reshape(-1, 3) / np.maximum(share, np.finfo(np.float32).tiny)[:, None]).astype(np.float32)[seen.face]

    def cached(self, progress: Progress) -> np.ndarray:
        """What the surface cache knows beside that (e, 3)."""
        context, seen, grid = self._context, self._voxels.seen, self._voxels.grid
        radius = 0.5 * float(np.linalg.norm(grid.high - grid.corner))
        size = max(size_for(context.geometry, grid.center, radius, TEXELS), 0.5 * grid.cell)
        lit_alike = context.links.lit_alike if context.links.has_receivers else None
        layout = TexelLayout(context.geometry, Focus(grid.center, radius, size), lit_alike)
        cache = SurfaceCache(context, layout, self._seed, RAYS)
        slots = layout.slots(seen.primitive, seen.u, seen.v, seen.side > 0)
        hits = SurfaceHits(seen.primitive, seen.u, seen.v, slots)
        other = SurfaceHits(seen.primitive, seen.u, seen.v, slots ^ 1)
        texel, behind = cache.reach([hits, other if context.surfaces.has_translucency else other.take(slice(0, 0))], progress)
        cache.solve(None, TOLERANCE, progress)
        return self._shown(self._by_chunks(
            lambda rows: self._leaving(rows, lambda _surface, turn: cache.irradiance_rest[(texel if turn > 0 else behind)[rows]]),
            progress, "light on voxels"))


def _received(part: VoxelLight, light: np.ndarray, surface: SurfacePoints) -> np.ndarray:
    return irradiance_of_cells(part.standing, light, surface.points, surface.face)
