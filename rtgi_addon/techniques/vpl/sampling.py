"""Which virtual lights to keep: light paths shared out by power, and of what they leave the part that lights the volumes.

Source: I. Georgiev and P. Slusallek, "Simple and Robust Iterative Importance Sampling of Virtual Point Lights", Eurographics 2010:
a candidate is kept with a probability in proportion to what it gives to pilot receivers, and counts by the inverse. Every
candidate keeps some chance by its flux alone, so nothing is left out for good and the estimate stays unbiased.
"""

from dataclasses import dataclass, replace

import numpy as np

from ...numerics import octahedral
from ...numerics.grid import z_order
from ...numerics.sampling import hash_u32, sobol_owen, sphere_from_square
from ...progress import Progress
from ...scene import ProbeVolume
from ...scene.memory import require_memory
from ...transport.context import LightContext
from ...transport.lights.beam import Beam
from ...transport.parallel import chunks, parallel_for
from ...transport.paths.from_lights import (
    FROM_EMITTERS,
    FROM_WORLD,
    LightPaths,
    emitter_paths,
    join,
    lamp_paths,
    no_paths,
    world_directions,
    world_paths,
)
from ...transport.rays.tracer import offset_origins
from ...transport.vectors import faced, luminance
from ..lattice.resample import thread_bytes
from .gather import BLOCK_PAIRS, cast_shadows, transfer_of
from .virtual_lights import VirtualLights

# Pilot receivers: so many free points of the volumes, and as many on the surfaces seen from them.
PILOTS = 48
# Numbers of a pilot: a place in a volume, and a direction from there.
_PILOT_DIMENSIONS = 5
# Tell the pilots' numbers, and where choices start, apart from all others of a seed: the letters pi and sy.
_PILOTS, _SYSTEMATIC = 0x7069, 0x7379
# Chance of a candidate by its flux alone, against that by what the pilots get from it.
FLUX_SHARE = 0.1
# Pilots take lights nearer than this share of the volumes' radius as this near: one of them shall not decide alone.
NEAREST = 0.1
# With fewer effective candidates than lights asked for, so many times more paths are traced, in so many rounds at most.
MORE_PATHS, MAX_ROUNDS = 4, 2
# One distant light for so many VPLs where there is a world, and candidates tried for each.
DISTANT_SHARE, DISTANT_CANDIDATES = 0.25, 4
# And no fewer than so many.
FEWEST_DISTANT = 64
# Directions in which the world's power is estimated.
_WORLD_DIRECTIONS = 256
# Candidates that a path leaves where half of the light is reflected; memory of each at the peak, measured with up to a million.
_CANDIDATES_PER_PATH, BYTES_PER_CANDIDATE = 2, 230
# How far a round of sampling is when its paths are traced.
_TRACED = 0.3
# Halvings of the interval in which the scale of chances lies: more than a float64 tells apart.
_BISECTIONS = 60
# Bits of a place on the Z-order curve along each axis, and what a box is wide there: its far side belongs to the last cell.
_MORTON_BITS, _MORTON_WIDTH = 10, 1023.999


@dataclass(frozen=True, eq=False)
class Pilots:
    """Receivers on which lights are tried: free ``points`` (a, 3), and ``surface`` points (b, 3) with unit ``normals`` (b, 3);
    ``bound`` [m⁻²] limits their geometry terms."""

    points: np.ndarray
    surface: np.ndarray
    normals: np.ndarray
    bound: float


