"""Milliseconds of a light propagation volume in numpy: 32^3 cells, 8 steps, blocking on, three channels; and how cost grows.

    python benchmarks/lpv.py [--resolution 32] [--steps 8] [--threads 2] [--repeats 15]

A closed room with a block in it, seen by a lamp's reflective shadow maps, is injected, its faces are derived from the geometry
volume, light is propagated and gathered at 100,000 points. Medians count. The second table grows cells and steps one at a time; the
last column is the slope in a log-log plot: 1 is linear. Writes benchmarks/results/lpv.json.
"""

import argparse
import json
import os
import sys
import time
from pathlib import Path
from statistics import median

import numpy as np

ROOT = Path(__file__).resolve().parents[1]
sys.path[:0] = [str(ROOT), str(ROOT / "tests/support")]

import room_scenes as rooms  # noqa: E402
import scene_builders as build  # noqa: E402

from rtgi_addon.techniques.lpv.crossings import trace_faces  # noqa: E402
from rtgi_addon.techniques.lpv.gather import gather  # noqa: E402
from rtgi_addon.techniques.lpv.geometry_volume import face_blocking, vacuum  # noqa: E402
from rtgi_addon.techniques.lpv.grid import LpvGrid  # noqa: E402
from rtgi_addon.techniques.lpv.injection import inject  # noqa: E402
from rtgi_addon.techniques.lpv.propagation import propagate  # noqa: E402
from rtgi_addon.techniques.lpv.surfels import peel  # noqa: E402
from rtgi_addon.transport.context import LightContext  # noqa: E402
from rtgi_addon.transport.views.reflective_shadow_map import capture  # noqa: E402
from rtgi_addon.transport.views.shadow_views import views_of  # noqa: E402

HELD_TO = 60.0
RECEIVERS = 100_000
CELLS, STEPS = (16, 24, 32, 48, 64), (4, 8, 16, 32, 64)


def milliseconds(work, repeats: int) -> float:
    """Median time of ``work()`` after one run that counts for nothing."""
    work()
    times = []
    for _ in range(repeats):
        started = time.perf_counter()
        work()
        times.append(1e3 * (time.perf_counter() - started))
    return median(times)


class Room:
    """A room at one resolution with all that its volumes need."""

    def __init__(self, resolution: int):
        block = rooms.moved(build.cube("block", 0.35), (0.2, -0.3, -0.62))
        scene = build.scene([build.cube("room", 1.0, inward=True), block], [build.material("wall", 0.6)],
                            [build.point_light((-0.3, 0.2, 0.5))])
        context = LightContext(scene)
        self.grid = LpvGrid((-1.1,) * 3, 2.2 / resolution, (resolution,) * 3)
        texels = [capture(context, view).lights() for view in views_of(context, 0, 128)]
        self.lights = tuple(np.concatenate(columns) for columns in zip(*(part[:3] for part in texels), strict=True))
        self.context, self.surfels = context, peel(context, self.grid)
        self.geometry = trace_faces(context, self.grid, self.surfels)
        self.blocking = face_blocking(self.geometry)
        self.injected = inject(self.grid, *self.lights, self.blocking.faces)

    def propagate(self, steps: int, threads: int) -> np.ndarray:
        """The accumulated volume."""
        return propagate(self.injected, self.blocking, steps, threads=threads)


def slope(x, y) -> float:
    """Exponent of the power law through the points."""
    return float(np.polyfit(np.log(x), np.log(y), 1)[0])


def main() -> None:
    """Measure, print Markdown, write JSON."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--resolution", type=int, default=32)
    parser.add_argument("--steps", type=int, default=8)
    parser.add_argument("--threads", type=int, default=min(2, os.cpu_count() or 1))
    parser.add_argument("--repeats", type=int, default=15)
    options = parser.parse_args()
    room, steps, threads = Room(options.resolution), options.steps, options.threads
    without, empty = face_blocking(room.geometry, bounces=False), vacuum(room.grid)
    accumulated = room.propagate(steps, threads)
    rng = np.random.default_rng(0)
    points = rng.uniform(-0.9, 0.9, (RECEIVERS, 3))
    normals = rng.normal(size=(RECEIVERS, 3))
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    parts = {
        f"inject {len(room.lights[0]):,} lights": lambda: inject(room.grid, *room.lights, room.blocking.faces),
        f"trace the faces near {len(room.surfels.area):,} surfels": lambda: trace_faces(room.context, room.grid, room.surfels),
        "faces, with bounces": lambda: face_blocking(room.geometry),
        "faces, blocking alone": lambda: face_blocking(room.geometry, bounces=False),
        f"{steps} steps, blocking and bounces": lambda: room.propagate(steps, threads),
        f"{steps} steps, blocking alone": lambda: propagate(room.injected, without, steps, threads=threads),
        f"{steps} steps, vacuum": lambda: propagate(room.injected, empty, steps, threads=threads),
        f"gather at {RECEIVERS:,} points": lambda: gather((room.grid,), (accumulated,), points, normals,
                                                                       faces=(room.blocking.faces,)),
    }
    times = {name: milliseconds(work, options.repeats) for name, work in parts.items()}
    whole = times["faces, blocking alone"] + times[f"{steps} steps, blocking alone"]
    print(f"{options.resolution}^3 cells, {threads} threads, load average {os.getloadavg()[0]:.1f}\n\n| part | ms |\n|---|---:|")
    for name, value in times.items():
        print(f"| {name} | {value:.1f} |")
    print(f"| **faces and {steps} steps, blocking alone** (held to {HELD_TO:.0f}) | **{whole:.1f}** |\n")
    repeats = max(3, options.repeats // 3)
    by_cells = {}
    for count in CELLS:
        other = Room(count)
        by_cells[count**3] = milliseconds(lambda other=other: other.propagate(steps, threads), repeats)
    by_steps = {count: milliseconds(lambda count=count: room.propagate(count, threads), repeats) for count in STEPS}
    print("| grows | ms | slope |\n|---|---|---:|")
    for name, rows in (("cells", by_cells), ("steps", by_steps)):
        listed = ", ".join(f"{x:,}: {y:.1f}" for x, y in rows.items())
        print(f"| {name} | {listed} | {slope(list(rows), list(rows.values())):.2f} |")
    path = ROOT / "benchmarks/results/lpv.json"
    path.parent.mkdir(exist_ok=True)
    path.write_text(json.dumps({"schema": "rtgi-lpv-times/1", "resolution": options.resolution, "steps": steps, "threads": threads,
                                "milliseconds": times, "held": whole, "by_cells": by_cells, "by_steps": by_steps}, indent=1) + "\n")


if __name__ == "__main__":
    main()
