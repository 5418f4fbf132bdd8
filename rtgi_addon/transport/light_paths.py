"""Light paths: from lamps, emissive surfaces and the world into the scene, leaving a virtual light wherever they are reflected.

Source: A. Keller, "Instant Radiosity", SIGGRAPH 1997. A path carries power Φ; where it meets a surface of albedo ρ it deposits a
VPL of flux ρΦ, and goes on with probability max ρ (Russian roulette), so that the power of what goes on stays that of the path
but for its colour. Interpolated normals count by cosθ_shading/cosθ_geometric of the arriving light (E. Veach, "Robust Monte Carlo
Methods for Light Transport Simulation", 1997, §5.3): with it a VPL is the surface's diffuse radiance about its geometric normal.
"""

from dataclasses import dataclass, fields, replace

import numpy as np

from ..numerics.sampling import cosine_hemisphere, frame, hash_u32, sobol_owen_at, sphere_from_square
from ..scene import Light
from .context import LightContext
from .light_emission import Beam, emit, near_gain
from .path_numbers import ROULETTE, SCATTER, PathNumbers
from .rays import offset_origins
from .vectors import dot, luminance, normalized

# Sources that are no lamps, in VirtualLights.source.
FROM_EMITTERS, FROM_WORLD = -1, -2
# The ratio of cosines under interpolated normals is unbounded at silhouettes of coarse meshes; beyond this it is cut.
MAX_SHADING_GAIN = 4.0
# A point this far away [m] stands for a direction in which nothing is.
_FAR = 1e6
# Surfaces that the light of a lamp without shadows passes.
MAX_LAYERS = 32


@dataclass(frozen=True, eq=False)
class LightPaths:
    """p paths and the n VPLs they left, as arrays.

    Per path: ``source`` (p,) int32 (a lamp's index, FROM_EMITTERS or FROM_WORLD), ``u`` (p, 2) the numbers of the place on a lamp
    that it left from, ``domain`` (p, 3) as in ``Emission``, ``power`` (p, 3) [W] with which it meets its first surface, ``first``
    (p, 3) that point, ``first_normal`` and ``first_shading`` (p, 3) its unit normals (0 if it met none: the point is far away).
    Per VPL: ``positions`` and ``normals`` (n, 3), ``throughput`` (n, 3) flux over the path's power, ``bounce`` (n,) int16 and
    ``path`` (n,) int64.
    """

    source: np.ndarray
    u: np.ndarray
    domain: np.ndarray
    power: np.ndarray
    first: np.ndarray
    first_normal: np.ndarray
    first_shading: np.ndarray
    positions: np.ndarray
    normals: np.ndarray
    throughput: np.ndarray
    bounce: np.ndarray
    path: np.ndarray

    @property
    def count(self) -> int:
        """Number of paths."""
        return len(self.source)

    @property
    def met(self) -> np.ndarray:
        """(p,) bool: paths that met a surface."""
        return np.any(self.first_normal != 0, axis=1)

    @property
    def flux(self) -> np.ndarray:
        """(n, 3) [W] of the VPLs."""
        return self.power[self.path] * self.throughput

    def keep(self, rows: np.ndarray, gain: np.ndarray | None = None) -> "LightPaths":
        """All paths with only the VPLs ``rows``, their throughput times ``gain`` (len(rows),)."""
        throughput = self.throughput[rows] if gain is None else self.throughput[rows] * gain[:, None].astype(np.float32)
        return replace(self, positions=self.positions[rows], normals=self.normals[rows], throughput=throughput,
                       bounce=self.bounce[rows], path=self.path[rows])

    def take_paths(self, chosen: np.ndarray) -> "LightPaths":
        """The paths ``chosen`` (indices, ascending) with their VPLs."""
        number = np.full(self.count, -1, np.int64)
        number[chosen] = np.arange(len(chosen))
        rows = np.flatnonzero(number[self.path] >= 0) if self.count else np.zeros(0, np.int64)
        kept = self.keep(rows)
        arrays = {name: getattr(self, name)[chosen] for name in _PER_PATH}
        return replace(kept, **arrays, path=number[kept.path])


_PER_PATH = ("source", "u", "domain", "power", "first", "first_normal", "first_shading")


def no_paths() -> LightPaths:
    """No paths at all."""
    vectors = np.zeros((0, 3), np.float32)
    return LightPaths(np.zeros(0, np.int32), np.zeros((0, 2), np.float32), *[vectors] * 8, np.zeros(0, np.int16),
                      np.zeros(0, np.int64))


def join(parts: list[LightPaths]) -> LightPaths:
    """The paths of all ``parts``, in order."""
    starts = np.cumsum([0] + [part.count for part in parts])
    arrays = {item.name: np.concatenate([getattr(part, item.name) for part in parts]) for item in fields(LightPaths)}
    paths = [part.path + start for part, start in zip(parts, starts, strict=False)]
    return LightPaths(**{**arrays, "path": np.concatenate(paths)})


