"""Next-event estimation for the path reference: one shadow ray each to a lamp, an emissive triangle and a bright world patch."""

import numpy as np

from .path_numbers import BRIGHT, EMITTER, LAMP
from .rays import SELF_INTERSECTION
from .vectors import dot, luminance

# The density of a ray that was not drawn: light sampling never competes with it.
NO_DENSITY = np.float32(np.inf)
# Shadow rays stop short of what they aim at by this share of their length: a lamp may lie on a surface, an emitter always does.
SHORTENING = np.float32(1e-4)


def direct_irradiance(context, points, geometric, shading, numbers, depth, lamps=True) -> np.ndarray:
    """An unbiased estimate (n, 3) [W·m⁻²] of the irradiance that light sources give ``points`` (n, 3), already off their surface.

    ``geometric`` and ``shading`` (n, 3) are normals on the lit side. Emissive triangles are weighted against hemisphere rays of
    density cosθ/π; ``lamps`` False leaves lamps out.
    """
    result = np.zeros((len(points), 3), np.float32)
    if lamps and context.lamps.count:
        result += lamp_irradiance(context, points, geometric, shading, numbers.draw(depth, LAMP, 3))
    scattered = np.float32(1.0 / np.pi)
    for directions, radiance in sample_environment(context, points, numbers, depth,
                                                   lambda d: np.maximum(dot(shading, d), 0.0) * scattered, (geometric, shading)):
        result += radiance * np.maximum(dot(shading, directions), 0.0)[:, None]
    return result


def sample_environment(context, points, numbers, depth, density, normals=None):
    """Sample what a probe sees of light sources from ``points`` (n, 3): yields (directions (n, 3), radiance over density (n, 3))
    for emissive triangles and for bright world patches, shadowed, where there are any.

    ``density(directions)`` (n,) is that of the rays with which emissive triangles are hit as well. ``normals`` (geometric,
    shading) limits shadow rays to the side that counts.
    """
    if context.emitters.count:
        yield _sample_emitter(context, points, numbers.draw(depth, EMITTER, 3), density, normals)
    if context.environment.bright.count:
        directions, radiance = context.environment.bright.sample(numbers.draw(depth, BRIGHT, 2))
        lit = _above(normals, directions)
        yield directions, _unshadowed(context, points, directions, None, radiance, lit)


def emitter_weight(context, primitive, t, cosine, density) -> np.ndarray:
    """Balance heuristic (n,) for a ray of solid-angle ``density`` (n,) that hit a triangle at distance ``t`` under ``cosine``."""
    toward = np.abs(cosine)
    sampled = context.emitters.pdf_area(primitive) * t * t / np.maximum(toward, 1e-12)
    with np.errstate(invalid="ignore"):
        return np.where(np.isinf(density), np.float32(1.0), density / (density + sampled))


def lamp_irradiance(context, points, geometric, shading, u) -> np.ndarray:
    """An unbiased estimate (n, 3) [W·m⁻²] of what all lamps give ``points`` (n, 3): one lamp each, drawn by ``u`` (n, 3)."""
    lamp, chance = _choose_lamp(context.lamps, points, shading, u[:, 0])
    sample = context.lamps.sample(lamp, points, u[:, 1:])
    cosine = dot(shading, sample.direction)
    arriving = sample.irradiance * (np.maximum(cosine, 0.0) / np.maximum(chance, 1e-30))[:, None]
    lit = (cosine > 0) & (dot(geometric, sample.direction) > 0) & (chance > 0)
    limits = sample.distance * (1 - SHORTENING)
    shadowless = ~context.lamps.casts_shadow[lamp]
    return _unshadowed(context, points, sample.direction, limits, arriving, lit, shadowless)


def _choose_lamp(lamps, points, normals, u) -> tuple[np.ndarray, np.ndarray]:
    """A lamp for each point by its estimated unshadowed irradiance, and the probability of the choice (0: none can reach it)."""
    n = len(points)
    if lamps.count == 1:
        return np.zeros(n, np.intp), np.ones(n, np.float32)
    cumulative = np.empty((lamps.count, n), np.float64)
    total = np.zeros(n)
    for lamp in range(lamps.count):
        total += luminance(lamps.irradiance_unshadowed(lamp, points, normals))
        cumulative[lamp] = total
    target = u * total
    chosen = np.minimum(np.sum(cumulative <= target, axis=0), lamps.count - 1)
    columns = np.arange(n)
    below = np.where(chosen > 0, cumulative[chosen - 1, columns], 0.0)
    chance = (cumulative[chosen, columns] - below) / np.maximum(total, 1e-300)
    return chosen, chance.astype(np.float32)


def _sample_emitter(context, points, u, density, normals):
    targets, emitter_normals, radiance, pdf_area, _ = context.emitters.sample(u)
    towards = targets - points
    squared = np.maximum(dot(towards, towards), np.float32(1e-20))
    distance = np.sqrt(squared)
    directions = towards / distance[:, None]
    cosine = np.abs(dot(emitter_normals, directions))
    lit = _above(normals, directions) & (cosine > 1e-6)
    # Balance heuristic against the rays that hit emitters by themselves: f/(p_light + p_rays).
    sampled = pdf_area * squared / np.maximum(cosine, 1e-6)
    arriving = radiance / (sampled + density(directions))[:, None]
    reach = np.maximum(np.abs(targets).max(axis=1), np.abs(points).max(axis=1))
    limits = np.maximum(distance * (1 - SHORTENING) - 4 * SELF_INTERSECTION * reach, 0.0)
    return directions, _unshadowed(context, points, directions, limits, arriving, lit)


def _above(normals, directions) -> np.ndarray:
    if normals is None:
        return np.ones(len(directions), bool)
    return (dot(normals[0], directions) > 0) & (dot(normals[1], directions) > 0)


def _unshadowed(context, points, directions, limits, arriving, lit, shadowless=None) -> np.ndarray:
    """``arriving`` (n, 3) where ``lit`` and no surface is in the way, else 0."""
    lit = lit & np.any(arriving > 0, axis=1)
    rows = np.flatnonzero(lit if shadowless is None else lit & ~shadowless)
    if rows.size:
        blocked = context.tracer.occluded(points[rows], directions[rows], None if limits is None else limits[rows])
        lit[rows[blocked]] = False
    return np.where(lit[:, None], arriving, np.float32(0.0))
