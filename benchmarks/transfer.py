"""What relighting from transfer costs and how far it is off: processor time of `rtgi relight`, bytes a probe, and errors by light.

    python benchmarks/transfer.py [samples…] [--probes 2048] [--rays 1024] [--sides 18 24] [--stored]

A sample is baked with transfer, with test suns in light groups of their own, which transfer holds exactly: so one bake has both
a sun by the table of directions and the same sun as a bake would have it. Errors are relative RMSE over the usable probes'
coefficients, of suns' bounces in shares of those of the suns as high, and of the brightest sun's. Times are processor time, medians
of several runs. `--stored` asks what the table of suns is as it is stored, and would be in less: in half floats, in bytes with a
scale for each probe, coefficient and colour, and as products of its strongest singular vectors, in half floats too.
"""

import argparse
import sys
import time
from dataclasses import replace
from pathlib import Path
from statistics import median

import numpy as np

ROOT = Path(__file__).resolve().parents[1]
sys.path[:0] = [str(ROOT), str(ROOT / "benchmarks")]

from bake_vs_cycles import open_sample  # noqa: E402

from rtgi_addon import techniques  # noqa: E402
from rtgi_addon.blender.extract import extract_scene  # noqa: E402
from rtgi_addon.progress import Progress  # noqa: E402
from rtgi_addon.scene import Scene, SunLight, World  # noqa: E402
from rtgi_addon.techniques.transfer.field import TransferField  # noqa: E402
from rtgi_addon.techniques.transfer.lighting import Lighting, sky_of, sun_from  # noqa: E402
from rtgi_addon.techniques.transfer.relight import relit  # noqa: E402

SAMPLES = ("sky_courtyard", "sun_window")
ELEVATIONS, AZIMUTHS = (1.0, 3.5, 7.0, 12.0, 20.0, 45.0, 75.0), (20.0, 110.0, 200.0, 290.0)
REPEATS = 7
# Singular vectors that are tried.
RANKS = (16, 32, 64, 128)


def seconds(work) -> float:
    """The median processor time of ``work``."""
    measured = []
    for _ in range(REPEATS):
        before = time.process_time()
        work()
        measured.append(time.process_time() - before)
    return median(measured)


def with_test_suns(scene: Scene) -> Scene:
    """``scene`` with a dark world and test suns alone, each in a group of its own."""
    suns = tuple(SunLight(f"{elevation:g}/{azimuth:g}", -sun_from(azimuth, elevation, 1.0).towards, np.ones(3, np.float32),
                          light_group=f"{elevation:g}/{azimuth:g}") for elevation in ELEVATIONS for azimuth in AZIMUTHS)
    return replace(scene, lights=suns, world=World.constant(0.0))


def off_between(field, dark: dict[str, np.ndarray]) -> list[tuple[float, float, float]]:
    """By how much the bounce of every test sun is off, and how large it is, by its elevation; ``dark`` switches all groups off."""
    transfer, grid = field.transfer, field.transfer.grids[0]
    usable, names, rows = grid.grid.usable, [light for light, _ in transfer.lights], []
    for elevation in ELEVATIONS:
        for azimuth in AZIMUTHS:
            exact = np.moveaxis(grid.lights[..., names.index(f"{elevation:g}/{azimuth:g}")], 0, -1)[usable]
            sun = Lighting(World.constant(0.0), (sun_from(azimuth, elevation, 1.0),), dark)
            rows.append((elevation, np.linalg.norm(relit(transfer, sun)[0].sh[usable] - exact), np.linalg.norm(exact)))
    return rows


