"""From a Scene to a finished bundle: the one bake that the shell, the module and the panel share."""

import contextlib
from collections.abc import Callable
from dataclasses import asdict, replace
from pathlib import Path

import numpy as np

from .. import techniques
from ..effects.atlas.bake import bake_atlas, require_atlas, wants_atlas
from ..effects.atlas.settings import AtlasSettings
from ..effects.spheres.bake import bake_spheres
from ..effects.spheres.settings import SphereSettings
from ..errors import BakeError, Cancelled
from ..evaluate.concerns import concerns, usable_probes
from ..evaluate.probe_picture import draw_probes
from ..exchange.bundle import check_target, replaceable, write_bundle
from ..machine.memory import peak_memory_bytes
from ..progress import Progress
from ..scene import Scene
from ..storage.paths import check_output
from ..storage.workplace import Workplace, workplace
from ..techniques import Field, validate_settings
from ..techniques.kernels import Kernels
from ..techniques.lattice.coverage import MOST_OF, mostly_inside
from ..techniques.lattice.field import ProbeField
from ..techniques.probes.bake import Begun
from ..techniques.scattered.settings import ScatterSettings
from ..transport.context import LightContext
from .belonging import about_scene
from .checkpoint import FileCheckpoint
from .fingerprint import fingerprint
from .ready import fitted_if_buried, linked_lamps, ready_scene
from .report import BakeSummary, lattice_warning, summarize
from .scatter import scattered_scene
from .settings import build_settings

# How far a bake that ends with a picture is when it begins to draw.
PICTURE_FROM = 0.8
# The share of a bake's progress that checking the scene takes, and the shares before its end at which it begins to estimate what
# was left out, and to write.
_CHECKED, _ESTIMATING, _WRITING = 0.02, 0.03, 0.02
# The share that placing scattered probes takes of what is left for the technique.
_SCATTERING = 0.2
# The shares that sphere probes and the light atlas take of it, where there are any.
SPHERES_SHARE, ATLAS_SHARE = 0.1, 0.3


