"""Memory of a bake: what it is thought to take before the first ray, and what it took at its peak.

    python benchmarks/memory.py [SAMPLE ...] [--techniques NAME ...] [--threads N]

Every bake is a process of its own, forked from one that has read the sample; its peak is of resident memory, above what was there
before the bake (evaluate/costs.py). Estimates are what the pre-flight and the technique ask for (scene/memory.py), each part before
it is taken: how many rays probes want is known once they have a few. They should lie 10 % below to 50 % above the peak: below, a
bake may be killed that was let through; above, one is refused that would fit.
"""

import argparse
import json
import os
import sys
import traceback
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
sys.path.insert(0, str(ROOT))


def measure(scene, technique: str, overrides: dict, threads: int | None) -> dict:
    """Estimate and peak [bytes] of one bake, in this process."""
    import numpy as np

    from rtgi_addon import techniques
    from rtgi_addon.evaluate.costs import metered
    from rtgi_addon.jobs.settings import build_settings
    from rtgi_addon.progress import Progress
    from rtgi_addon.scene import memory
    method = techniques.get(technique)
    settings = build_settings(method, overrides)
    asked, shortage = [], memory.shortage

    def listening(needs, free):
        asked.append(needs)
        return shortage(needs, free)

    memory.shortage = listening
    with metered() as costs:
        field = method.bake(scene, settings, np.random.default_rng(0), Progress(), threads=threads)
        field.grids()
    needs = memory.estimate_bytes(scene, getattr(settings, "order", 2))
    for part in asked:
        needs |= {name: max(count, needs.get(name, 0)) for name, count in part.items()}
    # These are asked for as they grow, the cache also for what it may become.
    for name, first in (("the surface cache", 1), ("virtual lights", 0)):
        grown = [part[name] for part in asked if name in part]
        if grown:
            needs[name] = max(grown[0], sum(grown[first:]))
    return {"estimate": sum(needs.values()), "peak": costs.peak_bytes, "needs": needs, "seconds": costs.seconds,
            "stats": {name: value for name, value in field.stats.items() if isinstance(value, (int, float))}}


def apart(function) -> dict:
    """The outcome of ``function()`` in a forked process."""
    reader, writer = os.pipe()
    child = os.fork()
    if child == 0:
        code = 1
        try:
            os.write(writer, json.dumps(function()).encode())
            code = 0
        except BaseException:
            traceback.print_exc()
        os._exit(code)
    os.close(writer)
    with open(reader, "rb") as stream:
        data = stream.read()
    os.waitpid(child, 0)
    return json.loads(data) if data else {}


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("samples", nargs="*", help="default: all")
    parser.add_argument("--techniques", nargs="+", default=["probes", "vpl", "rsm", "lpv"])
    parser.add_argument("--set", dest="overrides", nargs="+", default=[], metavar="NAME=VALUE")
    parser.add_argument("--threads", type=int)
    arguments = parser.parse_args()
    samples = arguments.samples or sorted(path.stem for path in (ROOT / "sample_blends").glob("*.blend"))
    overrides = {name: json.loads(value) for name, _, value in (word.partition("=") for word in arguments.overrides)}
    print("| sample | technique | estimate [MiB] | peak [MiB] | off |\n|---|---|---:|---:|---:|", flush=True)
    for sample in samples:
        def read(sample=sample):
            import bpy

            from rtgi_addon.blender.extract import extract_scene
            bpy.ops.wm.open_mainfile(filepath=str(ROOT / "sample_blends" / f"{sample}.blend"))
            scene = extract_scene()
            for technique in arguments.techniques:
                found = apart(lambda technique=technique: measure(scene, technique, overrides, arguments.threads))
                if not found:
                    continue
                off = found["estimate"] / found["peak"] - 1.0
                print(f"| {sample} | {technique} | {found['estimate'] / 2**20:,.0f} | {found['peak'] / 2**20:,.0f} | {off:+.0%} |",
                      flush=True)
                print(json.dumps(found), file=sys.stderr, flush=True)
            return {"done": True}

        apart(read)


if __name__ == "__main__":
    main()
