"""From a Scene to a prepared bake: everything that needs the file, done once, so that the rest can be done anywhere."""

from dataclasses import asdict, dataclass
from pathlib import Path

import numpy as np

from .. import techniques
from ..effects.spheres.settings import SphereSettings
from ..errors import BakeError
from ..evaluate.concerns import concerns
from ..exchange.array_folder import check_folder_target, write_folder
from ..exchange.plain import plain
from ..exchange.prepared import COMMON, PREPARED, SCENE, TRUTH, versions
from ..exchange.roles import lamp_roles, object_roles
from ..machine.memory import peak_memory_bytes
from ..progress import Progress
from ..scene import Scene
from ..scene.encoding import encode
from ..storage.workplace import workplace
from ..techniques import validate_settings
from ..techniques.lattice.coverage import MOST_OF, mostly_inside
from ..transport.context import LightContext
from ..words import as_lines
from .ready import fitted_if_buried, linked_lamps, ready_scene
from .settings import build_settings

# How far preparing is when the scene is checked, when it begins to estimate what was left out, and to write.
_CHECKED, _COMMON, _ESTIMATED = 0.02, 0.85, 0.9


@dataclass(frozen=True)
class PrepareSummary:
    """A prepared bake: its ``blocks``, the most parts that it can be cut into, of ``probes`` probes; ``size`` in bytes on the
    disk; ``seconds`` by stage."""

    out: Path
    technique: str
    blocks: int
    probes: int
    size: int
    seconds: dict[str, float]
    peak_memory_bytes: int
    warnings: tuple[str, ...]

    def to_json(self) -> dict:
        """The summary as JSON-able values."""
        return plain({**asdict(self), "out": str(self.out)})

    def to_text(self) -> str:
        """The summary as lines for a person."""
        return as_lines([
            f"Prepared {self.out} for {self.technique}: {self.probes:,} probes in {self.blocks:,} blocks",
            f"  size     {self.size / 2**20:,.1f} MiB",
            f"  next     rtgi bake {self.out} --part K/N --out PARTS/K for K from 1 to N, which is {self.blocks:,} at most,",
            "           then rtgi merge PARTS/* --out OUT; without --part rtgi bake makes all of it",
            f"  seconds  {sum(self.seconds.values()):.2f}",
            f"  memory   {self.peak_memory_bytes / 2**20:,.0f} MiB at most",
            *(f"  warning  {warning}" for warning in self.warnings)])


def prepare_scene(scene: Scene, technique: str = "probes", overrides: dict | None = None, out="prepared", *,
                  base: dict | None = None, seed: int = 0, threads: int | None = None, progress: Progress | None = None,
                  volume=None, spheres: SphereSettings | None = None) -> PrepareSummary:
    """Write all that a bake of ``scene`` has in common to the folder ``out``; arguments as those of ``bake_scene``.

    A bake from there differs from one of the file in its random numbers and nothing else: blocks know nothing of each other.
    Raises BakeError, UsageError, and Cancelled; a folder that was at ``out`` before is then as it was.
    """
    progress, overrides = progress or Progress(), overrides or {}
    method = techniques.get(technique)
    settings = build_settings(method, {**(base or {}), **overrides})
    if method.blocks is None:
        able = ", ".join(name for name, other in techniques.registry().items() if other.blocks is not None)
        raise BakeError(f"a bake of {technique} is one piece, it has no parts", f"bake the file itself, or choose one of {able}")
    if refusal := method.blocks.refusal(settings):
        raise BakeError(f"this bake is one piece, {refusal}", "leave that out, or bake the file itself")
    of_spheres = spheres or SphereSettings()
    validate_settings(of_spheres)
    target = check_folder_target(PREPARED, out, inputs=scene.files)
    progress.stage("check")
    progress.step(0.0, "Checking the scene")
    scene, findings, warnings = ready_scene(scene, method, settings, overrides, target, volume)
    with workplace(target, "prepare") as place:
        def prepare(scene: Scene):
            return method.blocks.prepare(scene, settings, np.random.default_rng(seed), progress.span(_CHECKED, _COMMON), threads)

        scene, common = fitted_if_buried(scene, prepare, findings)
        findings += [mostly_inside(of.name, share) for of, share in zip(scene.volumes, common.in_the_open, strict=True)
                     if of.wanted is None and of.near is None and share < MOST_OF]
        not_followed, omissions = (), (*scene.omissions, *linked_lamps(scene, common.direct_lamps))
        if omissions:
            progress.stage("concerns")
            progress.step(_COMMON, "Estimating what was left out")
            not_followed = concerns(LightContext(scene, threads), common.usable, omissions, seed)
        warnings = [*map(str, findings), *warnings]
        in_atlas = [item.name for item in scene.instances if item.atlas is not None]
        if in_atlas:
            warnings.append(f"the light atlas of {', '.join(in_atlas)} is no part of a prepared bake, and not in its bundle: bake "
                            "the file for it")
        progress.stage("write")
        progress.step(_ESTIMATED, f"Writing {target.name}")
        document, arrays = encode(scene)
        said = {"lamps": lamp_roles(scene, common), "objects": object_roles(scene), "notes": [*scene.notes, *common.notes],
                "warnings": warnings, "not_followed": [concern.to_json() for concern in not_followed],
                "direct_lamps": sorted(common.direct_lamps)}
        write_folder(PREPARED, place, plain({
            **versions(), "technique": technique, "settings": asdict(settings), "seed": seed, "blocks": common.blocks,
            "scene": document, "said": said, "spheres": asdict(of_spheres)}),
            {SCENE: arrays, COMMON: common.arrays, TRUTH: common.truth})
        size = sum(file.stat().st_size for file in target.iterdir())
    progress.step(1.0, "Done")
    return PrepareSummary(target, technique, common.blocks, sum(int(np.prod(of.resolution)) for of in scene.volumes), size,
                          progress.finish(), peak_memory_bytes(), tuple(warnings))
