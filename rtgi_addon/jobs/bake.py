"""From a Scene to a finished bundle: the one bake that the shell, the module and the panel share."""

import contextlib
from collections.abc import Callable
from dataclasses import asdict, replace

import numpy as np

from .. import techniques
from ..errors import BakeError, Cancelled, UsageError
from ..evaluate.probe_picture import draw_probes
from ..exchange.bundle import check_target, write_bundle
from ..progress import Progress
from ..scene import ProbeVolume, Scene
from ..scene.checks import check_scene, require
from ..techniques import Field
from ..techniques.kernels import Kernels
from ..techniques.probes.field import ProbeField
from ..transport.rays import slow_rays_warning
from .checkpoint import FileCheckpoint
from .fingerprint import fingerprint
from .memory import peak_memory_bytes
from .report import BakeSummary, summarize
from .settings import build_settings

# How far a bake that ends with a picture is when it begins to draw.
PICTURE_FROM = 0.8


def bake_scene(scene: Scene, technique: str = "probes", overrides: dict | None = None, out="bake", *,
               base: dict | None = None, seed: int = 0, threads: int | None = None, progress: Progress | None = None,
               resume: bool = False, volume=None, checkpoint_seconds: float = 10.0, device: str = "cpu",
               kernels: Kernels | None = None, picture=None, keep: Callable[[Field], None] | None = None) -> BakeSummary:
    """Bake the volumes of ``scene`` with the technique called ``technique`` into the bundle ``out``.

    ``overrides`` maps names of the technique's settings to values and wins over what a volume itself carries, which wins over
    ``base`` (the scene's own settings, as a panel holds them), which wins over the technique's defaults. ``volume`` is
    None (all of them), a name or several. The same scene, settings and seed give the same bytes for any ``threads``
    (None = every core), interrupted and continued with ``resume`` or not. A checkpoint is left in `OUT.partial` at most every
    ``checkpoint_seconds`` and removed once the bundle is written. With the ``device`` 'gpu' the technique's inner loops run as
    ``kernels`` (None: on Blender's GPU, from this thread, which must then be the main one). ``picture`` is a PNG to draw the
    probes into after that; ``keep`` is given the finished field, which knows more than the bundle does.

    Raises BakeError for what the user can mend and Cancelled once ``progress.cancel`` was called: the bundle that was at
    ``out`` before is then as it was. Any other exception of the technique goes through unchanged, with the same promise.
    """
    progress = progress or Progress()
    overrides = overrides or {}
    method = techniques.get(technique)
    settings = build_settings(method, {**(base or {}), **overrides})
    require_device(method, device)
    placed = {"kernels": kernels or _gpu_kernels()} if device == "gpu" else {}
    target = check_target(out)
    written = 1.0 if picture is None else PICTURE_FROM

    progress.stage("check")
    progress.step(0.0, "Checking the scene")
    scene = replace(scene, volumes=select_volumes(scene.volumes, volume, overrides))
    findings = check_scene(scene, sh_order=getattr(settings, "order", 2))
    require(findings)
    slow = slow_rays_warning()
    warnings = [str(finding) for finding in findings] + ([slow] if slow else [])

    checkpoint = FileCheckpoint(target, fingerprint(scene, technique, settings, seed), resume=resume, interval=checkpoint_seconds)
    try:
        progress.stage("bake")
        field = method.bake(scene, settings, np.random.default_rng(seed), progress.span(0.02, written - 0.02), threads=threads,
                            checkpoint=checkpoint, **placed)
        progress.stage("write")
        progress.step(written - 0.02, f"Writing {target.name}")
        write_bundle(target, field, scene, settings=asdict(settings), seed=seed, notes=[*scene.notes, *field.notes, *warnings],
                     stats=lambda: _stats(field, progress))
    except BaseException:
        checkpoint.remove_if_empty()
        raise
    checkpoint.remove()
    if keep is not None:
        keep(field)
    summary = summarize(field, scene, out=target, technique=technique, settings=asdict(settings), seed=seed, warnings=warnings,
                        resumed=checkpoint.resumed, stats=_stats(field, progress))
    if picture is not None:
        # What was shipped is what is seen: walls lit by the probes, not by the technique behind them.
        shown = field if isinstance(field, ProbeField) else ProbeField(field.grids(), includes_direct=field.includes_direct)
        picture = draw_probes(scene, shown, picture, threads=threads, progress=progress.span(PICTURE_FROM, 1.0))
        summary = replace(summary, picture=picture)
    # The bundle is written: a wish to stop that comes only now is too late.
    with contextlib.suppress(Cancelled):
        progress.step(1.0, "Done")
    return summary


def require_device(method: techniques.Technique, device: str) -> None:
    """Raise BakeError if the technique does not bake on ``device``."""
    if device not in method.devices:
        raise BakeError(f"technique {method.name!r} does not bake on the device {device!r}",
                        f"use --device {' or '.join(method.devices)}")


def _gpu_kernels() -> Kernels:
    from ..preview import context
    context.require()
    # Importable inside Blender alone.
    from ..preview.kernels import GpuKernels
    return GpuKernels()


def select_volumes(volumes: tuple[ProbeVolume, ...], wanted, overrides: dict) -> tuple[ProbeVolume, ...]:
    """The volumes called ``wanted``, in the scene's order, with their own settings where no override replaces them."""
    if wanted is not None:
        wanted = [wanted] if isinstance(wanted, str) else list(wanted)
        known = [volume.name for volume in volumes]
        for name in wanted:
            if name not in known:
                raise UsageError(f"unknown volume {name!r}", f"choose one of {', '.join(known) or '(the scene has none)'}")
        volumes = tuple(volume for volume in volumes if volume.name in wanted)
    return tuple(replace(volume, settings={name: value for name, value in volume.settings.items() if name not in overrides})
                 for volume in volumes)


def _stats(field: techniques.Field, progress: Progress) -> dict:
    seconds = progress.finish()
    return {"rays": 0, **field.stats, "seconds": seconds, "peak_memory_bytes": peak_memory_bytes()}
