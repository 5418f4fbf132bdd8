"""`render`: a picture of the preview without a window."""

import argparse
import time
from dataclasses import asdict, dataclass
from pathlib import Path

import numpy as np

from ... import techniques
from ...errors import BakeError, UsageError
from ...exchange.bundle import read_bundle
from ...exchange.exr import write_exr
from ...exchange.plain import plain
from ...jobs.console import duration
from ...jobs.field import bake_field
from ...preview.settings import PASSES, PreviewSettings
from ...progress import Progress
from ...scene import Camera, Scene
from ...techniques import Field
from .base import EXTRACT_SHARE, Session, Subcommand
from .options import add_technique, at_least, check_technique, overrides

_SUFFIXES = (".exr", ".png")
# The share of the progress that is over when drawing begins.
_DRAW_FROM = 0.8


@dataclass(frozen=True)
class PictureReport:
    """A picture that was written: what it shows, and how long each part took."""

    out: Path
    camera: str
    resolution: tuple[int, int]
    technique: str
    shown: str
    samples: int
    gpu: str
    seconds: dict[str, float]

    def to_json(self) -> dict:
        """The report as JSON-able values."""
        return plain({**asdict(self), "out": str(self.out)})

    def to_text(self) -> str:
        """The report as lines for a person."""
        width, height = self.resolution
        parts = ", ".join(f"{name} {seconds:.2f}" for name, seconds in self.seconds.items())
        return "\n".join([
            f"Rendered {self.out}, {width} × {height}, {self.shown} through camera {self.camera} with {self.technique}",
            f"  samples  {self.samples} on {self.gpu}",
            f"  time     {duration(sum(self.seconds.values()))} (seconds: {parts})",
        ])


def _add_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("--out", required=True, metavar="FILE", help="the picture: .exr (scene-linear) or .png (the scene's view "
                                                                     "transform)")
    parser.add_argument("--camera", metavar="NAME", help="default: the active camera")
    parser.add_argument("--samples", type=at_least(1), default=64, metavar="N", help="frames that are averaged (default 64)")
    parser.add_argument("--scale", type=_scale, default=1.0, metavar="S", help="share of the file's resolution (default 1)")
    parser.add_argument("--pass", dest="shown", choices=PASSES, default="combined", help="what to show (default combined)")
    parser.add_argument("--transparent", action="store_true", help="leave the world out of the picture")
    parser.add_argument("--bundle", metavar="DIR", help="show this bundle instead of baking")
    add_technique(parser)


def _check(arguments: argparse.Namespace) -> None:
    if Path(arguments.out).suffix.lower() not in _SUFFIXES:
        raise UsageError(f"{arguments.out} is neither an .exr nor a .png", "end --out in one of them")
    check_technique(arguments)


def _run(arguments: argparse.Namespace, session: Session) -> PictureReport:
    # Everything that can fail without the file fails before it is read.
    techniques.get(arguments.technique)
    out = Path(arguments.out).expanduser().resolve()
    if not out.parent.is_dir():
        raise BakeError(f"the folder {out.parent} does not exist", "create it first, or choose another --out")
    from ..gpu_context import open_context
    open_context()
    from ...preview import context
    progress, started = session.progress, time.monotonic()
    bundle = None if arguments.bundle is None else read_bundle(arguments.bundle)
    scene = session.read_scene()
    camera = _camera(scene, arguments.camera, arguments.scale)
    read = time.monotonic()
    if bundle is None:
        field = bake_field(scene, arguments.technique, overrides(arguments), seed=arguments.seed, threads=arguments.threads,
                           volume=arguments.volume, progress=progress.span(EXTRACT_SHARE, _DRAW_FROM))
        technique = arguments.technique
    else:
        field, technique = bundle.field, f"{bundle.path.name} ({bundle.manifest['technique']})"
    baked = time.monotonic()
    settings = PreviewSettings(samples=arguments.samples, film_transparent=arguments.transparent)
    pixels = _draw(scene, field, settings, camera, arguments.shown, progress.span(_DRAW_FROM, 0.99))
    drawn = time.monotonic()
    _write(out, pixels, {"camera": camera.name, "pass": arguments.shown, "technique": technique})
    progress.step(1.0, "Done")
    seconds = {"reading": read - started, "baking": baked - read, "drawing": drawn - baked, "writing": time.monotonic() - drawn}
    return PictureReport(out, camera.name, camera.resolution, technique, arguments.shown, arguments.samples, context.description(),
                         seconds)


def _draw(scene: Scene, field: Field, settings: PreviewSettings, camera: Camera, shown: str, progress: Progress) -> np.ndarray:
    """The pass called ``shown`` (h, w, 4) float32, row 0 at the bottom."""
    # Importable once there is a GPU.
    from ...preview.camera_view import CameraView
    from ...preview.renderer import PreviewRenderer
    renderer, view = PreviewRenderer(scene, field, settings, (shown,)), CameraView.of(camera)
    for sample in range(settings.samples):
        progress.step(sample / settings.samples, "Drawing")
        renderer.frame(view, camera.resolution)
    return renderer.image(shown)


def _camera(scene: Scene, name: str | None, scale: float) -> Camera:
    """The camera called ``name`` (None: the active one, which comes first) at ``scale`` times its resolution."""
    if not scene.cameras:
        raise BakeError(f"scene {scene.name!r} has no camera", "add one in Blender")
    known = {camera.name: camera for camera in reversed(scene.cameras)}
    if name is not None and name not in known:
        raise UsageError(f"unknown camera {name!r}", f"choose one of {', '.join(reversed(known))}")
    camera = scene.cameras[0] if name is None else known[name]
    width, height = (max(round(side * scale), 1) for side in camera.resolution)
    return Camera(camera.name, camera.world_from_camera, camera.clip_from_camera, (width, height))


def _write(out: Path, pixels: np.ndarray, about: dict) -> None:
    if out.suffix.lower() == ".exr":
        write_exr(out, {name: np.flipud(pixels[..., index]) for index, name in enumerate("RGBA")}, about)
    else:
        _write_png(out, pixels)


def _write_png(out: Path, pixels: np.ndarray) -> None:
    """Through Blender, which knows the scene's view transform."""
    import bpy
    height, width = pixels.shape[:2]
    image = bpy.data.images.new("rtgi render", width, height, alpha=True, float_buffer=True)
    try:
        image.alpha_mode = "PREMUL"
        image.pixels.foreach_set(np.ascontiguousarray(pixels, np.float32).ravel())
        scene = bpy.context.scene
        settings = scene.render.image_settings
        if hasattr(settings, "media_type"):
            settings.media_type = "IMAGE"
        settings.file_format, settings.color_mode, settings.color_depth = "PNG", "RGBA", "8"
        image.save_render(str(out), scene=scene)
    except RuntimeError as error:
        raise BakeError(f"cannot write the picture {out} ({str(error).strip()})", "choose another place or free space") from error
    finally:
        bpy.data.images.remove(image)


def _scale(text: str) -> float:
    value = float(text)
    if not 0.0 < value <= 16.0:
        raise argparse.ArgumentTypeError(f"{text} is not above 0 and up to 16")
    return value


SUBCOMMAND = Subcommand("render", "a picture of the scene under its baked light, without a window", True, _add_arguments, _run,
                        _check)
