"""Memory of a bake: what it is thought to take before the first ray, and what it took at its peak.

    python benchmarks/memory.py [SAMPLE ...] [--techniques NAME ...] [--threads N]

Every bake is a process of its own, forked from one that has read the sample; its peak is of resident memory, above what was there
before the bake (evaluate/costs.py). Estimates are what the pre-flight and the technique ask for (scene/memory.py), each part before
it is taken: how many rays probes want is known once they have a few. What is asked for counts on top of what the process has grown
by until then, or of what the pre-flight asked for if that is more; the most of all such sums is the estimate. It should lie 10 %
below to 50 % above the peak: below, a bake may be killed that was let through; above, one is refused that would fit. "At first" is
what the first of them alone says.
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
    from rtgi_addon.evaluate.costs import metered, resident_bytes
    from rtgi_addon.jobs.settings import build_settings
    from rtgi_addon.progress import Progress
    from rtgi_addon.scene import memory
    method = techniques.get(technique)
    settings = build_settings(method, overrides)
    first, asked, shortage = memory.estimate_bytes(scene, getattr(settings, "order", 2)), [], memory.shortage

    def listening(needs, free):
        asked.append((max(resident_bytes() - before, sum(first.values())), needs))
        return shortage(needs, free)

    memory.shortage = listening
    with metered() as costs:
        before = resident_bytes()
        field = method.bake(scene, settings, np.random.default_rng(0), Progress(), threads=threads)
        field.grids()
    sums = [held + sum(needs.values()) for held, needs in asked] or [sum(first.values())]
    held, needs = asked[int(np.argmax(sums))] if asked else (0, first)
    return {"estimate": max(sums), "at_first": sums[0], "peak": costs.peak_bytes, "held": held, "needs": needs, "preflight": first,
            "seconds": costs.seconds,
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
    print("| sample | technique | at first [MiB] | estimate [MiB] | peak [MiB] | off |\n|---|---|---:|---:|---:|---:|", flush=True)
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
                print(f"| {sample} | {technique} | {found['at_first'] / 2**20:,.0f} | {found['estimate'] / 2**20:,.0f} | "
                      f"{found['peak'] / 2**20:,.0f} | {off:+.0%} |", flush=True)
                print(json.dumps(found), file=sys.stderr, flush=True)
            return {"done": True}

        apart(read)


if __name__ == "__main__":
    main()