def smaller(suns: np.ndarray):
    """Ways to store ``suns`` (3, nz, ny, nx, k, K): their names, bytes a probe, and what is read of them."""
    of_probe, count = 3 * suns.shape[4], suns.shape[5]
    yield "whole floats", 4 * of_probe * count, suns
    yield "half floats", 2 * of_probe * count, suns.astype(np.float16).astype(np.float32)
    scale = np.maximum(np.abs(suns).max(axis=5, keepdims=True), 1e-30).astype(np.float16).astype(np.float32) / 127.0
    yield "bytes", of_probe * (count + 2), np.clip(np.rint(suns / np.maximum(scale, 1e-30)), -127, 127) * scale
    left, strengths, right = np.linalg.svd(suns.reshape(-1, count).astype(np.float64), full_matrices=False)
    for rank in RANKS:
        shares = (left[:, :rank] * strengths[:rank]).astype(np.float16).astype(np.float64)
        yield f"{rank} vectors", 2 * of_probe * rank, (shares @ right[:rank]).reshape(suns.shape).astype(np.float32)


def show_stored(field, dark: dict[str, np.ndarray]) -> None:
    """Print what the table of suns is off in less room."""
    transfer = field.transfer
    print("  suns stored as     bytes a probe   off, of the table   off, of suns' bounces")
    for what, size, suns in smaller(transfer.grids[0].suns):
        grid = replace(transfer.grids[0], suns=suns)
        rows = np.array(off_between(TransferField(replace(transfer, grids=(grid,))), dark))
        whole = transfer.grids[0].suns
        print(f"  {what:17} {size:14,} {100 * np.linalg.norm(suns - whole) / np.linalg.norm(whole):17.2f} % "
              f"{100 * np.sqrt(np.mean(rows[:, 1] ** 2) / np.mean(rows[:, 2] ** 2)):20.2f} %", flush=True)


def measure(name: str, probes: int, rays: int, side: int, stored: bool) -> None:
    """Print the rows of one sample and one table of suns."""
    open_sample(name, probes)
    scene = with_test_suns(extract_scene())
    method = techniques.get("transfer")
    field = method.bake(scene, method.Settings(rays=rays, sun_side=side, sites=0), np.random.default_rng(0), Progress())
    transfer, grid = field.transfer, field.transfer.grids[0]
    dark = {light: np.zeros(3) for light, _ in transfer.lights}
    noon = sun_from(170.0, 60.0, [3.0, 2.9, 2.7])
    gradient = World(np.linspace(0.2, 1.0, 64, dtype=np.float32)[:, None, None] * np.ones((64, 128, 3), np.float32))
    sky = sky_of(gradient, transfer)
    print(f"\n{name}, {grid.grid.validity.size:,} probes, {side}² directions: "
          f"{transfer.bytes_per_probe / 1000:.1f} kB a probe")
    for what, lighting, known in (("a sun", Lighting(World.constant(0.0), (noon,), dark), None),
                                  ("a sky", Lighting(gradient, (), dark), sky), ("both", Lighting(gradient, (noon,), dark), sky)):
        spent = seconds(lambda lighting=lighting, known=known: relit(transfer, lighting, known))
        print(f"  relighting, {what:6} {1000.0 * spent:8.1f} ms of processor time")
    rows = off_between(field, dark)
    brightest = max(size for _, _, size in rows)
    print("  elevation   off, of its bounce   off, of the brightest bounce   its bounce, of the brightest")
    for elevation in ELEVATIONS:
        off, size = np.array([row[1:] for row in rows if row[0] == elevation]).T
        # Of all azimuths together, at some of which a room gets nothing.
        own = 100 * np.linalg.norm(off) / np.linalg.norm(size)
        print(f"  {elevation:8.1f}° {own:17.1f} % {100 * np.mean(off) / brightest:26.2f} % "
              f"{100 * np.mean(size) / brightest:27.2f} %", flush=True)
    if stored:
        show_stored(field, dark)


def main() -> None:
    """Measure what the command line names."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("samples", nargs="*", default=SAMPLES)
    parser.add_argument("--probes", type=int, default=2048)
    parser.add_argument("--rays", type=int, default=1024)
    parser.add_argument("--sides", type=int, nargs="+", default=[24])
    parser.add_argument("--stored", action="store_true")
    arguments = parser.parse_args()
    for name in arguments.samples:
        for side in arguments.sides:
            measure(name, arguments.probes, arguments.rays, side, arguments.stored)


if __name__ == "__main__":
    main()
