"""How many probes do finer volumes within coarser ones save? Plans with and without, held to other points at equal error.

    python benchmarks/nested_plans.py [SAMPLE[:ERROR] ...] [--points N] [--factors F ...] [--threads N]

For each sample: a plan that looks for nested volumes for the target error; what light on surfaces is off by with its volumes at
N other surface points, two normals each; and the same of single lattices, FACTORS times as fine as the file's. The number of probes
of a single lattice with the error of the planned volumes is interpolated between those (logarithms of both), and no more than that
of the finest. All are measured by the pilot of another sample: the light of 128 rays from each probe that is read, noise taken out.
Prints a table.
"""

import argparse
import sys
from dataclasses import replace
from pathlib import Path
from time import process_time

import numpy as np

ROOT = Path(__file__).resolve().parents[1]
sys.path[:0] = [str(ROOT), str(ROOT / "benchmarks")]

from plan import read  # noqa: E402

from rtgi_addon.evaluate.measure import scaled_resolution  # noqa: E402
from rtgi_addon.evaluate.plan import Target, make_plan  # noqa: E402
from rtgi_addon.evaluate.plan.nesting import probes_in  # noqa: E402
from rtgi_addon.evaluate.plan.pilot import Pilot  # noqa: E402
from rtgi_addon.evaluate.plan.sample import draw_sample  # noqa: E402
from rtgi_addon.jobs.plan import HELD_BACK  # noqa: E402
from rtgi_addon.progress import Progress  # noqa: E402
from rtgi_addon.techniques.lattice.unseen import worth_rays  # noqa: E402
from rtgi_addon.transport.context import LightContext  # noqa: E402

SAMPLES = ("atrium:0.15", "corridor_door_ajar:0.04", "sun_window:0.05")
FACTORS = (0.75, 1.0, 1.5, 2.0, 2.5)


def measure(scene, target: float, options: argparse.Namespace) -> str:
    """A row of the table."""
    started = process_time()
    plan = make_plan(scene, Target(target, nested=True), others=False, threads=options.threads)
    spent = process_time() - started
    context = LightContext(scene, options.threads)
    bare = tuple(replace(volume, settings={}, wanted=None) for volume in scene.volumes)
    sample = draw_sample(context, bare, options.points, HELD_BACK)
    order = plan.settings["order"]
    pilot = Pilot(context, bare, sample, (order,), target, HELD_BACK, Progress())
    singles = []
    for factor in options.factors:
        volumes = tuple(replace(volume, resolution=scaled_resolution(volume.resolution, factor)) for volume in bare)
        singles.append((probes_in(volumes), pilot.measure_volumes(volumes, Progress()).error(order).value))
    error = pilot.measure_volumes(plan.volumes, Progress()).error(order)
    probes, errors = np.log(np.array(singles)).T
    falling = np.minimum.accumulate(errors)
    alike = float(np.exp(np.interp(-np.log(error.value), -falling, probes)))
    kept = sum(int(np.prod(volume.resolution)) if mask is None else int(mask.sum())
               for volume, mask in zip(plan.volumes, worth_rays(context.geometry, plan.volumes), strict=True))
    lattices = ", ".join(" x ".join(map(str, volume.resolution)) for volume in plan.volumes)
    known = "; ".join(f"{100 * off:.1f} % with {count:,}" for count, off in singles)
    found = f"{100 * error.value:.1f} ± {100 * error.standard_error:.1f} %"
    return (f"| {scene.name} | {lattices} | {plan.probes:,} ({kept:,}) | {found} "
            f"| {alike:,.0f} | {plan.probes / alike:.2f} | {spent:.1f} | {known} |")


def main() -> None:
    """Measure what the command line names."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("samples", nargs="*", metavar="SAMPLE[:ERROR]", default=SAMPLES, help=f"default: {', '.join(SAMPLES)}")
    parser.add_argument("--points", type=int, default=4096, help="surface points that lattices are held to (default 4096)")
    parser.add_argument("--factors", type=float, nargs="+", default=FACTORS, help="single lattices, of the file's resolution")
    parser.add_argument("--threads", type=int, help="default: every core")
    options = parser.parse_args()
    print("| sample | planned | probes (with rays) | error at other points | single lattice of that error | share "
          "| plan, CPU [s] | single lattices |\n|---|---|---:|---:|---:|---:|---:|---|", flush=True)
    for word in options.samples:
        name, _, error = word.partition(":")
        scene = read(name)
        print(measure(replace(scene, name=name), float(error or Target.error), options), flush=True)


if __name__ == "__main__":
    main()
