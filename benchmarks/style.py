"""Milliseconds of the stylized effect on one sample of a picture, style by style: numpy, and the shaders.

    python benchmarks/style.py [--sample toon_street] [--size 960 540] [--gpu-size 1920 1080] [--repeats 5]

The frame is drawn before the clock starts; the bake plays no part. CPU time of the process, the best of the repeats: what else runs
on the machine does not count. The shaders' time is what a frame of the preview takes longer with the effect than without, wall time
and CPU time, which on a software driver are of the same processor. Prints Markdown.
"""

import argparse
import sys
import time
from dataclasses import replace
from pathlib import Path

import bpy

ROOT = Path(__file__).resolve().parents[1]
sys.path.insert(0, str(ROOT))

from rtgi_addon.blender.extract import extract_scene  # noqa: E402
from rtgi_addon.blender.gpu_context import open_context  # noqa: E402
from rtgi_addon.effects import Chosen, get  # noqa: E402
from rtgi_addon.effects.lit import draw_frame  # noqa: E402
from rtgi_addon.effects.stylized.presets import STYLES  # noqa: E402
from rtgi_addon.errors import BakeError  # noqa: E402
from rtgi_addon.transport.views.camera import CameraView  # noqa: E402

STYLE = get("stylized")


def numpy_milliseconds(frame, settings, repeats: int) -> float:
    """CPU time of ``Effect.apply`` on ``frame``, with what a frame keeps of itself made anew."""
    times = []
    for _ in range(repeats):
        fresh = replace(frame)
        started = time.process_time()
        STYLE.apply(fresh, None, settings)
        times.append(time.process_time() - started)
    return 1000 * min(times)


def gpu_milliseconds(scene, view, size, settings, repeats: int) -> tuple[float, float]:
    """Wall and CPU time that ``settings`` add to a frame of the preview of ``size`` pixels, with its reading back."""
    from rtgi_addon.preview.renderer import PreviewRenderer
    taken = []
    for effects in ((), (Chosen(STYLE, settings),)):
        renderer, wall, cpu = PreviewRenderer(scene, passes=("combined",), effects=effects), [], []
        for repeat in range(repeats + 1):
            started = time.perf_counter(), time.process_time()
            renderer.frame(view, size)
            renderer.image("combined")
            if repeat:
                wall.append(time.perf_counter() - started[0])
                cpu.append(time.process_time() - started[1])
        taken.append((min(wall), min(cpu)))
    return tuple(1000 * (after - before) for before, after in zip(*taken, strict=True))


def main() -> int:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--sample", default="toon_street")
    parser.add_argument("--size", type=int, nargs=2, default=(960, 540))
    parser.add_argument("--gpu-size", type=int, nargs=2, default=(1920, 1080))
    parser.add_argument("--repeats", type=int, default=5)
    options = parser.parse_args(sys.argv[sys.argv.index("--") + 1:] if "--" in sys.argv else None)
    bpy.ops.wm.open_mainfile(filepath=str(ROOT / "sample_blends" / f"{options.sample}.blend"))
    scene = extract_scene()
    view = CameraView.of(scene.cameras[0])
    frame = draw_frame(scene, None, view, tuple(options.size))
    try:
        open_context()
        from rtgi_addon.preview import context
        device = context.description()
    except BakeError as error:
        device = None
        print(f"no GPU: {error}", file=sys.stderr)
    print(f"{options.sample}, numpy at {' x '.join(map(str, options.size))}"
          + (f", shaders at {' x '.join(map(str, options.gpu_size))} on {device}" if device else ""))
    print("\n| style | numpy [ms, CPU] | shaders [ms, wall] | shaders [ms, CPU] |\n|---|---:|---:|---:|")
    for name, values in STYLES.items():
        settings = STYLE.Settings(**values)
        cells = [f"{numpy_milliseconds(frame, settings, options.repeats):.0f}"]
        if device:
            cells += [f"{value:.0f}" for value in gpu_milliseconds(scene, view, tuple(options.gpu_size), settings, options.repeats)]
        print(f"| {name} | " + " | ".join(cells) + " |", flush=True)
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
