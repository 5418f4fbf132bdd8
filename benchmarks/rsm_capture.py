"""Seconds to capture a reflective shadow map by rays, and by rasterization where there is a GPU.

    python benchmarks/rsm_capture.py [--samples cornell_box sun_window atrium …] [--resolution 512] [--repeats 7] [--threads N]
    blender -b --python benchmarks/rsm_capture.py -- [the same]

Every sample's first lamp, its first view. By rays: `transport.views.reflective_shadow_map.capture`, with the rate of its rays. By
rasterization: the kernel of `--device gpu`, from arrays to arrays, so that what is sent to and fetched from the GPU counts; the
scene's triangles are sent before the clock starts. The last column is the share of texels on which both meet the same triangle.
Without a GPU context the table ends with the reason. Prints Markdown; medians over repeats.
"""

import argparse
import sys
import time
from pathlib import Path
from statistics import median

import bpy
import numpy as np

ROOT = Path(__file__).resolve().parents[1]
sys.path.insert(0, str(ROOT))

from rtgi_addon.blender.extract import extract_scene  # noqa: E402
from rtgi_addon.blender.gpu_context import open_context  # noqa: E402
from rtgi_addon.errors import BakeError  # noqa: E402
from rtgi_addon.preview import context as gpu_state  # noqa: E402
from rtgi_addon.preview.kernels import GpuKernels  # noqa: E402
from rtgi_addon.techniques.kernels import NUMPY  # noqa: E402
from rtgi_addon.transport.context import LightContext  # noqa: E402
from rtgi_addon.transport.views.shadow_views import views_of  # noqa: E402

SAMPLES = ("cornell_box", "two_rooms", "sun_window", "corridor_door_ajar", "many_lights", "atrium")


def open_gpu() -> tuple[GpuKernels | None, str]:
    """The GPU's kernels and what they run on, or None and the reason why there are none."""
    try:
        open_context()
        return GpuKernels(), gpu_state.description()
    except BakeError as error:
        return None, str(error)


def timed(kernels, context, view, repeats: int):
    """The map, and the median of its seconds after one run that is not counted."""
    result, seconds = kernels.capture(context, view), []
    for _ in range(repeats):
        started = time.perf_counter()
        result = kernels.capture(context, view)
        seconds.append(time.perf_counter() - started)
    return result, median(seconds)


def measure(sample: str, kernels: GpuKernels | None, resolution: int, repeats: int, threads: int | None) -> str:
    """One row of the table."""
    bpy.ops.wm.open_mainfile(filepath=str(ROOT / "sample_blends" / f"{sample}.blend"))
    context = LightContext(extract_scene(), threads)
    view = views_of(context, 0, resolution)[0]
    traced, by_rays = timed(NUMPY, context, view, repeats)
    raster, agreement = "–", "–"
    if kernels is not None:
        drawn, seconds = timed(kernels, context, view, repeats)
        raster, agreement = f"{1000 * seconds:.1f} ms", f"{100 * np.mean(drawn.primitive == traced.primitive):.2f} %"
    lamp = type(context.scene.lights[0]).__name__.removesuffix("Light").lower()
    rate = resolution**2 / by_rays / 1e6
    return (f"| {sample} | {lamp} | {context.geometry.count:,} | {1000 * by_rays:.1f} ms | {rate:.1f} M/s | {raster} | "
            f"{agreement} |")


def main() -> None:
    """Measure what the command line names and print the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--samples", nargs="+", default=SAMPLES)
    parser.add_argument("--resolution", type=int, default=512)
    parser.add_argument("--repeats", type=int, default=7)
    parser.add_argument("--threads", type=int, help="default: every core")
    options = parser.parse_args(sys.argv[sys.argv.index("--") + 1:] if "--" in sys.argv else None)
    kernels, reason = open_gpu()
    rows = [measure(sample, kernels, options.resolution, options.repeats, options.threads) for sample in options.samples]
    # Blender writes to the same stream while it opens files.
    print(f"\n| sample | lamp | triangles | {options.resolution}² by rays | texels | by rasterization | same triangle |")
    print("|---|---|---|---|---|---|---|")
    print("\n".join(rows))
    print(f"\nRasterization: {'on ' if kernels else 'not measured, '}{reason}")


if __name__ == "__main__":
    main()
