"""Is the plan right? Every sample is planned, baked as planned, and held to an exhaustive search over settings and lattices.

    python benchmarks/plan.py [SAMPLE ...] [--error E] [--points N] [--threads N] [--seeds S ...] [--table]

For each sample: `make_plan`; the planned bake; and probes of every order of ORDERS, ray setting of RAY_ERRORS and multiple of the
file's resolution of FACTORS, from coarse to fine until one meets the error (a finer one with the same order and rays costs more) or
has more than MOST_PROBES. All are held to the path tracer at the same surface points, which the plan did not see, with its noise
taken out. Cost is CPU time of the bake, all threads together, the less of two runs: other work on the machine hardly changes it.
A planned bake passes if its error is within the target, or above it by less than the points can tell (one-sided, 90 %), and if it
costs at most LIMIT times the cheapest of the search that is within the target. *Together*
is what the plan and a bake that goes on with its ray tracer, its surface cache and its probes cost, relative to the planned bake
alone, each the less of two runs. Writes benchmarks/results/plan.json after each sample, beside what is there of others, and prints
the table of all.
"""

import argparse
import json
import sys
from dataclasses import replace
from pathlib import Path
from time import process_time

import numpy as np

ROOT = Path(__file__).resolve().parents[1]
sys.path.insert(0, str(ROOT))

from rtgi_addon import techniques  # noqa: E402
from rtgi_addon.evaluate.costs import metered  # noqa: E402
from rtgi_addon.evaluate.measure import scaled_resolution  # noqa: E402
from rtgi_addon.evaluate.plan import Target, make_plan  # noqa: E402
from rtgi_addon.evaluate.plan.sample import draw_sample  # noqa: E402
from rtgi_addon.evaluate.plan.tries import upper  # noqa: E402
from rtgi_addon.evaluate.references import PathReference  # noqa: E402
from rtgi_addon.jobs.plan import HELD_BACK  # noqa: E402
from rtgi_addon.progress import Progress  # noqa: E402
from rtgi_addon.scene import Scene  # noqa: E402
from rtgi_addon.transport.context import LightContext  # noqa: E402

RESULTS = ROOT / "benchmarks/results/plan.json"
SAMPLES = ("cornell_box", "two_rooms", "sky_courtyard", "corridor_door_ajar", "outdoor_hdri", "furnace", "integrating_sphere",
           "adversarial", "many_lights", "sun_window", "atrium")
ORDERS, RAY_ERRORS, FACTORS = (1, 2), (0.1, 0.03), (0.5, 1.0, 1.5, 2.0, 2.5, 3.0, 3.5, 4.0, 5.0, 6.0)
MOST_PROBES, LIMIT = 20000, 1.5


def read(name: str) -> Scene:
    """The sample called ``name``."""
    import bpy

    from rtgi_addon.blender.extract import extract_scene
    bpy.ops.wm.open_mainfile(filepath=str(ROOT / "sample_blends" / f"{name}.blend"))
    return extract_scene()


class Yard:
    """The surface points that bakes of ``scene`` are held to."""

    def __init__(self, scene: Scene, points: int, noise: float, threads: int | None):
        context = LightContext(scene, threads)
        self.scene, self.threads = scene, threads
        self.sample = draw_sample(context, scene.volumes, points, HELD_BACK)
        self.truth = PathReference(context, noise).irradiance(self.sample.receivers, Progress())

    def bake(self, scene: Scene, settings: dict, repeats: int = 2, begun=None, seed: int = 0) -> tuple:
        """Error, CPU seconds and wall-clock seconds of probes with ``settings`` on the lattices of ``scene``; ``begun`` is what a
        plan has done of it."""
        method = techniques.get("probes")
        costs = []
        for _ in range(repeats):
            with metered() as cost:
                field = method.bake(scene, method.Settings(**settings), np.random.default_rng(seed), Progress(),
                                    threads=self.threads, begun=begun)
            costs.append(cost)
        receivers = self.sample.receivers
        return (self.sample.error(field.irradiance(receivers.points, receivers.normals), self.truth),
                min(cost.cpu_seconds for cost in costs), min(cost.seconds for cost in costs), costs[0].rays)


def search(yard: Yard, target: float) -> list[dict]:
    """Every setting of the grid up to the first that is within ``target``."""
    found = []
    for order in reversed(ORDERS):
        for ray_error in RAY_ERRORS:
            for factor in FACTORS:
                volumes = tuple(replace(volume, resolution=scaled_resolution(volume.resolution, factor), settings={})
                                for volume in yard.scene.volumes)
                probes = sum(int(np.prod(volume.resolution)) for volume in volumes)
                if probes > MOST_PROBES:
                    break
                # What has cost more than the cheapest that is within the target is not waited for.
                cheapest = min((one["cpu"] for one in found if one["error"] <= target), default=np.inf)
                error, cpu, _, _ = yard.bake(replace(yard.scene, volumes=volumes), {"order": order, "error": ray_error}, repeats=1)
                if error.value <= target and cpu < 2.0 * cheapest:
                    again = yard.bake(replace(yard.scene, volumes=volumes), {"order": order, "error": ray_error}, repeats=1)
                    cpu = min(cpu, again[1])
                found.append({"order": order, "ray_error": ray_error, "factor": factor, "probes": probes, "error": error.value,
                              "cpu": cpu})
                if error.value <= target or cpu > 2.0 * cheapest:
                    break
    return found


