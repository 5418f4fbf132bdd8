"""Null-collision tracking: where paths collide in media, without a step size and without bias, whatever the density does.

Media are filled up with matter that does nothing until extinction is the same everywhere, the majorant; distances between
collisions are then exponential, and at each it is drawn whether light was scattered or nothing happened. What is absorbed leaves
with the weight, and so do the colours' differences.

Sources: E. Woodcock et al., "Techniques Used in the GEM Code…", ANL-7050, 1965; J. Novák et al., "Monte Carlo Methods for
Volumetric Light Transport Simulation", Eurographics 2018 (§5.1.5, weighted tracking).
"""

from typing import NamedTuple

import numpy as np

from ...numerics.sampling import hash_u32, unit_interval
from ..context import LightContext
from ..media.grid import Coefficients
from ..media.table import CHUNK, MediaTable
from ..parallel import chunks
from .direct import NO_DENSITY
from .scattering import turned
from .source_points import from_sources
from .sources import Sources
from .wavefront import Wavefront

# Steps after which a path is given up; none is expected to take as many.
_MOST_STEPS = 1 << 16
# A path that carries less than this share of what it had goes on by chance, within one segment and from one to the next.
_LITTLE, _FAINT = 0.25, 0.1
# What numbers are drawn for.
_STEP, _EVENT, _ROULETTE, _GLOW, _FAINTNESS = range(101, 106)


class Collision(NamedTuple):
    """``distance`` (n,) float64 at which paths scatter, infinite where they come through, and the factor ``weight`` (n, 3) of what
    they carry; 0 where they were absorbed."""

    distance: np.ndarray
    weight: np.ndarray


def collide(media: MediaTable, origins: np.ndarray, directions: np.ndarray, limits: np.ndarray, key: np.ndarray) -> Collision:
    """Follow paths from ``origins`` (n, 3) along unit ``directions`` (n, 3) up to ``limits`` (n,) (infinite: to no end); their
    numbers come from ``key`` (n,) uint32."""
    n = len(origins)
    origins, directions = origins.astype(np.float64), directions.astype(np.float64)
    limits = np.asarray(limits, np.float64)
    spans = [filling.spans(origins, directions, limits) for filling in media.fillings]
    # Nothing collides before the first medium, or after the last.
    reached = [np.where(leave > enter, leave, 0.0).max(axis=1) for enter, leave in spans]
    entered = [np.where(leave > enter, enter, np.inf).min(axis=1) for enter, leave in spans]
    end, t = np.max(reached, axis=0), np.min(entered, axis=0)
    majorant = float(np.sum([filling.majorant for filling in media.fillings], axis=0).max())
    distance, weight = np.full(n, np.inf), np.ones((n, 3))
    rows = np.flatnonzero(t < end) if majorant > 0 else np.zeros(0, np.intp)
    for step in range(_MOST_STEPS):
        if rows.size == 0:
            break
        t[rows] -= np.log1p(-_number(key[rows], step, _STEP)) / majorant
        rows = rows[t[rows] < end[rows]]
        points = origins[rows] + directions[rows] * t[rows, None]
        found = media.at(points)
        scattering, extinction = sum(one.scattering for one in found), sum(one.extinction for one in found)
        nothing = np.maximum(majorant - extinction, 0.0)
        real, null = ((weight[rows] * part).mean(axis=1) for part in (scattering, nothing))
        chance = np.divide(real, real + null, out=np.zeros(len(rows)), where=real > 0)
        scatters = _number(key[rows], step, _EVENT) < chance
        factor = np.where(scatters[:, None], scattering, nothing) / majorant
        weight[rows] *= factor / np.maximum(np.where(scatters, chance, 1.0 - chance), 1e-300)[:, None]
        distance[rows[scatters]] = t[rows[scatters]]
        rows = rows[~scatters & (weight[rows].max(axis=1) > 0)]
        survival = np.minimum(weight[rows].max(axis=1) / _LITTLE, 1.0)
        kept = _number(key[rows], step, _ROULETTE) < survival
        weight[rows[~kept]] = 0.0
        weight[rows[kept]] /= survival[kept, None]
        rows = rows[kept]
    weight[rows] = 0.0
    return Collision(distance, weight)


