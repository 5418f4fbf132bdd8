"""Light paths: from lamps, emissive surfaces and the world into the scene, leaving a virtual light wherever they are reflected.

Source: A. Keller, "Instant Radiosity", SIGGRAPH 1997. A path carries power Φ; where it meets a surface of albedo ρ it deposits a
VPL of flux ρΦ, and goes on with probability max ρ (Russian roulette), so that the power of what goes on stays that of the path
but for its colour. Interpolated normals count by cosθ_shading/cosθ_geometric of the arriving light (E. Veach, "Robust Monte Carlo
Methods for Light Transport Simulation", 1997, §5.3): with it a VPL is the surface's diffuse radiance about its geometric normal.
"""

from dataclasses import dataclass, fields, replace

import numpy as np

from ...numerics.sampling import about, cosine_hemisphere, hash_u32, sobol_owen_at, sphere_from_square
from ...scene import Light
from ..context import LightContext
from ..lights.beam import Beam
from ..lights.kind import Emission
from ..lights.shaped import arriving_share, emit
from ..rays.tracer import Hits, Tracer, offset_origins
from ..vectors import dot, luminance, normalized
from .numbers import ROULETTE, SCATTER, PathNumbers
from .wavefront import Vertices, Wavefront

# Sources that are no lamps, in VirtualLights.source.
FROM_EMITTERS, FROM_WORLD = -1, -2
# The ratio of cosines under interpolated normals is unbounded at silhouettes of coarse meshes; beyond this it is cut.
MAX_SHADING_GAIN = 4.0
# Tell the numbers of lamps, emitters, the world, and of where the world's paths begin apart from one another, and from all others
# of a seed: the letters la, em, wo and wp.
_LAMPS, _EMITTERS, _WORLD, _WORLD_PLACES = 0x6C61, 0x656D, 0x776F, 0x7770
# The world's bright patches get at least this share of its samples, and leave as much to the rest.
_LEAST_SHARE = 0.1
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
    key = hash_u32(seed, lamp, _LAMPS)
    u = sobol_owen_at(index, 4, key)
    emission, u = emit(light, u, beam)
    numbers = PathNumbers(np.full(len(index), key), index.astype(np.uint32))
    return trace(context, light, lamp, emission, u[:, 2:], numbers, bounces, beam)


def emitter_paths(context: LightContext, index: np.ndarray, bounces: int | None, seed: int) -> LightPaths:
    """As ``lamp_paths``, from emissive triangles; the first VPL of each is the emitter's own light (bounce 0)."""
    key = hash_u32(seed, _EMITTERS)
    u = sobol_owen_at(index, 5, key)
    emitted = context.emitters.sample(u[:, :3])
    # Both faces shine: half of the square of directions is for each.
    back = u[:, 3] >= 0.5
    normals = np.where(back[:, None], -emitted.normals, emitted.normals)
    local = cosine_hemisphere(np.stack([2.0 * u[:, 3] - back, u[:, 4]], axis=1).astype(np.float32))
    directions = normalized(about(normals, local))
    origins = offset_origins(emitted.points, normals, normals)
    power = context.emitters.radiance(emitted, -directions) * (np.float32(2.0 * np.pi) / emitted.pdf_area)[:, None]
    n, numbers = len(index), PathNumbers(np.full(len(index), key), index.astype(np.uint32))
    emission, u = Emission(origins, directions, power, directions), np.zeros((n, 2), np.float32)
    if meets_all(context):
        paths = _walk(context, emission, numbers, bounces, FROM_EMITTERS, u)
    else:
        emitter, links = context.geometry.instance[emitted.primitive], context.links
        blockers, visible = links.emitter_blockers(emitter), context.geometry.visibility.shadow
        paths = _through(context, emission, numbers, bounces, FROM_EMITTERS, u,
                         lambda rows, instance: visible[instance] & links.blockers[blockers[rows], instance],
                         lambda rows, instance: links.emitter_lights(emitter[rows], instance))
    return replace(paths, positions=np.concatenate([origins, paths.positions]), normals=np.concatenate([normals, paths.normals]),
                   throughput=np.concatenate([np.ones((n, 3), np.float32), paths.throughput]),
                   bounce=np.concatenate([np.zeros(n, np.int16), paths.bounce]),
                   path=np.concatenate([np.arange(n), paths.path]))


def world_directions(context: LightContext, index: np.ndarray, seed: int) -> tuple[np.ndarray, np.ndarray]:
    """Directions of travel (n, 3) of light from the world, and radiance over density (n, 3) [W·m⁻²] (their mean is the world's)."""
    environment, key = context.environment, hash_u32(seed, _WORLD)
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
    return float(np.clip(bright / max(bright + base, 1e-30), _LEAST_SHARE, 1.0 - _LEAST_SHARE))


_SQUARE = sobol_owen_at(np.arange(256), 2, 1)


