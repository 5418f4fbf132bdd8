"""Seconds against error: this bake and Cycles panoramas, for the same probes of the same .blend on the same machine in one run.

    python benchmarks/bake_vs_cycles.py [samples…] [--probes 64 2048] [--method tiles|panorama] [--quick] [--chart]

Both sides start from the open file and end with SH in memory, set-up included: for the bake that is extraction, BVH, surface
cache and probes; for Cycles the time from the first render call, the file reopened before each measurement so that nothing is
left over. Cycles renders as rtgi_addon/blender/cycles/reference.py does it: by default the fastest way found, the tiles of all
probes in one picture through an OSL camera, or with `--method panorama` as people do it today, one equirectangular render a
probe. Blue-noise sampling, light tree, no denoising and no path guiding (which made these scenes slower).

Where a render would take more than ten million paths, Cycles renders 256 probes, those of the reference among them, and the time
beyond its set-up (a render of one probe with one sample) is scaled by the number of probes; on cornell_box that agrees with the
whole lattice of 2,048 within the noise (a subset of 96 does not: it overestimates Cycles' time by a third). Both errors are taken
at the same points against the same Cycles reference, whose own variance is subtracted. Measurements of the two are interleaved,
and the seconds at equal error are interpolated between the two nearest, log against log.
"""

import argparse
import json
import os
import platform
import sys
import time
from pathlib import Path

import bpy
import numpy as np

ROOT = Path(__file__).resolve().parents[1]
sys.path.insert(0, str(ROOT))

from rtgi_addon import techniques  # noqa: E402
from rtgi_addon.blender.cli.streams import Streams  # noqa: E402
from rtgi_addon.blender.cycles.reference import CyclesSettings, points_in_the_open, render_probes, volume_points  # noqa: E402
from rtgi_addon.blender.extract import extract_scene  # noqa: E402
from rtgi_addon.evaluate.metrics import relative_rmse  # noqa: E402
from rtgi_addon.progress import Progress  # noqa: E402

SAMPLES = ("cornell_box", "sky_courtyard", "sun_window", "atrium", "many_lights")
RESULTS = ROOT / "benchmarks/results"
REFERENCE_POINTS, SUBSET, FULL_PATHS = 24, 256, 10_000_000
BAKE_ERRORS = (0.08, 0.04, 0.02, 0.01, 0.005)
CYCLES_SAMPLES = (1, 4, 16, 64, 256)
TILE, BOUNCES = 32, 64


def open_sample(name: str, probes: int) -> bpy.types.Object:
    """Open a sample and give its volume ``probes`` samples in cells as even as can be."""
    bpy.ops.wm.open_mainfile(filepath=str(ROOT / "sample_blends" / f"{name}.blend"))
    volume = next(obj for obj in bpy.context.scene.objects if obj.type == "LIGHT_PROBE" and obj.data.type == "VOLUME")
    data = volume.data
    data.resolution_x, data.resolution_y, data.resolution_z = even_resolution(probes, np.array(volume.scale))
    bpy.context.view_layer.update()
    return volume


