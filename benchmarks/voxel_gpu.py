"""Voxels on the GPU: what a look-up by cones and rays costs beside numpy's, and how soon a changed scene is lit.

    python benchmarks/voxel_gpu.py [--sample cornell_box] [--receivers 2304] [--resolutions 64 128] [--only looks|live]

*Looks*: processor time a receiver [µs], on this machine's GPU (of a software GPU that is all there is; of others the clock in the
last column says it) and by numpy, for the same receivers on surfaces. *Live*: processor time until a scene is lit in which anything
has moved, or lamps alone, and for its tables for the GPU. Prints Markdown.
"""

import argparse
import sys
import time
from copy import copy
from dataclasses import replace
from pathlib import Path

import bpy
import numpy as np

ROOT = Path(__file__).resolve().parents[1]
sys.path[:0] = [str(ROOT)]

from rtgi_addon import techniques  # noqa: E402
from rtgi_addon.blender.extract import extract_scene  # noqa: E402
from rtgi_addon.blender.gpu_context import open_context  # noqa: E402
from rtgi_addon.progress import Progress  # noqa: E402
from rtgi_addon.techniques.voxels.settings import SURFACES, VOXELS  # noqa: E402

LOOKS = (("cone_tracing", {"cones": 6}, None), ("cone_tracing", {"cones": 16}, None), ("cone_tracing", {"cones": 16}, 32),
         ("cone_tracing", {"cones": 32}, None), ("voxel_march", {"rays": 64}, None), ("voxel_march", {"rays": 64}, 32))


def receivers(context, count: int) -> tuple[np.ndarray, np.ndarray]:
    """Points on surfaces by area, and their normals."""
    rng = np.random.default_rng(7)
    geometry = context.geometry
    areas = geometry.areas.astype(np.float64)
    chosen = rng.choice(geometry.count, count, p=areas / areas.sum()).astype(np.int32)
    root, v = np.sqrt(rng.random(count)), rng.random(count)
    points = geometry.points(chosen, (root * (1 - v)).astype(np.float32), (root * v).astype(np.float32))
    return points.astype(np.float32), geometry.normals_world[chosen].astype(np.float32)


def looks(scene, count: int, resolution: int) -> list[str]:
    """Rows of what look-ups cost at a resolution."""
    from rtgi_addon.preview.indirect import make_indirect
    from rtgi_addon.preview.indirect.base import irradiance
    rows, fields = [], {}
    for name, settings, samples in LOOKS:
        technique = techniques.get(name)
        if name not in fields:
            given = technique.Settings(resolution=resolution, light=VOXELS, bounces=0)
            fields[name] = technique.bake(scene, given, np.random.default_rng(0), Progress())
        field = copy(fields[name])
        field.settings = replace(field.settings, **settings)
        points, normals = receivers(field.context, count)
        made = make_indirect(field, scene, samples=samples)
        # Compiling is no part of it.
        irradiance(made, points[:64], normals[:64])
        started, clock = time.process_time(), time.perf_counter()
        irradiance(made, points, normals)
        gpu, clock = time.process_time() - started, time.perf_counter() - clock
        started = time.process_time()
        field.irradiance(points, normals)
        cpu = "" if samples else f"{1e6 * (time.process_time() - started) / count:.0f}"
        said = ", ".join(f"{value} {key}" for key, value in settings.items()) + (", as a frame has them" if samples else "")
        rows.append(f"| {resolution}³ | `{name}` {said} | {1e6 * gpu / count:.0f} | {cpu} | {clock:.2f} s |")
        made.close()
    return rows


def live(scene, resolution: int) -> list[str]:
    """Rows of what following a changed scene costs."""
    from rtgi_addon.preview.indirect.voxels import voxel_tables
    technique, rows = techniques.get("cone_tracing"), []
    for light in (SURFACES, VOXELS):
        settings = technique.Settings(resolution=resolution, light=light)
        started = time.process_time()
        field = technique.bake(scene, settings, np.random.default_rng(0), Progress())
        made = time.process_time() - started
        started = time.process_time()
        field.relight(scene)
        lit = time.process_time() - started
        started = time.process_time()
        tables = voxel_tables(field)
        packed, size = time.process_time() - started, sum(texels.nbytes for texels in tables.textures.values()) / 2**20
        rows.append(f"| {resolution}³ | {light} | {len(field.voxels.cells):,} | {made:.2f} s | {lit:.2f} s | {packed:.2f} s | "
                    f"{size:.1f} MiB |")
    return rows


def main() -> int:
    """Measure, and print Markdown."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--sample", default="cornell_box")
    parser.add_argument("--receivers", type=int, default=2304)
    parser.add_argument("--resolutions", type=int, nargs="+", default=[64, 128])
    parser.add_argument("--only", choices=("looks", "live"))
    arguments = parser.parse_args()
    bpy.ops.wm.open_mainfile(filepath=str(ROOT / "sample_blends" / f"{arguments.sample}.blend"))
    scene = extract_scene(bpy.context.evaluated_depsgraph_get())
    open_context()
    if arguments.only != "live":
        print("| voxels | look-up | GPU [µs] | numpy [µs] | on the clock |\n|---|---|---:|---:|---:|", flush=True)
        for resolution in arguments.resolutions:
            for row in looks(scene, arguments.receivers, resolution):
                print(row, flush=True)
    if arguments.only != "looks":
        print("\n| voxels | light on them | in use | anything moved | lamps moved | tables | textures |")
        print("|---|---|---:|---:|---:|---:|---:|", flush=True)
        for resolution in arguments.resolutions:
            print(*live(scene, resolution), sep="\n", flush=True)
    return 0


if __name__ == "__main__":
    sys.exit(main())
