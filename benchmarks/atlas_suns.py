"""How far a light atlas that knows suns from a grid of directions is off under a sun between them, and by what.

    python benchmarks/atlas_suns.py [sample] [--density 3] [--rays 256] [--side 8] [--count 3]

Under some suns half way between the grid's directions, in shares of their bounce (relative RMSE of texels' irradiance against a
bake of 2,048 rays under the very sun): what the grid says, as the look-up shares it among four directions and by cubics through
sixteen; what the same rays have in the very direction, in a grid twice as fine; and a bake of as many rays under that sun.
"""

import argparse
from dataclasses import replace

import numpy as np
from atlas import unwrapped

import rtgi_addon
from rtgi_addon import techniques
from rtgi_addon.effects.atlas.bake import bake_atlas
from rtgi_addon.effects.atlas.settings import AtlasSettings
from rtgi_addon.numerics import dome
from rtgi_addon.progress import Progress
from rtgi_addon.scene import SunLight, World
from rtgi_addon.techniques.transfer.settings import TransferSettings

_FINE = 2048
# Suns that bounce less than this share of the brightest are left out.
_DIM = 0.15


def cubic(place: float, side: int) -> np.ndarray:
    """Catmull and Rom's weights (side,) at ``place`` between nodes, which go on in a line beyond the ends."""
    low = min(int(place), side - 2)
    f = place - low
    four = ((-0.5 * f + 1) * f - 0.5) * f, (1.5 * f - 2.5) * f * f + 1, ((-1.5 * f + 2) * f + 0.5) * f, (0.5 * f - 0.5) * f * f
    weights = np.zeros(side)
    for node, weight in zip(range(low - 1, low + 3), four, strict=True):
        if 0 <= node < side:
            weights[node] += weight
        else:
            end, before = (0, 1) if node < 0 else (side - 1, side - 2)
            weights[end] += 2.0 * weight
            weights[before] -= weight
    return weights


def main() -> None:
    """Measure, and print a table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("sample", nargs="?", default="sun_window")
    parser.add_argument("--density", type=float, default=3.0)
    parser.add_argument("--rays", type=int, default=256)
    parser.add_argument("--side", type=int, default=8)
    parser.add_argument("--count", type=int, default=3)
    options = parser.parse_args()
    rtgi_addon.register()
    scene = replace(unwrapped(options.sample, options.density), lights=(), world=World.constant(0.0))
    lattice = tuple(replace(volume, resolution=(2, 2, 2), settings={}) for volume in scene.volumes[:1])
    few = TransferSettings(rays=64, cache_rays=32, sun_side=3, sites=0, sky_order=0)
    field = techniques.get("transfer").bake(replace(scene, volumes=lattice, world=World.constant(1.0)), few,
                                            np.random.default_rng(0), Progress())
    side = 2 * options.side - 1

    def baked(rays: int, suns: tuple = (), seed: int = 0, **of_field):
        settings = AtlasSettings(density=options.density, rays=rays, suns=side)
        return bake_atlas(replace(scene, lights=suns), of_field.get("field"), settings, seed).atlas

    atlas = baked(options.rays, field=field)
    table = atlas.transfer.suns[..., 4, :].mean(axis=0).reshape(*atlas.sheet.size, side, side).astype(np.float64)
    coarse, towards = table[..., ::2, ::2], dome.directions(side)
    power = np.linalg.norm(table[atlas.known], axis=0)
    between = [(row, column) for row in range(side) for column in range(side)
               if (row % 2 or column % 2) and power[row, column] > _DIM * power.max() and towards[row * side + column, 2] > 0.05]
    print("| elevation | shared by four | cubic | the very direction | a bake under it |\n|---:|---:|---:|---:|---:|")
    for row, column in np.random.default_rng(4).permutation(between)[:options.count]:
        way = towards[row * side + column]
        sun = (SunLight("sun", (-way).astype(np.float32), np.ones(3, np.float32)),)
        truth, fresh = baked(_FINE, sun, 1), baked(options.rays, sun, 2)
        known = atlas.known & truth.known & fresh.known
        right = truth.irradiance.mean(axis=2)[known]

        def off(light: np.ndarray, known=known, right=right) -> str:
            return f"{100 * np.linalg.norm(light[known] - right) / np.linalg.norm(right):.1f} %"

        tent = [np.maximum(1.0 - np.abs(place / 2.0 - np.arange(options.side)), 0.0) for place in (row, column)]
        smooth = [cubic(place / 2.0, options.side) for place in (row, column)]
        shared, curved = (np.einsum("hwrc,r,c->hw", coarse, *pair) for pair in (tent, smooth))
        print(f"| {np.degrees(np.arcsin(way[2])):.0f}° | {off(shared)} | {off(curved)} | {off(table[..., row, column])} | "
              f"{off(fresh.irradiance.mean(axis=2))} |", flush=True)


if __name__ == "__main__":
    main()
