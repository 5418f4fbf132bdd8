"""Milliseconds of a frame of the preview, part by part, for every technique.

    python benchmarks/preview.py [--sample cornell_box] [--techniques probes vpl rsm lpv] [--size 1280 720] [--repeats 5]
    blender -b --python benchmarks/preview.py -- [the same]
    python benchmarks/preview.py --bare [the same]

Parts: the G-buffer; direct light (shadow maps and the light through them); the technique's indirect irradiance with as many samples
as a frame takes; the film with the combined pass. Blender's gpu module has no timers, so a part is done several times over, then
the texture that it ends in is read; the time of that reading alone is taken off. The scene, the baked field and the compiled
programs are on the GPU before the clock starts. Medians over repeats. With ``--bare`` only the indirect irradiance, in an OpenGL
context without Blender through moderngl, on a G-buffer made by rays: for machines that have a GPU and no window.

A data-centre GPU is aimed to take at most 2 ms for indirect light at 1920 x 1080. Prints Markdown.
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
from rtgi_addon.jobs.field import bake_field  # noqa: E402
from rtgi_addon.preview.settings import PreviewSettings  # noqa: E402
from rtgi_addon.scene import Camera, Scene  # noqa: E402
from rtgi_addon.techniques import Field  # noqa: E402
from rtgi_addon.transport.context import LightContext  # noqa: E402
from rtgi_addon.transport.vectors import dot  # noqa: E402
from rtgi_addon.transport.views.camera import CameraView  # noqa: E402

TECHNIQUES = ("probes", "vpl", "rsm", "lpv")
PARTS = ("gbuffer", "direct", "indirect", "film")


def open_sample(name: str, size: tuple[int, int]) -> Scene:
    """A sample as the techniques see it, its camera at ``size`` pixels."""
    bpy.ops.wm.open_mainfile(filepath=str(ROOT / "sample_blends" / f"{name}.blend"))
    render = bpy.context.scene.render
    (render.resolution_x, render.resolution_y), render.resolution_percentage = size, 100
    return extract_scene()


class BlenderParts:
    """The parts of ``PreviewRenderer.frame``, one by one, of ``scene`` through its first camera."""

    def __init__(self, scene: Scene, size: tuple[int, int]):
        from rtgi_addon.preview.direct_light import DirectLight
        from rtgi_addon.preview.film import Background, Film
        from rtgi_addon.preview.gbuffer import GBuffer, gbuffer_surfaces
        from rtgi_addon.preview.renderer import scene_bounds
        from rtgi_addon.preview.textures import empty
        self.scene, self.view, self.size = scene, CameraView.of(scene.cameras[0]), size
        self._surfaces, self._bounds = gbuffer_surfaces(scene), scene_bounds(scene)
        self._lamps, self._gbuffer = DirectLight(PreviewSettings()), GBuffer(*size)
        self._film, self._background = Film(size, ("combined",)), Background(scene.world)
        self._direct, self._irradiance = empty(*size), empty(*size)
        self._indirect, self._frame = None, 0

    def use(self, field: Field) -> None:
        """Light the next frames with ``field``."""
        from rtgi_addon.preview.indirect import FRAME_SAMPLES, make_indirect
        self._indirect = make_indirect(field, self.scene, samples=FRAME_SAMPLES)

    def gbuffer(self):
        """Draw the surfaces; returns what they end in."""
        self._frame += 1
        self._gbuffer.draw(self._surfaces, self.view.drawn(self.size, np.zeros(2), self._frame))
        return self._gbuffer.textures["geometry"]

    def direct(self):
        """Shadow maps and the light of lamps."""
        self._lamps.draw(self.scene, self.scene.lights, self._surfaces, self._bounds, self.view, self._frame,
                         self._gbuffer.textures, self._direct)
        return self._direct

    def indirect(self):
        """The technique's irradiance."""
        from rtgi_addon.preview.indirect_pass import draw_indirect
        draw_indirect(self._indirect, self._gbuffer.textures, self._irradiance)
        return self._irradiance

    def film(self):
        """One more sample of the combined picture."""
        inputs = {**self._gbuffer.textures, "direct": self._direct, "irradiance": self._irradiance}
        self._film.add(self.view, np.zeros(2), inputs, self._background, False)
        return self._film.textures["combined"]

    def milliseconds(self, part: str, repeats: int, times: int) -> float:
        """Of one run of ``part``: the median over ``repeats`` of ``times`` runs and a reading, less a reading."""
        work, found = getattr(self, part), []
        work().read()
        for _ in range(repeats):
            started = time.perf_counter()
            for _ in range(times):
                texture = work()
            texture.read()
            done = time.perf_counter()
            texture.read()
            found.append(1e3 * (2.0 * done - started - time.perf_counter()) / times)
        return max(median(found), 0.0)


