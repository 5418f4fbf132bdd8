"""Maps of sphere probes averaged by GGX lobes: what a surface of some roughness mirrors that is looked at straight on.

The lobe about a direction n weighs light from l by D(h)·(n·l), h halfway between the two (B. Karis, "Real Shading in Unreal
Engine 4", SIGGRAPH 2013: N = V = R). Texel by texel over all of the map, by exact solid angles, and divided by the sum of weights:
a map of one radiance stays that at every level. Wide lobes read the map as averaged to blocks that are small beside them.
"""

import numpy as np

from ...numerics.octahedral import texel_directions, texel_solid_angles
from ...transport.parallel import chunks, parallel_for
from .maps import level_alpha, level_sides

# Levels read no fewer texels along a side.
_LEAST_SOURCE = 64
# Texels of a level per unit of work.
_CHUNK = 256


def prefiltered(maps: np.ndarray, threads: int | None = None) -> list[np.ndarray]:
    """Levels 0, 1, … (p, side, side, 3) float32 of ``maps`` (p, R, R, 3) of radiance, R a power of two."""
    resolution = maps.shape[1]
    levels = [np.asarray(maps, np.float32)]
    for level, side in list(enumerate(level_sides(resolution)))[1:]:
        source = averaged(maps, max(resolution >> max(level - 2, 0), min(_LEAST_SOURCE, resolution)))
        levels.append(_convolved(source, side, level_alpha(resolution, level), threads))
    return levels


def averaged(maps: np.ndarray, side: int) -> np.ndarray:
    """``maps`` (p, R, R, 3) averaged over blocks of texels by solid angle: (p, side, side, 3) float64."""
    count, resolution = maps.shape[:2]
    block = resolution // side
    weight = texel_solid_angles(resolution).reshape(side, block, side, block)
    summed = np.einsum("pibjkc,ibjk->pijc", np.asarray(maps, np.float64).reshape(count, side, block, side, block, 3), weight)
    return summed / weight.sum(axis=(1, 3))[None, :, :, None]


def lobe(cosine: np.ndarray, alpha: float) -> np.ndarray:
    """D(h)·(n·l) without its constants, of light from directions l whose ``cosine`` to n is given."""
    half = 0.5 * (1.0 + cosine)
    t = half * (alpha * alpha - 1.0) + 1.0
    return np.maximum(cosine, 0.0) / (t * t)


def _convolved(source: np.ndarray, side: int, alpha: float, threads: int | None) -> np.ndarray:
    count, of_source = source.shape[:2]
    directions, solid_angles = texel_directions(of_source), texel_solid_angles(of_source)
    radiance = source.reshape(count, -1, 3).transpose(1, 0, 2).reshape(len(directions), -1)
    targets = texel_directions(side)
    spans = chunks(len(targets), _CHUNK)

    def work(i: int) -> np.ndarray:
        # Doubles: of narrow lobes t is a small difference of numbers near one.
        weight = lobe(targets[spans[i]].astype(np.float64) @ directions.astype(np.float64).T, alpha) * solid_angles
        return (weight @ radiance) / weight.sum(axis=1)[:, None]

    found = np.concatenate(parallel_for(work, len(spans), threads))
    return found.reshape(side, side, count, 3).transpose(2, 0, 1, 3).astype(np.float32)
