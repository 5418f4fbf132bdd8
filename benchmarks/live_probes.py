"""Live probes: processor time a frame by its rays and by the scene, what it is spent on, and frames until light is right.

    python benchmarks/live_probes.py [--rays 8192 32768 131072] [SCENE.blend …]

Times are of the processor, with one thread: what a frame takes by the clock is that over the cores. Frames and errors do not depend
on the machine. Results: benchmarks/measured/techniques.md, "Live probes".
"""

import argparse
import os
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from rtgi_addon.evaluate.stability.parts import ONE, brightness, receivers, room_with_block
from rtgi_addon.progress import Progress
from rtgi_addon.techniques import get
from rtgi_addon.techniques.probes.live import LiveProbes, LiveSettings
from rtgi_addon.techniques.probes.settings import ProbeSettings

SAMPLES = Path(__file__).resolve().parents[1] / "sample_blends"
WARM, MEASURED = 3, 8


def processor_seconds() -> float:
    """Of this process and its threads."""
    times = os.times()
    return times.user + times.system


def frame_times(scene, rays: int) -> dict:
    """Seconds a frame, of following a lamp, and of following an object, with ``rays`` a frame."""
    live = LiveProbes(scene, LiveSettings(rays=rays), threads=1)
    for _ in range(WARM):
        live.frame()
    traced, started = 0, processor_seconds()
    for _ in range(MEASURED):
        traced += live.frame().rays
    frame = (processor_seconds() - started) / MEASURED
    started = processor_seconds()
    for _ in range(MEASURED):
        _ = live.field.lookups
        live._field = None
    shown = (processor_seconds() - started) / MEASURED
    dimmed = [replace(light, **{light.STRENGTH: light.strength * np.float32(0.9)}) for light in scene.lights]
    started = processor_seconds()
    live.follow(replace(scene, lights=tuple(dimmed)))
    lamp = processor_seconds() - started
    moved, moves = scene, []
    for step in range(3):
        shift = np.eye(4)
        shift[0, 3] = 0.01 * (step + 1)
        smallest = min(range(len(scene.instances)), key=lambda i: len(scene.meshes[scene.instances[i].mesh].triangles))
        instances = list(scene.instances)
        instances[smallest] = replace(instances[smallest], world_from_local=shift @ instances[smallest].world_from_local)
        moved = replace(scene, instances=tuple(instances), lights=tuple(dimmed))
        live._owed = 0
        started = processor_seconds()
        live.follow(moved)
        moves.append(processor_seconds() - started)
    probes = sum(int(np.prod(volume.resolution)) for volume in scene.volumes)
    return {"probes": probes, "rays": traced / MEASURED, "frame": frame, "shown": shown, "lamp": lamp, "object": moves[-1]}


def frames_to_right() -> list[tuple[float, int, float, float]]:
    """(hysteresis, frames, frames to rest, then off from a bake) in a room with a block: frames until light at its walls is within
    5 % of where it ends."""
    scene = room_with_block(4)
    points, normals = receivers(-ONE, ONE, 4)
    bake = get("probes").bake(scene, ProbeSettings(error=0.01), np.random.default_rng(0), Progress())
    truth = brightness(bake, points, normals)
    rows = []
    for hysteresis in (0.8, 0.9, 0.97):
        live, seen = LiveProbes(scene, LiveSettings(rays=1 << 22, hysteresis=hysteresis, noise=0.02)), []
        while not live.settled and len(seen) < 1200:
            live.frame()
            seen.append(brightness(live.field, points, normals))
        off = [float(np.sqrt(np.mean((light - seen[-1]) ** 2)) / seen[-1].mean()) for light in seen]
        rows.append((hysteresis, next(i for i, error in enumerate(off) if error < 0.05) + 1, len(seen),
                     float(np.sqrt(np.mean((seen[-1] - truth) ** 2)) / truth.mean())))
    return rows


def scenes(paths):
    """(name, scene) of the files, and of a room with a block."""
    yield "room with a block, 8³ probes", room_with_block(8)
    if not paths:
        return
    from rtgi_addon.blender.cli.open_file import known_properties, open_file
    from rtgi_addon.blender.extract import extract_scene
    with known_properties():
        for path in paths:
            open_file(str(path))
            yield Path(path).stem, extract_scene()


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("files", nargs="*", metavar="SCENE.blend")
    parser.add_argument("--rays", type=int, nargs="*", default=[8192, 32768, 131072])
    arguments = parser.parse_args()
    print("| scene | probes | rays a frame | ms a frame | ms to show it | ms to follow a lamp | an object |")
    print("|---|---:|---:|---:|---:|---:|---:|")
    for name, scene in scenes(arguments.files):
        for rays in arguments.rays:
            found = frame_times(scene, rays)
            cells = " | ".join(f"{1e3 * found[key]:.0f}" for key in ("frame", "shown", "lamp", "object"))
            print(f"| {name} | {found['probes']:,} | {found['rays']:,.0f} | {cells} |", flush=True)
    print("\n| hysteresis | frames to 5 % | frames to rest | then off from a bake |")
    print("|---:|---:|---:|---:|")
    for hysteresis, frames, rest, error in frames_to_right():
        print(f"| {hysteresis:g} | {frames} | {rest} | {100 * error:.1f} % |", flush=True)


if __name__ == "__main__":
    main()
