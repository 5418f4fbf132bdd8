"""How far bakes at default settings are off Cycles, and how far they think they are: every sample against its stored reference.

    python benchmarks/accuracy.py [samples…] [--seeds 4]

Twenty-four probes of each sample's own lattice (tests/references), the reference's variance subtracted. *Estimated* is the noise
that the bake reports of all usable probes, of their rays and those of the surface cache; *within* the share of all bakes that
are within their target.
"""

import argparse
import sys
import time
from pathlib import Path

import bpy
import numpy as np

ROOT = Path(__file__).resolve().parents[1]
sys.path.insert(0, str(ROOT))

from rtgi_addon import techniques  # noqa: E402
from rtgi_addon.blender.extract import extract_scene  # noqa: E402
from rtgi_addon.evaluate.metrics import relative_rmse, signed_bias  # noqa: E402
from rtgi_addon.jobs.report import estimated_error  # noqa: E402
from rtgi_addon.progress import Progress  # noqa: E402

REFERENCES = {path.stem: path for path in sorted((ROOT / "tests/references").glob("*.npz"))}


def measure(name: str, seeds: int) -> tuple[list[float], str]:
    """The errors of one sample's bakes, as shares of the target, and its row."""
    bpy.ops.wm.open_mainfile(filepath=str(ROOT / "sample_blends" / f"{name}.blend"))
    scene, method = extract_scene(), techniques.get("probes")
    with np.load(REFERENCES[name]) as data:
        known = {key: data[key] for key in ("sh", "variance", "lattice_index")}
    x, y, z = known["lattice_index"].T
    errors, biases, estimates, seconds, rays = [], [], [], [], []
    for seed in range(seeds):
        started = time.process_time()
        field = method.bake(scene, method.Settings(), np.random.default_rng(seed), Progress())
        (grid,) = field.grids()
        seconds.append(time.process_time() - started)
        usable = grid.usable[z, y, x]
        baked = grid.sh[z, y, x][usable]
        errors.append(relative_rmse(baked, known["sh"][usable], known["variance"][usable]))
        biases.append(signed_bias(baked, known["sh"][usable]).value)
        estimates.append(estimated_error(grid))
        rays.append(field.stats["probe_rays"] / np.count_nonzero(np.isfinite(grid.standard_error)))
    lows, highs = ([100 * end(values) for values in (errors, biases, estimates)] for end in (min, max))
    row = (f"| {name} | {lows[0]:.2f}–{highs[0]:.2f} % | {lows[1]:+.2f} to {highs[1]:+.2f} % | {lows[2]:.2f}–{highs[2]:.2f} % | "
           f"{np.mean(rays):,.0f} | {np.median(seconds):.2f} |")
    return [error / method.Settings().error for error in errors], row


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("samples", nargs="*", help=f"default: {' '.join(REFERENCES)}")
    parser.add_argument("--seeds", type=int, default=4)
    arguments = parser.parse_args()
    print("| sample | error | bias | estimated by the bake, noise alone | rays a probe | CPU [s] |\n|---|---:|---:|---:|---:|---:|")
    shares = []
    for name in arguments.samples or REFERENCES:
        found, row = measure(name, arguments.seeds)
        shares += found
        print(row, flush=True)
    within = np.mean(np.array(shares) <= 1.0)
    print(f"\n{within:.0%} of {len(shares)} bakes within their target, in the mean at {np.mean(shares):.2f} of it")


if __name__ == "__main__":
    main()
