"""Seconds of relighting a finished bake against baking afresh under the same new light, and how far their results differ.

    python benchmarks/relight.py [samples…] [--probes 2048] [--repeats 3]

Every sample is baked at default settings; then its first lamp moves and changes colour. Relighting and a fresh bake of the changed
scene are timed in turn, several times over, from the extracted scene to SH in memory; medians count. The relative RMSE between the
two is that of all usable probes' coefficients; next to it stands how far two fresh bakes of different seeds are apart, and how far
the light moved at all.
"""

import argparse
import json
import os
import platform
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
from rtgi_addon.evaluate.metrics import relative_rmse  # noqa: E402
from rtgi_addon.progress import Progress  # noqa: E402
from rtgi_addon.scene import Scene, SunLight  # noqa: E402

SAMPLES = ("cornell_box", "sun_window", "many_lights", "atrium")
TINT = np.array([1.5, 0.8, 0.5], np.float32)
# How far the lamp moves: a tenth of the volume's size, or a sun by this angle about the vertical [rad].
TURN = 0.15


def with_another_lamp(scene: Scene) -> Scene:
    """The scene with its first lamp moved and in another colour."""
    lamp, *others = scene.lights
    strength = next(name for name in ("irradiance", "intensity", "radiance") if hasattr(lamp, name))
    changes = {strength: getattr(lamp, strength) * TINT}
    if isinstance(lamp, SunLight):
        x, y, z = lamp.direction_world
        changes["direction_world"] = np.array([x * np.cos(TURN) - y * np.sin(TURN), x * np.sin(TURN) + y * np.cos(TURN), z],
                                              np.float32)
    else:
        step = 0.1 * np.asarray(scene.volumes[0].world_from_local)[:3, 0]
        changes["position_world"] = (lamp.position_world + step).astype(np.float32)
    return replace(scene, lights=(replace(lamp, **changes), *others))


def bake(scene: Scene, threads: int | None, seed: int = 0):
    """The field of a bake at default settings, and its seconds."""
    method = techniques.get("probes")
    started = time.perf_counter()
    field = method.bake(scene, method.Settings(), np.random.default_rng(seed), Progress(), threads=threads)
    return field, time.perf_counter() - started


def coefficients(field) -> np.ndarray:
    """SH (p, k, 3) of the usable probes of all volumes."""
    return np.concatenate([grid.sh[grid.usable] for grid in field.grids()])


def measure(name: str, probes: int, repeats: int, threads: int | None) -> dict:
    """One row of the table."""
    scene = _opened(name, probes)
    other = with_another_lamp(scene)
    field, _ = bake(scene, threads)
    bake_seconds, relight_seconds = [], []
    for repeat in range(repeats):
        started = time.perf_counter()
        relit = field.relight(other)
        relight_seconds.append(time.perf_counter() - started)
        fresh, seconds = bake(other, threads, seed=repeat)
        bake_seconds.append(seconds)
    another, _ = bake(other, threads, seed=repeats)
    return {"sample": name, "probes": probes, "lamps": len(scene.lights), "rays": field.stats["rays"],
            "bake_seconds": median(bake_seconds), "relight_seconds": median(relight_seconds),
            "ratio": median(relight_seconds) / median(bake_seconds), "all_bake_seconds": bake_seconds,
            "all_relight_seconds": relight_seconds, "relit_from_fresh": relative_rmse(coefficients(relit), coefficients(fresh)),
            "fresh_from_fresh": relative_rmse(coefficients(another), coefficients(fresh)),
            "before_from_fresh": relative_rmse(coefficients(field), coefficients(fresh))}


def main() -> None:
    """Measure what the command line names, print the table, write JSON (rows of other samples stay)."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("samples", nargs="*", metavar="sample", help=f"default: {' '.join(SAMPLES)}")
    parser.add_argument("--probes", type=int, default=2048)
    parser.add_argument("--repeats", type=int, default=3)
    parser.add_argument("--threads", type=int, help="default: every core")
    options = parser.parse_args()
    bake(with_another_lamp(_opened("cornell_box", 8)), options.threads)  # libraries are loaded once in a process
    machine = {"cpu": platform.processor() or platform.machine(), "threads": options.threads or os.cpu_count(),
               "load_average": os.getloadavg()[0] if hasattr(os, "getloadavg") else None}
    path = ROOT / "benchmarks/results/relight.json"
    rows = {row["sample"]: row for row in json.loads(path.read_text())["rows"]} if path.exists() else {}
    for name in options.samples or SAMPLES:
        row = rows[name] = measure(name, options.probes, options.repeats, options.threads) | {"machine": machine}
        print(f"{name:12s} {row['probes']:,} probes  bake {row['bake_seconds']:6.2f} s  relight {row['relight_seconds']:6.3f} s  "
              f"ratio 1/{1 / row['ratio']:.0f}  from a fresh bake {100 * row['relit_from_fresh']:.2f} % (two fresh bakes "
              f"{100 * row['fresh_from_fresh']:.2f} %, unchanged {100 * row['before_from_fresh']:.0f} %)", flush=True)
        path.parent.mkdir(exist_ok=True)
        path.write_text(json.dumps({"schema": "rtgi-relight/1", "rows": list(rows.values())}, indent=1) + "\n")


def _opened(name: str, probes: int) -> Scene:
    open_sample(name, probes)
    return extract_scene()


if __name__ == "__main__":
    main()
