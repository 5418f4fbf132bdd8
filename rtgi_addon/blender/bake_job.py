"""From what the panel says to a bake that a worker can run, and back to what the panel shows of it."""

from collections.abc import Callable
from dataclasses import asdict, replace
from pathlib import Path

import bpy
import numpy as np

from ..errors import BakeError
from ..exchange.bundle import check_target
from ..exchange.schema import MANIFEST
from ..jobs.bake import bake_scene
from ..jobs.check import check as check_scene
from ..jobs.plan import USUAL, PlannedBake, bake_fitted
from ..jobs.series import SeriesSummary, bake_series, check_series_target
from ..progress import Progress
from ..scene import ProbeVolume, Scene
from ..techniques import Technique
from ..techniques.lattice.fit import fit_volume
from .bundles import find_last_bake
from .extract import extract_scene, files_of_blend
from .fingerprint import fingerprint
from .frames import frames_of, frames_per_second, read_at
from .gpu_context import open_context
from .motion import find_motion
from .output import is_temporary, output_folder
from .session import Baked, Finding, session
from .ui.properties import atlas_settings, scatter_settings, scene_settings, sphere_settings
from .worker import KernelsOnMainThread, main_thread


def prepare(context) -> Callable[[Progress], object]:
    """Read the scene and return ``bake(progress) -> BakeSummary``, which touches Blender no more. Raises BakeError."""
    scene = context.scene
    technique, settings = scene_settings(scene)
    spheres, atlas, placement = sphere_settings(scene), atlas_settings(scene), scatter_settings(scene)
    output = output_folder(scene.rtgi.output)
    if is_temporary(output):
        output.parent.mkdir(parents=True, exist_ok=True)
    check_target(output, inputs=files_of_blend())
    seed = scene.rtgi.seed
    session.findings.pop(scene.name, None)
    session.digests[scene.name] = fingerprint(scene, context.evaluated_depsgraph_get())
    device, kernels = device_of(scene, technique)
    extracted, state = extract_scene(context=context), session.digests[scene.name]
    session.note_media(scene.name, extracted)
    key, motion = (scene.name, technique.name), find_motion()
    # Nothing says how to bake: there is no volume, and all settings are as they come.
    left_open = device == "cpu" and technique.name == USUAL and settings == technique.Settings() and not placement.scatters and \
        all(volume.fitted for volume in extracted.volumes)

    def bake(progress: Progress):
        options = {"seed": seed, "progress": progress, "state": state, "spheres": spheres, "atlas": atlas,
                   "keep": lambda field: session.baked.__setitem__(key, Baked(field, _as_baked(extracted, field)))}
        if left_open:
            done = bake_fitted(extracted, output, motion=motion, **options)
            return done.bake if isinstance(done, PlannedBake) else done
        return bake_scene(extracted, technique.name, out=output, base=asdict(settings), device=device,
                          placement=placement,
                          kernels=None if kernels is None else KernelsOnMainThread(kernels, progress), **options)

    return bake


def prepare_series(context) -> Callable[[Progress], SeriesSummary]:
    """``bake(progress)`` of a bundle for every frame that an animation of the scene renders, each read on the main thread when its
    turn comes; frames of an earlier run that have not changed are kept. Raises BakeError."""
    scene = context.scene
    technique, settings = scene_settings(scene)
    name, seed, placement = scene.name, scene.rtgi.seed, scatter_settings(scene)
    spheres, atlas = sphere_settings(scene), atlas_settings(scene)
    output, frames, files = output_folder(scene.rtgi.output), frames_of(scene), files_of_blend()
    if (output / MANIFEST).is_file():
        raise BakeError(f"{output} holds the bake of one frame", "choose another folder in the render properties, or move that one "
                                                                 "away")
    if is_temporary(output):
        raise BakeError("this file was never saved, and a series needs a place that stays", "save it, or choose a folder in the "
                                                                                           "render properties")
    check_series_target(output, files)
    device, kernels = device_of(scene, technique)

    def read(frame: int, progress: Progress) -> Scene:
        if bpy.context.scene.name != name:
            raise BakeError(f"scene {name!r} is no longer shown", "bake its frames again without going to another scene")
        return read_at(frame, progress)

    def bake(progress: Progress) -> SeriesSummary:
        return bake_series(lambda frame, part: main_thread.call(progress, read, frame, part), frames, technique.name, {}, output,
                           frames_per_second=lambda: main_thread.call(progress, frames_per_second), base=asdict(settings),
                           seed=seed, resume=True, device=device, spheres=spheres, atlas=atlas, placement=placement, inputs=files,
                           progress=progress,
                           kernels=None if kernels is None else KernelsOnMainThread(kernels, progress))

    return bake


