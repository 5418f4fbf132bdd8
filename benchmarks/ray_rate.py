"""Rays per second over a whole bake against bare embreex on the same rays with as many threads.

    python benchmarks/ray_rate.py [samples…] [--probes 2048] [--threads N]

A first bake, in numpy alone, records every ray it traces: of probes, of placing them, of form factors, of shadows, of what
splits texels, of the error on surfaces. Then, in turn and several times over, the bake runs unrecorded and embreex traces the
recorded rays with nothing around them.

The bake is all of it, from the extracted scene to SH in memory: placement, surface cache and its solver, sections of sequences
that tell the error, distances, deringing, the error on surfaces, checks. Reading the .blend is not part of it; building the BVH is
given on its own, since bare embreex would have to build it too. A rate is the rays that were traced, by both sides' own count, by
the time: kernels leave out rays into the surface that they leave, which numpy traces and throws away. Both are given by the clock,
with as many threads on either side, and by processor time, which says the same of a busy machine.
"""

import argparse
import json
import statistics
import sys
import time
from dataclasses import replace
from pathlib import Path
from typing import NamedTuple

import bpy
import numpy as np

ROOT = Path(__file__).resolve().parents[1]
sys.path.insert(0, str(ROOT))

from rtgi_addon import kernels, techniques  # noqa: E402
from rtgi_addon.blender.extract import extract_scene  # noqa: E402
from rtgi_addon.progress import Progress  # noqa: E402
from rtgi_addon.transport.context import LightContext  # noqa: E402
from rtgi_addon.transport.parallel import parallel_for, thread_count  # noqa: E402
from rtgi_addon.transport.rays import embree as rays  # noqa: E402
from rtgi_addon.transport.rays.ray_counter import count_rays  # noqa: E402


def load(name: str, probes: int):
    """The extracted sample, its first volume resized to about ``probes`` in cells as even as can be."""
    bpy.ops.wm.open_mainfile(filepath=str(ROOT / "sample_blends" / f"{name}.blend"))
    scene = extract_scene()
    volume = scene.volumes[0]
    sides = np.linalg.norm(np.asarray(volume.world_from_local)[:3, :3], axis=0)
    cell = (sides.prod() / probes) ** (1 / 3)
    resolution = tuple(int(count) for count in np.maximum(1, np.round(sides / cell)))
    return replace(scene, volumes=(replace(volume, resolution=resolution),))


class Run(NamedTuple):
    """Seconds by the ``clock`` and of the ``processor``, the ``rays`` traced in them, and how long the BVH took on its own."""

    clock: float
    processor: float
    rays: int
    bvh: float = 0.0


def timed(work) -> Run:
    """``work()``, which returns seconds that are not to count."""
    clock, processor = time.perf_counter(), time.process_time()
    with count_rays() as counter:
        left_out = work()
    return Run(time.perf_counter() - clock - left_out, time.process_time() - processor - left_out, counter.rays, left_out)


def bake(scene, threads: int) -> float:
    """One bake: the seconds of building its BVH."""
    technique, progress = techniques.get("probes"), Progress()
    technique.bake(scene, technique.Settings(), np.random.default_rng(0), progress, threads=threads)
    return progress.finish().get("ray tracer", 0.0)


def record(scene, threads: int) -> list[tuple]:
    """Every call that a bake makes to embreex: (function's name, origins, directions, limits)."""
    calls, tracer = [], rays.EmbreeTracer
    originals = tracer._intersect_chunk, tracer._occluded_chunk

    def recorder(name, original):
        def call(self, origins, directions, limits):
            calls.append((name, origins.copy(), directions.copy(), None if limits is None else np.array(limits)))
            return original(self, origins, directions, limits)
        return call

    try:
        tracer._intersect_chunk = recorder("_intersect_chunk", originals[0])
        tracer._occluded_chunk = recorder("_occluded_chunk", originals[1])
        with kernels.switched_off():
            bake(scene, threads)
    finally:
        tracer._intersect_chunk, tracer._occluded_chunk = originals
    return calls


def measure(name: str, probes: int, threads: int, runs: int) -> dict:
    """One row of the table."""
    scene = load(name, probes)
    calls = record(scene, threads)
    with kernels.switched_off():
        context = LightContext(scene, threads)
    tracer = getattr(context.tracer, "_tracer", context.tracer)
    total = sum(len(call[1]) for call in calls)

    def trace() -> float:
        parallel_for(lambda i: getattr(tracer, calls[i][0])(*calls[i][1:]), len(calls), threads)
        return 0.0

    pairs = [(timed(lambda: bake(scene, threads)), timed(trace)._replace(rays=total)) for _ in range(runs)]
    row = {"sample": name, "probes": int(np.prod(scene.volumes[0].resolution)), "threads": threads, "rays": pairs[0][0].rays,
           "bare_rays": total, "bvh_seconds": statistics.median(whole.bvh for whole, _ in pairs)}
    for kind in ("clock", "processor"):
        rates = [[run.rays / getattr(run, kind) for run in pair] for pair in pairs]
        row |= {f"bake_{kind}": statistics.median(getattr(whole, kind) for whole, _ in pairs),
                f"bare_{kind}": statistics.median(getattr(bare, kind) for _, bare in pairs),
                f"bake_rays_per_{kind}_second": statistics.median(ours for ours, _ in rates),
                f"bare_rays_per_{kind}_second": statistics.median(theirs for _, theirs in rates),
                f"ratio_{kind}": statistics.median(ours / theirs for ours, theirs in rates)}
    return row


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("samples", nargs="*", default=["atrium", "cornell_box"])
    parser.add_argument("--probes", type=int, default=2048)
    parser.add_argument("--threads", type=int, default=thread_count())
    parser.add_argument("--runs", type=int, default=3)
    arguments = parser.parse_args()
    rows = [measure(name, arguments.probes, arguments.threads, arguments.runs) for name in arguments.samples]
    print("| scene | probes | rays | BVH [s] | bake [s] | whole bake | bare embreex | ratio | ratio in processor time |\n"
          "|---|---:|---:|---:|---:|---:|---:|---:|---:|")
    for row in rows:
        print(f"| {row['sample']} | {row['probes']:,} | {row['rays'] / 1e6:.1f} M | {row['bvh_seconds']:.2f} | "
              f"{row['bake_clock']:.2f} | {row['bake_rays_per_clock_second'] / 1e6:.2f} M/s | "
              f"{row['bare_rays_per_clock_second'] / 1e6:.2f} M/s | {row['ratio_clock']:.2f} | {row['ratio_processor']:.2f} |")
    results = ROOT / "benchmarks/results"
    results.mkdir(exist_ok=True)
    (results / "ray_rate.json").write_text(json.dumps({"schema": "rtgi-ray-rate/2", "rows": rows}, indent=1) + "\n")


if __name__ == "__main__":
    main()
