"""Memory and time of large bakes: up to 10,000 probes over 1,000,000 triangles.

    python benchmarks/scale.py [--triangles 1000000] [--probes 1250 2500 5000 10000] [--rays 256]

The scene is a landscape of one mesh with a sky, a sun and some boxes on it, made in a fresh Blender for each number of probes,
in a process of its own, so that each peak of memory is that bake's: Blender, the .blend's data, extraction, BVH, cache and bundle
included. A fixed number of rays keeps the work per probe the same.
"""

import argparse
import json
import subprocess
import sys
import tempfile
import time
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]


def make_scene(triangles: int, probes: int):
    """A rolling landscape with boxes on it, lit by a sun and a sky, under one volume."""
    import bpy
    import numpy as np

    bpy.ops.wm.read_factory_settings(use_empty=True)
    side = int(np.sqrt(triangles / 2)) + 1
    x, y = np.meshgrid(np.linspace(-20, 20, side), np.linspace(-20, 20, side))
    height = 0.6 * np.sin(0.7 * x) * np.cos(0.5 * y) + 0.08 * np.sin(6 * x + y) * np.sin(5 * y)
    index = np.arange(side * side).reshape(side, side)
    quads = np.stack([index[:-1, :-1], index[:-1, 1:], index[1:, 1:], index[1:, :-1]], axis=-1).reshape(-1, 4)
    mesh = bpy.data.meshes.new("Landscape")
    mesh.from_pydata(np.stack([x, y, height], axis=-1).reshape(-1, 3), [], quads)
    bpy.context.collection.objects.link(bpy.data.objects.new("Landscape", mesh))
    for number in range(12):
        bpy.ops.mesh.primitive_cube_add(size=2, location=(4 * (number % 4) - 6, 5 * (number // 4) - 5, 1.2))
    bpy.ops.object.light_add(type="SUN", rotation=(0.7, 0.3, 0))
    bpy.context.object.data.energy = 3
    world = bpy.data.worlds.new("Sky")
    if not world.use_nodes:
        world.use_nodes = True
    world.node_tree.nodes["Background"].inputs["Color"].default_value = (0.5, 0.7, 1.0, 1.0)
    bpy.context.scene.world = world
    bpy.ops.object.lightprobe_add(type="VOLUME", location=(0, 0, 4))
    volume = bpy.context.object
    volume.scale = (10, 10, 2.5)
    columns = round((probes / 4) ** 0.5)
    volume.data.resolution_x, volume.data.resolution_y, volume.data.resolution_z = columns, columns, 4
    bpy.context.view_layer.update()
    return columns * columns * 4


def child(triangles: int, probes: int, rays: int) -> None:
    """Bake once and print one JSON line."""
    sys.path.insert(0, str(ROOT))
    made = make_scene(triangles, probes)
    from rtgi_addon.blender.extract import extract_scene
    from rtgi_addon.jobs.bake import bake_scene

    started = time.perf_counter()
    scene = extract_scene()
    extracted, began = time.perf_counter(), time.process_time()
    with tempfile.TemporaryDirectory() as folder:
        summary = bake_scene(scene, "probes", {"rays": rays}, Path(folder) / "bake")
    finished, processor = time.perf_counter(), time.process_time() - began
    counted = sum(len(scene.meshes[instance.mesh].triangles) for instance in scene.instances)
    print("RESULT " + json.dumps({
        "triangles": counted, "probes": made, "rays": rays, "extract_seconds": extracted - started,
        "bake_seconds": finished - extracted, "bake_processor_seconds": processor, "stages": summary.seconds,
        "peak_memory_bytes": summary.peak_memory_bytes}), flush=True)


def main() -> None:
    """Measure each number of probes in a process of its own and print the table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--triangles", type=int, default=1_000_000)
    parser.add_argument("--probes", type=int, nargs="+", default=[1250, 2500, 5000, 10000])
    parser.add_argument("--rays", type=int, default=256)
    parser.add_argument("--child", action="store_true", help=argparse.SUPPRESS)
    arguments = parser.parse_args()
    if arguments.child:
        child(arguments.triangles, arguments.probes[0], arguments.rays)
        return
    rows = []
    for probes in arguments.probes:
        command = [sys.executable, __file__, "--child", "--triangles", str(arguments.triangles), "--probes", str(probes),
                   "--rays", str(arguments.rays)]
        output = subprocess.run(command, capture_output=True, text=True, check=False)
        lines = [line for line in output.stdout.splitlines() if line.startswith("RESULT ")]
        if not lines:
            sys.exit(f"the bake of {probes:,} probes failed:\n{output.stderr[-2000:]}")
        row = json.loads(lines[0].removeprefix("RESULT "))
        rows.append(row)
        print(f"{row['triangles']:10,d} triangles {row['probes']:7,d} probes  extract {row['extract_seconds']:6.2f} s  bake "
              f"{row['bake_seconds']:6.2f} s ({row['bake_processor_seconds']:.2f} s of CPU time)  "
              f"{1e3 * row['stages'].get('rays', 0.0) / row['probes']:6.3f} ms of rays a probe  "
              f"peak {row['peak_memory_bytes'] / 2**30:5.2f} GiB", flush=True)
    results = ROOT / "benchmarks/results"
    results.mkdir(exist_ok=True)
    (results / "scale.json").write_text(json.dumps({"schema": "rtgi-scale/1", "rows": rows}, indent=1) + "\n")


if __name__ == "__main__":
    main()
