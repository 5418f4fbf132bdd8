"""Light that media scatter, or give of themselves, towards points: walks through media until they end on a surface or in the sky.

From a point on a ray, drawn in proportion to what would reach its origin from there, a walk turns by the phase function and goes
on. On each of its pieces it meets every light source by a shadow ray of its own (`source_points`): suns and sky from that point,
lamps from one which their falloff draws. What it ends on is for others to look up. All orders of scattering are followed: Russian
roulette ends walks that carry little.

Source: the formal solution of the radiative transfer equation, sampled as in E. Veach, "Robust Monte Carlo Methods", 1997, and
forced to collide as in J. Spanier and E. Gelbard, "Monte Carlo Principles and Neutron Transport Problems", 1969.
"""

from dataclasses import dataclass

import numpy as np

from ...numerics.sampling import hash_u32, unit_interval
from ..context import LightContext
from ..media.grid import Coefficients
from ..media.passage import Scattered
from ..media.phase import phase_value, sample_phase
from ..media.table import CHUNK
from ..parallel import chunks
from ..vectors import dot
from .source_points import Piece, from_sources_along, walk_numbers
from .sources import Sources

# Walks that carry less than this share of what they began with go on by chance.
_LITTLE = 0.25
# No walk turns more often.
MOST_TURNS = 256
# What numbers are drawn for at a turn.
_DISTANCE, _GOES_ON, _TURN, _WHICH = range(4)


@dataclass(frozen=True, eq=False)
class Walks:
    """What media add along rays: ``emitted`` (n, 3), radiance of their own that arrives unscattered; ``gained`` (n, 3), what light
    sources give at turns, and media at later pieces of the walk; and where walks end: ``rows`` (e,) of the rays, the surface
    ``primitive`` (−1: none), ``u``, ``v``, ``t`` (e,) as in Hits, met along ``directions`` from ``points`` (e, 3), and ``tint``
    (e, 3), by which light that leaves it that way arrives."""

    emitted: np.ndarray
    gained: np.ndarray
    rows: np.ndarray
    primitive: np.ndarray
    u: np.ndarray
    v: np.ndarray
    t: np.ndarray
    directions: np.ndarray
    points: np.ndarray
    tint: np.ndarray


def walk(context: LightContext, sources: Sources, origins: np.ndarray, directions: np.ndarray, limits: np.ndarray, key: np.ndarray,
         weight: np.ndarray | None = None, most_turns: int | None = None) -> Walks:
    """Follow what comes along rays from ``origins`` (n, 3) in unit ``directions`` (n, 3) up to ``limits`` (n,), where they meet
    surfaces (infinite: none). ``key`` (n,) uint32 is what each ray's numbers come from. ``weight`` (n, 3) multiplies what surfaces
    between leave of it all; ``most_turns`` limits the orders of scattering."""
    parts = [_walk(context, sources, origins[rows], directions[rows], limits[rows], key[rows],
                   None if weight is None else weight[rows], rows.start, MOST_TURNS if most_turns is None else most_turns)
             for rows in chunks(len(origins), CHUNK) or [slice(0, 0)]]
    return Walks(*(np.concatenate([getattr(part, name) for part in parts]) for name in Walks.__dataclass_fields__))


