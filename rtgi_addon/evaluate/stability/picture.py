"""A picture of a case: the bounced light that a technique gives surfaces where it fails most, beside where it fails least.

Both halves share one exposure and show irradiance as a white surface would reflect it, so leaks, bright spots and dark corners are
not hidden by paint or by the lamps' own light.
"""

from pathlib import Path

import numpy as np

from ...storage.png import write_png
from ...transport.context import LightContext
from ...transport.vectors import dot, luminance
from ..view import choose_view
from .case import Result, Sample

# Each half's size [px]; one sample a pixel, for virtual lights cast a shadow ray each.
HALF = (240, 180)
GAP = 6
BACKDROP = 0.02
# Exposure puts this quantile of the light of what fails least at this brightness.
EXPOSED, BRIGHTNESS = 0.9, 0.6


def draw_result(result: Result, path) -> Path | None:
    """Write the PNG ``path``; None where the case's samples keep nothing to be drawn. Raises BakeError if it cannot be written."""
    drawn = [sample for sample in result.samples if sample.field is not None]
    if not drawn:
        return None
    worst = max(drawn, key=lambda sample: sample.value if np.isfinite(sample.value) else np.inf)
    best = min(drawn, key=lambda sample: sample.value if np.isfinite(sample.value) else np.inf)
    halves = [_light(sample) for sample in ((worst, best) if worst.field is not best.field else (worst,))]
    lit = luminance(halves[-1][np.isfinite(halves[-1][..., 0])])
    exposure = BRIGHTNESS / max(float(np.quantile(lit, EXPOSED)) if lit.size else 0.0, 1e-30)
    shown = [np.where(np.isfinite(half), half * exposure, BACKDROP) for half in halves]
    gap = np.full((HALF[1], GAP, 3), 1.0, np.float32)
    picture = np.concatenate([column for half in shown for column in (gap, half)][1:], axis=1)
    encoded = np.clip(picture, 0.0, 1.0) ** (1.0 / 2.2)
    return write_png(path, np.round(255.0 * encoded).astype(np.uint8))


def _light(sample: Sample) -> np.ndarray:
    """E/π (height, width, 3) of what each pixel shows; NaN where there is nothing."""
    context = LightContext(sample.scene)
    view = choose_view(sample.scene, context, HALF)
    width, height = view.resolution
    column, row = np.meshgrid(np.arange(width), np.arange(height))
    origins, directions = view.rays(column.ravel() + 0.5, row.ravel() + 0.5)
    hits = context.tracer.intersect(origins, directions)
    seen = np.flatnonzero((hits.primitive >= 0) & np.any(directions != 0, axis=1))
    primitive = hits.primitive[seen]
    normals = context.geometry.normals_world[primitive]
    normals = np.where(dot(normals, directions[seen])[:, None] > 0, -normals, normals)
    points = context.geometry.points(primitive, hits.u[seen], hits.v[seen])
    radiance = np.full((width * height, 3), np.nan, np.float32)
    radiance[seen] = np.asarray(sample.field.irradiance(points, normals)) / np.float32(np.pi)
    picture = np.full((HALF[1], HALF[0], 3), np.nan, np.float32)
    picture[:height, :width] = radiance.reshape(height, width, 3)
    return picture