def glow(media: MediaTable, origins: np.ndarray, directions: np.ndarray, limits: np.ndarray, key: np.ndarray) -> np.ndarray:
    """One unbiased estimate (n, 3) of the radiance that media give along paths themselves, as ``collide`` takes them: exact where
    nothing is on a grid, elsewhere by one point in each emissive medium."""
    if all(filling.grid is None for filling in media.fillings):
        return media.emitted(origins, directions, limits)
    result = np.zeros((len(origins), 3))
    origins, directions = origins.astype(np.float64), directions.astype(np.float64)
    limits = np.asarray(limits, np.float64)
    for number, filling in enumerate(media.fillings):
        if not filling.medium.is_emissive:
            continue
        enter, leave = filling.spans(origins, directions, limits)
        lengths = leave - enter
        total = lengths.sum(axis=1)
        rows = np.flatnonzero((total > 0) & np.isfinite(total))
        along = _number(key[rows], number, _GLOW) * total[rows]
        before = np.cumsum(lengths[rows], axis=1) - lengths[rows]
        piece = np.sum(before <= along[:, None], axis=1) - 1
        t = enter[rows, piece] + along - before[np.arange(len(rows)), piece]
        points = origins[rows] + directions[rows] * t[:, None]
        result[rows] += filling.coefficients(points).emission * total[rows, None] * media.transmittance(
            origins[rows], directions[rows], t)
    return result


def scatter_in_media(context: LightContext, paths: Wavefront, limits: np.ndarray, radiance: np.ndarray, depth: int,
                     last: bool) -> tuple[np.ndarray, Wavefront, np.ndarray]:
    """Let ``paths`` (n,) cross media up to ``limits`` (n,), where they meet surfaces: what media give, and what light sources give
    where paths scatter, goes to ``radiance`` (by ``paths.rows``). ``last``: nothing more is scattered.

    Returns which (m,) of the paths come through, those that were scattered as they go on, and the throughput (m, 3) of the former.
    """
    media, sources, key = context.media, Sources(context), paths.numbers.hashes(depth)
    through, scattered, carried = [], [], []
    for span in chunks(len(paths.rows), CHUNK):
        rows = np.arange(span.start, span.stop)
        part = paths.take(rows)
        if media.is_emissive:
            radiance[part.rows] += part.throughput * glow(media, part.origins, part.directions, limits[span], key[span])
        collision = collide(media, part.origins, part.directions, limits[span], key[span])
        weight = part.throughput * collision.weight
        passed = np.flatnonzero(np.isinf(collision.distance) & (weight.max(axis=1) > 0))
        through.append(rows[passed])
        carried.append(weight[passed])
        met = np.flatnonzero(np.isfinite(collision.distance) & (weight.max(axis=1) > 0))
        if last or met.size == 0:
            continue
        part, weight = part.take(met), weight[met]
        points = part.origins + part.directions * collision.distance[met, None].astype(np.float32)
        found: list[Coefficients] = media.at(points)
        radiance[part.rows] += weight * from_sources(context, sources, media, found, points, part.directions, key[span][met], depth)
        directions, share = turned(media, found, part.directions, key[span][met], depth)
        weight = weight * share
        survival = np.minimum(weight.max(axis=1) / _FAINT, 1.0)
        kept = np.flatnonzero(_number(key[span][met], depth, _FAINTNESS) < survival)
        n = len(kept)
        scattered.append(Wavefront(part.rows[kept], points[kept], directions[kept],
                                   (weight[kept] / survival[kept, None]).astype(np.float32), part.numbers.take(kept),
                                   np.full(n, NO_DENSITY, np.float32), np.full(n, -1, np.int32)))
    throughput = np.concatenate(carried).astype(np.float32) if carried else np.zeros((0, 3), np.float32)
    return np.concatenate(through) if through else np.zeros(0, np.intp), Wavefront.join(scattered, paths), throughput


def _number(key: np.ndarray, step: int, purpose: int) -> np.ndarray:
    return unit_interval(hash_u32(key, step, purpose)).astype(np.float64)
