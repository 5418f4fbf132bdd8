"""Suns from all directions of a dome on the surface cache, as the nodes of a table that is read bilinearly.

What a surface makes of a sun changes by jumps, where a shadow's edge crosses it. A table that holds the light of suns in its very
nodes is right there alone; one that is fitted to suns all over the dome, in least squares as L. Kavan, A. Bargteil and P.-P. Sloan
fit what vertices hold ("Least Squares Vertex Baking", EGSR 2011), is nearer between them at no cost when it is read. The fit is
linear, as all that follows is, so what texels receive by themselves is fitted, and what they make of it between them follows.
"""

from dataclasses import replace

import numpy as np

from ...numerics import dome
from ...progress import Progress
from ...scene import SunLight
from ..context import LightContext
from ..parallel import chunks, parallel_for
from ..paths.sources import Sources
from .surface_cache import SurfaceCache

# Suns along a side of each square between four nodes.
FINENESS = 3
# Rays to suns that are held at a time.
_RAYS = 1 << 16


def sun_columns(cache: SurfaceCache, dark: LightContext, side: int, below: bool, progress: Progress) -> np.ndarray:
    """Direct irradiance (n + 1, K, 3) float32 on the texels of suns of irradiance 1 from a dome of ``side``² nodes (twice as many
    with those ``below``; numerics/dome.py), fitted to suns between them; a last row of zeros. ``dark`` has the surfaces of the
    ``cache``. Fitted values may be below 0. Raises Cancelled."""
    towards, fit = dome.samples(side, FINENESS, below)
    suns = tuple(SunLight(f"sun {number}", -way, np.ones(3, np.float32)) for number, way in enumerate(towards))
    context = LightContext(replace(dark.scene, lights=suns), dark.threads, same_surfaces=dark)
    sources, fit, m = Sources(context), fit.astype(np.float32), fit.shape[1]
    domes, spans = len(towards) // m**2, chunks(cache.count, max(_RAYS // m, 1))
    # A texel meets each sun at one of its points, neighbouring suns at others.
    row, column = np.divmod(np.arange(m**2), m)
    point = (row + FINENESS * column + row // FINENESS + column // FINENESS * FINENESS) % cache.points

    def work(i):
        texels = np.arange(spans[i].start, spans[i].stop)
        surface, n = cache.sampler.on_texels(texels, cache.points), len(texels)
        # v, texels, u, colours.
        found = np.empty((domes * m, n, side, 3), np.float32)
        uv, reach = np.full((n * m, 2), 0.5, np.float32), np.zeros(n * m, np.float32)
        for line in range(domes * m):
            asked = point[line % m * m:(line % m + 1) * m]
            at = surface.take((np.arange(n)[:, None] + asked * n).reshape(-1))
            numbers = np.tile(np.arange(line * m, (line + 1) * m), n)
            light = sources.irradiance(numbers, at.points, at.shading, at.face, reach, uv, at.primitive)
            found[line] = fit @ light.reshape(n, m, 3)
        parts = [np.einsum("av,vnuc->nauc", fit, part) for part in np.split(found, domes)]
        return np.stack(parts, axis=1).reshape(n, -1, 3)

    parts = parallel_for(work, len(spans), context.threads, progress, "suns on surfaces")
    return np.concatenate([*parts, np.zeros((1, domes * side**2, 3), np.float32)])
