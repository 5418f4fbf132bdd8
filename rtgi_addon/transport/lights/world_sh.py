"""The world's radiance in spherical harmonics, and what it gives to surfaces where nothing stands in its way."""

import numpy as np

from ...numerics import sh
from ...scene import World


def world_sh(world: World, order: int) -> np.ndarray:
    """SH projection ((order + 1)², 3) of the world's radiance, texel by texel."""
    pixels = np.asarray(world.equirect, np.float64)
    if bool(np.all(pixels == pixels[:1, :1])):
        result = np.zeros(((order + 1) ** 2, 3))
        result[0] = pixels[0, 0] * np.sqrt(4.0 * np.pi)
        return result
    directions, solid_angles = texel_directions(world)
    return sh.project(directions, pixels.reshape(-1, 3), solid_angles, order)


def texel_directions(world: World) -> tuple[np.ndarray, np.ndarray]:
    """World directions (h·w, 3) float64 of the texels of a world's map, row by row, and their solid angles (h·w,)."""
    height, width = np.shape(world.equirect)[:2]
    azimuth = (0.5 - (np.arange(width) + 0.5) / width) * 2.0 * np.pi
    latitude = ((np.arange(height) + 0.5) / height - 0.5) * np.pi
    across = np.cos(latitude)[:, None]
    local = np.stack([across * np.cos(azimuth), across * np.sin(azimuth), np.repeat(np.sin(latitude)[:, None], width, axis=1)], -1)
    # Exact areas of the latitude bands.
    edges = np.sin((np.arange(height + 1) / height - 0.5) * np.pi)
    solid_angles = np.repeat(np.diff(edges) * (2.0 * np.pi / width), width)
    return local.reshape(-1, 3) @ np.asarray(world.map_from_world, np.float64), solid_angles


def unshadowed_irradiance(world: World, normals: np.ndarray) -> np.ndarray:
    """Irradiance (n, 3) [W·m⁻²] of the world on surfaces with unit ``normals`` (n, 3): what is shown where there is no bake."""
    coefficients = world_sh(world, 2)
    if not coefficients[1:].any():
        # The same from everywhere: π times its radiance.
        return np.tile(np.maximum(coefficients[:1] * np.sqrt(np.pi / 4.0), 0.0).astype(np.float32), (len(normals), 1))
    return np.maximum(sh.irradiance(coefficients, normals), 0.0)
