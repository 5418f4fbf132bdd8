"""A bake in parts beside the same bake in one piece: CPU seconds, memory and bytes moved, at a number of probes.

    python benchmarks/farm.py atrium --probes 20000 --parts 16
    python benchmarks/farm.py --merge 1000000

Everything runs on this machine, one command after the other, each in a process of its own, so that memory is a worker's; CPU
seconds are those of all threads. With --workers the parts are made once more by as many local processes of Dask's `distributed`,
and the bundle is compared byte by byte. --merge measures `merge` alone, on parts whose numbers are made up.
"""

import argparse
import json
import os
import resource
import subprocess
import sys
import tempfile
import time
import traceback
from dataclasses import asdict
from pathlib import Path

import numpy as np

ROOT = Path(__file__).resolve().parents[1]
sys.path.insert(0, str(ROOT))


def main() -> None:
    """See the module's docstring."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("sample", nargs="?", default="atrium")
    parser.add_argument("--probes", type=int, default=20000)
    parser.add_argument("--parts", type=int, default=16)
    parser.add_argument("--error", type=float, default=0.05)
    parser.add_argument("--workers", type=int, default=0)
    parser.add_argument("--merge", type=int, default=0, metavar="PROBES", help="measure merge alone, of so many probes")
    arguments = parser.parse_args()
    with tempfile.TemporaryDirectory(prefix="rtgi-farm") as folder:
        if arguments.merge:
            measure_merge(arguments.merge, arguments.parts, Path(folder))
        else:
            measure(arguments, Path(folder))


def measure_merge(probes: int, parts: int, folder: Path) -> None:
    """Print CPU seconds and memory of merging made-up parts of a cube of about ``probes`` probes."""
    from rtgi_addon import techniques
    from rtgi_addon.effects.spheres.settings import SphereSettings
    from rtgi_addon.exchange.array_folder import write_folder
    from rtgi_addon.exchange.prepared import ABOUT, BLOCKS, PART, TRUTH, kernels_here, told, versions
    from rtgi_addon.jobs.prepared_bake import blocks_of
    from rtgi_addon.scene import ProbeVolume, Scene
    from rtgi_addon.storage.workplace import workplace
    from rtgi_addon.techniques.probes.block_field import Bricks
    from rtgi_addon.techniques.probes.surface_error import Truth
    from rtgi_addon.transport.cache.checkpoint import labelled
    side = round(probes ** (1 / 3))
    volume = ProbeVolume("Volume", np.diag([side, side, side, 1.0]), (side, side, side))
    bricks, rng = Bricks((volume,)), np.random.default_rng(0)
    scene, about = told(Scene(name="Scene", volumes=(volume,)))
    said = {"lamps": {}, "objects": {}, "notes": [], "warnings": [], "not_followed": [], "direct_lamps": []}
    spheres = asdict(SphereSettings())
    settings = asdict(techniques.get("probes").Settings())
    truth = Truth(rng.uniform(-side, side, (384, 3)).astype(np.float32), np.tile(np.float32([0, 0, 1]), (384, 1)),
                  np.ones((384, 3), np.float32), np.zeros((384, 3), np.float32))._asdict()
    for number in range(1, parts + 1):
        arrays, made = {}, list(blocks_of(number, parts, len(bricks)))
        for index in made:
            count = len(bricks[index])
            arrays |= labelled(f"{index}", {
                "sh": rng.random((count, 9, 3), np.float32), "visibility": rng.random((count, 64, 2), np.float32),
                "validity": np.where(rng.random(count) < 0.2, np.float32(0), np.float32(1)),
                "standard_error": rng.random(count, np.float32), "offset": np.zeros((count, 3), np.float32),
                "rays": np.array([1]), "found": np.array([0])})
        with workplace(folder / f"parts/{number:04}", "make up a part") as place:
            write_folder(PART, place, {
                **versions(), "technique": "probes", "settings": settings, "seed": 0, "blocks": len(bricks), "said": said,
                "spheres": spheres,
                "scene": scene, "prepared": "0" * 64, "part": number, "parts": parts, "kernels": kernels_here(), "made": made,
                "stats": {}}, {ABOUT: about, BLOCKS: arrays, TRUTH: truth})
    (cpu, memory), _ = command("merge", *sorted((folder / "parts").iterdir()), "--out", folder / "merged")
    print(f"merge of {side**3:,} probes in {parts} parts of {len(bricks)} blocks: {cpu:.1f} s, {memory / 2**20:,.0f} MiB at most; "
          f"{size(folder / 'parts') / 2**20:,.0f} MiB of parts, {size(folder / 'merged') / 2**20:,.0f} MiB merged")


def measure(arguments, folder: Path) -> None:
    """Print the table for one sample."""
    # Here, so that the workers of a cluster, which read this file, do without Blender.
    from ray_rate import load

    from rtgi_addon.jobs.bake import bake_scene
    from rtgi_addon.jobs.prepare import prepare_scene
    scene = load(arguments.sample, arguments.probes)
    probes = int(np.prod(scene.volumes[0].resolution))
    settings = {"error": arguments.error}
    whole, _ = in_a_process(lambda: bake_scene(scene, "probes", settings, folder / "plain"))
    prepared, summary = in_a_process(lambda: prepare_scene(scene, "probes", settings, folder / "prep").to_json())
    started = time.monotonic()
    one, _ = command("bake", folder / "prep", "--out", folder / "whole")
    clock = time.monotonic() - started
    parts = [command("bake", folder / "prep", "--part", f"{number}/{arguments.parts}", "--out", folder / f"parts/{number:03}")[0]
             for number in range(1, arguments.parts + 1)]
    merged, _ = command("merge", *sorted((folder / "parts").iterdir()), "--out", folder / "merged")
    print(f"{arguments.sample}, {probes:,} probes, error {arguments.error}, {summary['blocks']} blocks, {arguments.parts} parts")
    rows = {"bake of the file, its rays alone": whole, "prepare": prepared, "bake PREP": one,
            "parts, together": tuple(map(sum, zip(*((cpu, 0) for cpu, _ in parts), strict=True))), "merge": merged}
    for name, (cpu, memory) in rows.items():
        print(f"  {name:34} {cpu:8.1f} s" + (f"   {memory / 2**20:7,.0f} MiB" if memory else ""))
    print(f"  a part's memory: {max(memory for _, memory in parts) / 2**20:,.0f} MiB at most")
    print(f"  parts and merge against bake PREP: {(sum(cpu for cpu, _ in parts) + merged[0]) / one[0] - 1:+.1%}")
    print(f"  prepare, parts, merge against the bake of the file: "
          f"{(prepared[0] + sum(cpu for cpu, _ in parts) + merged[0]) / whole[0] - 1:+.1%}")
    sizes = {name: size(folder / name) for name in ("prep", "parts", "merged")}
    print("  bytes: " + ", ".join(f"{name} {value / 2**20:,.1f} MiB" for name, value in sizes.items()))
    print(f"  merged is the undivided bake: {same(folder / 'whole', folder / 'merged')}")
    if arguments.workers:
        from distributed import LocalCluster
        before = resource.getrusage(resource.RUSAGE_CHILDREN)
        with LocalCluster(n_workers=arguments.workers, threads_per_worker=1, processes=True, dashboard_address=None) as cluster:
            started = time.monotonic()
            command("farm", folder / "prep", "--scheduler", cluster.scheduler_address, "--parts", str(arguments.parts), "--out",
                    folder / "farmed")
            farmed = time.monotonic() - started
        after = resource.getrusage(resource.RUSAGE_CHILDREN)
        cpu = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
        print(f"  farm on {arguments.workers} workers, all processes: {cpu:.1f} s, against bake PREP {cpu / one[0] - 1:+.1%}")
        print(f"  on the clock: bake PREP {clock:.1f} s, farm {farmed:.1f} s with the workers there, {farmed / clock - 1:+.1%}")
        print(f"  {arguments.workers} workers give the undivided bake: {same(folder / 'whole', folder / 'farmed')}")


def in_a_process(work) -> tuple[tuple[float, int], object]:
    """(CPU seconds, peak bytes) of ``work`` in a forked process, and the JSON-able value that it returns."""
    read, write = os.pipe()
    child = os.fork()
    if not child:
        code = 1
        try:
            started = sum(os.times()[:2])
            value = work()
            used = sum(os.times()[:2]) - started, resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * 1024
            with os.fdopen(write, "w") as file:
                json.dump([used, value if isinstance(value, dict) else None], file)
            code = 0
        except BaseException:
            traceback.print_exc()
        finally:
            # Never back into what the parent does next.
            os._exit(code)
    os.close(write)
    with os.fdopen(read) as file:
        told = file.read()
    if os.waitpid(child, 0)[1]:
        raise SystemExit("the process above has failed")
    used, value = json.loads(told)
    return tuple(used), value


def command(*words) -> tuple[tuple[float, int], str]:
    """(CPU seconds, peak bytes) of `rtgi WORDS`, and what it printed."""
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    done = subprocess.run([sys.executable, "-m", "rtgi_addon", *map(str, words), "--json"], cwd=ROOT, check=True, text=True,
                          stdout=subprocess.PIPE, stderr=subprocess.DEVNULL)
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    cpu = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
    return (cpu, json.loads(done.stdout).get("peak_memory_bytes", 0)), done.stdout


def size(folder: Path) -> int:
    """Bytes of all files below ``folder``."""
    return sum(file.stat().st_size for file in folder.rglob("*") if file.is_file())


def same(first: Path, second: Path) -> bool:
    """Whether all files but bake.json, which holds the times, are the same bytes."""
    def files(folder: Path) -> dict:
        return {file.relative_to(folder): file.read_bytes() for file in folder.rglob("*") if file.is_file()
                and file.name != "bake.json"}
    return files(first) == files(second)


if __name__ == "__main__":
    main()
