"""Light that sources send into media and media scatter once: at a point, and along a ray, at points that each lamp's falloff draws.

A ray that passes a lamp sees most of its light scattered where it comes closest. Points that are drawn by what reaches the ray's
origin, whatever the light does, are rarely there. Points even in the angle under which the lamp sees them are (equiangular
sampling), more of them where more of its light is seen: what media leave, the phase function and the lamp's own cone or side are
looked up in the middle of parts of that angle. Both kinds of points are drawn, and weighted by the balance heuristic.

Source: C. Kulla and M. Fajardo, "Importance Sampling Techniques for Path Tracing in Participating Media", EGSR 2012, section 4.
"""

from typing import NamedTuple

import numpy as np

from ...numerics.sampling import hash_u32, unit_interval
from ..context import LightContext
from ..media.grid import Coefficients
from ..media.passage import Passage, Scattered
from ..media.phase import phase_value
from ..media.table import MediaTable
from ..vectors import dot, luminance, normalized
from .direct import choose_among
from .sources import Sources, Standing

# Sources beyond this number are chosen among, one a turn.
ALL_SOURCES = 4
# What numbers are drawn for: where on a source and which, where along a ray.
_SOURCE, _ALONG = 4, 6
# How far one source's numbers are shifted from the one's before it: see cache/hit_light.py.
_SHIFT = np.float32(0.381966)
# What share of the points is drawn by what reaches the ray's origin, in how many parts others' angles are.
_EVEN, _PARTS = 0.25, 8
# A lamp with a cone or a side is taken to send so much of its power [1/sr] to all others as well.
_ANYWAY = 0.02
# Lamps are never closer to a ray than this [m].
_CLOSEST = 1e-6


class Piece(NamedTuple):
    """Rays from ``origins`` (n, 3) along unit ``directions`` (n, 3), what they pass on their ``passage``, and the ``points`` (n, 3)
    where they are ``scattered`` on."""

    passage: Passage
    scattered: Scattered
    origins: np.ndarray
    directions: np.ndarray
    points: np.ndarray


def from_sources(context: LightContext, sources: Sources, media: MediaTable, found: list[Coefficients], points, coming, key,
                 turn: int) -> np.ndarray:
    """Radiance (n, 3) that light sources send on along ``-coming`` (n, 3) by one scattering at ``points`` (n, 3), per σ_s."""
    def sent(source, rows, uv):
        return _sent(sources, source, media, _part(found, rows), points[rows], coming[rows], uv)
    u = walk_numbers(key, turn, _SOURCE, 3)
    return _over_sources(sources, u, lambda u: sources.choose_in_space(points, u), sent)


def from_sources_along(context: LightContext, sources: Sources, piece: Piece, found: list[Coefficients], key,
                       turn: int) -> np.ndarray:
    """Radiance (n, 3) that light sources send to the origins of the rays of ``piece`` by one scattering on these. ``found`` is what
    media do at its points."""
    media, standing = context.media, sources.standing
    if not standing or len(key) == 0:
        return piece.scattered.weight * from_sources(context, sources, media, found, piece.points, piece.directions, key, turn)
    v = walk_numbers(key, turn, _ALONG, 3)

    def sent(source, rows, uv):
        scattered, directions = Scattered(*(part[rows] for part in piece.scattered)), piece.directions[rows]
        if source not in standing:
            return scattered.weight * _sent(sources, source, media, _part(found, rows), piece.points[rows], directions, uv)
        passage = piece.passage if len(rows) == len(key) else piece.passage.take(rows)
        origins = piece.origins[rows]
        lit = _towards(context, source, standing[source], passage, scattered, origins, directions, (v[rows] + _SHIFT * source) % 1)
        points = origins + directions * lit.distance[:, None].astype(np.float32)
        return lit.weight * _sent(sources, source, media, media.at(points), points, directions, uv)

    return _over_sources(sources, walk_numbers(key, turn, _SOURCE, 3), lambda u: _choose(sources, piece, u), sent)


def walk_numbers(key: np.ndarray, turn: int, purpose: int, dims: int) -> np.ndarray:
    """(n, dims) in [0, 1) for walks by ``key`` (n,) uint32 at a ``turn``."""
    return unit_interval(np.stack([hash_u32(key, turn, purpose, d) for d in range(dims)], axis=1))


def _over_sources(sources: Sources, u, choose, sent) -> np.ndarray:
    """The sum over all sources of what ``sent`` (source, rows, numbers (m, 2)) answers, or one that is ``choose``n by the last of
    ``u`` (n, 3) over how likely it was."""
    result, rows = np.zeros((len(u), 3)), np.arange(len(u))
    if sources.count <= ALL_SOURCES:
        for source in range(sources.count):
            result += sent(source, rows, (u[:, :2] + _SHIFT * source) % 1)
        return result
    chosen, chance = choose(u[:, 2])
    for source in np.unique(chosen).tolist():
        rows = np.flatnonzero(chosen == source)
        result[rows] = sent(source, rows, u[rows, :2]) / chance[rows, None]
    return result


