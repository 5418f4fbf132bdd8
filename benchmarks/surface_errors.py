"""What lookup.py and fit.py share: samples and options of their command lines, errors at receivers, rows of their tables."""

import argparse
import sys
from pathlib import Path

import bpy
import numpy as np

ROOT = Path(__file__).resolve().parents[1]
sys.path.insert(0, str(ROOT))

from rtgi_addon.blender.extract import extract_scene  # noqa: E402
from rtgi_addon.evaluate.measure import Yard  # noqa: E402
from rtgi_addon.evaluate.metrics import leak_ratio, relative_rmse  # noqa: E402

SAMPLES = sorted(path.stem for path in (ROOT / "sample_blends").glob("*.blend"))
# Columns that every row begins with.
COLUMNS = ("surfaces", "off them", "both", "leak")


def options_of(description: str) -> argparse.Namespace:
    """The command line: samples (names, or paths of other .blend files), seeds, points, and the reference's noise."""
    parser = argparse.ArgumentParser(description=description, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("samples", nargs="*", default=SAMPLES, metavar="SAMPLE", help="a sample, or any FILE.blend")
    parser.add_argument("--seeds", type=int, default=3)
    parser.add_argument("--points", type=int, default=512)
    parser.add_argument("--noise", type=float, default=0.03, help="relative noise of the reference, which is subtracted")
    return parser.parse_args()


def yards(sample: str, options: argparse.Namespace):
    """Yields a Yard of ``sample`` and its seed, for each seed."""
    path = Path(sample) if sample.endswith(".blend") else ROOT / "sample_blends" / f"{sample}.blend"
    bpy.ops.wm.open_mainfile(filepath=str(path.resolve()))
    scene = extract_scene()
    for seed in range(options.seeds):
        yield Yard(scene, points=options.points, noise=options.noise, seed=seed), seed


def figures(yard: Yard, found: np.ndarray) -> list[float]:
    """COLUMNS of the irradiance that was ``found`` (n, 3) at the receivers of ``yard``: errors on surfaces under their own normals,
    off them, and of both; and the leak, NaN where nothing is dark."""
    truth, own, dark = yard.truth, yard.receivers.own, yard.dark
    errors = [relative_rmse(found[rows], truth.mean[rows], truth.variance[rows]) for rows in (own, ~own, own | ~own)]
    return [*errors, leak_ratio(found, dark, ~dark) if dark.any() else np.nan]


def percent(value: float, digits: int = 1) -> str:
    """A share as a table has it; – where there is none."""
    return "–" if np.isnan(value) else f"{100.0 * value:.{digits}f} %"


def row(*cells: str) -> str:
    """A line of a Markdown table."""
    return f"| {' | '.join(cells)} |"


def table(*columns: str) -> list[str]:
    """The first lines of a table whose first column are names."""
    return [row(*columns), "|---|" + "---:|" * (len(columns) - 1)]


def show(lines: list[str]) -> None:
    """Print a table; Blender writes to the same stream while it opens files."""
    print("\n".join(["", *lines]))
