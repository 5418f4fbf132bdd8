"""One technique at one setting on one scene: what it costs and how far off it is.

``Yard`` holds what all measurements of a scene share: ray tracer, receivers, probes and references. ``Yard.measure`` bakes and
compares. A planner that wants other receivers makes another yard, or passes ``receivers`` with another seed.

Each bake is held to the reference in several places, which separates the causes of error:

- ``surface``: the technique's own field at all receivers: on surfaces under their normals, and just above under tilted ones;
- ``own_normals``: of these only the receivers under the surface's own normal;
- ``shipped``: the same receivers lit by the probes that the bundle holds, as an engine would be;
- ``probes``: the SH of usable probes, where nothing is interpolated;
- ``known``: ``surface`` against only that light which the technique knows (``Technique.knows``);
- ``atlas``: of ``own_normals`` those on surfaces that are in the light atlas, where there is one (`atlas.py`).
"""

from dataclasses import dataclass, field, replace
from time import perf_counter
from typing import Protocol

import numpy as np

from ..errors import BakeError
from ..numerics import sh
from ..progress import Progress
from ..scene import Scene
from ..techniques import Field, Technique
from ..techniques.base import KNOWN_LIGHT
from ..techniques.lattice.field import ProbeField
from ..techniques.lattice.focus import probes_of, spacing_of
from ..techniques.lattice.placement import place
from ..transport.context import LightContext
from .atlas import ATLAS_SWEEP, AtlasSweep, bake_and_read, on_atlas
from .costs import Costs, metered
from .metrics import energy_ratio, leak_ratio, relative_rmse, relmse
from .receivers import Receivers, open_probes, surface_receivers
from .references import PathReference, Reference, Truth

# Receivers with less than this share of the mean irradiance count as dark: what they get too much is leaked.
DARK = 0.01
# Receivers under other normals than the surface's stand this share of a lattice cell above it.
LIFT = 0.2
# Bands that probes are compared in, the most that any engine stores.
PROBE_ORDER = 2
# How far a measurement is when the field is baked.
_BAKED = 0.9
# Tells the choice of probes apart from all other numbers of a seed: the letters pr.
_STREAM = 0x7072
PLACES = ("surface", "own_normals", "shipped", "probes", "known", "atlas")


@dataclass(frozen=True)
class Errors:
    """How far an estimate is off in one place, the reference's variance taken out (metrics.py).

    ``error`` relative RMSE; ``relmse`` mean((x − r)²/(r² + ε)), ε a hundredth of the mean square of r, with the reference's noise
    in it; ``bias`` signed, Σ(x − r)/Σr; ``energy`` Σx/Σr; ``leak`` mean irradiance of dark receivers relative to the others, and
    ``true_leak`` the reference's own (None: no receiver is dark); ``minimum`` the least irradiance or mean radiance, relative to
    the reference's mean.
    """

    error: float
    relmse: float
    bias: float
    energy: float
    leak: float | None
    true_leak: float | None
    minimum: float


@dataclass(frozen=True, eq=False)
class Run:
    """One bake: ``costs`` of everything `rtgi bake` does but writing, ``lookup_seconds`` for one receiver of the technique's own
    field (wall clock), ``field_bytes`` of what the field keeps, ``errors`` by place and ``estimates``, the arrays behind them;
    ``lattice`` is the factor of the volumes' resolution; ``baked`` is the field itself, ``stored`` its forms as plain values
    (Field.stored_forms), where they were asked for."""

    technique: str
    settings: object
    seed: int
    costs: Costs
    lookup_seconds: float
    field_bytes: int
    errors: dict[str, Errors]
    estimates: dict[str, np.ndarray] = field(repr=False)
    baked: Field | None = field(repr=False, default=None)
    lattice: float = 1.0
    stored: tuple[dict, ...] = ()


class Keep(Protocol):
    """Where what was measured outlives the run (storage/parts.py)."""

    def save(self, name: str, arrays: dict[str, np.ndarray], document: dict | None = None) -> None:
        """Store arrays and a JSON-able document under ``name``."""

    def load(self, name: str) -> tuple[dict[str, np.ndarray], dict] | None:
        """What was stored under ``name``, or None."""