def lamp_paths(context: LightContext, light: Light, lamp: int, index: np.ndarray, beam: Beam, bounces: int | None,
               seed: int) -> LightPaths:
    """Paths ``index`` (n,) of the sequence of lamp number ``lamp``, each with all of its power (divide by their number)."""
    key = hash_u32(seed, lamp, 0x6C61)
    u = sobol_owen_at(index, 4, key)
    emission = emit(light, u, beam)
    return trace(context, light, lamp, emission, u[:, 2:], PathNumbers(np.full(len(index), key), index.astype(np.uint32)), bounces)


def emitter_paths(context: LightContext, index: np.ndarray, bounces: int | None, seed: int) -> LightPaths:
    """As ``lamp_paths``, from emissive triangles; the first VPL of each is the emitter's own light (bounce 0)."""
    key = hash_u32(seed, 0x656D)
    u = sobol_owen_at(index, 5, key)
    points, normals, radiance, pdf_area, _ = context.emitters.sample(u[:, :3])
    # Both faces shine: half of the square of directions is for each.
    back = u[:, 3] >= 0.5
    normals = np.where(back[:, None], -normals, normals)
    local = cosine_hemisphere(np.stack([2.0 * u[:, 3] - back, u[:, 4]], axis=1).astype(np.float32))
    tangent, bitangent = frame(normals)
    directions = normalized(tangent * local[:, :1] + bitangent * local[:, 1:2] + normals * local[:, 2:])
    origins = offset_origins(points, normals, normals)
    power = radiance * (np.float32(2.0 * np.pi) / pdf_area)[:, None]
    paths = _walk(context, origins, directions, power, PathNumbers(np.full(len(index), key), index.astype(np.uint32)), bounces,
                  FROM_EMITTERS, np.zeros((len(index), 2), np.float32), directions)
    n = len(index)
    return replace(paths, positions=np.concatenate([origins, paths.positions]), normals=np.concatenate([normals, paths.normals]),
                   throughput=np.concatenate([np.ones((n, 3), np.float32), paths.throughput]),
                   bounce=np.concatenate([np.zeros(n, np.int16), paths.bounce]),
                   path=np.concatenate([np.arange(n), paths.path]))


def world_directions(context: LightContext, index: np.ndarray, seed: int) -> tuple[np.ndarray, np.ndarray]:
    """Directions of travel (n, 3) of light from the world, and radiance over density (n, 3) [W·m⁻²] (their mean is the world's)."""
    environment, key = context.environment, hash_u32(seed, 0x776F)
    u = sobol_owen_at(index, 3, key)
    bright = np.zeros(len(index), bool)
    share = bright_share(context)
    bright[:] = u[:, 2] < share
    towards, value = np.empty((len(index), 3), np.float32), np.empty((len(index), 3), np.float32)
    rows = np.flatnonzero(~bright)
    if rows.size:
        towards[rows] = sphere_from_square(u[rows, :2])
        value[rows] = environment.base_radiance(towards[rows]) * np.float32(4.0 * np.pi / (1.0 - share))
    rows = np.flatnonzero(bright)
    if rows.size:
        towards[rows], weight = environment.bright.sample(u[rows, :2])
        value[rows] = weight / np.float32(share)
    return -towards, value


def bright_share(context: LightContext) -> float:
    """Share of samples of the world that go to its bright patches: by irradiance, a tenth at least where there are any."""
    environment = context.environment
    if environment.bright.count == 0:
        return 0.0
    bright = float(luminance(environment.bright.irradiance_estimate))
    base = 4.0 * np.pi * float(luminance(environment.base_radiance(sphere_from_square(_SQUARE))).mean())
    return float(np.clip(bright / max(bright + base, 1e-30), 0.1, 0.9))


_SQUARE = sobol_owen_at(np.arange(256), 2, 1)


def world_paths(context: LightContext, index: np.ndarray, beam: Beam, bounces: int | None, seed: int) -> LightPaths:
    """As ``lamp_paths``, from the world."""
    directions, weight = world_directions(context, index, seed)
    key = hash_u32(seed, 0x7770)
    origins, area = beam.origins(directions, sobol_owen_at(index, 2, key, shuffle=True))
    numbers = PathNumbers(np.full(len(index), key), index.astype(np.uint32))
    return _walk(context, origins, directions, weight * area[:, None], numbers, bounces, FROM_WORLD,
                 np.zeros((len(index), 2), np.float32), directions)