def measure(name: str, options: argparse.Namespace) -> dict:
    """Everything about one sample."""
    scene = read(name)
    yard = Yard(scene, options.points, options.noise, options.threads)
    grid = [] if options.no_search else search(yard, options.error)
    within = [one for one in grid if one["error"] <= options.error]
    cheapest = min(within, key=lambda one: one["cpu"]) if within else None
    plans = []
    for seed in options.seeds:
        plan_cpu = after = np.inf
        # A bake that goes on changes what it goes on with.
        for _ in range(2):
            started = process_time()
            plan = make_plan(scene, Target(options.error), seed=seed, others=False, threads=options.threads)
            plan_cpu = min(plan_cpu, process_time() - started)
            after = min(after, yard.bake(plan.applied(scene), plan.settings, 1, plan.found.reading.pilot.begun, seed)[1])
        error, cpu, seconds, rays = yard.bake(plan.applied(scene), plan.settings)
        plans.append({
            "seed": seed, "met": plan.met, "settings": plan.settings, "resolutions": [volume.resolution for volume in plan.volumes],
            "probes": plan.probes, "kept": plan.kept, "predicted": plan.chosen.error.value, "bound": upper(plan.chosen.error),
            "error": error.value, "standard_error": error.standard_error, "cpu": cpu, "seconds": seconds, "rays": rays,
            "predicted_rays": plan.chosen.price.rays, "predicted_seconds": plan.chosen.price.seconds, "plan_cpu": plan_cpu,
            "plan_seconds": plan.seconds, "together": (plan_cpu + after) / cpu,
            "ratio": cpu / cheapest["cpu"] if cheapest else None,
            "keeps_error": 2.0 * error.value - upper(error) <= options.error})
    return {"sample": name, "target": options.error, "points": yard.sample.points, "noise": yard.truth.noise, "cheapest": cheapest,
            "best": min((one["error"] for one in grid), default=None), "plans": plans, "grid": grid}


def table(results: list[dict]) -> str:
    """Markdown of what was measured."""
    lines = ["| sample | planned (order, rays to) | predicted | found | bake, CPU [s] | cheapest of the search | its CPU [s] | "
             "ratio | plan, CPU [s] | together |", "|---|---|---:|---:|---:|---|---:|---:|---:|---:|"]
    for result in results:
        for plan in result["plans"]:
            lattice = ", ".join(" x ".join(map(str, resolution)) for resolution in plan["resolutions"])
            best = result["cheapest"]
            other = f"x {best['factor']:g}, order {best['order']}, {100 * best['ray_error']:g} %" if best else \
                "not searched" if result["best"] is None else f"none ({100 * result['best']:.1f} % at best)"
            ratio, spent = (f"{plan['ratio']:.2f}", f"{best['cpu']:.2f}") if best else ("-", "-")
            short = "" if plan["met"] else ", target said to be out of reach"
            settings = f"{plan['settings']['order']}, {100 * plan['settings']['error']:g} %"
            lines.append(
                f"| {result['sample']} | {lattice} ({settings}){short} "
                f"| {100 * plan['predicted']:.1f} % | {100 * plan['error']:.1f} ± {100 * plan['standard_error']:.1f} % "
                f"| {plan['cpu']:.2f} | {other} | {spent} | {ratio} | {plan['plan_cpu']:.2f} "
                f"| {plan['together']:.2f} |")
    together = [plan["together"] for result in results for plan in result["plans"]]
    lines.append(f"| geometric mean |{' |' * 8} {np.exp(np.mean(np.log(together))):.2f} |")
    return "\n".join(lines)


def main() -> int:
    """Measure what the command line names."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("samples", nargs="*", metavar="SAMPLE", default=SAMPLES, help=f"default: {', '.join(SAMPLES)}")
    parser.add_argument("--error", type=float, default=0.05)
    parser.add_argument("--points", type=int, default=768, help="surface points that bakes are held to (default 768)")
    parser.add_argument("--noise", type=float, default=0.06, help="of the reference, which is taken out (default 0.06)")
    parser.add_argument("--threads", type=int, help="default: every core")
    parser.add_argument("--seeds", type=int, nargs="+", default=[0], help="of the plans (default 0)")
    parser.add_argument("--no-search", action="store_true", help="plan and bake alone")
    parser.add_argument("--table", action="store_true", help="measure nothing, print the table of what was measured before")
    options = parser.parse_args()
    RESULTS.parent.mkdir(exist_ok=True)
    stored = json.loads(RESULTS.read_text()) if RESULTS.exists() else {}
    for name in () if options.table else options.samples:
        stored[name] = measure(name, options)
        RESULTS.write_text(json.dumps({key: stored[key] for key in SAMPLES if key in stored}, indent=1) + "\n")
        print("\n" + table([stored[name]]), flush=True)
    results = [stored[name] for name in SAMPLES if name in stored]
    print("\n" + table(results))
    plans = [plan for result in results for plan in result["plans"] if plan["met"]]
    return 0 if all(plan["keeps_error"] and (plan["ratio"] or 0) <= LIMIT for plan in plans) else 1


if __name__ == "__main__":
    raise SystemExit(main())