class BareIndirect:
    """The irradiance functions in a bare OpenGL context, at what the first camera of ``scene`` sees."""

    def __init__(self, scene: Scene, size: tuple[int, int]):
        from benchmarks.bare_gl import BareContext
        self.bare, self.size = BareContext(), size
        self._position, self._normal = (self.bare.upload(texels) for texels in seen_by(scene, scene.cameras[0], size))
        self._target = self.bare.empty(*size)

    def milliseconds(self, field: Field, repeats: int) -> float:
        """Median of one dispatch until the GPU has finished."""
        from rtgi_addon.preview.indirect import FRAME_SAMPLES
        from rtgi_addon.preview.indirect.lpv import lpv_tables
        from rtgi_addon.preview.indirect.probes import probe_tables
        from rtgi_addon.preview.indirect.rsm import rsm_tables
        from rtgi_addon.preview.indirect.vpl import vpl_tables
        make = {"probes": probe_tables, "lpv": lpv_tables, "rsm": lambda field: rsm_tables(field, FRAME_SAMPLES),
                "vpl": lambda field: vpl_tables(field, FRAME_SAMPLES)}[field.technique]
        tables = make(field)
        samplers = {"gbuffer_position": self._position, "gbuffer_normal": self._normal,
                    **{name: self.bare.upload(texels) for name, texels in tables.textures.items()}}
        found = []
        for _ in range(repeats + 1):
            self.bare.gl.finish()
            started = time.perf_counter()
            self.bare.dispatch(tables.program, self.size, uniforms={"frame": {"size": self.size}, "indirect": tables.values},
                               samplers=samplers, images={"irradiance": self._target})
            self.bare.gl.finish()
            found.append(1e3 * (time.perf_counter() - started))
        return median(found[1:])


def seen_by(scene: Scene, camera: Camera, size: tuple[int, int]) -> tuple[np.ndarray, np.ndarray]:
    """World positions and normals (h, w, 4) float32 towards ``camera``, row 0 at the bottom; normals are 0 where nothing is."""
    context, view, (width, height) = LightContext(scene), CameraView.of(camera), size
    x, y = np.meshgrid((np.arange(width) + 0.5) / width, (np.arange(height) + 0.5) / height)
    base, across, up = view.rays(size)
    directions = base + x.reshape(-1, 1) * across + y.reshape(-1, 1) * up
    directions = (directions / np.linalg.norm(directions, axis=1, keepdims=True)).astype(np.float32)
    origins = np.tile(np.asarray(camera.world_from_camera, np.float32)[:3, 3], (len(directions), 1))
    hits = context.tracer.intersect(origins, directions)
    rows = np.flatnonzero(hits.primitive >= 0)
    position, normal = np.zeros((height * width, 4), np.float32), np.zeros((height * width, 4), np.float32)
    normals = context.geometry.normals_world[hits.primitive[rows]]
    position[rows, :3] = context.geometry.points(hits.primitive[rows], hits.u[rows], hits.v[rows])
    normal[rows, :3] = normals * -np.copysign(np.float32(1.0), dot(normals, directions[rows]))[:, None]
    return position.reshape(height, width, 4), normal.reshape(height, width, 4)


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--sample", default="cornell_box")
    parser.add_argument("--techniques", nargs="+", choices=TECHNIQUES, default=TECHNIQUES)
    parser.add_argument("--size", type=int, nargs=2, default=(1280, 720))
    parser.add_argument("--repeats", type=int, default=5)
    parser.add_argument("--times", type=int, default=3, help="runs of a part between two readings")
    parser.add_argument("--bare", action="store_true")
    options = parser.parse_args(sys.argv[sys.argv.index("--") + 1:] if "--" in sys.argv else sys.argv[1:])
    size = tuple(options.size)
    if options.bare:
        scene = open_sample(options.sample, size)
        bare = BareIndirect(scene, size)
        print(f"\n{bare.bare.description}; {options.sample}, {size[0]} x {size[1]}\n\n| technique | indirect [ms] |\n|---|---:|")
        for name in options.techniques:
            print(f"| {name} | {bare.milliseconds(bake_field(scene, name), options.repeats):.2f} |", flush=True)
        return
    from rtgi_addon.blender.gpu_context import open_context
    from rtgi_addon.preview import context
    open_context()
    scene = open_sample(options.sample, size)
    parts = BlenderParts(scene, size)
    print(f"\n{context.description()}; {options.sample}, {size[0]} x {size[1]}\n")
    print(f"| technique | {' | '.join(f'{part} [ms]' for part in PARTS)} | frame [ms] |\n|---" + "|---:" * (len(PARTS) + 1) + "|")
    for name in options.techniques:
        parts.use(bake_field(scene, name))
        found = [parts.milliseconds(part, options.repeats, options.times) for part in PARTS]
        print(f"| {name} | {' | '.join(f'{value:.2f}' for value in found)} | {sum(found):.2f} |", flush=True)


if __name__ == "__main__":
    main()
