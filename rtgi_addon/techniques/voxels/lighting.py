"""The light that leaves what voxels show: of all bounces, read from a surface cache, or of lamps alone and what voxels then send
each other.

Lamps and bright sky light every point that voxels show by shadow rays of its own, or lamps by what their reflective shadow maps put
into voxels; emissive surfaces are lit by themselves. The rest is the surface cache's (rays between surfaces), or comes from sweeps
of the voxels, which is what an engine can do every few frames.
"""

import numpy as np

from ...numerics import sh
from ...numerics.grid import trilinear
from ...numerics.sampling import fibonacci_sphere, hash_u32, sobol_owen
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
from ...transport.voxels import VoxelGrid, Voxels
from ...transport.voxels.grid import FACES
from ...transport.voxels.hierarchy import build_hierarchy
from ...transport.voxels.injection import inject
from ...transport.voxels.sweeps import sweep
from ..lpv.sources import map_views
from .settings import MAPS, SURFACES, VoxelSettings

# Texels about the voxels, rays from each, and by how much the solution may be off: many are seen at once, so their noise averages.
TEXELS, RAYS, TOLERANCE = 12000, 64, 2e-3
# Directions of a sweep between voxels.
SWEEPS = 64
# Tells the numbers for lamps of some extent apart from all others of a seed: the letters vx.
_STREAM = 0x7678
# Share of the light that a bounce may keep for a sum of all to be believed.
_MOST_KEPT = 0.95
# How far a lighting is when lamps are done, and what of that is theirs where there is a cache to solve.
_LAMPS = 0.3


def light_voxels(context: LightContext, cascades: tuple[Voxels, ...], settings: VoxelSettings, seed: int, beyond,
                 progress: Progress) -> list[np.ndarray]:
    """Radiance (e, 3) float32 that leaves what the faces of the voxels of each of nested grids show, by point of ``Voxels.seen``;
    ``beyond``(directions (k, 3)) is that (k, 3) of what lies outside them all. Raises Cancelled, BakeError."""
    parts, direct = [VoxelLight(context, voxels, settings, seed) for voxels in cascades], []
    shares = [progress.span(index / len(parts), (index + 1) / len(parts)) for index in range(len(parts))]
    if settings.light == SURFACES:
        return [part.direct(share.span(0.0, _LAMPS)) + part.cached(share.span(_LAMPS, 1.0))
                for part, share in zip(parts, shares, strict=True)]
    for index, part in enumerate(parts):
        direct.append(part.direct(progress.span(_LAMPS * index / len(parts), _LAMPS * (index + 1) / len(parts))))
    return _bounced(parts, settings, direct, beyond, progress.span(_LAMPS, 1.0))


def _bounced(parts: "list[VoxelLight]", settings: VoxelSettings, direct: list[np.ndarray], beyond,
             progress: Progress) -> list[np.ndarray]:
    """What leaves of ``direct`` (e, 3), of what lies beyond, and of what voxels then send each other, grid by grid."""
    steps = [beyond] if np.any(beyond(fibonacci_sphere(SWEEPS))) else []
    steps += [_nothing] * settings.bounces
    # Unlit voxels hide the sky from each other; then each reflects what the last one sent on.
    total = direct
    last = direct if len(steps) == settings.bounces else [np.zeros_like(light) for light in direct]
    for number, outside in enumerate(steps):
        found, around = [], None
        # From the outermost in: what comes through the border of a grid has come through the next.
        for index in reversed(range(len(parts))):
            done = number + (len(parts) - 1 - index) / len(parts)
            share = progress.span(done / len(steps), (done + 1 / len(parts)) / len(steps))
            light, swept = parts[index].swept(last[index], outside, around, share)
            found.insert(0, swept)
            around = None if index == 0 else (parts[index].grid, light)
        if outside is beyond:
            total = last = [light + new for light, new in zip(direct, found, strict=True)]
            continue
        total = [light + new for light, new in zip(total, found, strict=True)]
        if number == len(steps) - 1 and settings.further_bounces:
            # The outermost grid knows all that the light meets.
            more = parts[-1].still_to_come(last[-1], found[-1])
            total = [light + new * more for light, new in zip(total, found, strict=True)]
        last = found
    return total


