"""`render`: a picture of the preview without a window."""

import argparse
import time
from dataclasses import asdict, dataclass
from pathlib import Path

import numpy as np

from ... import techniques
from ...effects import EFFECT_PASSES, Chosen, concerned, notes_of
from ...effects.gathering import ERROR, GATHERS, MOST_SAMPLES, by_rays, reached_text
from ...effects.picture import draw_pictures
from ...effects.surroundings import eye_inside
from ...errors import BakeError, UsageError
from ...exchange.bundle import read_bundle
from ...exchange.exr import write_exr
from ...exchange.plain import plain
from ...exchange.series import bundle_at, is_series, read_series
from ...jobs.belonging import require_of_scene
from ...jobs.console import duration
from ...jobs.field import bake_field
from ...preview.settings import PASSES, PreviewSettings
from ...progress import Progress
from ...scene import Camera, Scene, drawn_otherwise
from ...storage.files import disk_error
from ...storage.paths import check_output, require_suffix
from ...storage.png import require_whole_png
from ...storage.workplace import workplace
from ...storage.writing import claim
from ...techniques import Field
from ...transport.parallel import thread_count
from ...transport.views.camera import CameraView
from ...words import as_lines
from ..styles import is_shipped
from .base import EXTRACT_SHARE, Session, Subcommand
from .options import (
    add_effects,
    add_technique,
    at_least,
    atlas_settings,
    check_technique,
    chosen_effects,
    overrides,
    sphere_settings,
)

_SUFFIXES = (".exr", ".png")
# The share of the progress that is over when drawing begins.
_DRAW_FROM = 0.8
# The share that is over when only the file is to be written.
_WRITE_FROM = 0.99
# Frames of a picture in the light of a bake.
_SAMPLES = 64
# The most that a picture is enlarged.
_MOST_SCALE = 16.0


@dataclass(frozen=True)
class PictureReport:
    """A picture that was written: what it shows, how long each part took, what of the scene it shows otherwise than it is, and the
    error that a picture by rays has by its noise, and was to have; its ``samples`` are the mean of its pixels."""

    out: Path
    camera: str
    resolution: tuple[int, int]
    technique: str
    shown: str
    effects: tuple[str, ...]
    samples: float
    device: str
    seconds: dict[str, float]
    notes: tuple[str, ...] = ()
    error: float | None = None
    wanted: float | None = None

    def to_json(self) -> dict:
        """The report as JSON-able values."""
        return plain({**asdict(self), "out": str(self.out)})

    def to_text(self) -> str:
        """The report as lines for a person."""
        width, height = self.resolution
        parts = ", ".join(f"{name} {seconds:.2f}" for name, seconds in self.seconds.items())
        effects = "".join(f", {name}" for name in self.effects)
        return as_lines([
            f"Rendered {self.out}, {width} × {height}, {self.shown} through camera {self.camera} with {self.technique}{effects}",
            f"  samples  {self.samples:.0f} on {self.device}",
            *([] if self.error is None else [f"  error    {reached_text(self.error, self.wanted, self.samples)}"]),
            f"  time     {duration(sum(self.seconds.values()))} (seconds: {parts})",
            *(f"  note     {note}" for note in self.notes),
        ])


def _add_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("--out", required=True, metavar="FILE", help="the picture: .exr (scene-linear) or .png (the scene's view "
                                                                     "transform)")
    parser.add_argument("--camera", metavar="NAME", help="default: the active camera")
    parser.add_argument("--samples", type=at_least(1), metavar="N",
                        help=f"frames that are averaged (default {_SAMPLES}); the most of a pixel with --gather rays (default "
                             f"{MOST_SAMPLES})")
    parser.add_argument("--gather", choices=GATHERS, default="bake",
                        help="where indirect light comes from: a bake, or rays of every pixel, which is exact (default bake)")
    parser.add_argument("--picture-error", type=_share, metavar="E",
                        help=f"with --gather rays: how far the picture may be off by its noise, relative (default {ERROR:g})")
    parser.add_argument("--scale", type=_scale, default=1.0, metavar="S", help="share of the file's resolution (default 1)")
    parser.add_argument("--pass", dest="shown", choices=(*PASSES, *EFFECT_PASSES), default="combined",
                        help="what to show (default combined)")
    parser.add_argument("--device", choices=("cpu", "gpu"), help="what draws: shaders as in the viewport, or rays, which need no "
                                                                 "driver (default gpu; cpu with --gather rays)")
    parser.add_argument("--transparent", action="store_true", help="leave the world out of the picture")
    parser.add_argument("--bundle", metavar="DIR", help="show this bundle instead of baking, or of a series the one of the frame")
    add_technique(parser)
    add_effects(parser)


def _check(arguments: argparse.Namespace) -> None:
    require_suffix(arguments.out, _SUFFIXES, "--out")
    rays = arguments.gather == "rays"
    if rays and arguments.device == "gpu":
        raise UsageError("--gather rays draws on the CPU", "leave out --device gpu")
    if rays and arguments.shown != "combined":
        raise UsageError("--gather rays makes the combined pass", f"leave out --pass {arguments.shown}, or --gather rays")
    if not rays and arguments.picture_error is not None:
        raise UsageError("--picture-error is of pictures by rays", "add --gather rays")
    if rays and "ray_traced" not in arguments.effects:
        # Its settings may be given without it.
        arguments.effects = [*arguments.effects, "ray_traced"]
    styled = arguments.effects or arguments.style is not None
    if styled and arguments.shown != "combined" and arguments.shown not in EFFECT_PASSES:
        raise UsageError(f"--pass {arguments.shown} has no effects", "leave --effect and --style out, or show the combined pass")
    if arguments.style is None or is_shipped(arguments.style):
        chosen_effects(arguments)
    check_technique(arguments)
    sphere_settings(arguments)
    atlas_settings(arguments)


