"""What a picture's media cost and how far they are off, by slices, columns, samples, lamps and orders of scattering, in numpy.

    python benchmarks/media.py [--sample fog_hall] [--bundle DIR] [--size 96 54]

Error is the relative RMSE of what media add (Volume Direct and Volume Indirect together) against columns of one pixel, 128
slices and 32 samples; of `lamps` alone against all orders, so that it says what further orders are worth. Time is CPU time of
`Effect.apply`, a sample, with what a frame keeps of itself made anew; frames are drawn before the clock starts. Without --bundle
probes are baked first (64 rays each). Lamps are counted by as many suns of as much less strength in the place of each. Prints
Markdown.
"""

import argparse
import sys
import time
from dataclasses import asdict, replace
from pathlib import Path

import bpy
import numpy as np

ROOT = Path(__file__).resolve().parents[1]
sys.path.insert(0, str(ROOT))

from rtgi_addon import techniques  # noqa: E402
from rtgi_addon.blender.extract import extract_scene  # noqa: E402
from rtgi_addon.effects import get  # noqa: E402
from rtgi_addon.effects.lit import draw_frame  # noqa: E402
from rtgi_addon.effects.media.froxels import Shape  # noqa: E402
from rtgi_addon.effects.media.integrate import Slices, gather  # noqa: E402
from rtgi_addon.exchange.bundle import read_bundle  # noqa: E402
from rtgi_addon.progress import Progress  # noqa: E402
from rtgi_addon.transport.context import LightContext  # noqa: E402
from rtgi_addon.transport.views.camera import CameraView  # noqa: E402

MEDIA = get("media")
EXACT, SAMPLES = {"tile": 1, "slices": 128}, 32
# What is measured: the settings that charts hold to Cycles, and finer columns, and how many samples are averaged. The light of the
# bake is what they share: rays find another.
CASES = [*((asdict(settings), 16 if settings.orders == "lamps" else 1) for settings in MEDIA.sweep(0) if not settings.rays),
         ({"tile": 1, "slices": 64}, 1), *(({"tile": 8, "slices": 64}, samples) for samples in (4, 16))]
# What the cost of lamps is measured for: of each that the sample has.
LAMPS, SLICES = (1, 2, 4, 8), (32, 64, 128)


def added(frames, field, samples: int, **settings) -> tuple[np.ndarray, float]:
    """What media add (h, w, 3) over so many ``samples``, and CPU seconds a sample."""
    total, seconds = 0.0, []
    for frame in frames[:samples]:
        fresh = replace(frame, passes={}, kept={})
        started = time.process_time()
        MEDIA.apply(fresh, field, MEDIA.Settings(**{**settings, "steady": False}))
        seconds.append(time.process_time() - started)
        total = total + (fresh.passes["volume_direct"] + fresh.passes["volume_indirect"])[..., :3].astype(np.float64)
    return total / samples, float(np.median(seconds))


def main() -> int:
    """Measure what the command line names."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--sample", default="fog_hall")
    parser.add_argument("--bundle", help="a bake of that sample")
    parser.add_argument("--size", nargs=2, type=int, default=(96, 54))
    options = parser.parse_args()
    bpy.ops.wm.open_mainfile(filepath=str(ROOT / "sample_blends" / f"{options.sample}.blend"))
    scene = extract_scene()
    if options.bundle:
        field = read_bundle(options.bundle).field
    else:
        method = techniques.get("probes")
        field = method.bake(scene, method.Settings(rays=64), np.random.default_rng(0), Progress())
    context, view = LightContext(scene, whole=True), CameraView.of(scene.cameras[0])
    frames = [draw_frame(context, field, view, tuple(options.size), index=index) for index in range(SAMPLES)]
    exact, _ = added(frames, field, SAMPLES, **EXACT)
    print(f"160 × 90 × 64 cells added up: {1000 * min(added_up() for _ in range(5)):.0f} ms (held to 30)\n")
    size = f"{options.size[0]} × {options.size[1]}"
    print(f"`{options.sample}`, {size} pixels:\n\n| tile | slices | samples | orders | error | ms a sample |")
    print("|---:|---:|---:|---|---:|---:|")
    for settings, samples in CASES:
        found, seconds = added(frames, field, samples, **settings)
        error = np.sqrt(np.mean((found - exact) ** 2) / np.mean(exact**2))
        print(f"| {settings['tile']} | {settings['slices']} | {samples} | {settings.get('orders', 'all')} | {100 * error:.2g} % "
              f"| {1000 * seconds:.0f} |", flush=True)
    print("\n| slices | lamps | orders | ms a sample |\n|---:|---:|---|---:|")
    for count in LAMPS:
        lights = tuple(replace(light, name=f"{light.name} {number}", **{light.STRENGTH: light.strength / count})
                       for light in scene.lights for number in range(count))
        lit = LightContext(replace(scene, lights=lights), whole=True)
        frame = draw_frame(lit, field, view, tuple(options.size))
        for slices in SLICES:
            for orders in ("all", "lamps"):
                seconds = min(added([frame], field, 1, tile=8, slices=slices, orders=orders)[1] for _ in range(3))
                print(f"| {slices} | {len(lights)} | {orders} | {1000 * seconds:.0f} |", flush=True)
    return 0


def added_up() -> float:
    """CPU seconds of adding a volume's slices up."""
    shape, rng = Shape((1280, 720), 8, 64, 0.0, 50.0), np.random.default_rng(0)
    depth, direct, indirect = (rng.random((64, 90, 160, 3), np.float32) * np.float32(0.05) for _ in range(3))
    limits = np.broadcast_to(shape.limits[:, None, None], (65, 90, 160))
    slices, started = Slices(depth, direct, indirect, limits[:-1], limits[1:]), time.process_time()
    gather(slices)
    return time.process_time() - started


if __name__ == "__main__":
    raise SystemExit(main())
