"""Pictures that engines draw, beside ours."""

import os
from pathlib import Path

import numpy as np

from rtgi_addon.numerics.colour import srgb_from_linear
from rtgi_addon.storage.png import write_png
from rtgi_addon.transport.views.pixel_filter import WIDTH, filter_offset


def through_our_filter(drawn, finer):
    """``drawn`` (n·size, n·size, 3), ``finer`` times as fine as a picture, as our film would have it (size, size, 3)."""
    reach = round(0.5 * (WIDTH - 1) * finer)
    edges = (np.arange(finer + 2 * reach + 1) - reach) / finer - 0.5
    weights = np.histogram(filter_offset((np.arange(1 << 14) + 0.5) / (1 << 14)), edges)[0] / (1 << 14)
    for axis in (0, 1):
        padded = np.pad(drawn, [(reach, reach) if axis == other else (0, 0) for other in range(3)], mode="edge")
        places = np.arange(drawn.shape[axis] // finer) * finer
        drawn = sum(weight * np.take(padded, places + number, axis=axis) for number, weight in enumerate(weights))
    return drawn


def keep(name, linear):
    """Scene-linear ``linear`` (h, w, 3) as a PNG where RTGI_SCREENSHOTS says."""
    folder = os.environ.get("RTGI_SCREENSHOTS")
    if folder:
        write_png(Path(folder) / f"{name}.png", np.rint(255 * srgb_from_linear(np.clip(linear, 0, 1))).astype(np.uint8))


def atrium(folder, size) -> Path:
    """The sample as a file in ``folder`` that renders ``size`` pixels a side."""
    import bpy
    path = Path(folder) / "atrium.blend"
    bpy.ops.wm.open_mainfile(filepath=str(Path(__file__).resolve().parents[2] / "sample_blends/atrium.blend"), load_ui=False)
    render = bpy.context.scene.render
    render.resolution_x = render.resolution_y = size
    render.resolution_percentage = 100
    bpy.ops.wm.save_as_mainfile(filepath=str(path), copy=True, relative_remap=True)
    return path
