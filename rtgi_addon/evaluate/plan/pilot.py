"""The pilot: the error of any lattice at a sample of receivers, for the price of the probes that these read.

What a bake of the whole lattice would say at a receiver depends on eight probes. So lattices of every spacing are measured as they
are, none is extrapolated, and each costs about as many rays as the sample is large.
"""

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from functools import cache
from time import perf_counter

import numpy as np

from ...progress import Progress
from ...scene import ProbeVolume
from ...techniques.probes.adaptive import FIRST_ROUND, SAMPLING_SHARE, SLOPE, ErrorModel, ladder
from ...techniques.probes.bake import surface_cache
from ...techniques.probes.gather import GROUP
from ...techniques.probes.placement import place_points
from ...techniques.probes.reconstruction import dering
from ...techniques.probes.settings import ProbeSettings
from ...transport.context import LightContext
from ...transport.ray_counter import count_rays
from ..metrics import Figure
from ..receivers import Receivers
from ..references import Truth
from .gathering import HALVES, PROBE_RAYS, ProbeLight, light_at_probes, light_at_receivers
from .sample import NORMALS_PER_POINT, Sample
from .sparse import SparseField, SparseLookup, positions_of, probes_read

# The bake's target error at which the pilot's surface cache is made: as coarse as any that is planned.
PILOT_ERROR = 0.1
# Rays of a receiver where 5 % are asked for, and the least and the most.
RECEIVER_RAYS, RECEIVER_RANGE = 256, (128, 4096)
# Shares of the surface points on which a lattice is measured: more only where fewer leave open whether it will do.
LEVELS = (1.0 / 16.0, 0.25, 1.0)
FEWEST_POINTS = 64
# What the cache itself is off at surfaces, as a share of the bake's target error: both sides of the pilot's comparison share a
# cache, so this is not seen in it. Measured against the path tracer on the samples: a tenth to a sixth.
CACHE_SHARE = 0.15


@dataclass(frozen=True)
class Effort:
    """Rays and wall-clock seconds of one part of the pilot."""

    rays: int
    seconds: float