def bake_scene(scene: Scene, technique: str = "probes", overrides: dict | None = None, out="bake", *,
               base: dict | None = None, seed: int = 0, threads: int | None = None, progress: Progress | None = None,
               resume: bool = False, volume=None, checkpoint_seconds: float = 10.0, device: str = "cpu",
               kernels: Kernels | None = None, picture=None, keep: Callable[[Field], None] | None = None,
               state: str = "", begun: Begun | None = None, spheres: SphereSettings | None = None,
               atlas: AtlasSettings | None = None, placement: ScatterSettings | None = None) -> BakeSummary:
    """Bake the volumes of ``scene`` with the technique called ``technique`` into the bundle ``out``, a path or its Workplace.

    ``overrides`` maps names of the technique's settings to values and wins over what a volume itself carries, which wins over
    ``base`` (the scene's own settings, as a panel holds them), which wins over the technique's defaults. ``volume`` is
    None (all of them), a name or several. The same scene, settings and seed give the same bytes for any ``threads``
    (None = every core), interrupted and continued with ``resume`` or not. A checkpoint is left in `OUT.partial` at most every
    ``checkpoint_seconds`` and removed once the bundle is written. With the ``device`` 'gpu' the technique's inner loops run as
    ``kernels`` (None: on Blender's GPU, from this thread, which must then be the main one). ``picture`` is a PNG to draw the
    probes into after that; ``keep`` is given the finished field, which knows more than the bundle does; ``state`` is a digest of
    the scene that the bundle is to remember; ``begun`` is what a plan of this scene has done already of a bake of probes;
    ``spheres`` and ``atlas`` say how sphere probes and the light atlas are baked (None: by their defaults), ``placement`` where
    probes stand (None: on their lattices).

    Raises BakeError for what the user can mend, another bake to ``out`` that is at work among it, and Cancelled once
    ``progress.cancel`` was called: the bundle that was at ``out`` before is then as it was, unless the message says that the new
    one is written. Any other exception of the technique goes through unchanged, with the same promise.
    """
    progress = progress or Progress()
    overrides = overrides or {}
    method = techniques.get(technique)
    settings, of_spheres = build_settings(method, {**(base or {}), **overrides}), spheres or SphereSettings()
    of_atlas, placement = atlas or AtlasSettings(), placement or ScatterSettings()
    for chosen in (of_spheres, of_atlas, placement):
        validate_settings(chosen)
    require_device(method, device)
    placed = {"kernels": kernels or _gpu_kernels()} if device == "gpu" else {}
    if begun is not None and technique == "probes":
        placed["begun"] = begun
    target = out if isinstance(out, Workplace) else check_target(out, inputs=scene.files)
    if picture is not None:
        picture = check_picture(picture, target, scene.files)
    written = 1.0 if picture is None else PICTURE_FROM
    lit = written - _WRITING - (SPHERES_SHARE if of_spheres.bake and scene.spheres else 0.0)
    baked = lit * (1.0 - ATLAS_SHARE) if wants_atlas(scene) else lit

    progress.stage("check")
    progress.step(0.0, "Checking the scene")
    scene, findings, warnings = ready_scene(scene, method, settings, overrides, target, volume)
    require_atlas(scene, of_atlas)
    placed_until = _CHECKED
    if placement.scatters:
        placed_until += _SCATTERING * (baked - _CHECKED)
        scene, begun = scattered_scene(scene, method, settings, placement, seed, threads, progress.span(_CHECKED, placed_until))
        if technique == "probes":
            placed["begun"] = begun

    with workplace(target, "bake") as place:
        replaceable(place.path)  # again: a bundle that a killed run had put aside may have come back
        run = fingerprint(scene, technique, settings, seed)
        checkpoint = FileCheckpoint(place, run, resume=resume, interval=checkpoint_seconds)
        progress.stage("bake")

        def bake(scene: Scene) -> Field:
            return method.bake(scene, settings, np.random.default_rng(seed), progress.span(placed_until, baked),
                               threads=threads, checkpoint=checkpoint, **placed)

        scene, field = fitted_if_buried(scene, bake, findings)
        whole = [grid for grid in field.grids() if grid.volume.wanted is None and grid.volume.near is None]
        findings += [mostly_inside(grid.volume.name, share) for grid in whole
                     if (share := float(grid.in_the_open.mean())) < MOST_OF]
        if wants_atlas(scene):
            progress.stage("atlas")
        sheet = bake_atlas(scene, field, of_atlas, seed, threads, progress.span(baked, lit))
        if of_spheres.bake and scene.spheres:
            progress.stage("spheres")
        mirrors = bake_spheres(scene, field, of_spheres, seed, threads, progress.span(lit, written - _WRITING))
        field.spheres, field.atlas = mirrors.probes, sheet.atlas
        not_followed, omissions = (), (*scene.omissions, *field.omissions, *linked_lamps(scene, field.direct_lamps))
        if omissions:
            progress.stage("concerns")
            progress.step(written - _ESTIMATING, "Estimating what was left out")
            not_followed = concerns(LightContext(scene, threads), usable_probes(field), omissions, seed)
        warnings = [*map(str, findings), *mirrors.notes, *sheet.notes, *warnings]
        coarse = lattice_warning(field)
        warnings += [coarse] if coarse else []
        progress.stage("write")
        progress.step(written - _WRITING, f"Writing {place.path.name}")
        write_bundle(place, field, scene, settings=asdict(settings), seed=seed, notes=[*scene.notes, *field.notes, *warnings],
                     not_followed=[concern.to_json() for concern in not_followed],
                     stats=lambda: {**_stats(field, progress), **about_scene(scene, field, state),
                                    **({"sphere_rays": mirrors.rays} if mirrors.rays else {}),
                                    **({"atlas": {**asdict(of_atlas), "rays": sheet.rays}} if sheet.atlas else {})})
        checkpoint.parts.remove()
    if keep is not None:
        keep(field)
    stats = {**_stats(field, progress), **({"spheres_traced": mirrors.traced} if mirrors.traced else {})}
    summary = summarize(field, scene, out=place.path, technique=technique, settings=asdict(settings), seed=seed,
                        warnings=warnings, resumed=checkpoint.resumed, stats=stats, not_followed=not_followed,
                        findings=tuple(findings))
    if picture is not None:
        # What was shipped is what is seen: walls lit by the probes, not by the technique behind them.
        try:
            picture = draw_probes(scene, ProbeField.of(field), picture, threads=threads, progress=progress.span(PICTURE_FROM, 1.0))
        except Cancelled:
            raise Cancelled(f"the bundle {place.path} is written, its picture is not") from None
        summary = replace(summary, picture=picture)
    # The bundle is written: a wish to stop that comes only now is too late.
    with contextlib.suppress(Cancelled):
        progress.step(1.0, "Done")
    return summary


def check_picture(picture, target, inputs=()) -> Path:
    """The absolute path of the PNG ``picture`` that a bake to ``target`` (a path or a Workplace) draws, while ``inputs`` are read.
    Raises as ``check_output`` does."""
    others = [target.path if isinstance(target, Workplace) else target]
    return check_output(picture, folder=False, option="--picture", suffixes=(".png",), inputs=inputs, others=others)


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


def _stats(field: techniques.Field, progress: Progress) -> dict:
    seconds = progress.finish()
    return {"rays": 0, **field.stats, "seconds": seconds, "peak_memory_bytes": peak_memory_bytes()}