class VoxelLight:
    """The light on ``voxels`` of the scene of ``context``, of one grid."""

    def __init__(self, context: LightContext, voxels: Voxels, settings: VoxelSettings, seed: int):
        self._context, self._voxels, self._settings, self._seed = context, voxels, settings, seed
        self._sources = Sources(context)
        # Sources that shadow rays are sent to: where maps know lamps, what follows them is bright sky.
        self._first = context.lamps.count if settings.light == MAPS else 0

    @property
    def grid(self) -> VoxelGrid:
        """Of the voxels."""
        return self._voxels.grid

    def direct(self, progress: Progress) -> np.ndarray:
        """Radiance (e, 3) that leaves of the light of lamps, bright sky and what is emitted. Raises Cancelled, BakeError."""
        direct = self._by_chunks(self._direct, progress, "lamps on voxels")
        return direct + self._mapped(progress) if self._settings.light == MAPS else direct

    def swept(self, last: np.ndarray, beyond, around: tuple[VoxelGrid, np.ndarray] | None,
              progress: Progress) -> tuple[np.ndarray, np.ndarray]:
        """What arrives in the cells (nz, ny, nx, 9, 3) of what leaves what they show, ``last`` (e, 3), and of what lies beyond the
        grid, or what arrives in those of the one ``around`` it; and what leaves of that (e, 3)."""
        voxels, inflow = self._voxels, None
        lit = build_hierarchy(voxels, voxels.by_face(last), levels=1)
        if around is not None:
            inflow = np.zeros((*self.grid.shape, *around[1].shape[3:]), np.float32)
            inside = np.ones(self.grid.shape, bool)
            inside[1:-1, 1:-1, 1:-1] = False
            border = np.flatnonzero(inside)
            inflow.reshape(self.grid.count, *inflow.shape[3:])[border] = sample_cells(*around, self.grid.centers_of(border))
        light = sweep(lit, SWEEPS, 2, beyond, self._context.threads, progress, inflow)
        return light, self._by_chunks(lambda rows: self._swept(light, rows), progress, "light between voxels")

    def still_to_come(self, before: np.ndarray, after: np.ndarray) -> np.ndarray:
        """How much of ``after`` (e, 3), which a bounce made of ``before`` (e, 3), all further ones add (3,): each keeps the share
        of the light that this one did, and no more than surfaces reflect in the mean. M. Cohen et al., "A Progressive Refinement
        Approach to Fast Radiosity Image Generation", SIGGRAPH 1988, have such an ambient term of that mean alone; the share also
        knows what escapes. Sweeps spread light and may find more of it than was sent: in corridor_door_ajar the share was 1.13, and
        all further bounces twenty times the first."""
        weight = self._voxels.seen.weight.astype(np.float64)
        reflected = self._by_chunks(lambda rows: self._leaving(rows, lambda surface, _turn: np.float32(np.pi)), Progress(), "")
        share = [weight @ leaving / np.maximum(weight @ whole, np.finfo(np.float64).tiny)
                 for leaving, whole in ((after, before), (reflected, np.ones_like(reflected)))]
        kept = np.minimum(np.minimum(*share), _MOST_KEPT)
        return (kept / (1.0 - kept)).astype(np.float32)

    def _by_chunks(self, work, progress: Progress, label: str) -> np.ndarray:
        """``work``(slice) → (m, 3) of all that voxels show, (e, 3)."""
        spans = chunks(len(self._voxels.seen.face), CHUNK)
        parts = parallel_for(lambda i: work(spans[i]), len(spans), self._context.threads, progress, label)
        return np.concatenate(parts) if parts else np.zeros((0, 3), np.float32)

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
        return self._by_chunks(lambda rows: self._leaving(
            rows, lambda _surface, turn: cache.irradiance_rest[(texel if turn > 0 else behind)[rows]]), progress, "light on voxels")

    def _swept(self, light: np.ndarray, rows: slice) -> np.ndarray:
        """What a sweep found (nz, ny, nx, k, 3) makes leave (m, 3)."""
        grid = self._voxels.grid
        return self._leaving(rows, lambda surface, _turn: irradiance_of_cells(grid, light, surface.points, surface.face))


def irradiance_of_cells(grid, light: np.ndarray, points: np.ndarray, normals: np.ndarray) -> np.ndarray:
    """Irradiance (n, 3) at ``points`` (n, 3) under ``normals`` (n, 3) by the cells in front of them: ``light`` (nz, ny, nx, 9, 3)
    is what arrives there, in SH."""
    coefficients = sample_cells(grid, light, points + normals * np.float32(grid.cell))
    return np.maximum(sh.irradiance(coefficients, normals[:, None].astype(np.float32))[:, 0], 0.0).astype(np.float32)


def sample_cells(grid, values: np.ndarray, points: np.ndarray) -> np.ndarray:
    """``values`` (nz, ny, nx, …) of the cells of ``grid`` at ``points`` (n, 3), interpolated: (n, …)."""
    indices, weights = trilinear(grid.cells_of(points) - 0.5, grid.resolution)
    flat = values.reshape(grid.count, -1)
    total = np.zeros((len(points), flat.shape[1]), np.float32)
    for corner in range(8):
        total += weights[:, corner, None] * flat[indices[:, corner]]
    return total.reshape(len(points), *values.shape[3:])


def _nothing(directions: np.ndarray) -> np.ndarray:
    """Radiance (k, 3) of what lies outside for light that stays within."""
    return np.zeros((len(directions), 3), np.float32)
