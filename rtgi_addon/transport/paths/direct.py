"""Next-event estimation: shadow rays to lamps, emissive triangles and bright patches of the world."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from ..context import LightContext
from ..lights.emitters import EmitterSamples
from ..parallel import chunks
from ..rays.tracer import offset_origins, short_of
from ..vectors import dot, largest
from .numbers import BRIGHT, EMITTER, LAMP
from .wavefront import Vertices

# Points and lamps that are weighed against each other at a time, each pair of them in some ten bytes.
PAIRS = 1 << 21
# The density of a ray that was not drawn: light sampling never competes with it.
NO_DENSITY = np.float32(np.inf)


class Receiver(NamedTuple):
    """A surface that light arrives on: unit ``shading`` and ``face`` normals (n, 3) on the lit side, triangles ``primitive`` (n,)
    for light linking; None: ones that all light reaches."""

    shading: np.ndarray
    face: np.ndarray
    primitive: np.ndarray | None = None

    def instance(self, context: LightContext) -> np.ndarray | None:
        """The instances (n,) that it lies on."""
        return None if self.primitive is None else context.geometry.instance[self.primitive]


def direct_irradiance(context, points, receiver: Receiver, numbers, depth, lamps: Sequence[int] | None = None) -> np.ndarray:
    """An unbiased estimate (n, 3) [W·m⁻²] of the irradiance that light sources give ``points`` (n, 3), already off their surface.

    Emissive triangles are weighted against hemisphere rays of density cosθ/π; ``lamps`` are the indices of those that count (None:
    all). The light is on its way to what is looked at from after ``depth`` reflections in all.
    """
    result = np.zeros((len(points), 3), np.float32)
    if context.lamps.count if lamps is None else len(lamps):
        result += lamp_irradiance(context, points, receiver, numbers.draw(depth, LAMP, 3), depth, lamps)
    for _, irradiance in sample_environment(context, points, numbers, depth, 1.0, receiver):
        result += irradiance
    return result


def sample_environment(context, points, numbers, depth, per_ray, receiver=None, emitters=True):
    """Sample what a probe sees of light sources from ``points`` (n, 3): yields directions (n, 3) and contributions (n, 3), with
    shadows, of emissive triangles and of bright world patches, where there are any.

    A contribution is radiance over density; at a ``receiver`` times the cosine. What rays find of emissive triangles as well is
    ``per_ray`` of ``connect_emitters``; ``emitters`` False leaves those to rays.
    """
    if emitters and context.emitters.count:
        emitted = context.emitters.sample(numbers.draw(depth, EMITTER, 3))
        yield connect_emitters(context, emitted, points, 1.0, per_ray, receiver)
    if context.environment.bright.count:
        directions, light = context.environment.bright.sample(numbers.draw(depth, BRIGHT, 2))
        lit = np.ones(len(directions), bool)
        if receiver is not None:
            lit = _above(receiver, directions)
            light = light * np.maximum(dot(receiver.shading, directions), 0.0)[:, None]
        yield directions, unshadowed(context, points, directions, None, light, lit, looked=receiver is None)


def connect_emitters(context: LightContext, emitted: EmitterSamples, points: np.ndarray, per_light: float, per_ray: float,
                     receiver: Receiver | None = None) -> tuple[np.ndarray, np.ndarray]:
    """Join ``points`` (n, 3) to as many points on emissive surfaces, one connection each.

    Returns unit directions (n, 3) and contributions (n, 3) = L·T·V / (per_light·p + per_ray·T): T is cosine·cosine/distance² [m⁻²]
    at a ``receiver``, from which ``per_ray`` rays of density cosθ/π go as well; in free space (None) it is cosine/distance², and
    ``per_ray`` the density [1/sr] of all rays together. p is the density of emissive points, so this is the balance heuristic's
    share (Veach and Guibas 1995) of what ``per_light`` connections and those rays find together.
    """
    towards = emitted.points - points
    squared = np.maximum(dot(towards, towards), np.float32(1e-20))
    distance = np.sqrt(squared)
    directions = towards / distance[:, None]
    cosine = np.abs(dot(emitted.normals, directions))
    if receiver is None:
        transfer = cosine / squared
        found_by_rays = np.float32(per_ray) * transfer
    else:
        transfer = np.maximum(dot(receiver.shading, directions), 0) * cosine / squared
        transfer *= dot(receiver.face, directions) > 0
        found_by_rays = np.float32(per_ray) * transfer / np.float32(np.pi)
        points = offset_origins(points, receiver.face, receiver.face)
    links, emitter = context.links, context.geometry.instance[emitted.primitive]
    if links.emitters_have_blockers and receiver is not None:
        found_by_rays = np.where(links.emitter_blockers(emitter) == 0, found_by_rays, np.float32(0))
    share = transfer / np.maximum(np.float32(per_light) * emitted.pdf_area + found_by_rays, np.float32(1e-30))
    limits = short_of(distance, points, emitted.points)
    lit, arriving = transfer > 0, context.emitters.radiance(emitted, directions) * share[:, None]
    if links.has_receivers and receiver is not None:
        lit &= links.emitter_lights(emitter, receiver.instance(context))
    blockers = links.emitter_blockers(emitter) if links.emitters_have_blockers and receiver is not None else 0
    return directions, unshadowed(context, points, directions, limits, arriving, lit, blockers=blockers, looked=receiver is None)


def emitter_weight(context: LightContext, met: Vertices, density: np.ndarray) -> np.ndarray:
    """Balance heuristic (n,) for rays of solid-angle ``density`` (n,) that ``met`` emissive triangles, against one connection."""
    toward = np.abs(dot(met.normals(context), met.directions))
    sampled = context.emitters.pdf_area(met.primitive, met.u, met.v) * met.t * met.t / np.maximum(toward, 1e-12)
    with np.errstate(invalid="ignore"):
        return np.where(np.isinf(density), np.float32(1.0), density / (density + sampled))


def lamp_irradiance(context, points, receiver: Receiver, u, depth=0, lamps: Sequence[int] | None = None) -> np.ndarray:
    """An unbiased estimate (n, 3) [W·m⁻²] of what ``lamps`` (indices; None: all) give ``points`` (n, 3): one lamp each, drawn by
    ``u`` (n, 3). Those whose light may not be reflected ``depth`` times before it is looked at (see ``Lamp``) give none."""
    lamp, chance = choose_lamp(context, points, receiver, u[:, 0], depth, lamps)
    sample = context.lamps.sample(lamp, points, u[:, 1:])
    cosine = dot(receiver.shading, sample.direction)
    arriving = sample.irradiance * (np.maximum(cosine, 0.0) / np.maximum(chance, 1e-30))[:, None]
    lit = (cosine > 0) & (dot(receiver.face, sample.direction) > 0) & (chance > 0)
    shadowless = ~context.lamps.casts_shadow[lamp]
    blockers = context.links.lamp_blockers(lamp) if context.links.has_blockers else 0
    return unshadowed(context, points, sample.direction, short_of(sample.distance), arriving, lit, shadowless,
                      context.lamps.is_delta[lamp], blockers)


def choose_lamp(context, points, receiver, u, depth, wanted) -> tuple[np.ndarray, np.ndarray]:
    """A lamp for each point by its estimated unshadowed irradiance, drawn by ``u`` (n,), and the probability of the choice (0: none
    can reach it); ``wanted`` and ``depth`` as ``lamp_irradiance`` has them."""
    links, lamps = context.links, context.lamps
    instance = receiver.instance(context) if links.has_receivers else None
    reaches = np.flatnonzero(lamps.max_bounces >= depth - 1)
    if wanted is not None:
        reaches = np.intersect1d(reaches, np.asarray(wanted, np.intp))
    if lamps.count == 1:
        chance = np.full(len(points), len(reaches), np.float32)
        return np.zeros(len(points), np.intp), chance if instance is None else chance * links.lamp_lights(0, instance)

    def choose(rows):
        estimates = lamps.luminance_unshadowed(points[rows], receiver.shading[rows])
        if len(reaches) < lamps.count:
            estimates[np.setdiff1d(np.arange(lamps.count), reaches)] = 0.0
        if instance is not None:
            estimates *= links.lamp_lights(np.arange(lamps.count)[:, None], instance[rows])
        return choose_among(estimates, u[rows])

    blocks = [choose(rows) for rows in chunks(len(points), max(1, PAIRS // lamps.count)) or [slice(0, 0)]]
    return tuple(np.concatenate(parts) for parts in zip(*blocks, strict=True))


def choose_among(estimates: np.ndarray, u: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """One of the lamps with ``estimates`` (lamps, n) of their light for each of n points, by ``u`` (n,) in [0, 1), and how likely
    it was (n,): 0 where none has any."""
    lamps, n = estimates.shape
    cumulative = np.cumsum(estimates, axis=0, dtype=np.float64)
    total = cumulative[-1]
    target = u * total
    chosen = np.minimum(np.sum(cumulative <= target, axis=0), lamps - 1)
    columns = np.arange(n)
    below = np.where(chosen > 0, cumulative[chosen - 1, columns], 0.0)
    chance = (cumulative[chosen, columns] - below) / np.maximum(total, 1e-300)
    return chosen, chance.astype(np.float32)


def _above(receiver, directions) -> np.ndarray:
    return (dot(receiver.shading, directions) > 0) & (dot(receiver.face, directions) > 0)


def unshadowed(context: LightContext, points: np.ndarray, directions: np.ndarray, limits: np.ndarray | None, arriving: np.ndarray,
               lit: np.ndarray, shadowless: np.ndarray | None = None, is_delta: np.ndarray | None = None,
               blockers=0, looked: bool = False) -> np.ndarray:
    """What surfaces leave of ``arriving`` light (n, 3), which is ``lit`` (n,) bool or 0, on its way to ``points`` (n, 3), along
    ``directions`` (n, 3) up to ``limits`` (n,) (None: anywhere); ``shadowless`` (n,) bool asks for no ray, ``is_delta`` (n,) bool
    is light of lamps without a size, ``blockers`` (one, or (n,)) are the sets of instances in the way. ``looked``: what counts is
    what a look passes on its way, not what throws a shadow."""
    lit = lit & (largest(arriving) > 0)
    rows = np.flatnonzero(lit if shadowless is None else lit & ~shadowless)
    arriving = np.where(lit[:, None], arriving, np.float32(0.0))
    if rows.size:
        limits = None if limits is None else limits[rows]
        if looked:
            arriving[rows] *= context.tracers.view.transmittance(points[rows], directions[rows], limits)
            return arriving
        delta = False if is_delta is None else is_delta[rows]
        chosen = blockers if np.ndim(blockers) == 0 else blockers[rows]
        arriving[rows] *= context.lamp_transmittance(delta, points[rows], directions[rows], limits, chosen)
    return arriving
