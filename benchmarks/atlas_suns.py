"""How far a light atlas that knows suns from a grid of directions is off under suns between them, by the grid and by its rays.

    python benchmarks/atlas_suns.py [samples…] [--density 3] [--rays 256] [--sides 8 12 18] [--count 6]

Under suns drawn all over the square that the grid divides, of those that bounce more than a share of the brightest: relative RMSE
of texels' irradiance against a bake of 2,048 rays under the very sun, in shares of its bounce, by each grid, and by a bake of as
many rays as the grids have under that sun, which is what rays cost by themselves. The last line is over all suns.
"""

import argparse
import time
from dataclasses import replace

import numpy as np
from atlas import unwrapped

import rtgi_addon
from rtgi_addon import techniques
from rtgi_addon.effects.atlas.bake import bake_atlas
from rtgi_addon.effects.atlas.relight import relit_atlas
from rtgi_addon.effects.atlas.settings import AtlasSettings
from rtgi_addon.numerics import dome
from rtgi_addon.progress import Progress
from rtgi_addon.scene import SunLight, World
from rtgi_addon.techniques.transfer.lighting import DistantSun, Lighting
from rtgi_addon.techniques.transfer.settings import TransferSettings

_FINE = 2048
# Suns that bounce less than this share of the brightest are left out; so many are drawn.
_DIM, _DRAWN = 0.15, 200


def drawn(count: int) -> np.ndarray:
    """Directions (count, 3), spread evenly over the square of a dome's grid."""
    rng, towards = np.random.default_rng(4), dome.directions(64)
    return towards[rng.choice(len(towards), count, replace=False)]


def show(name: str, row) -> None:
    """Print a row of the table: errors, and what they are shares of as the last."""
    print(f"| {name} | {' | '.join(f'{100 * off / row[-1]:.1f} %' for off in row[:-1])} |", flush=True)


def measure(sample: str, density: float, rays: int, sides: list[int], count: int) -> None:
    """Print a table of one sample."""
    scene = replace(unwrapped(sample, density), lights=(), world=World.constant(0.0))
    lattice = tuple(replace(volume, resolution=(2, 2, 2), settings={}) for volume in scene.volumes[:1])
    few = TransferSettings(rays=64, cache_rays=32, sun_side=3, sites=0, sky_order=0)
    field = techniques.get("transfer").bake(replace(scene, volumes=lattice, world=World.constant(1.0)), few,
                                            np.random.default_rng(0), Progress())

    def baked(rays: int, suns: tuple = (), seed: int = 0, side: int = 8, of=None):
        return bake_atlas(replace(scene, lights=suns), of, AtlasSettings(density=density, rays=rays, suns=side), seed).atlas

    tables = []
    for side in sides:
        before = time.process_time()
        tables.append(baked(rays, side=side, of=field))
        print(f"{sample}, {side} a side: {time.process_time() - before:.1f} s of processor time", flush=True)

    def under(atlas, towards) -> np.ndarray:
        light = Lighting(World.constant(0.0), (DistantSun(towards, np.ones(3)),))
        return relit_atlas(atlas, field.transfer, light).irradiance.mean(axis=2)

    tried = drawn(_DRAWN)
    power = np.array([np.linalg.norm(under(tables[-1], towards)) for towards in tried])
    suns, rows = tried[power > _DIM * power.max()][:count], []
    print(f"| elevation | {' | '.join(f'{side} a side' for side in sides)} | a bake under it |\n|---:|{'---:|' * (len(sides) + 1)}")
    for way in suns[np.argsort(suns[:, 2])]:
        lamp = (SunLight("sun", (-way).astype(np.float32), np.ones(3, np.float32)),)
        truth, fresh = baked(_FINE, lamp, 1), baked(rays, lamp, 2)
        known = tables[0].known & truth.known & fresh.known
        right = truth.irradiance.mean(axis=2)[known]
        lights = [*(under(atlas, way) for atlas in tables), fresh.irradiance.mean(axis=2)]
        rows.append([*(np.linalg.norm(light[known] - right) for light in lights), np.linalg.norm(right)])
        show(f"{np.degrees(np.arcsin(way[2])):.0f}°", rows[-1])
    show("all", np.linalg.norm(np.array(rows), axis=0))


def main() -> None:
    """Measure what the command line names."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("samples", nargs="*", default=["sun_window", "cornell_box", "evening_shop"])
    parser.add_argument("--density", type=float, default=3.0)
    parser.add_argument("--rays", type=int, default=256)
    parser.add_argument("--sides", type=int, nargs="+", default=[8, 12, 18])
    parser.add_argument("--count", type=int, default=6)
    options = parser.parse_args()
    rtgi_addon.register()
    for sample in options.samples:
        measure(sample, options.density, options.rays, options.sides, options.count)


if __name__ == "__main__":
    main()
