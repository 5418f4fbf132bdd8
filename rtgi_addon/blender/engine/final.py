"""F12: one view layer as a picture, sample by sample, with its passes."""

import time
from collections.abc import Callable

import numpy as np

from ...effects import Chosen, notes_of
from ...effects.atlas.relight import STALE_ATLAS, is_left_out
from ...effects.gathering import by_rays, reached_text
from ...effects.picture import draw_pictures
from ...effects.surroundings import eye_inside
from ...errors import BakeError, Cancelled
from ...progress import Progress
from ...scene import Camera, Scene, drawn_otherwise
from ...techniques import Field
from ...techniques.probes.live import LiveSettings
from ..extract import extract_scene
from ..extract.cameras import read_camera
from ..session import session
from ..translations import sentence
from ..ui.effect_settings import chosen_effects
from ..ui.light_settings import in_its_light
from ..ui.preview_settings import preview_settings
from ..ui.progress_text import progress_parts
from ..worker import Report
from .layer import OverlayLayer
from .passes import add_passes, passes_of, write_passes
from .shown import lit_for, shown_for

# How often the picture in the making is shown [s], and the share of progress that reading and relighting take.
_SHOW_EVERY, _READING, _RELIGHTING = 0.5, 0.1, 0.1


def render(engine, depsgraph) -> None:
    """Render ``depsgraph``'s view layer into ``engine``'s result. Raises BakeError, Cancelled."""
    layer, original = depsgraph.view_layer, depsgraph.scene.original
    size = _result_size(engine, layer)
    progress = _progress(engine)
    engine.update_stats("", sentence("Reading the scene"))
    read = extract_scene(depsgraph, progress=progress.span(0.0, _READING), reuse=True)
    session.note_media(original.name, read)
    scene = in_its_light(read, original)
    camera = cropped(_camera(depsgraph), depsgraph.scene.render, size)
    shown = shown_for(original)
    effects, rays = chosen_effects(original), original.rtgi_preview.gather == "rays"
    effects = by_rays(effects) if rays else effects
    # A picture by rays looks at a bake only for what media scatter more than once.
    looks_at_bake = bool(scene.media) or not rays
    inside = eye_inside(scene, camera.name, camera.world_from_camera[:3, 3])
    for note in (shown.note if looks_at_bake else "", inside, drawn_otherwise(scene), *notes_of(effects, scene)):
        if note:
            engine.report({"INFO"}, sentence(note))
    engine.update_stats("", sentence("Relighting"))
    try:
        field = lit_for(shown, scene, progress.span(_READING, _READING + _RELIGHTING)) if looks_at_bake else None
    except BakeError as error:
        if shown.baked is not None or isinstance(shown.live, LiveSettings):
            raise
        # A bundle on disk may be of an earlier state of the file: it is shown as it was baked.
        engine.report({"WARNING"}, sentence(str(error)))
        field = shown.field
    if is_left_out(field, shown.field):
        engine.report({"INFO"}, sentence(STALE_ATLAS))
    drawing = progress.span(_READING + _RELIGHTING, 1.0)
    if rays:
        _by_rays(engine, layer, original, scene, field, effects, camera, drawing)
        return
    from ...preview.renderer import PreviewRenderer  # importable once there is a GPU
    from ...transport.views.camera import CameraView
    settings = preview_settings(original, final=True)
    renderer = PreviewRenderer(scene, field, settings, tuple(entry.source for entry in passes_of(layer)),
                               None if shown.baked is None or field is not shown.field else shown.baked.scene, shown.live,
                               effects)
    view, written = CameraView.of(camera), time.monotonic()
    for sample in range(settings.samples):
        drawing.step(sample / settings.samples, f"Sample {sample} of {settings.samples}")
        renderer.frame(view, size)
        if not engine.is_preview and time.monotonic() - written > _SHOW_EVERY:
            _write(engine, layer, size, renderer.image)
            written = time.monotonic()
    overlay = _overlay(original, shown, view, size, renderer)
    _write(engine, layer, size, renderer.image, overlay)
    drawing.step(1.0, "Done")