def world_paths(context: LightContext, index: np.ndarray, beam: Beam, bounces: int | None, seed: int) -> LightPaths:
    """As ``lamp_paths``, from the world."""
    directions, weight = world_directions(context, index, seed)
    key = hash_u32(seed, _WORLD_PLACES)
    origins, area = beam.origins(directions, sobol_owen_at(index, 2, key, shuffle=True))
    numbers = PathNumbers(np.full(len(index), key), index.astype(np.uint32))
    return _walk(context, Emission(origins, directions, weight * area[:, None], directions), numbers, bounces, FROM_WORLD,
                 np.zeros((len(index), 2), np.float32))


def trace(context: LightContext, light: Light, lamp: int, emission: Emission, u: np.ndarray, numbers: PathNumbers,
          bounces: int | None, beam: Beam) -> LightPaths:
    """Follow what ``light`` emits. What casts no shadow of it is lit, and lets it on to what lies behind: each surface along a ray
    begins a path of its own."""
    bounces = at_most(light, bounces)
    if meets_all(context, light, lamp):
        paths = _walk(context, emission, numbers, bounces, lamp, u)
    else:
        stops = blocking_instances(context, light, lamp)
        paths = _through(context, emission, numbers, bounces, lamp, u, lambda rows, instance: stops[instance],
                         lambda rows, instance: context.links.lamp_lights(lamp, instance))
    return replace(paths, power=paths.power * arriving_share(light, paths.first, paths.u, beam))


def _through(context: LightContext, emission: Emission, numbers: PathNumbers, bounces: int | None, source: int, u: np.ndarray,
             stops, lights) -> LightPaths:
    """As ``_walk``, past what does not stop the light. ``stops(rows, instance)`` and ``lights(rows, instance)``, (m,) bool, say
    whether what lies on ``instance`` (m,) stops the rays ``rows`` (m,), and whether these light it."""
    parts, rows, origins = [], np.arange(len(u)), emission.origins
    for _ in range(MAX_LAYERS):
        part = Emission(origins, *(array[rows] for array in emission[1:]))
        hits = _tracer(context, source, 1).intersect(part.origins, part.directions)
        met = np.flatnonzero(hits.primitive >= 0)
        instance = context.geometry.instance[hits.primitive[met]]
        share = np.zeros(len(rows), np.float32)
        share[met] = _taken_share(context, part, hits, met) * lights(rows[met], instance)
        parts.append(_walk(context, part, numbers.take(rows), bounces, source, u[rows], hits, share))
        on = met[~stops(rows[met], instance)]
        if on.size == 0 or bounces == 0:
            break
        rows, points = rows[on], parts[-1].first[on]
        reach = np.abs(points - part.origins[on]).max(axis=1)
        # Once back onto the surface that the point was moved off, and once through it.
        for _ in range(2):
            points = offset_origins(points, parts[-1].first_normal[on], part.directions[on], reach)
        origins = points
    return join(parts)


def at_most(light: Light, bounces: int | None) -> int | None:
    """How often the light of ``light`` is reflected where ``bounces`` (None: any number) are asked for."""
    if light.max_bounces is None:
        return bounces
    return light.max_bounces + 1 if bounces is None else min(bounces, light.max_bounces + 1)


def blocking_instances(context: LightContext, light: Light, lamp: int) -> np.ndarray:
    """(i,) bool: what casts a shadow of ``light``, which is number ``lamp``."""
    visible, links = context.geometry.visibility, context.links
    return visible.shadow & links.blockers[int(links.lamp_blockers(lamp))] & light.casts_shadow


def meets_all(context: LightContext, light: Light | None = None, lamp: int = 0) -> bool:
    """Whether ``light``, which is number ``lamp`` (None: of emissive surfaces), lights every surface that it meets and goes on past
    none."""
    visible, links = context.geometry.visibility, context.links
    if light is None:
        return not links.restricts_emitters and all(part.all() for part in visible)
    return (light.casts_shadow and light.linking is None and not context.surfaces.keeps_shadow.any()
            and all(part.all() for part in visible))


def _taken_share(context: LightContext, part: Emission, hits: Hits, met: np.ndarray) -> np.ndarray:
    """Share (m,) of the light that the surfaces among ``hits`` at ``met`` (m,) take: nothing where nobody sees them, and of
    what keeps shadow rays, whatever it shows, what it covers."""
    primitive, visible, surfaces = hits.primitive[met], context.geometry.visibility, context.surfaces
    share = (visible.camera | visible.diffuse)[context.geometry.instance[primitive]].astype(np.float32)
    halting = np.flatnonzero(surfaces.keeps_shadow[context.geometry.material[primitive]])
    rows = met[halting]
    cosine = -dot(context.geometry.normals_world[primitive[halting]], part.directions[rows])
    share[halting] *= surfaces.coverage(primitive[halting], hits.u[rows], hits.v[rows], cosine)
    return share


def _tracer(context: LightContext, source: int, depth: int) -> Tracer:
    """The tracer of the segment number ``depth`` of paths from ``source``."""
    if depth > 1 or source == FROM_WORLD:
        return context.tracers.diffuse
    whole, points = context.tracers.light, context.tracers.light.of_points()
    return points if points is not whole and source >= 0 and context.lamps.is_delta[source] else whole