def trace(context: LightContext, light: Light, lamp: int, emission, u: np.ndarray, numbers: PathNumbers,
          bounces: int | None) -> LightPaths:
    """Follow what ``light`` emits. A lamp without shadows lights every surface along each ray, each as a path of its own."""
    if light.casts_shadow:
        paths = _walk(context, emission.origins, emission.directions, emission.power, numbers, bounces, lamp, u, emission.domain)
        return _softened(paths, light)
    parts, rows = [], np.arange(len(u))
    origins = emission.origins
    for _ in range(MAX_LAYERS):
        parts.append(_walk(context, origins, emission.directions[rows], emission.power[rows], numbers.take(rows), bounces, lamp,
                           u[rows], emission.domain[rows]))
        met = np.flatnonzero(parts[-1].met)
        if met.size == 0:
            break
        first, normals, rows = parts[-1].first[met], parts[-1].first_normal[met], rows[met]
        reach = np.abs(first - origins[met]).max(axis=1)
        # Once back onto the surface that the point was moved off, and once through it.
        for _ in range(2):
            first = offset_origins(first, normals, emission.directions[rows], reach)
        origins = first
    return _softened(join(parts), light)


def _softened(paths: LightPaths, light: Light) -> LightPaths:
    return replace(paths, power=paths.power * near_gain(light, paths.first)[:, None])


def shading_gain(shading: np.ndarray, geometric: np.ndarray, directions: np.ndarray) -> np.ndarray:
    """(n,) cosθ_shading/cosθ_geometric of light that travels along ``directions`` (n, 3), cut at MAX_SHADING_GAIN."""
    arriving = -dot(shading, directions)
    return np.clip(arriving / np.maximum(-dot(geometric, directions), np.float32(1e-6)), 0.0, np.float32(MAX_SHADING_GAIN))


def _walk(context, origins, directions, power, numbers, bounces, source, u, domain) -> LightPaths:
    """Trace paths until roulette or ``bounces`` ends them; ``power`` (p, 3) leaves with each."""
    p = len(origins)
    geometry, surfaces = context.geometry, context.surfaces
    # What meets nothing is remembered by a point far along its ray.
    first = (origins + directions * np.float32(_FAR)).astype(np.float32)
    first_normal, first_shading = np.zeros((p, 3), np.float32), np.zeros((p, 3), np.float32)
    power = np.array(power, np.float32)
    rows = np.arange(p) if bounces != 0 else np.zeros(0, np.int64)
    throughput = np.ones((p, 3), np.float32)
    deposits, depth = [], 0
    while rows.size:
        depth += 1
        hits = context.tracer.intersect(origins, directions)
        found = np.flatnonzero(hits.primitive >= 0)
        rows, directions, throughput, numbers = rows[found], directions[found], throughput[found], numbers.take(found)
        primitive, hu, hv, t = hits.primitive[found], hits.u[found], hits.v[found], hits.t[found]
        normals = geometry.normals_world[primitive]
        side = -np.copysign(np.float32(1.0), dot(normals, directions))[:, None]
        geometric, shading = normals * side, surfaces.shading_normal(primitive, hu, hv) * side
        points = offset_origins(geometry.points(primitive, hu, hv), geometric, geometric, t)
        gain = shading_gain(shading, geometric, directions)[:, None]
        if depth == 1:
            # The first surface's part belongs to the path: it changes as its lamp moves.
            first[rows], first_normal[rows], first_shading[rows] = points, geometric, shading
            power[rows] *= gain
        else:
            throughput = throughput * gain
        albedo = surfaces.albedo(primitive, hu, hv)
        throughput = throughput * albedo
        deposits.append((points, geometric, throughput, np.full(len(rows), depth, np.int16), rows))
        if bounces is not None and depth >= bounces:
            break
        chance = albedo.max(axis=1)
        kept = np.flatnonzero(numbers.draw(depth, ROULETTE, 1)[:, 0] < chance)
        rows, numbers, geometric, origins = rows[kept], numbers.take(kept), geometric[kept], points[kept]
        throughput = throughput[kept] / chance[kept, None]
        local = cosine_hemisphere(numbers.draw(depth, SCATTER, 2))
        tangent, bitangent = frame(geometric)
        directions = normalized(tangent * local[:, :1] + bitangent * local[:, 1:2] + geometric * local[:, 2:])
    if not deposits:
        deposits = [(np.zeros((0, 3), np.float32),) * 3 + (np.zeros(0, np.int16), np.zeros(0, np.int64))]
    positions, normals, throughput, bounce, path = (np.concatenate(column) for column in zip(*deposits, strict=True))
    lit = np.flatnonzero(np.any(throughput > 0, axis=1))
    return LightPaths(np.full(p, source, np.int32), u.astype(np.float32), domain.astype(np.float32), power, first, first_normal,
                      first_shading, positions[lit], normals[lit], throughput[lit], bounce[lit], path[lit])