def _by_rays(engine, layer, original, scene: Scene, field: Field | None, effects: tuple[Chosen, ...], camera: Camera,
             drawing: Progress) -> None:
    """Fill the result with the picture of ``scene`` by rays of every pixel, and say how near it came."""
    from ...transport.views.camera import CameraView
    wanted = original.rtgi_preview
    drawn = draw_pictures(scene, field, CameraView.of(camera), camera.resolution,
                          shown=tuple(dict.fromkeys(entry.source for entry in passes_of(layer))), samples=wanted.gather_samples,
                          error=wanted.gather_error, effects=effects, transparent=original.render.film_transparent,
                          progress=drawing)
    _write(engine, layer, camera.resolution, drawn.pictures.__getitem__)
    engine.report({"INFO"}, sentence(reached_text(drawn.error, wanted.gather_error, drawn.samples)))
    if wanted.overlays_in_renders:
        engine.report({"WARNING"}, sentence("Overlays are not drawn over pictures by rays"))
    drawing.step(1.0, "Done")


def _overlay(scene, shown, view, size: tuple[int, int], renderer):
    """What the scene wants to be drawn over the finished picture, or None."""
    return OverlayLayer().draw(scene, shown, view, size, renderer) if scene.rtgi_preview.overlays_in_renders else None


def cropped(camera: Camera, render, size: tuple[int, int]) -> Camera:
    """``camera`` over the border of ``render`` alone, which is ``size`` pixels; the same camera if there is no border."""
    if not render.use_border:
        return camera
    width, height = camera.resolution
    left, bottom = (_first(*side) for side in ((render.border_min_x, render.border_max_x, width, size[0]),
                                               (render.border_min_y, render.border_max_y, height, size[1])))
    scale = np.array([width / size[0], height / size[1]])
    centre = np.array([left + size[0] / 2.0, bottom + size[1] / 2.0]) / (width, height) * 2.0 - 1.0
    crop = np.diag([*scale, 1.0, 1.0])
    crop[:2, 3] = -centre * scale
    return Camera(camera.name, camera.world_from_camera, crop @ camera.clip_from_camera, size)


def _first(low: float, high: float, side: int, count: int) -> int:
    """The first of ``count`` pixels between two shares of a side: versions of Blender cut down or round."""
    return int(low * side) if int(high * side) - int(low * side) == count else round(low * side)


def _result_size(engine, layer) -> tuple[int, int]:
    """Width and height [pixels] of what is to be filled: the border alone, where there is one."""
    result = engine.begin_result(0, 0, engine.resolution_x, engine.resolution_y, layer=layer.name)
    if result is None:
        raise Cancelled()
    size = result.resolution_x, result.resolution_y
    engine.end_result(result, cancel=True)
    return size


def _camera(depsgraph) -> Camera:
    active = depsgraph.scene.camera
    if active is None:
        raise BakeError(f"scene {depsgraph.scene.name!r} has no camera", "add one, or make one active")
    notes: list[str] = []
    camera = read_camera(active, depsgraph, depsgraph.scene.render, notes)
    if camera is None:
        raise BakeError(notes[0], "choose a perspective or orthographic lens")
    return camera


def _progress(engine) -> Progress:
    """A Progress that shows in Blender's bar and stops on ESC."""
    def report(fraction, label, seconds_left):
        engine.update_progress(fraction)
        engine.update_stats("", ", ".join(progress_parts(Report(fraction, label, seconds_left))))

    return _Breakable(engine, report)


class _Breakable(Progress):
    """Asks Blender at every step whether the user wants to stop."""

    def __init__(self, engine, report):
        super().__init__(report)
        self._engine = engine

    def check(self) -> None:
        """See Progress."""
        if self._engine.test_break():
            self.cancel()
        super().check()


def _write(engine, layer, size: tuple[int, int], image: Callable[[str], np.ndarray], overlay=None) -> None:
    add_passes(engine, layer)
    result = engine.begin_result(0, 0, *size, layer=layer.name)
    if result is None:
        raise Cancelled()
    images = {entry.source: image(entry.source) for entry in passes_of(layer)}
    if overlay is not None:
        from ...preview.overlays import laid_over
        images["combined"] = laid_over(images["combined"], overlay)
    write_passes(result.layers[0], layer, images.__getitem__)
    engine.end_result(result)