def _choose(sources: Sources, piece: Piece, u) -> tuple[np.ndarray, np.ndarray]:
    """One source (n,) for each ray, and how likely it was (n,): one time of two by its light where the ray is scattered on, else by
    what a clear ray would see scattered of it, if it stands somewhere."""
    there = sources.weights_in_space(piece.points)
    weights = 0.5 * there / there.sum(axis=0)
    begin, end = piece.passage.scattering_between
    past = np.full(there.shape, 1e-30)
    for source, lamp in sources.standing.items():
        nearest, closest = _closest(piece.origins, piece.directions, lamp)
        past[source] += lamp.power / closest * (np.arctan((end - nearest) / closest) - np.arctan((begin - nearest) / closest))
    weights += 0.5 * past / past.sum(axis=0)
    return choose_among(weights, u)


def _towards(context: LightContext, source: int, lamp: Standing, passage: Passage, scattered: Scattered, origins, directions,
             v) -> Scattered:
    """Points on rays for the light of ``lamp``, one each by ``v`` (n, 3): the one where the ray is scattered on anyway, or one that
    is even in angle within one of ``_PARTS`` parts of it, chosen by what of the lamp's light would be seen from its middle."""
    nearest, closest = _closest(origins, directions, lamp)
    begin, end = (np.arctan((limit - nearest) / closest) for limit in passage.scattering_between)
    width = np.maximum((end - begin) / _PARTS, 1e-12)
    middle = begin[:, None] + width[:, None] * (np.arange(_PARTS) + 0.5)
    distances = nearest[:, None] + closest[:, None] * np.tan(middle)
    strength = passage.reaching(distances) * sum(phase_value(filling.medium.phase, -np.sin(middle)) for filling in
                                                 context.media.fillings if np.any(np.asarray(filling.medium.scattering) > 0))
    if lamp.directed:
        points = (origins[:, None] + directions[:, None] * distances[:, :, None].astype(np.float32)).reshape(-1, 3)
        towards = normalized(np.asarray(lamp.position, np.float32) - points)
        light = luminance(context.lamps.irradiance_unshadowed(source, points, towards)).reshape(strength.shape)
        # The edge of a cone, or a lamp's plane, may run through a part whose middle is dark.
        strength = strength * (light * (closest[:, None] / np.cos(middle)) ** 2 + _ANYWAY * lamp.power)
    upper = np.cumsum(strength, axis=1)
    total, rows = upper[:, -1], np.arange(len(width))
    part = np.minimum(np.sum(upper <= (v[:, 0] * total)[:, None], axis=1), _PARTS - 1)
    turned = nearest + closest * np.tan(begin + width * (part + v[:, 1]))
    distance = np.where((v[:, 2] < _EVEN) | (total <= 0), scattered.distance, turned)
    away = distance - nearest
    part = np.clip((np.arctan(away / closest) - begin) / width, 0, _PARTS - 1).astype(np.intp)
    by_angle = strength[rows, part] / np.maximum(total, 1e-300) / width * closest / (closest * closest + away * away)
    there, even = passage.met(distance)
    density = np.where(total > 0, _EVEN * even + (1.0 - _EVEN) * by_angle, even)
    return Scattered(distance, np.where((density > 0)[:, None], there / np.maximum(density, 1e-300)[:, None], 0.0))


def _closest(origins, directions, lamp: Standing) -> tuple[np.ndarray, np.ndarray]:
    """Where rays come closest to a ``lamp``: how far along (n,), and how far (n,) its light is from there, which is not less than
    its extent."""
    away = (lamp.position - origins).astype(np.float64)
    nearest = dot(away, directions)
    squared = np.maximum(dot(away, away) - nearest * nearest, 0.0)
    return nearest, np.sqrt(squared + max(lamp.extent, _CLOSEST) ** 2)


def _sent(sources: Sources, source: int, media: MediaTable, found, points, coming, uv) -> np.ndarray:
    """Radiance (n, 3) that one source sends on along ``-coming`` (n, 3) by one scattering at ``points`` (n, 3), per σ_s."""
    direction, irradiance = sources.facing_irradiance(source, points, uv)
    cosine, scattering = dot(coming, direction), np.maximum(sum(one.scattering for one in found), 1e-300)
    phase = sum(one.scattering * phase_value(filling.medium.phase, cosine)[:, None]
                for filling, one in zip(media.fillings, found, strict=True)) / scattering
    return phase * (irradiance * sources.scattered[source])


def _part(found: list[Coefficients], rows: np.ndarray) -> list[Coefficients]:
    """What media do at some of the points."""
    if found and len(rows) == len(found[0].scattering):
        return found
    return [Coefficients(*(part[rows] for part in one)) for one in found]
