"""Scattered placement before a bake: the scene with its probes scattered."""

from dataclasses import fields, replace

from ..errors import UsageError
from ..progress import Progress
from ..scene import Scene
from ..techniques import Technique, volumes_by_settings
from ..techniques.probes.bake import Begun
from ..techniques.probes.settings import ProbeSettings
from ..techniques.scattered.scatter import scatter
from ..techniques.scattered.settings import ScatterSettings

# What of a technique's settings the bake that places its probes goes by, where it has them.
_SHARED = ("order", "error", "bounces", "direct", "texel_size", "cache_rays", "visibility_resolution")


def require_scatterable(scene: Scene, settings) -> None:
    """Raises UsageError if volumes of ``scene`` are to be fitted, baked with ``settings`` or their own."""
    if any(getattr(of_group, "fit", False) for of_group, _ in volumes_by_settings(scene.volumes, settings)):
        raise UsageError("scattered probes are not fitted to surfaces",
                         "leave out --fit (Fit to Surfaces), or --placement scattered")


def scattered_scene(scene: Scene, method: Technique, settings, chosen: ScatterSettings, seed: int, threads: int | None,
                    progress: Progress) -> tuple[Scene, Begun | None]:
    """``scene`` with its probes scattered for a bake by ``method`` with ``settings``, with notes on it, and what of a bake of
    probes has begun. Raises BakeError, UsageError, Cancelled."""
    require_scatterable(scene, settings)
    progress.stage("scatter")
    shared = {item.name: getattr(settings, item.name) for item in fields(settings) if item.name in _SHARED}
    found = scatter(scene, chosen, ProbeSettings(**shared), seed, threads, progress, any_light=method.transfers)
    return replace(found.scene, notes=(*scene.notes, *found.notes)), found.begun
