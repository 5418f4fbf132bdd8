"""The light that media scatter once more, by rays of its own: from each slice one in a direction of the phase function, followed
through media until it ends on a surface or in the sky.

All orders of scattering, nothing looked up between probes: right however coarse the bake's lattice is beside the medium, and
however far forward the phase function points. Walks are those of bakes (transport/paths/scattering.py), the light of surfaces is
that of the surface cache which rays of pixels read. Noise settles as samples are averaged.
"""

from typing import NamedTuple

import numpy as np

from ...numerics.sampling import hash_u32, unit_interval
from ...scene.medium import Phase
from ...transport.cache.look import CachedScene, Looks
from ...transport.cache.media_walks import ONLY
from ...transport.cache.texel_table import SurfaceHits
from ...transport.media.phase import phase_value, sample_phase
from ...transport.parallel import chunks, parallel_for
from ...transport.paths.numbers import PathNumbers
from ...transport.paths.scattering import walk
from ...transport.paths.sources import Sources
from ...transport.vectors import dot

# Rays per unit of work.
_CHUNK = 1 << 12
# What numbers rays draw: which phase function, where it turns them, walks, a point of the world's bright patches.
_WHICH, _TURN, _WALK, _BRIGHT = 0x67, 0x68, 0x69, 0x6A


class Ends(NamedTuple):
    """What a chunk of rays found: ``gained`` (n, 3) on the way, and ``looks`` at what lies at the ends (e,) of rays and walks,
    whose light arrives at ``rays`` (e,) by ``tint`` (e, 3)."""

    gained: np.ndarray
    looks: Looks
    rays: np.ndarray
    tint: np.ndarray


def gathered(scene: CachedScene, points: np.ndarray, coming: np.ndarray, strengths: dict[Phase, np.ndarray], key: np.ndarray,
             threads: int | None = None) -> np.ndarray:
    """Light (n, 3) float32 that turns from anywhere but lamps at ``points`` (n, 3), in media, into the way against unit ``coming``
    (n, 3): of what is scattered by each phase function with its strength (n, 3). ``key`` (n,) uint32 is what numbers come from.
    The same for any number of ``threads``."""
    spans = chunks(len(points), _CHUNK)
    onward, weight = _turned(coming, strengths, key)
    sources = Sources(scene.context)
    parts = parallel_for(lambda i: _ends(scene, sources, points[spans[i]], onward[spans[i]], key[spans[i]]), len(spans), threads)
    texels = scene.settle([part.looks for part in parts])

    def work(i: int) -> np.ndarray:
        part = parts[i]
        result = part.gained.astype(np.float64)
        np.add.at(result, part.rays, scene.radiance(part.looks, texels[i]) * part.tint)
        result *= weight[spans[i]]
        return result + _of_bright_patches(scene, sources, points[spans[i]], coming[spans[i]],
                                           {phase: each[spans[i]] for phase, each in strengths.items()}, key[spans[i]])

    light = parallel_for(work, len(spans), threads)
    return np.concatenate(light).astype(np.float32) if light else np.zeros((0, 3), np.float32)


def _turned(coming, strengths: dict[Phase, np.ndarray], key) -> tuple[np.ndarray, np.ndarray]:
    """Directions (n, 3) float32 by one of the phase functions each, and the weight (n, 3) of what comes from there."""
    shares = np.stack([strength.mean(axis=1) for strength in strengths.values()]).astype(np.float64)
    shares /= np.maximum(shares.sum(axis=0), 1e-300)
    which = unit_interval(hash_u32(key, _WHICH))
    chosen = np.minimum(np.sum(np.cumsum(shares, axis=0) <= which, axis=0), len(shares) - 1)
    u = unit_interval(np.stack([hash_u32(key, _TURN, d) for d in range(2)], axis=1))
    onward = np.zeros(coming.shape, np.float32)
    for number, phase in enumerate(strengths):
        rows = np.flatnonzero(chosen == number)
        if rows.size:
            onward[rows] = sample_phase(phase, coming[rows], u[rows])[0]
    cosine = dot(coming, onward)
    values = [phase_value(phase, cosine) for phase in strengths]
    density = sum(share * value for share, value in zip(shares, values, strict=True))
    weight = sum(strength * value[:, None] for strength, value in zip(strengths.values(), values, strict=True))
    return onward, weight / np.maximum(density, 1e-300)[:, None]


def _ends(scene: CachedScene, sources: Sources, points, onward, key) -> Ends:
    context, n = scene.context, len(points)
    hits = context.bare.scatter.intersect(points, onward)
    walks = walk(context, sources, points, onward, np.where(hits.primitive >= 0, hits.t, np.inf), hash_u32(key, _WALK))
    # What was not scattered on its way ends where the ray does.
    left = context.media.transmittance(points, onward, hits.t)
    left = left if hits.tint is None else left * hits.tint
    primitive, u, v, t = (np.concatenate([getattr(hits, name), getattr(walks, name)]) for name in ("primitive", "u", "v", "t"))
    origins, directions = np.concatenate([points, walks.points]), np.concatenate([onward, walks.directions])
    rays, rows = np.concatenate([np.arange(n), walks.rows]), np.flatnonzero(primitive >= 0)
    cosine = -dot(context.geometry.normals_world[primitive[rows]], directions[rows])
    slots = scene.cache.layout.slots(primitive[rows], u[rows], v[rows], cosine > 0)
    # The world's bright patches are met by shadow rays, here and at every turn of a walk; all else that glows by rays alone.
    numbers = PathNumbers(key[rays], np.arange(len(rays)) // n)
    looks = Looks(origins.astype(np.float32), directions.astype(np.float32), numbers, rows,
                  SurfaceHits(primitive[rows], u[rows], v[rows], slots), t[rows], cosine, None, np.full(len(rays), ONLY))
    return Ends(walks.emitted + walks.gained, looks, rays, np.concatenate([left, walks.tint]))


def _of_bright_patches(scene: CachedScene, sources: Sources, points, coming, strengths, key) -> np.ndarray:
    if not scene.context.environment.bright.count:
        return np.zeros(points.shape)
    u = unit_interval(np.stack([hash_u32(key, _BRIGHT, d) for d in range(2)], axis=1))
    direction, irradiance = sources.facing_irradiance(sources.count - 1, points, u)
    cosine = dot(coming, direction)
    return irradiance * sum(strength * phase_value(phase, cosine)[:, None] for phase, strength in strengths.items())
