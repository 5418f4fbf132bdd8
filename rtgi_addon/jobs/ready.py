"""What comes before any bake: the volumes that are wanted, and a scene that has been checked."""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import TypeVar

from .. import techniques
from ..errors import UsageError
from ..exchange.bundle import least_bytes
from ..scene import Omission, ProbeVolume, Scene
from ..scene.checks import Finding, check_scene, require
from ..scene.lights import NOT_AT_ALL, lamps_to_add
from ..storage.paths import require_room
from ..storage.workplace import Workplace
from ..techniques.lattice.coverage import NoUsableProbe, coverage_findings, fitted_in_place
from ..transport.rays.choose import slow_rays_warning

_Made = TypeVar("_Made")


def ready_scene(scene: Scene, method: techniques.Technique, settings, overrides: dict, target: Workplace | Path,
                volume=None) -> tuple[Scene, list[Finding], list[str]]:
    """``scene`` with the volumes that are wanted (see ``select_volumes``), what was found of it, and what is to be warned of,
    before it is baked by ``method`` with ``settings`` to ``target``. Raises BakeError for what no bake can do with, UsageError."""
    scene = replace(scene, volumes=select_volumes(scene.volumes, volume, overrides))
    findings = check_scene(scene, sh_order=getattr(settings, "order", 2))
    require(findings)
    findings += coverage_findings(scene, scene.volumes)
    require_room(target.path if isinstance(target, Workplace) else target, least_bytes(
        scene.volumes, getattr(settings, "order", 2), getattr(settings, "visibility_resolution", 0)))
    slow = slow_rays_warning()
    warnings = [slow] if slow else []
    if scene.media and not method.follows_media:
        warnings.append(f"{method.label} follow media in part only, and not what they scatter or give: bake with probes for that")
    return scene, findings, warnings


def fitted_if_buried(scene: Scene, make: Callable[[Scene], _Made], findings: list[Finding]) -> tuple[Scene, _Made]:
    """What ``make`` makes of ``scene``, and the scene: where no probe of it stands in the open, one with a volume fitted in its
    place, which is told in ``findings``. Raises as ``make`` does."""
    try:
        return scene, make(scene)
    except NoUsableProbe as refused:
        # A volume as Blender adds it, in the cube of its startup scene: nothing has been measured yet.
        fitted = fitted_in_place(scene, refused)
        if fitted is None:
            raise
        scene, told = fitted
        findings.append(told)
        return scene, make(scene)


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


def linked_lamps(scene: Scene, held: frozenset[str] | None) -> tuple[Omission, ...]:
    """What a probe cannot tell: to whom it gives the direct light of the lamps ``held``."""
    held = [light for light in scene.lights if light.linking is not None and light.linking.receivers is not None
            and light.bake != NOT_AT_ALL and light not in lamps_to_add((light,), held)]
    return tuple(Omission(f"lamp {light.name} lights linked objects alone, and probes give its direct light to all",
                          objects=(light.name,)) for light in held)
