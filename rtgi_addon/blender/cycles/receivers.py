"""Cycles as the reference of charts: irradiance at receivers and SH at probes of the open file.

Every receiver is a square tile of one picture: a camera written in OSL starts its rays at the receiver, cosine-distributed about
the normal (Shirley and Chiu's concentric map, lifted to the hemisphere), so irradiance is π times the tile's mean. Everything else
is as in `reference`: lamps hidden from the camera, nothing that trades bias for speed. Renders with different seeds are
added until their spread is small enough.
"""

import tempfile
from pathlib import Path

import bpy
import numpy as np

from ...errors import BakeError
from ...evaluate.receivers import Receivers
from ...evaluate.references import Truth
from ...numerics.sampling import frame
from ...progress import Progress
from ...scene.lights import ALL_LIGHT
from ..ui.role_properties import lamp_role
from ..worker import main_thread
from .reference import (
    CAMERA_BEGINS,
    CAMERA_ENDS,
    CyclesSettings,
    compile_camera,
    listed,
    render_picture,
    render_probes,
    rendering,
    set_camera,
)

_RECEIVER_CAMERA = CAMERA_BEGINS + """
    float r = 0.0, phi = 0.0;
    if (abs(u) > abs(v)) {{
      r = u;
      phi = {quarter_pi} * v / u;
    }}
    else if (v != 0.0) {{
      r = v;
      phi = 2.0 * {quarter_pi} - {quarter_pi} * u / v;
    }}
    float x = r * cos(phi), y = r * sin(phi), z = sqrt(max(1.0 - r * r, 0.0));
    int f = 9 * place;
    /* Cycles' camera space is Blender's with Z reversed. */
    direction = vector(x * frames[f] + y * frames[f + 3] + z * frames[f + 6],
                       x * frames[f + 1] + y * frames[f + 4] + z * frames[f + 7],
                       -(x * frames[f + 2] + y * frames[f + 5] + z * frames[f + 8]));
""" + CAMERA_ENDS
_FRAMES = " float frames[{floats}] = {{ {frames} }},"
# Side of a receiver's tile [pixels], samples a pixel and render, and renders at most.
TILE, SAMPLES, MOST_RENDERS = 8, 32, 64
# Renders before their spread is trusted.
FEWEST_RENDERS = 4
# Side of a probe's tile [pixels] and samples a pixel and render.
PROBE_TILE, PROBE_SAMPLES = 64, 2


class CyclesReference:
    """See evaluate.references.Reference. Renders on Blender's main thread, wherever it is asked from, until the relative noise is
    ``noise``. Needs a Blender whose Cycles has OSL."""

    kind = "Cycles"

    def __init__(self, noise: float = 0.01, threads: int | None = None, scene: bpy.types.Scene | None = None):
        if not bpy.app.build_options.cycles_osl:
            raise BakeError("this Blender's Cycles has no OSL, which the reference needs", "use --reference path")
        held = sorted(obj.name for obj in bpy.data.objects if obj.type == "LIGHT" and lamp_role(obj.data) == ALL_LIGHT)
        if held:
            raise BakeError(f"Cycles' reference is of indirect light, and the direct light of {', '.join(held)} is baked",
                            "use --reference path, or let bakes hold their bounces only")
        self.noise, self.threads, self.scene = noise, threads, scene

    def irradiance(self, receivers: Receivers, progress: Progress) -> Truth:
        """See Reference."""
        return main_thread.call(progress, self._irradiance, receivers, progress)

    def probes(self, points: np.ndarray, order: int, progress: Progress) -> Truth:
        """See Reference."""
        return main_thread.call(progress, self._probes, points, order, progress)

    def _irradiance(self, receivers: Receivers, progress: Progress) -> Truth:
        scene = self.scene or bpy.context.scene
        settings = CyclesSettings(samples=SAMPLES, threads=self.threads)
        with rendering(scene, settings) as camera, tempfile.TemporaryDirectory() as name:
            folder = Path(name)
            columns, rows = aim(camera, scene, _RECEIVER_CAMERA, receivers.points, receivers.normals, TILE, folder,
                                quarter_pi=repr(np.pi / 4))

            def render(seed: int) -> np.ndarray:
                scene.cycles.seed = seed
                picture = render_picture(scene, folder)
                tiles = picture.reshape(rows, TILE, columns, TILE, 3).mean(axis=(1, 3)).reshape(-1, 3)
                return np.pi * tiles[:len(receivers.points)]

            return self._until_quiet(render, progress, "Cycles at surfaces")

    def _probes(self, points: np.ndarray, order: int, progress: Progress) -> Truth:
        def render(seed: int) -> np.ndarray:
            settings = CyclesSettings(order=order, resolution=PROBE_TILE, samples=PROBE_SAMPLES, first_seed=seed,
                                      threads=self.threads)
            return render_probes(points, settings, self.scene)["sh"]

        return self._until_quiet(render, progress, "Cycles at probes")

    def _until_quiet(self, render, progress: Progress, label: str) -> Truth:
        """The mean of renders with different seeds, and its variance."""
        total = squares = 0.0
        for count in range(1, MOST_RENDERS + 1):
            progress.step((count - 1) / MOST_RENDERS, f"{label}, render {count}")
            estimate = render(count)
            total, squares = total + estimate, squares + estimate**2
            mean = total / count
            variance = np.maximum(squares / count - mean**2, 0.0) / max(count - 1, 1)
            truth = Truth(mean, variance)
            if count >= FEWEST_RENDERS and truth.noise <= self.noise:
                break
        return truth


def aim(camera, scene, source: str, points: np.ndarray, normals: np.ndarray, tile: int, folder: Path, **values) -> tuple[int, int]:
    """Give ``camera`` the shader ``source`` for places ``points`` (n, 3), which finds their tangents, bitangents and ``normals``
    (n, 3) in ``frames``, and ``scene`` the size of a picture with a square of ``tile`` pixels for each; returns its columns and
    rows of tiles. ``values`` are put into the source as they are."""
    count = len(points)
    columns = int(np.ceil(np.sqrt(count)))
    rows = -(-count // columns)
    scene.render.resolution_x, scene.render.resolution_y = columns * tile, rows * tile
    frames = np.concatenate([*frame(normals), normals], axis=1)
    source = source.format(floats=3 * count, places=count, columns=columns, rows=rows, origins=listed(points),
                           parameters=_FRAMES.format(floats=9 * count, frames=listed(frames)), **values)
    set_camera(camera, compile_camera(source, folder))
    return columns, rows