def _walk(context, sources, origins, directions, limits, key, weight, offset, most_turns) -> Walks:
    media, n = context.media, len(origins)
    carried = np.ones((n, 3)) if weight is None else weight.astype(np.float64)
    gained, ends = np.zeros((n, 3)), []
    passage = media.passage(origins, directions, limits)
    emitted = carried * passage.emitted()
    scattered = passage.scatter(walk_numbers(key, 0, _DISTANCE, 2))
    before, carried = carried, carried * scattered.weight
    # No walk begins where next to nothing scatters.
    rows = np.flatnonzero(carried.max(axis=1) > 0)
    began = carried.max(axis=1)
    points = origins + directions * scattered.distance[:, None].astype(np.float32)
    turns = 0

    def meet_sources(chosen, origins, directions, weight):
        """Add light of sources to ``rows``, whose pieces are those ``chosen`` of the passage and carry ``weight``; what media do at
        their points."""
        found = media.at(points[rows])
        piece = Piece(passage.take(chosen), Scattered(*(part[chosen] for part in scattered)), origins, directions, points[rows])
        gained[rows] += weight * from_sources_along(context, sources, piece, found, key[rows], turns + 1)
        return found

    if turns < most_turns:
        found = meet_sources(rows, origins[rows], directions[rows], before[rows])
    while rows.size and turns < most_turns:
        turns += 1
        here, coming, numbers = points[rows], directions[rows], key[rows]
        onward, share = turned(media, found, coming, numbers, turns)
        carried[rows] *= share
        hits = context.bare.scatter.intersect(here, onward)
        tint = np.ones((len(rows), 3)) if hits.tint is None else hits.tint.astype(np.float64)
        passage = media.passage(here, onward, hits.t)
        gained[rows] += carried[rows] * passage.emitted()
        scattered, left = passage.scatter(walk_numbers(numbers, turns, _DISTANCE, 2)), passage.transmittance()
        again, out = scattered.weight.max(axis=1), (left * tint).max(axis=1)
        chance = np.divide(again, again + out, out=np.zeros(len(rows)), where=again > 0)
        if turns == most_turns:
            chance[:] = 0.0
        on = walk_numbers(numbers, turns, _GOES_ON, 1)[:, 0] < chance
        stop = np.flatnonzero(~on & (out > 0))
        ends.append((rows[stop] + offset, *(part[stop] for part in (hits.primitive, hits.u, hits.v, hits.t, onward, here)),
                     carried[rows[stop]] * (left * tint)[stop] / (1.0 - chance[stop])[:, None]))
        points[rows] = here + onward * scattered.distance[:, None].astype(np.float32)
        weight = carried[rows] / np.maximum(chance, 1e-30)[:, None]
        carried[rows] = weight * scattered.weight
        directions = directions.copy() if turns == 1 else directions
        directions[rows] = onward
        chosen = np.flatnonzero(on & (chance > 0))
        # Roulette by what a walk carries of what it began with.
        share = carried[rows[chosen]].max(axis=1) / np.maximum(_LITTLE * began[rows[chosen]], 1e-30)
        kept = unit_interval(hash_u32(numbers[chosen], turns, _GOES_ON, 7)) < share
        chosen, kept = chosen[kept], np.minimum(share[kept], 1.0)[:, None]
        rows = rows[chosen]
        carried[rows] /= kept
        found = meet_sources(chosen, here[chosen], onward[chosen], weight[chosen] / kept)
    columns = [np.concatenate(part) for part in zip(*ends, strict=True)] if ends else [
        np.zeros(0, np.intp), np.zeros(0, np.int32), *(np.zeros(0, np.float32) for _ in range(3)),
        *(np.zeros((0, 3), np.float32) for _ in range(3))]
    columns[-1] = columns[-1].astype(np.float32)
    return Walks(emitted.astype(np.float32), gained.astype(np.float32), *columns)


def turned(media, found: list[Coefficients], coming, key, turn) -> tuple[np.ndarray, np.ndarray]:
    """New directions (n, 3) float32 of walks, and the factor (n, 3) of what they carry: each turns by the phase function of one of
    the media where it is, chosen by what they scatter there."""
    strengths = np.stack([one.scattering.mean(axis=1) for one in found])
    total = np.maximum(strengths.sum(axis=0), 1e-300)
    chosen = np.sum(np.cumsum(strengths, axis=0) <= walk_numbers(key, turn, _WHICH, 1)[:, 0] * total, axis=0)
    chosen = np.minimum(chosen, len(found) - 1)
    scattering = np.maximum(sum(one.scattering for one in found), 1e-300)
    onward, factor = np.empty((len(key), 3), np.float32), np.ones((len(key), 3))
    u = walk_numbers(key, turn, _TURN, 2)
    for number, filling in enumerate(media.fillings):
        rows = np.flatnonzero(chosen == number)
        if rows.size:
            onward[rows], density = sample_phase(filling.medium.phase, coming[rows], u[rows])
            value = phase_value(filling.medium.phase, dot(onward[rows], coming[rows]))
            probability = strengths[number, rows] / total[rows]
            ratio = found[number].scattering[rows] / scattering[rows] / np.maximum(probability, 1e-300)[:, None]
            factor[rows] = ratio * (value / density)[:, None]
    return onward, factor
