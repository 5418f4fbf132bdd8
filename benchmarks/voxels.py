"""Voxels: how long a scene takes into them, and how far cones and rays through them are from the path reference.

    python benchmarks/voxels.py [--samples cornell_box …] [--points 300] [--noise 0.02] [--threads 2]
                                [--only times|errors|walls|cascades]

*Times*: spheres of 245,760 triangles in a room, put into 64³ and 128³ voxels; seconds of processor time, the best of three.
*Errors*: relative RMSE less the reference's own variance, bias and leak as in technique_errors.py, with processor seconds of the
bake. *Walls*: two_rooms at voxels that its wall holds one and two of. *Cascades*: atrium in one grid of 64 voxels, and in three of
as many cells together and of 64 each. Prints Markdown.
"""

import argparse
import sys
import time
from pathlib import Path

import bpy
import numpy as np

ROOT = Path(__file__).resolve().parents[1]
sys.path[:0] = [str(ROOT), str(ROOT / "tests/support")]

import scene_builders as build  # noqa: E402

from rtgi_addon import techniques  # noqa: E402
from rtgi_addon.blender.extract import extract_scene  # noqa: E402
from rtgi_addon.evaluate.measure import Yard  # noqa: E402
from rtgi_addon.transport.surfaces.geometry import flatten  # noqa: E402
from rtgi_addon.transport.surfaces.materials import Surfaces  # noqa: E402
from rtgi_addon.transport.voxels import grid_around, voxelize  # noqa: E402

SAMPLES = ("cornell_box", "two_rooms", "sun_window", "corridor_door_ajar", "atrium")
RUNS = (("cone_tracing", {}), ("cone_tracing", {"cones": 6}), ("cone_tracing", {"light": "voxels"}),
        ("cone_tracing", {"light": "voxels", "bounces": 4}), ("voxel_march", {}), ("voxel_march", {"gather": "voxels"}))
# One grid; three that are as large together, 64³ / 3 each; three of 64³.
CASCADES = ({}, {"resolution": 44, "cascades": 3}, {"cascades": 3})
# The wall between the rooms of two_rooms [m].
WALL = 0.04


def times(threads: int | None) -> list[str]:
    """Rows of voxelization's cost."""
    meshes = [build.sphere(f"sphere {index}", radius=0.3 + 0.05 * index, subdivisions=6) for index in range(3)]
    scene = build.scene([*meshes, build.cube("room", 1.5, inward=True)])
    geometry = flatten(scene)
    surfaces, rows = Surfaces(scene, geometry), ["| voxels | triangles | in use | processor time |", "|---|---:|---:|---:|"]
    for resolution in (64, 128):
        grid, best = grid_around(np.array(geometry.bounds()), resolution), np.inf
        for _ in range(3):
            started = time.process_time()
            voxels = voxelize(geometry, surfaces, grid, threads)
            best = min(best, time.process_time() - started)
        rows.append(f"| {resolution}³ | {geometry.count:,} | {len(voxels.cells):,} | {best:.2f} s |")
    return rows


def _row(yard: Yard, sample: str, name: str, settings: dict) -> str:
    technique = techniques.get(name)
    started = time.process_time()
    run = yard.measure(technique, technique.Settings(**settings), seed=0)
    seconds, found = time.process_time() - started, run.errors["surface"]
    leak = "–" if found.leak is None else f"{100 * found.leak:.2g} % (true {100 * found.true_leak:.1g} %)"
    said = ", ".join(f"{key} {value:.3g}" if isinstance(value, float) else f"{key} {value}" for key, value in settings.items())
    return f"| {sample} | `{name}` {said} | {seconds:.1f} | {100 * found.error:.1f} % | {100 * found.bias:+.1f} % | {leak} |"


def _yard(sample: str, options) -> Yard:
    bpy.ops.wm.open_mainfile(filepath=str(ROOT / "sample_blends" / f"{sample}.blend"))
    return Yard(extract_scene(), points=options.points, normals_per_point=1, noise=options.noise, threads=options.threads)


def main() -> None:
    """Measure what the command line names and print the tables."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--samples", nargs="+", default=SAMPLES)
    parser.add_argument("--points", type=int, default=300)
    parser.add_argument("--noise", type=float, default=0.02, help="relative noise of the reference, which is subtracted")
    parser.add_argument("--only", choices=("times", "errors", "walls", "cascades"))
    parser.add_argument("--threads", type=int, help="default: every core")
    options = parser.parse_args()
    head = ["| sample | settings | processor seconds, gather included | error | bias | leak |", "|---|---|---:|---:|---:|---:|"]
    if options.only in (None, "times"):
        print("\n".join(times(options.threads)), flush=True)
    if options.only in (None, "errors"):
        print("\n".join(["", *head]))
        for sample in options.samples:
            yard = _yard(sample, options)
            for name, settings in RUNS:
                print(_row(yard, sample, name, settings), flush=True)
    if options.only in (None, "walls"):
        print("\n".join(["", *head]))
        yard = _yard("two_rooms", options)
        for voxels in (1, 2):
            for name in ("cone_tracing", "voxel_march"):
                print(_row(yard, "two_rooms", name, {"voxel_size": WALL / voxels}), flush=True)
    if options.only in (None, "cascades"):
        print("\n".join(["", *head]))
        yard = _yard("atrium", options)
        for name in ("cone_tracing", "voxel_march"):
            for settings in CASCADES:
                print(_row(yard, "atrium", name, settings), flush=True)


if __name__ == "__main__":
    main()
