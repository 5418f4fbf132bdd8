"""How far each technique is from the path reference: error, bias and leak at points on surfaces.

    python benchmarks/technique_errors.py [--techniques vpl rsm lpv] [--samples cornell_box …] [--set NAME=VALUE …]

Points lie where rays from the usable probes of a sample's volumes meet surfaces. Each technique is held to two references: to all
light, and to the part of it that the technique knows (`Technique.knows`: of a single-bounce technique for lamps that is the lamps'
first bounce). The error is the relative RMSE less the reference's own variance; the bias is the signed difference of the sums; the
leak is the mean at points that get less than a hundredth of the mean light, relative to that at the others. Prints Markdown.
"""

import argparse
import sys
import time
from dataclasses import replace
from pathlib import Path

import bpy
import numpy as np

ROOT = Path(__file__).resolve().parents[1]
sys.path.insert(0, str(ROOT))

from rtgi_addon import techniques  # noqa: E402
from rtgi_addon.blender.extract import extract_scene  # noqa: E402
from rtgi_addon.evaluate.metrics import leak_ratio, relative_rmse, signed_bias  # noqa: E402
from rtgi_addon.jobs.settings import build_settings  # noqa: E402
from rtgi_addon.numerics.grid import lattice_points  # noqa: E402
from rtgi_addon.numerics.sampling import sphere_from_square  # noqa: E402
from rtgi_addon.progress import Progress  # noqa: E402
from rtgi_addon.scene import Channel, Scene, World  # noqa: E402
from rtgi_addon.techniques.base import KNOWN_LIGHT  # noqa: E402
from rtgi_addon.transport.context import LightContext  # noqa: E402
from rtgi_addon.transport.path import Estimate, irradiance_at  # noqa: E402
from rtgi_addon.transport.vectors import dot  # noqa: E402

SAMPLES = ("cornell_box", "two_rooms", "sun_window", "corridor_door_ajar")
DARK = 0.01


def receivers(context: LightContext, probes: np.ndarray, count: int, seed: int = 0) -> tuple[np.ndarray, np.ndarray]:
    """``count`` points (n, 3) on surfaces that rays from ``probes`` (p, 3) meet, with normals towards the probe."""
    rng = np.random.default_rng(seed)
    origins = probes[rng.integers(0, len(probes), 4 * count)].astype(np.float32)
    directions = sphere_from_square(rng.random((len(origins), 2))).astype(np.float32)
    hits = context.tracer.intersect(origins, directions)
    rows = np.flatnonzero(hits.primitive >= 0)[:count]
    normals = context.geometry.normals_world[hits.primitive[rows]]
    side = -np.copysign(np.float32(1.0), dot(normals, directions[rows]))[:, None]
    return context.geometry.points(hits.primitive[rows], hits.u[rows], hits.v[rows]), normals * side


def limited(scene: Scene, knows: frozenset) -> Scene:
    """``scene`` with only the light sources in ``knows``."""
    black = Channel.of(0.0)
    materials = scene.materials if "emissive surfaces" in knows else \
        tuple(replace(material, emission=black) for material in scene.materials)
    return replace(scene, lights=scene.lights if "lamps" in knows else (), materials=materials,
                   world=scene.world if "world" in knows else World.constant(0.0))


def measure(scene: Scene, names: list[str], assignments: dict, points: int, paths: int, threads: int | None):
    """Yield (technique, seconds of the bake, all-light figures, known-light figures) for one scene."""
    context = LightContext(scene, threads)
    lattice = np.concatenate([lattice_points(volume.world_from_local, volume.resolution).reshape(-1, 3)
                              for volume in scene.volumes])
    x = n = None
    references: dict[frozenset, Estimate] = {}
    for name in names:
        method = techniques.get(name)
        settings = build_settings(method, assignments)
        started = time.perf_counter()
        field = method.bake(scene, settings, np.random.default_rng(0), Progress(), threads=threads)
        seconds = time.perf_counter() - started
        if x is None:
            usable = np.concatenate([grid.usable.ravel() for grid in field.grids()])
            x, n = receivers(context, lattice[usable], points)
        for knows in (KNOWN_LIGHT, method.knows):
            if knows not in references:
                lit = context if knows == KNOWN_LIGHT else LightContext(limited(scene, knows), threads)
                references[knows] = irradiance_at(lit, x, n, paths, bounces=None if "bounces" in knows else 1)
        estimate, whole = field.irradiance(x, n), references[KNOWN_LIGHT]
        brightness = whole.mean.sum(axis=1)
        dark = brightness < DARK * brightness.mean()
        yield name, seconds, *(_figures(estimate, references[knows], dark) for knows in (KNOWN_LIGHT, method.knows))


def _figures(estimate: np.ndarray, reference: Estimate, dark: np.ndarray) -> dict:
    variance = reference.standard_error.astype(np.float64) ** 2
    bias = signed_bias(estimate, reference.mean)
    leaks = {} if dark.all() or not dark.any() else {
        "leak": leak_ratio(estimate, dark, ~dark), "true_leak": leak_ratio(reference.mean, dark, ~dark)}
    return {"error": relative_rmse(estimate, reference.mean, variance), "bias": bias.value, "dark": int(dark.sum()), **leaks}


def _cells(figures: dict) -> str:
    leak = f"{figures['leak']:.2g} ({figures['true_leak']:.1g})" if "leak" in figures else "–"
    return f"{100 * figures['error']:.1f} % | {100 * figures['bias']:+.1f} % | {leak}"


def main() -> None:
    """Measure what the command line names and print the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--techniques", nargs="+", default=techniques.names(), choices=techniques.names())
    parser.add_argument("--samples", nargs="+", default=SAMPLES)
    parser.add_argument("--set", action="append", default=[], metavar="NAME=VALUE", dest="assignments")
    parser.add_argument("--points", type=int, default=400)
    parser.add_argument("--paths", type=int, default=4096, help="of the reference, at every point")
    parser.add_argument("--threads", type=int, help="default: every core")
    options = parser.parse_args()
    assignments = dict(text.split("=", 1) for text in options.assignments)
    table = ["| sample | technique | bake | error, all light | bias | leak (true) | error, what it knows | bias | leak (true) |",
             "|---|---|---|---|---|---|---|---|---|"]
    for sample in options.samples:
        bpy.ops.wm.open_mainfile(filepath=str(ROOT / "sample_blends" / f"{sample}.blend"))
        rows = measure(extract_scene(), options.techniques, assignments, options.points, options.paths, options.threads)
        for name, seconds, whole, known in rows:
            table.append(f"| {sample} | {name} | {seconds:.2f} s | {_cells(whole)} | {_cells(known)} |")
    # Blender writes to the same stream while it opens files.
    print("\n".join(["", *table]))


if __name__ == "__main__":
    main()
