"""The suite on a user's own scene: what must not matter there (where the lattice lies, how it is turned, which random numbers are
drawn, the scene's size, a lamp's creeping), and what a bake gets wrong against path tracing (leaks, energy).

The scene stays as it is; its volumes and lamps are moved. Failures as in docs/physics.md §3.
"""

from collections.abc import Callable
from dataclasses import replace
from functools import cached_property

import numpy as np

from ...numerics import grid as lattice
from ...progress import Progress
from ...scene import ProbeVolume, Scene
from ...techniques import Field, get, names
from ...techniques.lattice.focus import probes_of
from ...transport.context import LightContext
from ...transport.lights.kinds import kind_of
from ..leaks import find_leaks
from ..measure import scaled_resolution
from ..receivers import Receivers, open_probes, surface_receivers
from ..references import PathReference, Truth
from .case import Bench, Case, Sample
from .motion import CREEP, FRAMES, TEXELS, flicker
from .parts import brightness, moved, rms_change, rotation

# Receivers, and the relative noise of the reference at them.
POINTS, NOISE = 256, 0.02
LEAK_POINTS = 1000
SEEDS = 3
# Angles by which the lattice is turned [degrees].
ANGLES = (15.0, 45.0)
# Shifts of the lattice, in cells along x, y and z.
PHASES = ((0.5, 0.0, 0.0), (0.0, 0.5, 0.0), (0.0, 0.0, 0.5), (0.25, 0.25, 0.25))
SIZES = (1e-3, 1e3)
# How far a case is when its field is baked and is to be held to path tracing.
_BAKED = 0.5
OWN_NAMES = ("phase", "rotation", "refinement", "seeds", "size", "lamp-motion", "leaks", "energy")


class OwnScene:
    """A user's ``scene`` with receivers on its surfaces, and references made when they are first asked for."""

    def __init__(self, scene: Scene, threads: int | None = None, points: int = POINTS, seed: int = 0):
        self.scene, self.threads, self._points, self._seed = scene, threads, points, seed
        self._truths: dict[frozenset[str], Truth] = {}

    @cached_property
    def context(self) -> LightContext:
        """The scene made ready for rays."""
        return LightContext(self.scene, self.threads)

    @cached_property
    def receivers(self) -> Receivers:
        """Points of surfaces around the volumes, under their own normals."""
        volumes = self.scene.volumes
        return surface_receivers(self.context, probes_of(volumes)[open_probes(self.context, volumes)], self._points, 1, self._seed)

    @cached_property
    def extent(self) -> float:
        """Diagonal [m] of the box around all volumes."""
        box = np.concatenate([lattice.box_corners(volume.world_from_local) for volume in self.scene.volumes])
        return float(np.linalg.norm(np.ptp(box, axis=0)))

    def inside(self, volumes: tuple[ProbeVolume, ...]) -> np.ndarray:
        """(n,) bool: receivers inside one of ``volumes`` and one of the scene's own."""
        inside = np.ones(len(self.receivers.points), bool)
        for group in (self.scene.volumes, volumes):
            local = [lattice.local_from_world(volume.world_from_local, self.receivers.points) for volume in group]
            inside &= np.any([np.abs(points).max(axis=1) <= 1.0 for points in local], axis=0)
        return inside

    def truth(self, technique: str, progress: Progress) -> Truth:
        """Irradiance at the receivers of the light that ``technique`` knows, by the path tracer."""
        knows = get(technique).knows
        if knows not in self._truths:
            reference = PathReference(self.context, NOISE, seed=self._seed + 1)
            self._truths[knows] = reference.irradiance(self.receivers, progress, knows)
        return self._truths[knows]

    def brightness(self, field: Field, rows=slice(None)) -> np.ndarray:
        """Mean irradiance of the channels at the receivers ``rows``."""
        return brightness(field, self.receivers.points[rows], self.receivers.normals[rows])


def own_cases(scene: Scene, threads: int | None = None, points: int = POINTS, seed: int = 0) -> dict[str, Case]:
    """The cases of ``scene`` (which has volumes) by name; without lamps there is none in which a lamp moves."""
    own = OwnScene(scene, threads, points, seed)
    return {name: case for name, case in _cases(own).items() if scene.lights or name != "lamp-motion"}


