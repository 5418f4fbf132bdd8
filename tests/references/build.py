"""Render the checked-in Cycles references: ``python tests/references/build.py [names…]``.

For each sample a few dozen points of its probe lattice, spread out and in the open, are rendered by Cycles with independent seeds
until the standard error of the relative RMSE is small enough or time is up. An .npz holds the mean, the variance of that mean,
the lattice indices and the settings as JSON; tests subtract the variance (``evaluate.metrics.relative_rmse``).
"""

import argparse
import json
import sys
import time
from pathlib import Path

import bpy
import numpy as np

HERE = Path(__file__).resolve().parent
ROOT = HERE.parents[1]
sys.path.insert(0, str(ROOT))

from rtgi_addon.blender.cycles.reference import CyclesSettings, points_in_the_open, render_probes, volume_points  # noqa: E402

SAMPLES = ("cornell_box", "furnace", "integrating_sphere", "two_rooms", "corridor_door_ajar", "sky_courtyard", "sun_window",
           "atrium", "many_lights", "outdoor_hdri", "adversarial")
PROBES = 24
BOUNCES = 64
# Side of a probe's tile [pixels] and samples per pixel. The sun of outdoor_hdri is seen directly and is a few pixels even of the
# large tile: many pixels of one sample each hit it evenly, few pixels of many samples by luck.
TILES = {"outdoor_hdri": (512, 1)}
TILE = (128, 8)


def relative_error(mean: np.ndarray, variance: np.ndarray) -> float:
    """Standard error of ``mean`` as a share of its norm."""
    return float(np.sqrt(variance.sum() / np.square(mean).sum()))


def build(name: str, target: float, seconds: float, threads: int | None) -> None:
    """Render the reference of one sample and write its file."""
    bpy.ops.wm.open_mainfile(filepath=str(ROOT / "sample_blends" / f"{name}.blend"))
    volume = next(obj for obj in bpy.context.scene.objects if obj.type == "LIGHT_PROBE" and obj.data.type == "VOLUME")
    resolution = np.array((volume.data.resolution_x, volume.data.resolution_y, volume.data.resolution_z))
    lattice = volume_points(bpy.context.scene)
    clearance = 0.2 * float((np.array(volume.scale) * 2 / resolution).min())
    flat = points_in_the_open(bpy.context.scene, lattice, clearance, PROBES)
    tile, samples = TILES.get(name, TILE)
    started = time.perf_counter()
    estimates = []
    while len(estimates) < 4 or time.perf_counter() - started < seconds:
        settings = CyclesSettings(resolution=tile, samples=samples, bounces=BOUNCES, first_seed=len(estimates), threads=threads)
        result = render_probes(lattice[flat], settings)
        estimates.append(result["sh"])
        mean = np.mean(estimates, axis=0)
        variance = np.var(estimates, axis=0, ddof=min(1, len(estimates) - 1)) / len(estimates)
        if len(estimates) >= 4 and relative_error(mean, variance) <= target:
            break
    index = np.stack(np.unravel_index(flat, resolution[::-1]), axis=1)[:, ::-1]
    notes = {
        "sample": name, "blender": bpy.app.version_string, "method": result["method"], "tile": tile, "samples": samples,
        "seeds": len(estimates), "bounces": BOUNCES, "sh_order": 2, "relative_standard_error": relative_error(mean, variance),
        "command": f"python tests/references/build.py {name}",
    }
    np.savez_compressed(HERE / f"{name}.npz", sh=mean.astype(np.float32), variance=variance.astype(np.float32),
                        points_world=lattice[flat], lattice_index=index.astype(np.int32), resolution=resolution.astype(np.int32),
                        notes=json.dumps(notes, sort_keys=True))
    print(f"{name}: {len(flat)} probes, {len(estimates)} seeds, standard error {100 * notes['relative_standard_error']:.3f} %, "
          f"{time.perf_counter() - started:.0f} s", flush=True)


def main() -> int:
    """Build what the command line names (all by default)."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("names", nargs="*", metavar="name", help=f"of {', '.join(SAMPLES)}")
    parser.add_argument("--target", type=float, default=0.0015, help="standard error to reach, as a share of the norm")
    parser.add_argument("--seconds", type=float, default=240.0, help="time limit for each sample")
    parser.add_argument("--threads", type=int, help="threads for Cycles (default: every core)")
    options = parser.parse_args()
    for name in options.names or SAMPLES:
        build(name, options.target, options.seconds, options.threads)
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
