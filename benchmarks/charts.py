"""Charts of speed against accuracy of techniques and of effects' pictures, tables and error maps of the samples, into
benchmarks/results/charts/SAMPLE.

    python benchmarks/charts.py [SAMPLE …] [--seeds N] [--noise E] [--threads N]

Each sample is charted by `rtgi chart` in a process of its own, so that memory is that of this sample alone. What was drawn before
stays until it is drawn anew. Prints how long each took and writes benchmarks/results/charts/README.md, which shows them all.
"""

import argparse
import json
import subprocess
import sys
import time
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
SAMPLES = ROOT / "sample_blends"
RESULTS = ROOT / "benchmarks/results/charts"


def chart(sample: str, options: argparse.Namespace) -> bool:
    """Chart one sample; True if it worked."""
    out = RESULTS / sample
    words = [SAMPLES / f"{sample}.blend", "chart", "--out", out, "--seeds", options.seeds, "--noise", options.noise]
    words += ["--threads", options.threads] if options.threads else []
    started = time.perf_counter()
    done = subprocess.run([sys.executable, "-m", "rtgi_addon", *map(str, words)], cwd=ROOT, stdout=subprocess.DEVNULL)
    seconds = time.perf_counter() - started
    if done.returncode == 0:
        (out / "seconds.json").write_text(json.dumps({"seconds": round(seconds, 1)}) + "\n")
    print(f"{sample}: {seconds:.0f} s" + ("" if done.returncode == 0 else ", FAILED"), flush=True)
    return done.returncode == 0


def defaults() -> list[str]:
    """A table of every sample that was charted: errors with default settings at surfaces, the probes' with a lattice twice as fine
    and at the probes themselves."""
    techniques = ("probes", "vpl", "lpv", "rsm")
    lines = ["Relative RMSE at surfaces, default settings (*×2*: probes on a lattice twice as fine; *at probes*: of the baked "
             "coefficients; – was left out or does not apply):", "",
             "| sample | " + " | ".join(techniques) + " | probes ×2 | at probes |", "|---|" + "---:|" * (len(techniques) + 2)]
    for path in sorted(RESULTS.glob("*/chart.json")):
        points = json.loads(path.read_text())["points"]

        def error(technique, place="surface", lattice=1.0, points=points):
            for point in points:
                plain = point["default"] or lattice != 1.0
                if point["technique"] == technique and plain and point["lattice"] == lattice and point["accuracy"].get(place):
                    percent = 100 * point["accuracy"][place]["spread"]["error"]["mean"]
                    return f"{percent:.0f} %" if percent >= 10 else f"{percent:.2g} %"
            return "–"

        cells = [error(name) for name in techniques] + [error("probes", lattice=2.0), error("probes", "probes")]
        lines.append(f"| {path.parent.name} | {' | '.join(cells)} |")
    return [*lines, ""]


def effects() -> list[str]:
    """A table of the pictures of every sample that was charted: each effect at its defaults, and the picture without it."""
    rows = []
    for path in sorted(RESULTS.glob("*/chart.json")):
        for point in (json.loads(path.read_text()).get("pictures") or {"points": []})["points"]:
            if point["default"] or point["label"] == "without":
                # A named tuple is a list in JSON: samples, seconds, CPU seconds, error, bias.
                _, seconds, cpu, error, bias = point["steps"][-1]
                rows.append(f"| {path.parent.name} | {point['effect']}, {point['label']} | {100 * error:.1f} % | "
                            f"{100 * point['coarse']:.1f} % | {100 * bias:+.1f} % | {seconds:.1f} | {cpu:.1f} |")
    if not rows:
        return []
    return ["Error of the picture against Cycles after 16 samples (*coarse*: of means over 4 × 4 pixels):", "",
            "| sample | effect | error | coarse | bias | time [s] | CPU [s] |", "|---|---|---:|---:|---:|---:|---:|", *rows, ""]


def index() -> str:
    """Markdown of every chart that is there."""
    lines = ["# Speed against accuracy, every sample", "",
             "Made by `make charts`. Towards the lower left is better; on the black line lie the settings that no other beats in "
             "both time and error. Every figure is behind the titles. Below each: pictures with effects, held to Cycles.", "",
             *defaults(), *effects()]
    for path in sorted(RESULTS.glob("*/chart.md")):
        name = path.parent.name
        taken = path.with_name("seconds.json")
        seconds = f" ({json.loads(taken.read_text())['seconds']:.0f} s to measure)" if taken.exists() else ""
        lines += [f"## [{name}]({name}/chart.md){seconds}", "", f"![{name}]({name}/chart.png)", ""]
        if path.with_name("effects.png").exists():
            lines += [f"![effects of {name}]({name}/effects.png)", ""]
    return "\n".join(lines)


def main() -> int:
    """Chart what the command line names."""
    names = sorted(path.stem for path in SAMPLES.glob("*.blend"))
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("samples", nargs="*", metavar="SAMPLE", help=f"default: all of {', '.join(names)}")
    parser.add_argument("--seeds", type=int, default=4, help="bakes of each setting (default 4)")
    parser.add_argument("--noise", type=float, default=0.01, help="of the reference (default 0.01)")
    parser.add_argument("--threads", type=int, help="default: every core")
    options = parser.parse_args()
    unknown = set(options.samples) - set(names)
    if unknown:
        parser.error(f"no sample {', '.join(sorted(unknown))}; there are {', '.join(names)}")
    RESULTS.mkdir(parents=True, exist_ok=True)
    worked = [chart(name, options) for name in options.samples or names]
    (RESULTS / "README.md").write_text(index())
    return 0 if all(worked) else 1


if __name__ == "__main__":
    raise SystemExit(main())
