"""Instant radiosity: gather rate against bare embreex, cost by number of lights, accuracy, clamp loss, flicker of a moving lamp.

    python benchmarks/vpl.py [rate linear accuracy flicker] [--samples NAME…] [--threads N] [--runs 3] [--seeds 3]

Each part prints a Markdown table. *rate*: LIGHTS virtual lights from the sample's own light paths times RECEIVERS points on
surfaces, shadow rays included, against embreex on the very same rays with as many threads and nothing around them, in turn; pairs
whose normals face away need no ray, so there are more pairs than rays. *linear*: seconds of the gather by number of lights
(`linear_cost.py` charts it beside the other techniques' costs). *accuracy*: irradiance at surface points seen from the sample's
volumes against the path reference; leak is the mean where the reference is dark, over the mean elsewhere. *flicker*: the first
lamp of the sample moves by 5 mm a frame; temporal standard deviation over mean of the middle receiver after a quadratic trend,
for lights that are followed and for lights sampled afresh.
"""

import argparse
import statistics
import sys
import time
from dataclasses import replace
from pathlib import Path

import bpy
import numpy as np

ROOT = Path(__file__).resolve().parents[1]
sys.path.insert(0, str(ROOT))

from rtgi_addon import kernels, techniques  # noqa: E402
from rtgi_addon.blender.extract import extract_scene  # noqa: E402
from rtgi_addon.progress import Progress  # noqa: E402
from rtgi_addon.techniques.vpl.gather import gather  # noqa: E402
from rtgi_addon.transport.context import LightContext  # noqa: E402
from rtgi_addon.transport.parallel import parallel_for, thread_count  # noqa: E402
from rtgi_addon.transport.paths.reference import irradiance_at  # noqa: E402
from rtgi_addon.transport.rays import embree as rays  # noqa: E402
from rtgi_addon.transport.vectors import dot  # noqa: E402

SAMPLES = ("cornell_box", "two_rooms", "sun_window", "corridor_door_ajar")
LIGHTS, RECEIVERS = 1000, 100_000
REFERENCE_RECEIVERS, REFERENCE_PATHS, DARK = 256, 8192, 1e-3
FRAMES, STEP = 32, 0.005
VPL = techniques.get("vpl")


def load(name: str):
    """The extracted sample."""
    bpy.ops.wm.open_mainfile(filepath=str(ROOT / "sample_blends" / f"{name}.blend"))
    return extract_scene()


def bake(scene, seed: int = 0, threads: int | None = None, **settings):
    """A field of virtual lights."""
    return VPL.bake(scene, VPL.Settings(**settings), np.random.default_rng(seed), Progress(), threads=threads)


def receivers(scene, count: int, seed: int = 0):
    """Points on surfaces that free points of the volumes see, and their normals."""
    rng, context = np.random.default_rng(seed), LightContext(scene)
    matrix = np.asarray(scene.volumes[0].world_from_local)
    origins = (rng.uniform(-1, 1, (4 * count, 3)) @ matrix[:3, :3].T + matrix[:3, 3]).astype(np.float32)
    directions = rng.normal(size=(4 * count, 3)).astype(np.float32)
    hits = context.tracer.intersect(origins, directions)
    found = np.flatnonzero(hits.primitive >= 0)
    found = found[dot(context.geometry.normals_world[hits.primitive[found]], directions[found]) < 0][:count]
    primitive = hits.primitive[found]
    return context.geometry.points(primitive, hits.u[found], hits.v[found]), context.geometry.normals_world[primitive]


def record(work) -> list[tuple]:
    """(origins, directions, limits) of every occlusion query that ``work`` makes."""
    calls, original = [], rays.EmbreeTracer._occluded_chunk

    def recorded(self, origins, directions, limits):
        calls.append((origins.copy(), directions.copy(), None if limits is None else np.array(limits)))
        return original(self, origins, directions, limits)

    try:
        rays.EmbreeTracer._occluded_chunk = recorded
        work()
    finally:
        rays.EmbreeTracer._occluded_chunk = original
    return calls


def rate(name: str, threads: int, runs: int) -> str:
    """One row: the gather and bare embreex in turn."""
    scene = load(name)
    context = LightContext(scene, threads)
    lights = bake(scene, threads=threads, lights=LIGHTS).lights
    lights = lights.take(slice(0, LIGHTS)).with_distant(*np.zeros((2, 0, 3)))
    points, normals = receivers(scene, RECEIVERS)
    order = np.lexsort(np.round(points.T, 1))
    points, normals = points[order], normals[order]

    def whole():
        gather(context, lights, points, normals, threads=threads)

    with kernels.switched_off():
        plain = LightContext(scene, threads)
        calls = record(lambda: gather(plain, lights, points, normals, threads=threads))
    tracer = getattr(plain.tracer, "_tracer", plain.tracer)
    traced = sum(len(call[0]) for call in calls)
    seconds, bare = [], []
    for _ in range(runs):
        started = time.perf_counter()
        whole()
        seconds.append(time.perf_counter() - started)
        started = time.perf_counter()
        # The query itself, without what the tracer's own wrapper does around it.
        parallel_for(lambda i: tracer._scene.run(calls[i][0], calls[i][1], np.array(calls[i][2], np.float32), query="OCCLUDED"),
                     len(calls), threads)
        bare.append(time.perf_counter() - started)
    ratio = statistics.median(b / s for b, s in zip(bare, seconds, strict=True))
    gathered, alone = statistics.median(seconds), statistics.median(bare)
    return (f"| {name} | {lights.count * len(points) / 1e6:.1f} M | {traced / 1e6:.1f} M | {gathered:.2f} | "
            f"{traced / gathered / 1e6:.1f} M/s | {traced / alone / 1e6:.1f} M/s | {ratio:.2f} |")