def even_resolution(probes: int, size: np.ndarray) -> tuple[int, int, int]:
    """Three factors of ``probes`` that cut a box of ``size`` (3,) into cells with the least difference of their sides."""
    factors = [(x, y, probes // (x * y)) for x in range(1, probes + 1) if probes % x == 0
               for y in range(1, probes // x + 1) if probes // x % y == 0]
    return min(factors, key=lambda counts: float(np.ptp(np.log(size / np.array(counts)))))


def reference(name: str, probes: int, seconds: float, threads: int | None, keep: bool) -> dict:
    """Flat lattice indices, SH and variance at points in the open; with ``keep`` stored in benchmarks/results for later runs."""
    path = RESULTS / f"reference_{name}_{probes}.npz"
    volume = open_sample(name, probes)
    lattice = volume_points(bpy.context.scene)
    if path.exists():
        with np.load(path) as data:
            known = {key: data[key] for key in data.files}
        if np.allclose(known["points_world"], lattice[known["index"]], atol=1e-5):
            return known
    resolution = (volume.data.resolution_x, volume.data.resolution_y, volume.data.resolution_z)
    candidates = np.unique(np.linspace(0, len(lattice) - 1, 256).astype(int))
    clearance = 0.2 * float((2 * np.array(volume.scale) / resolution).min())
    index = candidates[points_in_the_open(bpy.context.scene, lattice[candidates], clearance, REFERENCE_POINTS)]
    estimates, started = [], time.perf_counter()
    while len(estimates) < 4 or time.perf_counter() - started < seconds:
        settings = CyclesSettings(resolution=128, samples=8, bounces=BOUNCES, first_seed=1000 + len(estimates), threads=threads)
        estimates.append(render_probes(lattice[index], settings)["sh"])
        if len(estimates) < 4:
            continue
        mean, variance = np.mean(estimates, axis=0), np.var(estimates, axis=0, ddof=1) / len(estimates)
        if variance.sum() <= 0.0015**2 * np.square(mean).sum():
            break
    known = {"index": index, "sh": mean, "variance": variance, "points_world": lattice[index]}
    if keep:
        np.savez_compressed(path, **known)
    return known


def measure_bake(name: str, probes: int, error: float, known: dict, threads: int | None) -> dict:
    """Bake the whole lattice from the open file; the error at the reference's points."""
    open_sample(name, probes)
    method = techniques.get("probes")
    started = time.perf_counter()
    scene = extract_scene()
    extracted = time.perf_counter()
    field = method.bake(scene, method.Settings(error=error), np.random.default_rng(0), Progress(), threads=threads)
    (grid,) = field.grids()
    seconds = time.perf_counter() - started
    baked = grid.sh.reshape(-1, *grid.sh.shape[3:])[known["index"]]
    return {"setting": error, "seconds": seconds, "extract_seconds": extracted - started,
            "error": relative_rmse(baked, known["sh"], known["variance"])}


def measure_cycles(name: str, probes: int, samples: int, known: dict, options) -> dict:
    """Render the lattice, or a subset of it scaled up, from the open file; the error at the reference's points."""
    open_sample(name, probes)
    lattice = volume_points(bpy.context.scene)
    chosen = known["index"]
    others = np.setdiff1d(np.arange(probes), chosen)
    extra = (probes if probes * TILE**2 * samples <= FULL_PATHS else min(probes, SUBSET)) - len(chosen)
    if extra > 0:
        chosen = np.concatenate((chosen, others[np.linspace(0, len(others) - 1, extra).astype(int)]))
    common = {"resolution": TILE, "bounces": BOUNCES, "threads": options.threads, "method": options.method}
    settings = CyclesSettings(samples=samples, **common)
    rendered = render_probes(lattice[chosen], settings)
    seconds, scaled = rendered["seconds"], len(chosen) < probes
    if scaled:
        open_sample(name, probes)
        least = CyclesSettings(samples=1, **common)
        set_up = render_probes(lattice[:1], least)["seconds"]
        seconds = set_up + (seconds - set_up) * probes / len(chosen)
    return {"setting": samples, "seconds": seconds, "rendered_probes": len(chosen), "scaled": scaled,
            "error": relative_rmse(rendered["sh"][:len(known["index"])], known["sh"], known["variance"])}


def seconds_at(points: list[dict], error: float) -> tuple[float, str]:
    """Seconds at ``error`` from measured points: interpolated log-log, or how it lies outside them."""
    points = sorted(points, key=lambda point: point["seconds"])
    below = [index for index, point in enumerate(points) if point["error"] <= error]
    if not below:
        # Past the last point both sides are at best Monte Carlo: error ∝ seconds^−½.
        last = points[-1]
        return last["seconds"] * (last["error"] / error) ** 2, "extrapolated"
    if below[0] == 0:
        return points[0]["seconds"], "at most"
    worse, better = points[below[0] - 1], points[below[0]]
    share = np.log(worse["error"] / error) / np.log(worse["error"] / max(better["error"], 1e-6))
    return float(np.exp((1 - share) * np.log(worse["seconds"]) + share * np.log(better["seconds"]))), "interpolated"


def compare(name: str, probes: int, options, say) -> dict:
    """Both curves for one sample and lattice."""
    say(f"{name}, {probes} probes: reference")
    known = reference(name, probes, options.reference_seconds, options.threads, not options.quick)
    ours, cycles = [], []
    bake_errors, cycles_samples = list(BAKE_ERRORS), list(CYCLES_SAMPLES)
    if options.quick:
        bake_errors, cycles_samples = bake_errors[1:4], cycles_samples[:3]
    while bake_errors or cycles_samples:
        if bake_errors:
            runs = [measure_bake(name, probes, bake_errors[0], known, options.threads) for _ in range(options.repeats)]
            ours.append(sorted(runs, key=lambda run: run["seconds"])[len(runs) // 2])
            bake_errors.pop(0)
            say(f"  bake --error {ours[-1]['setting']:g}: {ours[-1]['seconds']:.2f} s, error {100 * ours[-1]['error']:.2f} %")
        if cycles_samples:
            cycles.append(measure_cycles(name, probes, cycles_samples.pop(0), known, options))
            say(f"  Cycles {TILE}² × {cycles[-1]['setting']}: {cycles[-1]['seconds']:.2f} s"
                f"{' (scaled)' if cycles[-1]['scaled'] else ''}, error {100 * cycles[-1]['error']:.2f} %")
            if cycles[-1]["error"] < options.at / 2:
                cycles_samples.clear()
    (bake_seconds, bake_how), (cycles_seconds, cycles_how) = seconds_at(ours, options.at), seconds_at(cycles, options.at)
    noise = float(np.sqrt(known["variance"].sum() / np.square(known["sh"]).sum()))
    return {"sample": name, "probes": probes, "method": options.method, "at_error": options.at, "bake": ours, "cycles": cycles,
            "bake_seconds": bake_seconds, "bake_how": bake_how, "cycles_seconds": cycles_seconds, "cycles_how": cycles_how,
            "ratio": cycles_seconds / bake_seconds, "reference_standard_error": noise}


def chart(rows: list[dict], path: Path) -> None:
    """Error against seconds, log-log, one panel a row."""
    import matplotlib
    matplotlib.use("Agg")
    import matplotlib.pyplot as plt
    figure, axes = plt.subplots(1, len(rows), figsize=(4.2 * len(rows), 4), squeeze=False)
    for axis, row in zip(axes[0], rows, strict=True):
        for key, label, style in (("cycles", "Cycles panoramas", "s--"), ("bake", "rtgi bake", "o-")):
            points = sorted(row[key], key=lambda point: point["seconds"])
            axis.loglog([point["seconds"] for point in points], [100 * point["error"] for point in points], style, label=label)
        axis.axhline(100 * row["at_error"], color="grey", linewidth=0.8)
        axis.set(title=f"{row['sample']}, {row['probes']:,} probes, {row['method']}: {row['ratio']:.0f}×")
        axis.set(xlabel="seconds", ylabel="relative RMSE [%]")
        axis.grid(True, which="both", alpha=0.25)
    axes[0, 0].legend()
    figure.tight_layout()
    figure.savefig(path, dpi=110)


def table(rows: list[dict]) -> str:
    """The rows as Markdown."""
    lines = ["| sample | probes | Cycles | Cycles [s] | bake [s] | ratio |", "|---|---:|---|---:|---:|---:|"]
    marks = {"interpolated": "", "extrapolated": " (extrapolated)", "at most": " (at most)"}
    lines += [f"| {row['sample']} | {row['probes']:,} | {row['method']} | {row['cycles_seconds']:.2f}{marks[row['cycles_how']]} | "
              f"{row['bake_seconds']:.2f}{marks[row['bake_how']]} | {row['ratio']:.1f}× |" for row in rows]
    return "\n".join(lines)


def main() -> int:
    """Compare what the command line names, print the table, write JSON (rows of other samples stay)."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("samples", nargs="*", metavar="sample", help=f"default: {' '.join(SAMPLES)}")
    parser.add_argument("--probes", type=int, nargs="+", default=[64, 2048], help="lattice sizes")
    parser.add_argument("--method", choices=("tiles", "panorama"), default="tiles", help="how Cycles renders the probes")
    parser.add_argument("--at", type=float, default=0.01, help="error at which seconds are compared")
    parser.add_argument("--threads", type=int, help="threads for both sides (default: every core)")
    parser.add_argument("--repeats", type=int, default=3, help="runs of each bake, of which the median counts")
    parser.add_argument("--reference-seconds", type=float, default=180.0, help="time limit for each reference")
    parser.add_argument("--quick", action="store_true", help="short curves, one run of each, for a look")
    parser.add_argument("--chart", action="store_true", help="also draw benchmarks/results/bake_vs_cycles.png (needs matplotlib)")
    options = parser.parse_args()
    if options.quick:
        options.repeats, options.reference_seconds = 1, min(options.reference_seconds, 40.0)
    import addon_utils
    addon_utils.enable("cycles")
    RESULTS.mkdir(exist_ok=True)
    streams = Streams()
    sys.stderr = streams.err

    def say(text):
        print(text, file=streams.out, flush=True)

    # Libraries and kernels are loaded once in a process; neither side is to pay for the other.
    measure_bake("cornell_box", 8, 0.2, {"index": np.arange(1), "sh": np.ones((1, 9, 3)), "variance": None}, options.threads)
    render_probes([(0.0, 1.0, 1.0)], CyclesSettings(resolution=16, samples=1, threads=options.threads))

    rows = [compare(name, probes, options, say) for name in options.samples or SAMPLES for probes in options.probes]
    path = RESULTS / "bake_vs_cycles.json"
    earlier = json.loads(path.read_text())["rows"] if path.exists() else []
    fresh = {(row["sample"], row["probes"], row["method"]) for row in rows}
    machine = {"cpu": platform.processor() or platform.machine(), "threads": options.threads or os.cpu_count(),
               "blender": bpy.app.version_string, "load_average": os.getloadavg()[0] if hasattr(os, "getloadavg") else None}
    rows = [dict(row, machine=row.get("machine", machine)) for row in
            [row for row in earlier if (row["sample"], row["probes"], row["method"]) not in fresh] + rows]
    path.write_text(json.dumps({"schema": "rtgi-bake-vs-cycles/1", "rows": rows}, indent=1) + "\n")
    say(f"\nSeconds at {100 * options.at:g} % relative RMSE:\n{table(rows)}")
    if options.chart:
        chart(rows, RESULTS / "bake_vs_cycles.png")
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