def _run(arguments: argparse.Namespace, session: Session) -> PictureReport:
    # Everything that can fail without the file fails before it is read.
    techniques.get(arguments.technique)
    chosen = chosen_effects(arguments)
    inputs = [*session.inputs, *([] if arguments.bundle is None else [arguments.bundle])]
    out = check_output(arguments.out, folder=False, suffixes=_SUFFIXES, inputs=inputs)
    rays = arguments.gather == "rays"
    on_gpu = not rays and arguments.device != "cpu"
    if on_gpu:
        from ..gpu_context import open_context
        open_context()
    progress, started = session.progress, time.monotonic()
    # Of a series, the frame says which.
    series = None if arguments.bundle is None or not is_series(arguments.bundle) else read_series(arguments.bundle)
    bundle = None if arguments.bundle is None or series is not None else read_bundle(arguments.bundle, session.progress)
    if bundle is not None and bundle.atlas is not None:
        # Its objects need their UV maps, whatever the file says.
        arguments.shown_atlas = [(part.name, part.uv_map) for part in bundle.atlas.sheet.parts]
    scene = session.read_scene()
    check_output(out, folder=False, inputs=scene.files)
    told = ()
    if series is not None:
        from ..frames import current_frame
        folder, told = bundle_at(series, current_frame())
        bundle = read_bundle(folder)
    if bundle is not None:
        require_of_scene(bundle.path, scene)
    camera = _camera(scene, arguments.camera, arguments.scale)
    told = (*told, eye_inside(scene, camera.name, camera.world_from_camera[:3, 3], arguments.threads))
    read = time.monotonic()
    if bundle is None and rays and not scene.media:
        field, technique = None, "rays"
    elif bundle is None:
        field = bake_field(scene, arguments.technique, overrides(arguments), seed=arguments.seed, threads=arguments.threads,
                           volume=arguments.volume, progress=progress.span(EXTRACT_SHARE, _DRAW_FROM),
                           spheres=sphere_settings(arguments) if any(entry.effect.reads_spheres for entry in chosen) else None,
                           atlas=atlas_settings(arguments))
        # A bundle said so when it was baked.
        technique, told = arguments.technique, (*told, *field.notes)
    else:
        field, technique = bundle.field, f"{bundle.path.name} ({bundle.manifest['technique']})"
    baked = time.monotonic()
    settings = PreviewSettings(samples=arguments.samples or (MOST_SAMPLES if rays else _SAMPLES),
                               film_transparent=arguments.transparent)
    chosen, wanted = concerned(by_rays(chosen) if rays else chosen, scene), None
    progress = progress.span(_DRAW_FROM if field is not None else EXTRACT_SHARE, 1.0)
    if rays:
        wanted = ERROR if arguments.picture_error is None else arguments.picture_error
    if on_gpu:
        pixels, device = _draw(scene, field, settings, camera, arguments.shown, chosen, progress.span(0.0, _WRITE_FROM))
        samples, error = settings.samples, None
    else:
        pictures, samples, error = draw_pictures(
            scene, field, CameraView.of(camera), camera.resolution, shown=(arguments.shown,), samples=settings.samples,
            error=wanted, effects=chosen, transparent=settings.film_transparent, threads=arguments.threads,
            progress=progress.span(0.0, _WRITE_FROM))
        pixels, device = pictures[arguments.shown], f"the CPU, {thread_count(arguments.threads)} threads"
    drawn = time.monotonic()
    names = tuple(entry.effect.name for entry in chosen)
    _write(out, pixels, {"camera": camera.name, "pass": arguments.shown, "technique": technique, "effects": list(names)})
    progress.step(1.0, "Done")
    seconds = {"reading": read - started, "baking": baked - read, "drawing": drawn - baked, "writing": time.monotonic() - drawn}
    return PictureReport(out, camera.name, camera.resolution, technique, arguments.shown, names, samples, device, seconds,
                         tuple(filter(None, [*told, drawn_otherwise(scene), *notes_of(chosen, scene)])), error, wanted)


def _draw(scene: Scene, field: Field, settings: PreviewSettings, camera: Camera, shown: str, effects: tuple[Chosen, ...],
          progress: Progress) -> tuple[np.ndarray, str]:
    """The pass called ``shown`` (h, w, 4) float32 after ``effects``, row 0 at the bottom, and what drew it."""
    # Importable once there is a GPU.
    from ...preview import context
    from ...preview.renderer import PreviewRenderer
    renderer, view = PreviewRenderer(scene, field, settings, (shown,), effects=effects), CameraView.of(camera)
    for sample in range(settings.samples):
        progress.step(sample / settings.samples, "Drawing")
        renderer.frame(view, camera.resolution)
    return renderer.image(shown), context.description()


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
        return
    with workplace(out, "render") as place:
        try:
            picture = claim(place.new / out.name)
            _write_png(picture, pixels)
            # Blender says nothing of a disk that was full.
            require_whole_png(picture, pixels.shape[:2])
            place.put_file()
        except OSError as error:
            raise disk_error(out, error) from error


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


def _share(text: str) -> float:
    value = float(text)
    if not 0.0 < value < 1.0:
        raise argparse.ArgumentTypeError(f"{text} is not between 0 and 1")
    return value


def _scale(text: str) -> float:
    value = float(text)
    if not 0.0 < value <= _MOST_SCALE:
        raise argparse.ArgumentTypeError(f"{text} is not above 0 and up to {_MOST_SCALE:g}")
    return value


SUBCOMMAND = Subcommand("render", "a picture of the scene under its baked light, without a window", True, _add_arguments, _run,
                        _check)
