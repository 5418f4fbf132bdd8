"""Rays per second over a whole bake against bare embreex on the same rays with as many threads.

    python benchmarks/ray_rate.py [samples…] [--probes 2048] [--threads N]

A first bake records every ray it traces: probe rays, form-factor rays, shadow rays, the segments that split texels. Then, in turn
and several times over, the bake runs unrecorded and embreex traces the recorded rays with nothing around them. The ratio of
the two times is the ratio of the rates, as the rays are the same. Reading the .blend is not part of it; building the BVH is
given on its own, since bare embreex would have to build it too.
"""

import argparse
import json
import statistics
import sys
import time
from dataclasses import replace
from pathlib import Path

import bpy
import numpy as np

ROOT = Path(__file__).resolve().parents[1]
sys.path.insert(0, str(ROOT))

from rtgi_addon import techniques  # noqa: E402
from rtgi_addon.blender.extract import extract_scene  # noqa: E402
from rtgi_addon.progress import Progress  # noqa: E402
from rtgi_addon.transport import rays  # noqa: E402
from rtgi_addon.transport.context import LightContext  # noqa: E402
from rtgi_addon.transport.parallel import parallel_for, thread_count  # noqa: E402


def load(name: str, probes: int):
    """The extracted sample, its first volume resized to about ``probes`` in cells as even as can be."""
    bpy.ops.wm.open_mainfile(filepath=str(ROOT / "sample_blends" / f"{name}.blend"))
    scene = extract_scene()
    volume = scene.volumes[0]
    sides = np.linalg.norm(np.asarray(volume.world_from_local)[:3, :3], axis=0)
    cell = (sides.prod() / probes) ** (1 / 3)
    resolution = tuple(int(count) for count in np.maximum(1, np.round(sides / cell)))
    return replace(scene, volumes=(replace(volume, resolution=resolution),))


def bake(scene, threads: int):
    """Seconds of one bake, and of building its BVH."""
    technique = techniques.get("probes")
    started = time.perf_counter()
    progress = Progress()
    technique.bake(scene, technique.Settings(), np.random.default_rng(0), progress, threads=threads)
    seconds = time.perf_counter() - started
    return seconds, progress.finish().get("ray tracer", 0.0)


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
        bake(scene, threads)
    finally:
        tracer._intersect_chunk, tracer._occluded_chunk = originals
    return calls


def measure(name: str, probes: int, threads: int, runs: int) -> dict:
    """One row of the table."""
    scene = load(name, probes)
    calls = record(scene, threads)
    context = LightContext(scene, threads)
    tracer = getattr(context.tracer, "_tracer", context.tracer)
    total = sum(len(call[1]) for call in calls)
    whole, bare, bvh = [], [], []
    for _ in range(runs):
        seconds, building = bake(scene, threads)
        whole.append(seconds - building)
        bvh.append(building)
        started = time.perf_counter()
        parallel_for(lambda i: getattr(tracer, calls[i][0])(*calls[i][1:]), len(calls), threads)
        bare.append(time.perf_counter() - started)
    ratio = statistics.median(b / w for b, w in zip(bare, whole, strict=True))
    return {"sample": name, "probes": int(np.prod(scene.volumes[0].resolution)), "rays": total, "threads": threads,
            "bake_seconds": statistics.median(whole), "bvh_seconds": statistics.median(bvh),
            "bare_seconds": statistics.median(bare),
            "bake_rays_per_second": total / statistics.median(whole), "bare_rays_per_second": total / statistics.median(bare),
            "ratio": ratio}


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("samples", nargs="*", default=["atrium", "cornell_box"])
    parser.add_argument("--probes", type=int, default=2048)
    parser.add_argument("--threads", type=int, default=thread_count())
    parser.add_argument("--runs", type=int, default=3)
    arguments = parser.parse_args()
    rows = [measure(name, arguments.probes, arguments.threads, arguments.runs) for name in arguments.samples]
    for row in rows:
        print(f"{row['sample']:16s} {row['probes']:6,d} probes  {row['rays'] / 1e6:7.2f} M rays  "
              f"bake {row['bake_seconds']:7.2f} s (and {row['bvh_seconds']:.2f} s of set-up)  "
              f"{row['bake_rays_per_second'] / 1e6:5.2f} M/s  "
              f"bare embreex {row['bare_rays_per_second'] / 1e6:5.2f} M/s  ratio {row['ratio']:.2f}")
    results = ROOT / "benchmarks/results"
    results.mkdir(exist_ok=True)
    (results / "ray_rate.json").write_text(json.dumps({"schema": "rtgi-ray-rate/1", "rows": rows}, indent=1) + "\n")


if __name__ == "__main__":
    main()
