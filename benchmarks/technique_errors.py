"""How far each technique is from the path reference: error, bias and leak at points on surfaces.

    python benchmarks/technique_errors.py [--techniques vpl rsm lpv] [--samples cornell_box …] [--set NAME=VALUE …]

Points lie where rays from the usable probes of a sample's volumes meet surfaces, under their own normals. Each technique is held to
two references: to all light, and to the part of it that the technique knows (`Technique.knows`: of a single-bounce technique for
lamps that is the lamps' first bounce). The error is the relative RMSE less the reference's own variance; the bias is the signed
difference of the sums; the leak is the mean at points that get less than a hundredth of the mean light, relative to that at the
others. Prints Markdown. Measured with what `rtgi chart` measures with (rtgi_addon/evaluate/measure.py).
"""

import argparse
import sys
from pathlib import Path

import bpy

ROOT = Path(__file__).resolve().parents[1]
sys.path.insert(0, str(ROOT))

from rtgi_addon import techniques  # noqa: E402
from rtgi_addon.blender.extract import extract_scene  # noqa: E402
from rtgi_addon.evaluate.measure import Errors, Yard  # noqa: E402
from rtgi_addon.jobs.settings import build_settings  # noqa: E402

SAMPLES = ("cornell_box", "two_rooms", "sun_window", "corridor_door_ajar")


def _cells(errors: Errors) -> str:
    leak = "–" if errors.leak is None else f"{errors.leak:.2g} ({errors.true_leak:.1g})"
    return f"{100 * errors.error:.1f} % | {100 * errors.bias:+.1f} % | {leak}"


def main() -> None:
    """Measure what the command line names and print the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--techniques", nargs="+", default=techniques.names(), choices=techniques.names())
    parser.add_argument("--samples", nargs="+", default=SAMPLES)
    parser.add_argument("--set", action="append", default=[], metavar="NAME=VALUE", dest="assignments")
    parser.add_argument("--points", type=int, default=400)
    parser.add_argument("--noise", type=float, default=0.01, help="relative noise of the reference, which is subtracted")
    parser.add_argument("--threads", type=int, help="default: every core")
    options = parser.parse_args()
    assignments = dict(text.split("=", 1) for text in options.assignments)
    table = ["| sample | technique | bake | error, all light | bias | leak (true) | error, what it knows | bias | leak (true) |",
             "|---|---|---|---|---|---|---|---|---|"]
    for sample in options.samples:
        bpy.ops.wm.open_mainfile(filepath=str(ROOT / "sample_blends" / f"{sample}.blend"))
        yard = Yard(extract_scene(), points=options.points, normals_per_point=1, noise=options.noise, threads=options.threads)
        for name in options.techniques:
            technique = techniques.get(name)
            run = yard.measure(technique, build_settings(technique, assignments), seed=0)
            whole = run.errors["surface"]
            known = run.errors.get("known", whole)
            table.append(f"| {sample} | {name} | {run.costs.seconds:.2f} s | {_cells(whole)} | {_cells(known)} |")
    # Blender writes to the same stream while it opens files.
    print("\n".join(["", *table]))


if __name__ == "__main__":
    main()
