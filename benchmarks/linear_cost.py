"""Does cost grow linearly in virtual lights, samples, steps and cells? One chart for all four.

    python benchmarks/linear_cost.py [--sample cornell_box] [--runs 5] [--threads N]

Virtual lights and RSM samples: seconds of the gather at 10,000 surface points of the sample (shadow rays for virtual lights, none
for RSM, as in its paper). Steps and cells: seconds of propagating a light volume through a closed room with blocking. Best of a few
runs in turn. Prints Markdown with the log-log slope (1 is linear) and writes linear_cost.png and .json to benchmarks/results.
"""

import argparse
import json
import sys
import time
from pathlib import Path

import numpy as np

ROOT = Path(__file__).resolve().parents[1]
sys.path[:0] = [str(ROOT), str(ROOT / "benchmarks")]

import lpv  # noqa: E402
import vpl  # noqa: E402

from rtgi_addon import techniques  # noqa: E402
from rtgi_addon.progress import Progress  # noqa: E402
from rtgi_addon.transport.parallel import thread_count  # noqa: E402

RECEIVERS = 10_000
LIGHTS, SAMPLES = (250, 500, 1000, 2000, 4000), (100, 200, 400, 800, 1600)
STEPS, CELLS = (4, 8, 16, 32, 64), (16, 24, 32, 48, 64)
# Okabe and Ito's colours, which the colour-blind can tell apart, with a mark each.
STYLES = (("#0072B2", "o"), ("#D55E00", "s"), ("#009E73", "^"), ("#CC79A7", "D"))


def works(sample: str, threads: int) -> dict[str, dict[int, object]]:
    """What to time: by the name of what grows, by its size."""
    scene = vpl.load(sample)
    context = vpl.LightContext(scene, threads)
    points, normals = vpl.receivers(scene, RECEIVERS)
    lights = vpl.bake(scene, threads=threads, lights=max(LIGHTS)).lights
    rsm = techniques.get("rsm")
    fields = {count: rsm.bake(scene, rsm.Settings(samples=count), np.random.default_rng(0), Progress(), threads=threads)
              for count in SAMPLES}
    rooms = {count: lpv.Room(count) for count in CELLS}
    order = np.random.default_rng(0).permutation(lights.count)
    parts = {count: lights.take(order[:count]) for count in LIGHTS if count <= lights.count}
    return {
        "virtual lights": {count: lambda part=part: vpl.gather(context, part, points, normals, threads=threads)
                           for count, part in parts.items()},
        "RSM samples": {count: lambda field=field: field.irradiance(points, normals) for count, field in fields.items()},
        "LPV steps": {count: lambda count=count: rooms[32].propagate(count, threads) for count in STEPS},
        "LPV cells": {count**3: lambda room=room: room.propagate(8, threads) for count, room in rooms.items()},
    }


def measure(work: dict[int, object], runs: int) -> dict[int, float]:
    """Best seconds by size, the sizes in turn so that a busy moment hits all alike."""
    best = dict.fromkeys(work, np.inf)
    for _ in range(runs):
        for size, call in work.items():
            started = time.perf_counter()
            call()
            best[size] = min(best[size], time.perf_counter() - started)
    return best


def chart(measured: dict[str, dict[int, float]], path: Path) -> None:
    """Seconds over size relative to the smallest, beside a line of slope 1."""
    import matplotlib
    matplotlib.use("Agg")
    import matplotlib.pyplot as plt
    figure, axes = plt.subplots(figsize=(6.4, 4.6))
    for (name, rows), (color, mark) in zip(measured.items(), STYLES, strict=True):
        sizes, seconds = np.array(list(rows)), np.array(list(rows.values()))
        axes.loglog(sizes / sizes[0], 1e3 * seconds, color=color, marker=mark, label=f"{name} (from {sizes[0]:,})")
        axes.loglog(sizes / sizes[0], 1e3 * seconds[-1] * sizes / sizes[-1], color=color, linestyle=":", linewidth=1)
    axes.set_xlabel("times as many")
    axes.set_ylabel("milliseconds (dotted: slope 1)")
    axes.grid(True, which="both", alpha=0.25)
    axes.legend()
    figure.savefig(path, dpi=130, bbox_inches="tight")


def main() -> None:
    """Measure, print, write."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--sample", default="cornell_box")
    parser.add_argument("--runs", type=int, default=5)
    parser.add_argument("--threads", type=int, default=thread_count())
    options = parser.parse_args()
    measured = {name: measure(work, options.runs) for name, work in works(options.sample, options.threads).items()}
    print("\n| what grows | milliseconds | slope |\n|---|---|---:|")
    for name, rows in measured.items():
        listed = ", ".join(f"{size:,}: {1e3 * seconds:.1f}" for size, seconds in rows.items())
        print(f"| {name} | {listed} | {lpv.slope(list(rows), list(rows.values())):.2f} |")
    results = ROOT / "benchmarks/results"
    results.mkdir(exist_ok=True)
    (results / "linear_cost.json").write_text(json.dumps(measured, indent=1), encoding="utf-8")
    chart(measured, results / "linear_cost.png")


if __name__ == "__main__":
    main()