@dataclass(frozen=True, eq=False)
class Reading:
    """What one set of lattices is worth. ``volumes`` have the resolutions that were measured; ``probes`` how many were baked.

    ``estimate(order)`` is the irradiance (n, 3) at the first n receivers of the pilot's; ``variance`` (n, 3) is that of
    PROBE_RAYS rays a probe; ``model`` knows the noise of each of the m probes, and ``mixed`` (n, m) their shares in the receivers.
    """

    volumes: tuple[ProbeVolume, ...]
    probes: int
    estimate: Callable[[int], np.ndarray]
    variance: np.ndarray
    pilot: "Pilot"
    model: ErrorModel
    mixed: np.ndarray
    effort: Effort
    _known: dict = field(default_factory=dict, repr=False)

    @property
    def resolutions(self) -> tuple[tuple[int, int, int], ...]:
        """(x, y, z) of each volume."""
        return tuple(tuple(volume.resolution) for volume in self.volumes)

    @property
    def lattice_points(self) -> int:
        """Probes of the whole lattices."""
        return int(sum(np.prod(resolution) for resolution in self.resolutions))

    def rays(self, error: float) -> np.ndarray:
        """Rays (m,) that a bake with the target ``error`` is expected to trace from each probe of the pilot."""
        if error not in self._known:
            self._known[error] = self._rays(error)
        return self._known[error]

    def _rays(self, error: float) -> np.ndarray:
        probes = np.flatnonzero(self.model.rays > 0)
        groups = np.unique(probes // GROUP, return_inverse=True)[1].reshape(-1)
        needed = self.model.rays_needed(probes, groups, error * SAMPLING_SHARE)
        return ladder(np.maximum(needed, FIRST_ROUND), ProbeSettings().max_rays)

    def error(self, order: int, error: float | None = None) -> Figure:
        """Relative RMSE at the receivers, and its standard error over surface points, of a bake with SH of ``order`` and the target
        ``error``; None: of the lattice alone, without noise."""
        if (order, error) not in self._known:
            self._known[order, error] = self._error(order, error)
        return self._known[order, error]

    def _error(self, order: int, error: float | None) -> Figure:
        estimate = self.estimate(order)
        forgiven, allowance = self.variance, 0.0
        if error is not None:
            probes = np.flatnonzero(self.model.rays > 0)
            ratio = np.zeros(len(self.model.rays))
            ratio[probes] = (PROBE_RAYS / self.rays(error)) ** (2 * SLOPE)
            forgiven = forgiven - self.variance * (self.mixed @ ratio)[:, None]
            allowance = CACHE_SHARE * error
        figure = self.pilot.sample.error(estimate, self.pilot.truth, forgiven)
        value = float(np.hypot(figure.value, allowance))
        return Figure(value, figure.standard_error * (figure.value / value if value > 0 else 1.0))


class Pilot:
    """Measures lattices in the volumes of ``context.scene`` at the receivers of ``sample``, finely enough for errors around
    ``target``. ``orders`` are the SH orders to tell apart. The same seed gives the same readings for any number of threads. Raises
    Cancelled."""

    def __init__(self, context: LightContext, volumes: tuple[ProbeVolume, ...], sample: Sample, orders: tuple[int, ...],
                 target: float, seed: int, progress: Progress):
        self.context, self.volumes, self.sample, self.orders, self._seed = context, volumes, sample, orders, seed
        self.settings = ProbeSettings(order=max(orders), error=PILOT_ERROR)
        self.cache = surface_cache(context, volumes, self.settings, seed)
        self.receiver_rays = int(np.clip(RECEIVER_RAYS * 2.0 ** round(2.0 * np.log2(0.05 / target)), *RECEIVER_RANGE))
        self._known: dict[tuple, Reading] = {}
        self.truth, self.truth_effort = Truth(*np.zeros((2, 0, 3))), Effort(0, 0.0)
        self._trace_truth(self.points(0), progress)

    @property
    def readings(self) -> tuple[Reading, ...]:
        """All that was measured so far."""
        return tuple(self._known.values())

    def points(self, level: int) -> int:
        """Surface points of a ``level`` of LEVELS."""
        return max(min(FEWEST_POINTS, self.sample.points), round(LEVELS[level] * self.sample.points))

    def measure(self, resolutions: tuple[tuple[int, int, int], ...], progress: Progress, level: int = -1) -> Reading:
        """The Reading of the volumes at ``resolutions`` on the surface points of ``level``; what was measured before is not
        measured again. Raises Cancelled."""
        resolutions = tuple(tuple(int(count) for count in resolution) for resolution in resolutions)
        points = self.points(level)
        self._trace_truth(points, progress.span(0.0, 0.2))
        key = resolutions, points
        if key not in self._known:
            volumes = tuple(replace(volume, resolution=own) for volume, own in zip(self.volumes, resolutions, strict=True))
            self._known[key] = self._measured(volumes, self.sample.receivers.take(slice(0, points * NORMALS_PER_POINT)), progress)
        return self._known[key]

    def _trace_truth(self, points: int, progress: Progress) -> None:
        """Have the irradiance at the receivers of the first ``points`` points."""
        done, wanted = len(self.truth.mean), points * NORMALS_PER_POINT
        if done >= wanted:
            return
        with count_rays() as counter:
            started = perf_counter()
            more = light_at_receivers(self.context, self.cache, self.settings, self.sample.receivers.take(slice(done, wanted)),
                                      self.receiver_rays, self._seed + 1 + done, progress)
            effort = Effort(self.truth_effort.rays + counter.rays, self.truth_effort.seconds + perf_counter() - started)
        self.truth, self.truth_effort = Truth(*(np.concatenate(parts) for parts in zip(self.truth, more, strict=True))), effort

    def _measured(self, volumes: tuple[ProbeVolume, ...], receivers: Receivers, progress: Progress) -> Reading:
        points = receivers.points
        with count_rays() as counter:
            started = perf_counter()
            rows = [probes_read(volume, points) for volume in volumes]
            owner = np.repeat(np.arange(len(volumes)), [len(part) for part in rows])
            lattice = np.concatenate([positions_of(volume, part) for volume, part in zip(volumes, rows, strict=True)])
            placement = place_points(self.context, volumes, lattice, owner, self.settings.virtual_offset, progress.span(0.0, 0.2))
            light = light_at_probes(self.context, self.cache, self.settings, placement, self._seed, progress.span(0.2, 0.9))
            effort = Effort(counter.rays, perf_counter() - started)
        found = SparseField([SparseLookup(volume, part, (lattice + placement.offset)[owner == number],
                                          placement.measured[owner == number], light.visibility[owner == number],
                                          light.sh[owner == number])
                             for number, (volume, part) in enumerate(zip(volumes, rows, strict=True))])
        return self._reading(volumes, receivers, found, light, placement, owner, effort)

    def _reading(self, volumes, receivers, field, light: ProbeLight, placement, owner, effort) -> Reading:
        def under(sh):
            parts = {id(volume): sh[owner == number] for number, volume in enumerate(volumes)}
            return field.holding(lambda lookup: parts[id(lookup.volume)]).irradiance(receivers.points, receivers.normals)

        @cache
        def estimate(order):
            return under(dering(light.sh[:, :(order + 1) ** 2]))

        # Without deringing, which would cut off some of the noise and is slow.
        halves = [under((part / light.rays).astype(np.float32)) for part in (light.first, light.second)]
        model = ErrorModel(len(owner), light.first.shape[1])
        probes = np.flatnonzero(placement.measured)
        for part in (light.first, light.second):
            model.add(probes, part[probes], np.full(len(probes), light.rays))
        return Reading(volumes, len(probes), estimate, HALVES * (halves[0] - halves[1]) ** 2, self, model,
                       _mixed(volumes, receivers, field, owner), effort)


def _mixed(volumes, receivers: Receivers, field: SparseField, owner: np.ndarray) -> np.ndarray:
    """Share (n, m) of every probe in what each receiver reads."""
    share = field.shares(receivers.points)
    mixed = np.zeros((len(receivers.points), len(owner)), np.float32)
    starts = {id(volume): np.searchsorted(owner, number) for number, volume in enumerate(volumes)}
    receiver = np.repeat(np.arange(len(receivers.points)), 8)
    for column, lookup in enumerate(field.lookups):
        index, weight = lookup.weights(receivers.points, receivers.normals)
        np.add.at(mixed, (receiver, starts[id(lookup.volume)] + index.ravel()), (weight * share[:, column, None]).ravel())
    return mixed