@dataclass(frozen=True, eq=False)
class LightSet:
    """The virtual lights of one state of the scene's sources, with what it takes to follow a change.

    ``paths`` holds the kept VPLs; ``radius`` [m] is that of the volumes' common sphere; ``weights`` (3,) make one number of a
    candidate's colour, and ``by_contribution`` and ``by_flux`` a chance of what the pilots get of that and of its flux;
    ``directions`` and ``irradiance`` (m, 3) are the distant lights; ``generation`` counts the changes.
    """

    paths: LightPaths
    beam: Beam
    radius: float
    pilots: Pilots
    weights: np.ndarray
    by_contribution: float
    by_flux: float
    directions: np.ndarray
    irradiance: np.ndarray
    generation: int = 0

    def lights(self) -> VirtualLights:
        """As an array of lights, those near one another together, so that their rays are too."""
        paths = self.paths
        order = np.argsort(morton(paths.positions), kind="stable")
        lights = VirtualLights(paths.positions, paths.normals, paths.flux.astype(np.float32), paths.source[paths.path],
                               np.minimum(paths.bounce, np.iinfo(np.int8).max).astype(np.int8), paths.path.astype(np.int32))
        return lights.take(order).with_distant(self.directions, self.irradiance)


def pilots_in(context: LightContext, volumes: tuple[ProbeVolume, ...], radius: float, seed: int) -> Pilots:
    """Receivers in and about ``volumes``, whose common sphere has ``radius`` [m]."""
    u = sobol_owen(PILOTS, _PILOT_DIMENSIONS, hash_u32(seed, _PILOTS))
    matrices = np.stack([np.asarray(volume.world_from_local, np.float64) for volume in volumes])
    chosen = matrices[np.arange(PILOTS) % len(volumes)]
    points = (np.einsum("nij,nj->ni", chosen[:, :3, :3], 2.0 * u[:, :3] - 1.0) + chosen[:, :3, 3]).astype(np.float32)
    directions = sphere_from_square(u[:, 3:])
    hits = context.tracer.intersect(points, directions)
    rows = np.flatnonzero(hits.primitive >= 0)
    primitive = hits.primitive[rows]
    normals = faced(context.geometry.normals_world[primitive], directions[rows])
    surface = offset_origins(context.geometry.points(primitive, hits.u[rows], hits.v[rows]), normals, normals, hits.t[rows])
    return Pilots(points, surface, normals, 1.0 / (NEAREST * max(radius, 1e-6)) ** 2)


def sample_lights(context: LightContext, volumes: tuple[ProbeVolume, ...], settings, seed: int, focus: tuple[np.ndarray, float],
                  progress: Progress) -> LightSet:
    """About ``settings.lights`` virtual lights for ``volumes``, whose common sphere is ``focus`` (centre, radius)."""
    beam = Beam(np.array(context.geometry.bounds()), *focus)
    pilots = pilots_in(context, volumes, focus[1], seed)
    distant = distant_lights(context, pilots, settings.lights, seed)
    paths = no_paths()
    for rounds in range(MAX_ROUNDS):
        span = progress.span(rounds / MAX_ROUNDS, (rounds + 1) / MAX_ROUNDS)
        counts = paths_per_source(context, beam, focus[1], path_count(settings) * MORE_PATHS**rounds)
        candidates = MORE_PATHS * len(paths.path) if rounds else sum(count for _, count in counts) * _CANDIDATES_PER_PATH
        require_memory({"virtual lights": candidates * BYTES_PER_CANDIDATE, "threads": thread_bytes(context)})
        paths = _all_paths(context, counts, beam, settings.bounces, seed, span.span(0.0, _TRACED))
        transfer = pilot_transfer(context, paths, pilots, span.span(_TRACED, 1.0))
        reached = luminance(paths.flux) * transfer
        # As many as would give the same variance if all gave the same (Kish).
        if not reached.any() or reached.sum() ** 2 >= settings.lights * (reached**2).sum():
            break
    # A channel counts by its share of all light in that channel: what is dim in all of them is dim for any eye.
    totals = paths.flux.sum(axis=0, dtype=np.float64)
    weights = np.where(totals > 0, 1.0 / np.maximum(totals, 1e-300), 0.0)
    flux = paths.flux @ weights
    scales = _scales(transfer * flux, flux, settings.lights)
    return choose(LightSet(paths, beam, focus[1], pilots, weights, *scales, *distant), paths, flux, transfer, seed)


