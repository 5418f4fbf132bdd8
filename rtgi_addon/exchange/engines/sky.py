"""A scene's world as a panorama behind the sample scene: a picture only, for its light is in the probes already."""

from pathlib import Path

import numpy as np

from ...scene import World
from ...transport.lights.environment import Environment
from ..exr import write_exr
from .axes import Axes
from .halves import half_scale, over

SKY = "sky.exr"
# Rows of the panorama, at most, and of a constant one.
_ROWS, _PLAIN = 1024, 4


def write_sky(folder: Path, world: World | None, axes: Axes, first_column: float) -> float | None:
    """Write the ``world`` as `sky.exr` into ``folder``, and return what its pixels are stored over (halves.py), a power of two of 1
    at most; None where there is none, or a black one.

    Equirectangular, the engine's +Y in the top row. Column u, from 0 to 1, looks along (sin φ, 0, −cos φ) in the engine's axes, φ =
    2π (u + ``first_column``): engines begin their panoramas in different directions. Radiance [W·sr⁻¹·m⁻²] as halves. Raises
    BakeError for a disk that refuses.
    """
    if world is None or world.is_black:
        return None
    rows = _PLAIN if world.equirect.shape[:2] == (1, 1) else min(max(world.equirect.shape[0], _PLAIN), _ROWS)
    u, v = (np.arange(2 * rows) + 0.5) / (2 * rows), (np.arange(rows) + 0.5) / rows
    azimuth, polar = 2.0 * np.pi * (u + first_column), np.pi * v
    directions = np.stack([np.sin(polar)[:, None] * np.sin(azimuth), np.broadcast_to(np.cos(polar)[:, None], (rows, 2 * rows)),
                           -np.sin(polar)[:, None] * np.cos(azimuth)], axis=-1)
    seen = Environment(world).radiance((directions.reshape(-1, 3) @ axes.engine_from_blender).astype(np.float32))
    pixels = np.minimum(seen.reshape(rows, 2 * rows, 3), np.finfo(np.float16).max)
    scale = half_scale(pixels)
    stored = over(pixels, scale)
    write_exr(folder / SKY, {letter: stored[..., index] for index, letter in enumerate("RGB")}, {})
    return scale