class Yard:
    """A scene made ready to measure on. ``scene``'s volumes lose their own settings: what is measured is what is said.

    ``receivers`` are made at the scene's usable probes unless given; ``reference`` is the path tracer unless given. References are
    traced when they are first needed; those that ``keep`` has from an earlier run are taken from there, and others given to it.
    """

    def __init__(self, scene: Scene, *, points: int = 128, normals_per_point: int = 4, probes: int = 64, noise: float = 0.01,
                 seed: int = 0, threads: int | None = None, receivers: Receivers | None = None,
                 reference: Reference | None = None, keep: Keep | None = None):
        """Raises BakeError if no probe is usable or nothing can be seen from any."""
        self.scene = replace(scene, volumes=tuple(replace(volume, settings={}) for volume in scene.volumes))
        self.threads = threads
        if not scene.volumes:
            raise BakeError("the scene has no probe volume", "add a Light Probe Volume")
        self.context = LightContext(self.scene, threads)
        self.usable = open_probes(self.context, self.scene.volumes)
        if not len(self.usable):
            raise BakeError("no probe lies in the open", "move the Light Probe Volume out of geometry")
        lattice = probes_of(self.scene.volumes)
        self.receivers = receivers if receivers is not None else surface_receivers(
            self.context, lattice[self.usable], points, normals_per_point, seed, LIFT * spacing_of(self.scene.volumes))
        if not len(self.receivers.points):
            raise BakeError("no surface can be seen from any probe", "move the Light Probe Volume to the geometry")
        # A bake moves probes off a wall that they lie on: what they hold is no answer for their lattice point.
        unmoved = self.usable[~place(self.context, self.scene.volumes, True, Progress()).offset[self.usable].any(axis=1)]
        comparable = unmoved if len(unmoved) else self.usable
        chosen = np.random.default_rng([seed, _STREAM]).permutation(len(comparable))[:probes]
        self.probe_rows = np.sort(comparable[chosen])
        self.probe_points = lattice[self.probe_rows].astype(np.float32)
        self.path_reference = PathReference(self.context, noise)
        self.reference = reference or self.path_reference
        self.on_atlas = on_atlas(self.context, self.receivers)
        self._truths: dict[object, Truth] = {}
        self._keep = keep

    def prepare(self, known: list[frozenset[str]], progress: Progress) -> None:
        """Trace the references now: of all light, and of each set of light sources in ``known``."""
        wanted = [KNOWN_LIGHT, "probes", *dict.fromkeys(light for light in known if light != KNOWN_LIGHT)]
        for number, what in enumerate(wanted):
            self._truth(what, progress.span(number / len(wanted), (number + 1) / len(wanted)))

    @property
    def floor(self) -> float:
        """The least error that this yard can tell from none: with the reference's variance subtracted, what is left of it is the
        fourth root of 2 over the number of independent values of its noise (of a sum of so many squared normals)."""
        return self.truth.noise * (2.0 / len(self.receivers.points)) ** 0.25

    @property
    def truth(self) -> Truth:
        """Irradiance (n, 3) at the receivers."""
        return self._truth(KNOWN_LIGHT)

    @property
    def probe_truth(self) -> Truth:
        """SH (p, 9, 3) at the probes."""
        return self._truth("probes")

    @property
    def dark(self) -> np.ndarray:
        """(n,) bool: receivers that get next to no light."""
        brightness = self.truth.mean.sum(axis=1)
        return brightness < DARK * brightness.mean()

    def measure(self, technique: Technique | AtlasSweep, settings, seed: int, progress: Progress | None = None, *,
                lattice: float = 1.0, **options) -> Run:
        """Bake with ``technique`` and compare. ``lattice`` multiplies the volumes' resolution; there are no errors at ``probes``
        where that is not 1, since others are baked. ``options`` go to the technique's ``bake``. Raises BakeError, Cancelled."""
        progress = progress or Progress()
        if technique is ATLAS_SWEEP:
            return self._measured_atlas(settings, seed, progress)
        scene = self.scene if lattice == 1.0 else replace(self.scene, volumes=tuple(
            replace(volume, resolution=scaled_resolution(volume.resolution, lattice)) for volume in self.scene.volumes))
        with metered() as costs:
            baked = technique.bake(scene, settings, np.random.default_rng(seed), progress.span(0.0, _BAKED),
                                   threads=self.threads, **options)
            grids = baked.grids()
        progress.step(_BAKED, "looking up receivers")
        started = perf_counter()
        surface = baked.irradiance(self.receivers.points, self.receivers.normals)
        lookup = (perf_counter() - started) / len(surface)
        probes = ProbeField.of(baked)
        estimates = {"surface": surface, "own_normals": surface[self.receivers.own],
                     "shipped": probes.irradiance(self.receivers.points, self.receivers.normals)}
        if self.on_atlas is not None:
            estimates["atlas"] = surface[self.on_atlas.rows]
        if lattice == 1.0:
            estimates["probes"] = np.concatenate([grid.sh.reshape(-1, *grid.sh.shape[3:]) for grid in grids])[self.probe_rows]
        if technique.knows != KNOWN_LIGHT:
            estimates["known"] = surface
        run = Run(technique.name, settings, seed, costs, lookup, sum(array.nbytes for array in baked.arrays().values()), {},
                  estimates, baked, lattice)
        return self.compared(run, technique)

    def _measured_atlas(self, settings, seed: int, progress: Progress) -> Run:
        costs, lookup, held, light = bake_and_read(self.scene, self.context, self.receivers, self.on_atlas, settings, seed,
                                                   self.threads, progress)
        return self.compared(Run(ATLAS_SWEEP.name, settings, seed, costs, lookup, held, {}, {"atlas": light}), ATLAS_SWEEP)

    def compared(self, run: Run, technique: Technique | AtlasSweep) -> Run:
        """``run`` of ``technique`` with its errors, from its estimates."""
        return replace(run, errors={place: self._errors(place, estimate, technique) for place, estimate in run.estimates.items()})

    def truth_for(self, place: str, estimate: np.ndarray, technique: Technique | AtlasSweep) -> Truth:
        """The reference that ``estimate`` in ``place`` (of PLACES) is held to, of its shape."""
        if place == "probes":
            count = min(estimate.shape[1], sh.coefficient_count(PROBE_ORDER))
            return Truth(*(values[:, :count] for values in self.probe_truth))
        if place == "known":
            return self._truth(technique.knows)
        return Truth(*(self._at(place, values) for values in self.truth))

    def _at(self, place: str, values: np.ndarray) -> np.ndarray:
        """Those of ``values`` (n, …) at all receivers that belong to ``place``."""
        if place == "atlas":
            return values[self.on_atlas.rows]
        return values[self.receivers.own] if place == "own_normals" else values

    def _errors(self, place: str, estimate: np.ndarray, technique: Technique) -> Errors:
        truth = self.truth_for(place, estimate, technique)
        leak = true_leak = None
        if place == "probes":
            estimate = estimate[:, :truth.mean.shape[1]]
            level = truth.mean[:, 0]
            least = estimate[:, 0]
        else:
            level, least = truth.mean, estimate
            dark = self._at(place, self.dark)
            if dark.any() and not dark.all():
                leak, true_leak = leak_ratio(estimate, dark, ~dark), leak_ratio(truth.mean, dark, ~dark)
        energy, mean = energy_ratio(estimate, truth.mean).value, float(np.mean(level))
        return Errors(relative_rmse(estimate, truth.mean, truth.variance), relmse(estimate, truth.mean), energy - 1.0, energy, leak,
                      true_leak, float(np.min(least)) / mean if mean > 0 else 0.0)

    def _truth(self, what, progress: Progress | None = None) -> Truth:
        if what not in self._truths:
            name = f"reference, {what if what == 'probes' else ', '.join(sorted(what))}"
            stored = None if self._keep is None else self._keep.load(name)
            if stored is None:
                truth = self._traced(what, progress or Progress())
                if self._keep is not None:
                    self._keep.save(name, truth._asdict())
            else:
                truth = Truth(**stored[0])
            self._truths[what] = truth
        return self._truths[what]

    def _traced(self, what, progress: Progress) -> Truth:
        if what == "probes":
            return self.reference.probes(self.probe_points, PROBE_ORDER, progress)
        if what == KNOWN_LIGHT:
            return self.reference.irradiance(self.receivers, progress)
        return self.path_reference.irradiance(self.receivers, progress, what)


def scaled_resolution(resolution: tuple[int, int, int], factor: float) -> tuple[int, int, int]:
    """A lattice's resolution times ``factor``, one probe along each axis at least."""
    return tuple(max(1, round(count * factor)) for count in resolution)