def _all_paths(context, counts, beam, bounces, seed, progress) -> LightPaths:
    """The paths of every (source, number) in ``counts``."""
    parts = parallel_for(lambda i: source_paths(context, *counts[i], beam, bounces, seed), len(counts), context.threads, progress,
                         "light paths")
    return join(parts) if parts else no_paths()


def path_count(settings) -> int:
    """Light paths that leave about ``candidates`` VPLs for each that is kept, where half of the light is reflected."""
    return max(1, settings.lights * settings.candidates // _CANDIDATES_PER_PATH)


def source_paths(context: LightContext, source: int, count: int, beam: Beam, bounces: int | None, seed: int) -> LightPaths:
    """``count`` paths from one source, which share its power."""
    index = np.arange(count)
    if source == FROM_EMITTERS:
        paths = emitter_paths(context, index, bounces, seed)
    elif source == FROM_WORLD:
        paths = world_paths(context, index, beam, bounces, seed)
    else:
        paths = lamp_paths(context, context.scene.lights[source], source, index, beam, bounces, seed)
    return replace(paths, power=paths.power / np.float32(count))


def paths_per_source(context: LightContext, beam: Beam, radius: float, total: int) -> list[tuple[int, int]]:
    """(source, number of paths) in proportion to luminous power, one at least; light from afar counts by what falls on a disk
    twice as wide as the volumes, the rest of which it lights for others."""
    disk = np.pi * min(2.0 * radius, beam.radius) ** 2
    power = context.lamps.power_estimate.astype(np.float64)
    power[context.lamps.is_distant] *= disk / np.pi
    sources = [(lamp, float(value)) for lamp, value in enumerate(power)]
    sources.append((FROM_EMITTERS, context.emitters.total_power))
    if not context.environment.is_black:
        _, value = world_directions(context, np.arange(_WORLD_DIRECTIONS), 0)
        sources.append((FROM_WORLD, float(luminance(value).mean()) * disk))
    sources = [(source, value) for source, value in sources if value > 0]
    whole = sum(value for _, value in sources)
    return [(source, max(1, round(total * value / whole))) for source, value in sources]


def pilot_transfer(context: LightContext, paths: LightPaths, pilots: Pilots, progress: Progress | None = None) -> np.ndarray:
    """(n,) float64 [m⁻²]: mean bounded geometry term between each VPL of ``paths`` and the pilots, shadows included."""
    count = len(paths.path)
    result = np.zeros(count)
    receivers = ((pilots.points, None), (pilots.surface, pilots.normals))
    widest = max(1, max(len(points) for points, _ in receivers))
    spans = chunks(count, max(1, BLOCK_PAIRS // widest))

    def work(i):
        span = spans[i]
        lights = VirtualLights.of(paths.positions[span], paths.normals[span], paths.positions[span])
        total = np.zeros(span.stop - span.start)
        for points, normals in receivers:
            towards, transfer = transfer_of(points, normals, lights, pilots.bound)
            tint = cast_shadows(context, points, towards, transfer)
            transfer = transfer if tint is None else transfer * tint.mean(axis=2)
            total += transfer.sum(axis=0, dtype=np.float64)
        result[span] = total

    parallel_for(work, len(spans), context.threads, progress, "choosing virtual lights")
    return result / max(1, sum(len(points) for points, _ in receivers))


def _scales(contribution: np.ndarray, flux: np.ndarray, budget: int) -> tuple[float, float]:
    """Factors with which min(1, factors · (contribution, flux)) sums to ``budget``, or to all there is if that is less."""
    total_flux, total = flux.sum(), contribution.sum()
    if total_flux == 0:
        return 0.0, 0.0
    share = FLUX_SHARE if total > 0 else 1.0
    chance = share * flux / total_flux + ((1.0 - share) * contribution / total if total > 0 else 0.0)
    if np.count_nonzero(chance) <= budget:
        scale = 1.0 / chance[chance > 0].min()
    else:
        low, high = 0.0, 1.0 / chance[chance > 0].min()
        for _ in range(_BISECTIONS):
            scale = 0.5 * (low + high)
            low, high = (scale, high) if np.minimum(1.0, scale * chance).sum() < budget else (low, scale)
    return (scale * (1.0 - share) / total if total > 0 else 0.0), scale * share / total_flux


def added_paths(context: LightContext, lights: LightSet, paths: LightPaths, seed: int) -> LightPaths:
    """``paths`` with as many of their VPLs as if they had been among the candidates for ``lights``."""
    return choose(lights, paths, paths.flux @ lights.weights, pilot_transfer(context, paths, lights.pilots), seed).paths


def choose(lights: LightSet, paths: LightPaths, flux: np.ndarray, transfer: np.ndarray, seed: int) -> LightSet:
    """``lights`` with ``paths`` of which each VPL is kept by its chance, and then counts by the inverse; ``flux`` (n,) weighted,
    ``transfer`` (n,) as by ``pilot_transfer``."""
    chance = np.minimum(flux * (lights.by_contribution * transfer + lights.by_flux), 1.0)
    rows = systematic(chance, morton(paths.positions), seed)
    return replace(lights, paths=paths.keep(rows, 1.0 / chance[rows]))


def systematic(chance: np.ndarray, order: np.ndarray, seed: int) -> np.ndarray:
    """Rows (k,) int64, ascending, each chosen with its ``chance`` (n,) in [0, 1]: evenly along the curve that ``order`` (n,) gives,
    so that the choice is as stratified as the rows are, and k is the sum of chances to within one."""
    along = np.argsort(order, kind="stable")
    start = int(hash_u32(seed, _SYSTEMATIC)) / 2.0**32
    steps = np.floor(np.cumsum(chance[along]) + start)
    chosen = np.diff(steps, prepend=np.floor(start)) > 0
    return np.sort(along[chosen])


def morton(points: np.ndarray) -> np.ndarray:
    """Places (n,) uint64 of ``points`` (n, d), d = 2 or 3, along a Z-order curve through their bounding box."""
    if len(points) == 0:
        return np.zeros(0, np.uint64)
    low = points.min(axis=0)
    extent = max(float((points.max(axis=0) - low).max()), 1e-30)
    return z_order(np.minimum((points - low) * (_MORTON_WIDTH / extent), 2**_MORTON_BITS - 1).astype(np.int64))


def distant_lights(context: LightContext, pilots: Pilots, budget: int, seed: int) -> tuple[np.ndarray, np.ndarray]:
    """Directions (m, 3) towards parts of the world and their irradiance (m, 3), m about a quarter of ``budget``: denser where more
    pilots see them."""
    if context.environment.is_black:
        return np.zeros((0, 3), np.float32), np.zeros((0, 3), np.float32)
    wanted = max(FEWEST_DISTANT, int(DISTANT_SHARE * budget))
    count = wanted * DISTANT_CANDIDATES
    travel, value = world_directions(context, np.arange(count), seed)
    directions, value = -travel, value / np.float32(count)
    receivers = np.concatenate([pilots.points, pilots.surface])
    free = np.zeros(count)
    for span in chunks(count, max(1, BLOCK_PAIRS // len(receivers))):
        rays = np.repeat(directions[span], len(receivers), axis=0)
        passed = context.tracer.transmittance(np.tile(receivers, (span.stop - span.start, 1)), rays)
        free[span] = passed.mean(axis=1).reshape(-1, len(receivers)).mean(axis=1)
    brightness = luminance(value).astype(np.float64)
    by_contribution, by_flux = _scales(free * brightness, brightness, wanted)
    chance = np.minimum(by_contribution * free * brightness + by_flux * brightness, 1.0)
    rows = systematic(chance, morton(octahedral.encode(directions)), seed)
    return directions[rows], (value[rows] / chance[rows, None]).astype(np.float32)