def linear(name: str, threads: int, runs: int) -> list[tuple[int, float]]:
    """(number of lights, seconds of the gather at 10,000 receivers)."""
    scene = load(name)
    context = LightContext(scene, threads)
    points, normals = receivers(scene, 10_000)
    rows = []
    for count in (250, 500, 1000, 2000, 4000, 8000):
        lights, seconds = bake(scene, threads=threads, lights=count).lights, []
        for _ in range(runs):
            started = time.perf_counter()
            gather(context, lights, points, normals, threads=threads)
            seconds.append(time.perf_counter() - started)
        rows.append((lights.count, min(seconds)))
    return rows


def accuracy(name: str, seeds: int, **settings) -> str:
    """One row: errors at surface points, over seeds, the reference's own noise subtracted."""
    scene = load(name)
    points, normals = receivers(scene, REFERENCE_RECEIVERS)
    reference = irradiance_at(LightContext(scene), points, normals, REFERENCE_PATHS)
    exact, noise = reference.mean.astype(np.float64), (reference.standard_error.astype(np.float64) ** 2).sum()
    norm, dark = (exact**2).sum(), exact.sum(axis=1) <= DARK * exact.sum(axis=1).mean()
    errors, biases, medians, leaks, losses, took = [], [], [], [], [], []
    for seed in range(seeds):
        started = time.perf_counter()
        field = bake(scene, seed, **settings)
        took.append(time.perf_counter() - started)
        measured = field.irradiance(points, normals).astype(np.float64)
        errors.append(np.sqrt(max(((measured - exact) ** 2).sum() - noise, 0) / norm))
        biases.append(measured.sum() / exact.sum() - 1)
        medians.append(np.median(np.abs(measured - exact)[~dark].sum(axis=1) / exact[~dark].sum(axis=1)))
        leaks.append(measured[dark].mean() / exact[~dark].mean() if dark.any() else np.nan)
        losses.append(field.stats.get("clamp_loss", 0.0))
    leak = "–" if np.isnan(leaks[0]) else f"{max(leaks):.1e}"
    return (f"| {name} | {100 * min(errors):.1f}–{100 * max(errors):.1f} % | "
            f"{100 * min(biases):+.1f} to {100 * max(biases):+.1f} % | {100 * statistics.median(medians):.1f} % | {leak} | "
            f"{100 * statistics.mean(losses):.2f} % | {100 * np.sqrt(noise / norm):.1f} % | {statistics.median(took):.2f} |")


def flicker(name: str, **settings) -> str:
    """One row: temporal standard deviation over mean, median over receivers, of both ways to follow a lamp."""
    scene = load(name)
    points, normals = receivers(scene, REFERENCE_RECEIVERS)
    field, fractions, seconds, followed, fresh = bake(scene, **settings), [], [], [], []
    for frame in range(FRAMES):
        lamp = scene.lights[0]
        moved = lamp.position_world + np.float32([STEP * (frame + 1), 0, 0])
        now = replace(scene, lights=(replace(lamp, position_world=moved), *scene.lights[1:]))
        started = time.perf_counter()
        field = field.relight(now)
        seconds.append(time.perf_counter() - started)
        fractions.append(field.stats["replaced_fraction"])
        followed.append(field.irradiance(points, normals).mean(axis=1))
        fresh.append(bake(now, frame + 1, **settings).irradiance(points, normals).mean(axis=1))
    lit = np.mean(fresh, axis=0) > DARK * np.mean(fresh)

    def noise(frames):
        frames = np.array(frames, np.float64)[:, lit]
        at = np.arange(len(frames))
        trend = np.polynomial.polynomial.polyval(at, np.polynomial.polynomial.polyfit(at, frames, 2)).T
        return 100 * np.median((frames - trend).std(axis=0) / frames.mean(axis=0))

    return (f"| {name} | {100 * np.mean(fractions):.2f} % | {100 * max(fractions):.2f} % | {statistics.median(seconds):.3f} | "
            f"{noise(followed):.2f} % | {noise(fresh):.2f} % |")


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("parts", nargs="*", default=[])
    parser.add_argument("--samples", nargs="+", default=list(SAMPLES))
    parser.add_argument("--threads", type=int, default=thread_count())
    parser.add_argument("--runs", type=int, default=3)
    parser.add_argument("--seeds", type=int, default=3)
    arguments = parser.parse_args()
    parts = arguments.parts or ["rate", "linear", "accuracy", "flicker"]
    if "rate" in parts:
        print("\n| sample | pairs | rays | seconds | gather | bare embreex | ratio |\n|---|---:|---:|---:|---:|---:|---:|")
        for name in arguments.samples:
            print(rate(name, arguments.threads, arguments.runs), flush=True)
    if "linear" in parts:
        rows = linear(arguments.samples[0], arguments.threads, arguments.runs)
        print("\n| lights | seconds | per light |\n|---:|---:|---:|")
        for lights, seconds in rows:
            print(f"| {lights:,} | {seconds:.3f} | {1e6 * seconds / lights:.0f} µs |")
    if "accuracy" in parts:
        print("\n| sample | error | bias | median error | leak | clamp loss | reference's noise | bake [s] |\n"
              "|---|---:|---:|---:|---:|---:|---:|---:|")
        for name in arguments.samples:
            print(accuracy(name, arguments.seeds), flush=True)
    if "flicker" in parts:
        print("\n| sample | replaced a frame | most | update [s] | followed | sampled afresh |\n|---|---:|---:|---:|---:|---:|")
        for name in arguments.samples:
            if hasattr(load(name).lights[0], "position_world"):
                print(flicker(name, lights=1024, candidates=4), flush=True)


if __name__ == "__main__":
    main()