def shading_gain(shading: np.ndarray, geometric: np.ndarray, directions: np.ndarray) -> np.ndarray:
    """(n,) cosθ_shading/cosθ_geometric of light that travels along ``directions`` (n, 3), cut at MAX_SHADING_GAIN."""
    arriving = -dot(shading, directions)
    return np.clip(arriving / np.maximum(-dot(geometric, directions), np.float32(1e-6)), 0.0, np.float32(MAX_SHADING_GAIN))


def _passed(context: LightContext, met: Vertices, throughput: np.ndarray, depth: int, rows: np.ndarray) -> tuple:
    """VPLs (as in ``_walk``) on the other side of translucent surfaces that light ``met`` with ``throughput`` (n, 3)."""
    chosen = np.flatnonzero(context.surfaces.translucent[context.geometry.material[met.primitive]])
    part = met.take(chosen)
    points, geometric, _ = part.facing(context, np.ones(len(chosen), bool))
    passed = context.surfaces.translucency(part.primitive, part.u, part.v, -part.cosine(context))
    return points, geometric, throughput[chosen] * passed, np.full(len(chosen), depth, np.int16), rows[chosen]


def _walk(context, emission: Emission, numbers, bounces, source, u, first_hits: Hits | None = None,
          share: np.ndarray | None = None) -> LightPaths:
    """Trace paths until roulette or ``bounces`` ends them; the power of ``emission`` leaves with each. ``first_hits`` are those of
    the rays that leave the light, where they are known already, and ``share`` (p,) what the surfaces there take of it."""
    p = len(emission.origins)
    # What meets nothing is remembered by a point far along its ray.
    first = (emission.origins + emission.directions * np.float32(_FAR)).astype(np.float32)
    first_normal, first_shading = np.zeros((p, 3), np.float32), np.zeros((p, 3), np.float32)
    power, domain = np.array(emission.power, np.float32), emission.domain
    paths = Wavefront(np.arange(p), emission.origins, emission.directions, np.ones((p, 3), np.float32), numbers)
    if bounces == 0:
        paths = paths.take(np.zeros(0, np.int64))
    deposits, depth = [], 0
    while paths.rows.size:
        depth += 1
        hits = first_hits
        if hits is None or depth > 1:
            hits = _tracer(context, source, depth).intersect(paths.origins, paths.directions)
        found, met = Vertices.of(hits, paths.directions)
        paths = paths.take(found)
        if hits.tint is not None and depth == 1 and source != FROM_EMITTERS:
            power[paths.rows] *= hits.tint[found]
        elif hits.tint is not None:
            paths = paths.carrying(paths.throughput * hits.tint[found])
        points, geometric, shading = met.facing(context)
        gain = shading_gain(shading, geometric, paths.directions)[:, None]
        throughput, rows = paths.throughput, paths.rows
        if depth == 1:
            # The first surface's part belongs to the path of a lamp: it changes as that moves.
            first[rows], first_normal[rows], first_shading[rows] = points, geometric, shading
            throughput = throughput if share is None else throughput * share[rows, None]
        if depth == 1 and source != FROM_EMITTERS:
            power[rows] *= gain
        else:
            throughput = throughput * gain
        albedo = context.surfaces.albedo_of_side(met.primitive, met.u, met.v, met.cosine(context))
        deposits.append((points, geometric, throughput * albedo, np.full(len(rows), depth, np.int16), rows))
        if context.surfaces.has_translucency:
            deposits.append(_passed(context, met, throughput, depth, rows))
        if bounces is not None and depth >= bounces:
            break
        carried, through = met.choose_side(context, albedo, -met.cosine(context), paths.numbers, depth)
        if through is not None:
            points, geometric, _ = met.facing(context, through)
        chance = np.minimum(carried.max(axis=1), np.float32(1.0))
        kept = np.flatnonzero(paths.numbers.draw(depth, ROULETTE, 1)[:, 0] < chance)
        numbers = paths.numbers.take(kept)
        directions = normalized(about(geometric[kept], cosine_hemisphere(numbers.draw(depth, SCATTER, 2))))
        throughput = throughput[kept] * carried[kept] / chance[kept, None]
        paths = Wavefront(rows[kept], points[kept], directions, throughput, numbers)
    if not deposits:
        deposits = [(np.zeros((0, 3), np.float32),) * 3 + (np.zeros(0, np.int16), np.zeros(0, np.int64))]
    positions, normals, throughput, bounce, path = (np.concatenate(column) for column in zip(*deposits, strict=True))
    lit = np.flatnonzero(np.any(throughput > 0, axis=1))
    return LightPaths(np.full(p, source, np.int32), u.astype(np.float32), domain.astype(np.float32), power, first, first_normal,
                      first_shading, positions[lit], normals[lit], throughput[lit], bounce[lit], path[lit])