def _as_baked(scene: Scene, field) -> Scene:
    """``scene`` with the volumes of its ``field``: one may have been fitted in the place of another, and its lattice planned."""
    volumes = tuple(grid.volume for grid in field.grids())
    return replace(scene, volumes=volumes) if any(volume.fitted for volume in volumes) else scene


def device_of(scene: bpy.types.Scene, technique: Technique):
    """Where ``scene`` is to be baked, "cpu" or "gpu", and the GPU's kernels, for the main thread; None on the CPU."""
    device = scene.rtgi.device.lower() if "gpu" in technique.devices else "cpu"
    if device == "cpu":
        return device, None
    open_context()
    # Importable once there is a GPU.
    from ..preview.kernels import GpuKernels
    return device, GpuKernels()


def check(context) -> list[Finding]:
    """Read the scene, run the pre-flight, and keep all there is to say for the panel."""
    extracted = extract_scene(context=context)
    session.note_media(context.scene.name, extracted)
    report = check_scene(extracted)
    findings = [Finding(found.severity, str(found), *found.subject) for found in report.findings]
    findings += [_concern(concern) for concern in report.not_followed]
    findings += [Finding("note", note) for note in report.notes]
    session.findings[context.scene.name] = findings
    return findings


def fitted_volume(context) -> ProbeVolume:
    """A probe volume fitted to the scene, whatever volumes it has."""
    scene = extract_scene(context=context)
    return fit_volume(scene)


# An omission that concerns at least this share of the light at the probes is a warning.
_MATTERS = 0.01
# What of the error on surfaces is kept, by the names that the scene has for it.
_SURFACE_ERROR = {"surface_error": "value", "surface_low": "low", "surface_high": "high"}


def last_bake_of(summary) -> dict:
    """The values of ``Scene.rtgi.last_bake`` for a finished bake (a BakeSummary). ``error`` (noise at the probes) and the
    error on surfaces with its interval are −1 where they are not known."""
    volumes = summary.volumes
    probes, usable = (sum(getattr(volume, name) for volume in volumes) for name in ("probes", "usable"))
    errors = [(volume.estimated_error, volume.usable) for volume in volumes
              if volume.estimated_error is not None and volume.usable]
    values, weights = np.array(errors, np.float64).reshape(-1, 2).T
    surfaces = summary.error_on_surfaces
    return {
        "folder": str(summary.out), "technique": summary.technique, "probes": probes, "usable": usable / max(probes, 1),
        "error": float(np.sqrt(np.average(values**2, weights=weights))) if len(errors) else -1.0,
        "seconds": float(sum(summary.seconds.values())),
        **{name: -1.0 if surfaces is None else surfaces[key] for name, key in _SURFACE_ERROR.items()},
    }


def record(scene: bpy.types.Scene, summary) -> None:
    """Write on ``scene`` what its last bake was, in a way that undo does not take back."""
    values = {**last_bake_of(summary), "fingerprint": session.digests.get(scene.name, "")}
    for name, value in values.items():
        setattr(scene.rtgi.last_bake, name, value)
    session.records[scene.name] = values
    session.stale[scene.name] = False
    subjects = {str(found): found.subject for found in summary.findings}
    session.findings[scene.name] = [*(Finding("warning", text, *subjects.get(text, ()))
                                      for text in (*_unsaved(summary.out), *summary.warnings)),
                                    *map(_concern, summary.not_followed),
                                    *(Finding("note", text) for text in summary.notes)]


def record_series(scene: bpy.types.Scene, summary: SeriesSummary) -> None:
    """Keep what the bundles of a series say for the panel, each line once, and show the series: an earlier bake of this session
    would be shown in its place."""
    session.baked.pop((scene.name, summary.series.technique), None)
    found = [_concern(concern) for baked in summary.baked.values() for concern in baked.not_followed]
    lines = [Finding(severity, text) for baked in summary.baked.values()
             for severity, texts in (("warning", baked.warnings), ("note", baked.notes)) for text in texts]
    session.findings[scene.name] = list(dict.fromkeys([*lines, *found]))
    scene.rtgi.last_bake.folder = str(summary.series.path)
    find_last_bake(scene)


def _concern(concern) -> Finding:
    severity = "warning" if concern.share is None or concern.share >= _MATTERS else "note"
    return Finding(severity, str(concern), concern.omission.objects, concern.omission.materials)


def _unsaved(folder: Path) -> tuple[str, ...]:
    """A warning where a bake goes when Blender quits."""
    return ("this file was never saved, and its bake is gone when Blender quits: save it, and the bake moves beside it",) \
        if is_temporary(folder) else ()
