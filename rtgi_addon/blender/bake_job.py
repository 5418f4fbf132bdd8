"""From what the panel says to a bake that a worker can run, and back to what the panel shows of it."""

from collections.abc import Callable
from dataclasses import asdict
from pathlib import Path

import bpy
import numpy as np

from ..errors import BakeError
from ..jobs.bake import bake_scene
from ..progress import Progress
from ..scene import ProbeVolume
from ..scene.checks import check_scene
from .extract import extract_scene
from .extract.volumes import fit_volume
from .fingerprint import fingerprint
from .gpu_context import open_context
from .properties import scene_settings
from .session import Baked, Finding, session
from .worker import KernelsOnMainThread


def prepare(context) -> Callable[[Progress], object]:
    """Read the scene and return ``bake(progress) -> BakeSummary``, which touches Blender no more. Raises BakeError."""
    scene = context.scene
    technique, settings = scene_settings(scene)
    output = output_folder(scene.rtgi.output)
    seed = scene.rtgi.seed
    session.findings.pop(scene.name, None)
    session.digests[scene.name] = fingerprint(scene, context.evaluated_depsgraph_get())
    device = scene.rtgi.device.lower() if "gpu" in technique.devices else "cpu"
    kernels = _gpu_kernels() if device == "gpu" else None
    extracted = extract_scene(context=context)
    key = scene.name, technique.name

    def bake(progress: Progress):
        return bake_scene(extracted, technique.name, out=output, seed=seed, base=asdict(settings), progress=progress, device=device,
                          kernels=None if kernels is None else KernelsOnMainThread(kernels, progress),
                          keep=lambda field: session.baked.__setitem__(key, Baked(field, extracted)))

    return bake


def _gpu_kernels():
    open_context()
    # Importable once there is a GPU.
    from ..preview.kernels import GpuKernels
    return GpuKernels()


def check(context) -> list[Finding]:
    """Read the scene, run the pre-flight, and keep all there is to say for the panel."""
    scene = extract_scene(context=context)
    findings = [Finding(found.severity, str(found)) for found in check_scene(scene)]
    findings += [Finding("note", note) for note in scene.notes]
    session.findings[context.scene.name] = findings
    return findings


def fitted_volume(context) -> ProbeVolume:
    """A probe volume fitted to the scene, whatever volumes it has."""
    scene = extract_scene(context=context)
    return fit_volume(scene.meshes, scene.instances, scene.name)


def output_folder(setting: str) -> Path:
    """The absolute folder for the ``output`` property. Raises BakeError if it is relative to a file that was never saved."""
    if not setting.strip():
        raise BakeError("no output folder is set", "choose one in the render properties, under RTGI")
    if setting.startswith("//") and not bpy.data.filepath:
        raise BakeError(f"the output folder {setting} is relative to this file, which was never saved",
                        "save the file, or choose an absolute folder in the render properties, under RTGI")
    return Path(bpy.path.abspath(setting)).resolve()


def last_bake_of(summary) -> dict:
    """The values of ``Scene.rtgi.last_bake`` for a finished bake (a BakeSummary). ``error`` is −1 where it is not known."""
    volumes = summary.volumes
    probes, usable = (sum(getattr(volume, name) for volume in volumes) for name in ("probes", "usable"))
    errors = [(volume.estimated_error, volume.usable) for volume in volumes
              if volume.estimated_error is not None and volume.usable]
    values, weights = np.array(errors, np.float64).reshape(-1, 2).T
    return {
        "folder": str(summary.out), "technique": summary.technique, "probes": probes, "usable": usable / max(probes, 1),
        "error": float(np.sqrt(np.average(values**2, weights=weights))) if len(errors) else -1.0,
        "seconds": float(sum(summary.seconds.values())),
    }


def record(scene: bpy.types.Scene, summary) -> None:
    """Write on ``scene`` what its last bake was, in a way that undo does not take back."""
    values = {**last_bake_of(summary), "fingerprint": session.digests.get(scene.name, "")}
    for name, value in values.items():
        setattr(scene.rtgi.last_bake, name, value)
    session.records[scene.name] = values
    session.stale[scene.name] = False
    session.findings[scene.name] = [*(Finding("warning", text) for text in summary.warnings),
                                    *(Finding("note", text) for text in summary.notes)]