def _moved_volumes(own: OwnScene, bench: Bench, steps: list[tuple[str, tuple[ProbeVolume, ...]]]) -> list[Sample]:
    """The change of irradiance, at receivers in both, when the volumes are replaced."""
    before = bench.bake(own.scene, **_settings(bench))
    samples = []
    for name, volumes in steps:
        rows = own.inside(volumes)
        if not rows.any():
            continue
        changed = replace(own.scene, volumes=volumes)
        field = bench.bake(changed, **_settings(bench))
        samples.append(Sample(name, rms_change(own.brightness(field, rows), own.brightness(before, rows)), changed, field))
    return samples or [Sample("nothing was measured: no receiver stays inside", float("nan"))]


def _phase(own: OwnScene) -> Callable[[Bench], list[Sample]]:
    def shifted(volume: ProbeVolume, cells) -> ProbeVolume:
        shift = np.eye(4)
        shift[:3, 3] = np.asarray(cells) @ lattice.cell_axes(volume.world_from_local, volume.resolution)
        return replace(volume, world_from_local=shift @ volume.world_from_local)

    return lambda bench: _moved_volumes(own, bench, [
        (f"{', '.join(f'{cell:g}' for cell in cells)} cells", tuple(shifted(volume, cells) for volume in own.scene.volumes))
        for cells in PHASES])


def _rotation(own: OwnScene) -> Callable[[Bench], list[Sample]]:
    def turned(volume: ProbeVolume, degrees: float) -> ProbeVolume:
        turn = rotation((0, 0, 1), degrees)
        turn[:3, 3] = volume.world_from_local[:3, 3] - turn[:3, :3] @ volume.world_from_local[:3, 3]
        return replace(volume, world_from_local=turn @ volume.world_from_local)

    return lambda bench: _moved_volumes(own, bench, [
        (f"{degrees:g} degrees", tuple(turned(volume, degrees) for volume in own.scene.volumes)) for degrees in ANGLES])


def _refinement(own: OwnScene, bench: Bench) -> list[Sample]:
    """The change of irradiance when the technique works twice as finely."""
    field = bench.bake(own.scene, **_settings(bench))
    finer, settings = own.scene, {}
    if bench.technique == "probes":
        finer = replace(finer, volumes=tuple(replace(volume, resolution=scaled_resolution(volume.resolution, 2.0))
                                             for volume in finer.volumes))
    else:
        settings = _doubled(bench)
    again = bench.bake(finer, **{**_settings(bench), **settings})
    return [Sample("twice as fine", rms_change(own.brightness(field), own.brightness(again)), own.scene, field)]


def _seeds(own: OwnScene, bench: Bench) -> list[Sample]:
    """The spread of irradiance over seeds."""
    fields = [replace(bench, seed=bench.seed + number).bake(own.scene, **_settings(bench)) for number in range(SEEDS)]
    seen = np.array([own.brightness(field) for field in fields])
    spread = float(np.sqrt(seen.var(axis=0, ddof=1).mean()) / seen.mean())
    return [Sample(f"{SEEDS} seeds", spread if np.isfinite(spread) else np.inf, own.scene, fields[0])]


def _size(own: OwnScene, bench: Bench) -> list[Sample]:
    """The change of irradiance when the whole scene with its lattices and light grows or shrinks."""
    expected, samples = own.brightness(bench.bake(own.scene, **_settings(bench))), []
    for scale in SIZES:
        grown = moved(own.scene, np.diag([scale, scale, scale, 1.0]), intensity=scale * scale)
        field = bench.bake(grown, **_settings(bench))
        seen = brightness(field, own.receivers.points * np.float32(scale), own.receivers.normals)
        samples.append(Sample(f"{scale:g} times as large", rms_change(seen, expected), grown, field))
    return samples


def _lamp_motion(own: OwnScene, bench: Bench) -> list[Sample]:
    """Flicker as all lamps creep by a tenth of a texel of a map of the volumes a frame, and suns turn as slowly."""
    field, frames = None, []
    for step in range(FRAMES):
        share = step * CREEP / TEXELS
        turn = rotation((0, 0, 1), np.degrees(share))[:3, :3]
        lights = []
        for light in own.scene.lights:
            if kind_of(light).is_distant:
                lights.append(replace(light, direction_world=(turn @ light.direction_world).astype(np.float32)))
            else:
                away = np.float32([share * own.extent, 0, 0])
                lights.append(replace(light, position_world=light.position_world + away))
        frame = replace(own.scene, lights=tuple(lights))
        field = bench.bake(frame, **_settings(bench)) if field is None else field.relight(frame)
        frames.append(own.brightness(field))
    return [Sample("all lamps", flicker(np.array(frames)), frame, field)]


