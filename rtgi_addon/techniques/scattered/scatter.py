"""A scene whose volumes' probes are scattered: where they stand, by the light of a short bake."""

from dataclasses import dataclass, replace

import numpy as np

from ...errors import BakeError, UsageError
from ...progress import Progress
from ...scene import ProbeVolume, Scattered, Scene, World
from ...scene.capture import captured_light
from ...scene.scattered import MOST_PROBES, SLOTS, packed
from ...transport.context import LightContext
from ..base import Checkpoint
from ..probes.bake import Begun, ProbeBake
from ..probes.captured import capturing, lamp_light_of
from ..probes.settings import ProbeSettings
from .floors import candidates, clear, inside, spacing
from .index import scattered_at
from .settings import ScatterSettings
from .thinning import thinned

_PLACED, _LIT, _THINNED = 0.1, 0.7, 0.85


@dataclass(frozen=True, eq=False)
class Scatterings:
    """The ``scene`` with scattered volumes, ``notes`` for the user on each, and what of a bake of probes has ``begun`` (None:
    nothing that serves another)."""

    scene: Scene
    notes: tuple[str, ...]
    begun: Begun | None


def scatter(scene: Scene, settings: ScatterSettings, of_probes: ProbeSettings, seed: int, threads: int | None,
            progress: Progress, any_light: bool = False) -> Scatterings:
    """Scatter the probes of all volumes of ``scene``, whose light a bake with ``of_probes`` finds; with ``any_light`` they also
    serve a sky that is the same everywhere, for bakes that will be lit anew. Raises BakeError where no probe has a place,
    Cancelled."""
    context = LightContext(scene, threads)
    volumes, notes, begun, wanted = [], [], None, wanted_points(scene, settings)
    for number, volume in enumerate(scene.volumes):
        span = progress.span(number / len(scene.volumes), (number + 1) / len(scene.volumes))
        places, kept, told = _places(context, volume, wanted, settings.adds, span.span(0.0, _PLACED))
        points = places
        if settings.adds:
            light, begun = _light(context, volume, places, settings, of_probes, seed, span.span(_PLACED, _LIT), any_light)
            points = places[thinned(context, places, kept, light, max(spacing(volume)), settings.error, span.span(_LIT, _THINNED))]
        if len(points) > MOST_PROBES:
            raise BakeError(f"volume {volume.name} takes {len(points):,} scattered probes, and words name {MOST_PROBES:,}",
                            "lower its resolution or raise the thinning (--set scatter.error=0.1)")
        volumes.append(replace(volume, resolution=packed(len(points)), wanted=None, near=None,
                               scattered=scattered_at(context, volume, points, span.span(_THINNED, 1.0))))
        nx, ny, nz = volume.resolution
        notes += [f"volume {volume.name}: {len(points):,} scattered probes of {len(places):,} places, where its lattice has "
                  f"{nx * ny * nz:,}", *told]
    return Scatterings(replace(scene, volumes=tuple(volumes)), tuple(notes), begun if len(volumes) == 1 else None)


def wanted_points(scene: Scene, settings: ScatterSettings) -> np.ndarray:
    """Places (n, 3) float64 that ``settings`` name. Raises UsageError for a collection without Empties."""
    if not settings.points:
        return np.zeros((0, 3))
    if settings.points not in scene.probe_points:
        known = ", ".join(scene.probe_points) or "(none has)"
        raise UsageError(f"collection {settings.points!r} has no Empties for probes", f"choose one of {known}")
    return np.asarray(scene.probe_points[settings.points], np.float64)


def _places(context: LightContext, volume: ProbeVolume, wanted: np.ndarray, adds: bool,
            progress: Progress) -> tuple[np.ndarray, np.ndarray, list[str]]:
    """Places (n, 3) for probes of ``volume``, which of them (n,) are to be kept, those that are ``wanted`` (m, 3), and what to say
    of those that are not there; there are others if it ``adds`` some."""
    wanted = wanted[inside(volume, wanted)]
    own = clear(context, volume, wanted, progress)
    told = [f"volume {volume.name}: {len(wanted) - len(own)} of the places for probes lie inside geometry"] \
        if len(own) < len(wanted) else []
    places = np.concatenate([own, candidates(context, volume, progress)]) if adds else own
    if not len(places):
        raise BakeError(f"volume {volume.name} has no place for scattered probes: no floor lies below it, or all of it is inside "
                        "geometry", "bake it on a lattice (--placement lattice), or put Empties of a collection of probes into it")
    return places, np.arange(len(places)) < len(own), told


def _light(context: LightContext, volume: ProbeVolume, places: np.ndarray, settings: ScatterSettings, of_probes: ProbeSettings,
           seed: int, progress: Progress, any_light: bool) -> tuple[list[tuple[np.ndarray, np.ndarray]], Begun]:
    """Coefficients and standard errors at ``places`` (n, 3) under each light that counts, and the bake that found the first."""
    nz, ny, nx = reversed(volume.nodes)
    # Only how finely it is looked up counts here; nothing reads these probes.
    far = np.full(len(places), 2.0 * np.linalg.norm(np.asarray(volume.world_from_local)[:3, :3]), np.float32)
    nowhere = Scattered(np.zeros((nz, ny, nx, SLOTS), np.int32), places, far)
    whole = replace(volume, resolution=packed(len(places)), wanted=None, near=None, scattered=nowhere)
    short = replace(of_probes, rays=None, max_rays=max(256, settings.rays), fit=False)
    scenes = [context.scene]
    if any_light:
        scenes.append(replace(context.scene, world=World.constant(1.0), lights=()))
    found, begun = [], None
    for number, scene in enumerate(scenes):
        lit = context if scene is context.scene else LightContext(scene, context.threads, same_surfaces=context)
        bake = ProbeBake(capturing(lit, captured_light(scene, volume)), (whole,), short, seed,
                         progress.span(number / len(scenes), (number + 1) / len(scenes)), Checkpoint(), "scatter",
                         lamp_light_of(lit, volume, short, seed))
        bake.run()
        coefficients, error = bake.measured()
        found.append((coefficients[:len(places)].astype(np.float64), error[:len(places)].astype(np.float64)))
        begun = begun or Begun(lit, bake.cache, short.target)
    return found, begun
