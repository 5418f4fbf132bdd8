"""What a bake costs without Embree, where rays go through Blender's own BVH: whole bakes, one after the other, same rays.

    python benchmarks/without_embree.py [samples…] [--rays 64] [--runs 3] [--threads N]

Platforms without a wheel of embreex (Windows and Linux on Arm) bake this way.
"""

import argparse
import statistics
import sys
import time
from pathlib import Path
from unittest import mock

import bpy
import numpy as np

ROOT = Path(__file__).resolve().parents[1]
sys.path.insert(0, str(ROOT))

from rtgi_addon import techniques  # noqa: E402
from rtgi_addon.blender.extract import extract_scene  # noqa: E402
from rtgi_addon.jobs.settings import build_settings  # noqa: E402
from rtgi_addon.progress import Progress  # noqa: E402
from rtgi_addon.transport.parallel import thread_count  # noqa: E402
from rtgi_addon.transport.rays import embree as rays  # noqa: E402


def seconds(scene, count: int, threads: int) -> float:
    """One bake of ``count`` rays a probe, without reading the .blend or writing a bundle."""
    method = techniques.get("probes")
    settings = build_settings(method, {"rays": count})
    started = time.perf_counter()
    method.bake(scene, settings, np.random.default_rng(0), Progress(), threads=threads)
    return time.perf_counter() - started


def main() -> None:
    """Measure in turn and print a table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("samples", nargs="*", default=["cornell_box", "two_rooms", "atrium"])
    parser.add_argument("--rays", type=int, default=64)
    parser.add_argument("--runs", type=int, default=3)
    parser.add_argument("--threads", type=int, default=thread_count())
    arguments = parser.parse_args()
    print("| scene | triangles | with Embree [s] | without [s] | times as long |\n|---|---:|---:|---:|---:|")
    for name in arguments.samples:
        bpy.ops.wm.open_mainfile(filepath=str(ROOT / "sample_blends" / f"{name}.blend"))
        scene = extract_scene()
        pairs = []
        for _ in range(arguments.runs):
            with_embree = seconds(scene, arguments.rays, arguments.threads)
            with mock.patch.object(rays, "rtcore_scene", None):
                pairs.append((with_embree, seconds(scene, arguments.rays, arguments.threads)))
        fast, slow = (statistics.median(column) for column in zip(*pairs, strict=True))
        ratio = statistics.median(without / with_embree for with_embree, without in pairs)
        triangles = sum(len(scene.meshes[instance.mesh].triangles) for instance in scene.instances)
        print(f"| {name} | {triangles:,} | {fast:.2f} | {slow:.2f} | {ratio:.1f} |", flush=True)


if __name__ == "__main__":
    main()