def _leaks(own: OwnScene, bench: Bench) -> list[Sample]:
    """The share of receivers with light that should not be there."""
    field = bench.bake(own.scene, **_settings(bench))
    leaks = find_leaks(own.context, field, LEAK_POINTS, bench.seed, bench.progress.span(_BAKED, 1.0))
    counts = leaks.counts()
    most = next(iter(counts)).text if counts else "nowhere"
    return [Sample(most, sum(counts.values()) / max(len(leaks.cause), 1), own.scene, field)]


def _energy(own: OwnScene, bench: Bench) -> list[Sample]:
    """How far the light of all receivers together is from path tracing's."""
    field = bench.bake(own.scene, **_settings(bench))
    true = own.truth(bench.technique, bench.progress.span(_BAKED, 1.0)).mean.mean(axis=1)
    ratio = float(own.brightness(field).mean() / true.mean()) if true.mean() > 0 else np.inf
    return [Sample("too bright" if ratio > 1 else "too dark", abs(ratio - 1.0), own.scene, field)]


def _settings(bench: Bench) -> dict:
    return {"probes": {"error": 0.02}, "lpv": {"steps": 128}}.get(bench.technique, {})


def _doubled(bench: Bench) -> dict:
    defaults = get(bench.technique).Settings()
    return {name: 2 * getattr(defaults, name) for name in
            {"vpl": ("lights",), "rsm": ("resolution", "samples"), "lpv": ("resolution", "steps"),
             "cone_tracing": ("resolution",), "voxel_march": ("resolution", "rays")}[bench.technique]}


_FINER_LATTICE = "raise the volume's resolution, or lay its layers half a cell off walls and floors"
_FINER_CELLS = "raise its resolution"
_LIGHTS = "raise the number of virtual lights"
_SAMPLES = "raise its samples"
_WALLS = "make the wall thicker than half a cell, give both rooms volumes of their own, or raise the resolution"


def _cases(own: OwnScene) -> dict[str, Case]:
    scene, file = f"the scene {own.scene.name}", own.scene.source or f"{own.scene.name}.blend"
    on_lattices = {"probes": _FINER_LATTICE, **dict.fromkeys(("lpv", "cone_tracing", "voxel_march"), _FINER_CELLS)}
    everywhere = {"probes": "lower its target error", "vpl": _LIGHTS, "rsm": _SAMPLES,
                  **dict.fromkeys(("lpv", "cone_tracing", "voxel_march"), _FINER_CELLS)}

    def case(name, failure, metric, sweep, goal, measure, remedies) -> Case:
        return Case(name, failure, scene, metric, sweep, goal, measure, file=file,
                    remedies={technique: remedy for technique, remedy in remedies.items() if technique in names()})

    change = "RMS change of irradiance at points of the surfaces, over its mean"
    cases = (
        case("phase", "light that depends on where the lattice happens to lie", change, "the lattice's shift", 0.05, _phase(own),
             on_lattices),
        case("rotation", "light that depends on how the lattice is turned", change, "the angle", 0.05, _rotation(own), on_lattices),
        case("refinement", "too coarse to have converged", change, "twice the lattice, virtual lights or texels", 0.05,
             lambda bench: _refinement(own, bench), {**everywhere, **on_lattices}),
        case("seeds", "noise", "standard deviation of irradiance over seeds, over its mean", "the seed", 0.02,
             lambda bench: _seeds(own, bench), everywhere),
        case("size", "results that depend on the scene's size", change, "the scale", 0.02, lambda bench: _size(own, bench),
             {**everywhere, "probes": "report it: nothing in your scene should cause this"}),
        case("lamp-motion", "light flickers as lamps creep", "RMS over eight frames of what is left after a straight line in time, "
             "over the mean", "the lamps", 0.005, lambda bench: _lamp_motion(own, bench), everywhere),
        case("leaks", "light where none should be", "share of points of the surfaces that leak (the worst cause is named)", "none",
             0.01, lambda bench: _leaks(own, bench),
             {"probes": _WALLS, "vpl": _LIGHTS, "rsm": "trace shadow rays: --set visibility=true", "lpv": _WALLS,
              "cone_tracing": _WALLS, "voxel_march": _WALLS}),
        case("energy", "more or less light than there is", "deviation of the mean irradiance from path tracing of the light that "
             "the technique knows", "none", 0.05, lambda bench: _energy(own, bench), everywhere),
    )
    return {known.name: known for known in cases}
