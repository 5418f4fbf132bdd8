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
from ...techniques.base import seed_of
from ...techniques.lamp_light import LampLight
from ...techniques.lattice.placement import PILOT_RAYS, place_points
from ...techniques.probes import LAMP_SAMPLES
from ...techniques.probes.adaptive import FIRST_ROUND, SAMPLING_SHARE, SLOPE, ErrorModel
from ...techniques.probes.bake import Begun, surface_cache
from ...techniques.probes.distances import mean_distances
from ...techniques.probes.gather import GROUP
from ...techniques.probes.gathering import HALVES, light_at_receivers
from ...techniques.probes.settings import ProbeSettings
from ...techniques.probes.started import HALF_RAYS, PROBE_RAYS, Finished, StartedProbes, lattice_key, rounded_out, start_probes
from ...transport.context import LightContext
from ...transport.rays.ray_counter import count_rays
from ..metrics import Figure
from ..receivers import Receivers
from ..references import Truth
from .sample import NORMALS_PER_POINT, Sample
from .sparse import SparseField, SparseLookup, answered, positions_of, probes_read

# The bake's target error at which the pilot's surface cache is made: as coarse as any that is planned.
PILOT_ERROR = 0.1
# Rays of a receiver where USUAL_TARGET is asked for, and the least and the most: errors differ more between points than by noise.
RECEIVER_RAYS, RECEIVER_RANGE, USUAL_TARGET = 128, (128, 4096), 0.05
# Shares of the surface points on which a lattice is measured: more only where fewer leave open whether it will do, and where that
# is worth its rays.
LEVELS = (1.0 / 16.0, 0.125, 0.25, 0.5, 1.0)
FEWEST_POINTS = 128
# The share of the points that lattices are compared without where none meets the target.
WORST = 0.02
# Rays of one of the pilot's probes, its placement included.
RAYS_A_PROBE = PROBE_RAYS + 2 * PILOT_RAYS
# How far a measurement is when the truth is traced and the probes are placed, and when their light is gathered.
_PLACED, _GATHERED = 0.2, 0.9
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
    PROBE_RAYS rays a probe; ``model`` knows the noise of each of the m probes, and ``mixed`` gives a mean (n,) over the probes that
    each receiver reads, in their shares, of any number (m,) that they have.
    """

    volumes: tuple[ProbeVolume, ...]
    probes: int
    estimate: Callable[[int], np.ndarray]
    variance: np.ndarray
    pilot: "Pilot"
    model: ErrorModel
    mixed: Callable[[np.ndarray], np.ndarray]
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
        if "forecast" not in self._known:
            probes = np.flatnonzero(self.model.rays > 0)
            # Neighbours, if not those that share directions.
            groups = np.unique(probes // GROUP, return_inverse=True)[1].reshape(-1)
            self._known["forecast"] = self.model.forecast(probes, groups)
        return np.maximum(self._known["forecast"].rays_needed(error * SAMPLING_SHARE, ProbeSettings().max_rays), FIRST_ROUND)

    def error(self, order: int, error: float | None = None) -> Figure:
        """Relative RMSE at the receivers, and its standard error over surface points, of a bake with SH of ``order`` and the target
        ``error``; None: of the lattice alone, without noise."""
        if (order, error) not in self._known:
            self._known[order, error] = self._error(order, error)
        return self._known[order, error]

    def bulk(self, order: int, error: float) -> float:
        """``error`` without the worst points, of which one more or less may hold most of it."""
        key = "bulk", order, error
        if key not in self._known:
            forgiven, allowance = self._noise(error)
            figure = self.pilot.sample.error(self.estimate(order), self.pilot.truth, forgiven, trimmed=WORST)
            self._known[key] = float(np.hypot(figure.value, allowance))
        return self._known[key]

    def _error(self, order: int, error: float | None) -> Figure:
        forgiven, allowance = self._noise(error)
        figure = self.pilot.sample.error(self.estimate(order), self.pilot.truth, forgiven)
        value = float(np.hypot(figure.value, allowance))
        return Figure(value, figure.standard_error * (figure.value / value if value > 0 else 1.0))

    def _noise(self, error: float | None) -> tuple[np.ndarray, float]:
        """The pilot's variance (n, 3) that a bake to ``error`` does not have, and what its cache is off by: for any order."""
        key = "noise", error
        if key not in self._known:
            self._known[key] = self._forgiven(error)
        return self._known[key]

    def _forgiven(self, error: float | None) -> tuple[np.ndarray, float]:
        forgiven, allowance = self.variance, 0.0
        if error is not None:
            probes = np.flatnonzero(self.model.rays > 0)
            ratio = np.zeros(len(self.model.rays))
            ratio[probes] = (PROBE_RAYS / self.rays(error)) ** (2 * SLOPE)
            forgiven = forgiven - self.variance * self.mixed(ratio)[:, None]
            allowance = CACHE_SHARE * error
        return forgiven, allowance


class Pilot:
    """Measures lattices in the volumes of ``context.scene`` at the receivers of ``sample``, finely enough for errors around
    ``target``. ``orders`` are the SH orders to tell apart. The same seed gives the same readings for any number of threads. Raises
    Cancelled."""

    def __init__(self, context: LightContext, volumes: tuple[ProbeVolume, ...], sample: Sample, orders: tuple[int, ...],
                 target: float, seed: int, progress: Progress):
        self.context, self.volumes, self.sample, self.orders, self._seed = context, volumes, sample, orders, seed
        self.settings = ProbeSettings(order=max(orders), error=PILOT_ERROR)
        self.cache = surface_cache(context, volumes, self.settings, seed)
        self.receiver_rays = int(np.clip(RECEIVER_RAYS * 2.0 ** round(2.0 * np.log2(USUAL_TARGET / target)), *RECEIVER_RANGE))
        self._known: dict[tuple, Reading] = {}
        self._started: dict[tuple, StartedProbes] = {}  # by lattice
        # A bake that was made to see how good it is, and is the one that is planned.
        self.finished: Finished | None = None
        self.bake_seed = seed_of(np.random.default_rng(seed))
        self._probes = 0
        self.truth, self.truth_effort = Truth(*np.zeros((2, 0, 3))), Effort(0, 0.0)
        self._trace_truth(self.points(0), progress)

    @property
    def readings(self) -> tuple[Reading, ...]:
        """All that was measured so far."""
        return tuple(self._known.values())

    @property
    def begun(self) -> Begun:
        """What a bake of the same scene with the same seed need not do again."""
        return Begun(self.context, self.cache, self.settings.target, tuple(self._started.values()), self.finished)

    @property
    def spent(self) -> int:
        """Rays that went into what most of a bake has no use for: all but those of the cache."""
        return len(self.truth.mean) * self.receiver_rays + self._probes * RAYS_A_PROBE

    def points(self, level: int) -> int:
        """Surface points of a ``level`` of LEVELS."""
        return max(min(FEWEST_POINTS, self.sample.points), round(LEVELS[level] * self.sample.points))

    def measure(self, resolutions: tuple[tuple[int, int, int], ...], progress: Progress, level: int = -1) -> Reading:
        """The Reading of the volumes at ``resolutions`` on the surface points of ``level``; what was measured before is not
        measured again. Raises Cancelled."""
        volumes = tuple(replace(volume, resolution=tuple(int(count) for count in resolution))
                        for volume, resolution in zip(self.volumes, resolutions, strict=True))
        return self.measure_volumes(volumes, progress, level)

    def measure_volumes(self, volumes: tuple[ProbeVolume, ...], progress: Progress, level: int = -1) -> Reading:
        """The same of any ``volumes``, of other boxes than the pilot's as well. Raises Cancelled."""
        points = self.points(level)
        self._trace_truth(points, progress.span(0.0, _PLACED))
        key = tuple(map(lattice_key, volumes)), points
        if key not in self._known:
            self._known[key] = self._measured(volumes, self.sample.receivers.take(slice(0, points * NORMALS_PER_POINT)), progress)
        return self._known[key]

    @property
    def seed(self) -> int:
        """That of all it draws, and of the bake that it prepares."""
        return self._seed

    def _trace_truth(self, points: int, progress: Progress) -> None:
        """Have the irradiance at the receivers of the first ``points`` points."""
        done, wanted = len(self.truth.mean), points * NORMALS_PER_POINT
        if done >= wanted:
            return
        with count_rays() as counter:
            started = perf_counter()
            receivers = self.sample.receivers.take(slice(done, wanted))
            more = light_at_receivers(self.context, self.cache, self.settings, receivers.points, receivers.normals,
                                      LampLight(self.context, self.settings.direct, LAMP_SAMPLES, self._seed + 1 + done),
                                      self.receiver_rays, self._seed + 1 + done, progress)
            effort = Effort(self.truth_effort.rays + counter.rays, self.truth_effort.seconds + perf_counter() - started)
        self.truth, self.truth_effort = Truth(*(np.concatenate(parts) for parts in zip(self.truth, more, strict=True))), effort

    def _measured(self, volumes: tuple[ProbeVolume, ...], receivers: Receivers, progress: Progress) -> Reading:
        read = [probes_read(volume, receivers.points[rows], receivers.normals[rows])
                for volume, rows in zip(volumes, answered(volumes, receivers.points), strict=True)]
        with count_rays() as counter:
            started = perf_counter()
            baked = self._completed(volumes, read, progress)
            effort = Effort(counter.rays, perf_counter() - started)
        return self._reading(volumes, receivers, baked, effort)

    def _completed(self, volumes, read: list[np.ndarray], progress: Progress) -> list[StartedProbes]:
        """The probes that are ``read`` (rows by volume) and those that are known, which are not traced again, by volume."""
        starts, known, rows = np.cumsum([0, *(int(np.prod(volume.resolution)) for volume in volumes)]), [], []
        for volume, first, probes in zip(volumes, starts, read, strict=False):
            old = self._started.get(lattice_key(volume))
            known.append(old)
            wanted = rounded_out(volume, int(first) if old is None else old.start, probes)
            rows.append(wanted if old is None else np.setdiff1d(wanted, old.rows))
        owner = np.repeat(np.arange(len(volumes)), [len(own) for own in rows])
        if not len(owner):
            return [old for old in known if old is not None]
        self._probes += len(owner)
        lattice = np.concatenate([positions_of(volume, own) for volume, own in zip(volumes, rows, strict=True)])
        placed = place_points(self.context, volumes, lattice, owner, self.settings.virtual_offset, progress.span(0.0, _PLACED))
        for number, (volume, old) in enumerate(zip(volumes, known, strict=True)):
            own = owner == number
            if not own.any():
                continue
            done = _PLACED + (_GATHERED - _PLACED) * np.searchsorted(owner, [number, number + 1]) / len(owner)
            start = int(starts[number]) if old is None else old.start
            new = start_probes(self.context, self.cache, self.settings, volume, start, self.bake_seed, rows[number],
                               placed.take(own), progress.span(*done))
            known[number] = self._started[lattice_key(volume)] = new if old is None else old.joined(new)
        return known

    def _reading(self, volumes, receivers, baked: list[StartedProbes], effort) -> Reading:
        side = self.settings.visibility_resolution
        field = SparseField([SparseLookup(volume, own.rows, own.placement.positions, own.placement.measured,
                                          mean_distances(own.distance, own.weight, side), own.sh)
                             for volume, own in zip(volumes, baked, strict=True)])
        shares = _Shares(volumes, receivers, field, np.cumsum([0, *(len(own.rows) for own in baked)]))
        first, second, sh, measured = (np.concatenate(parts) for parts in (
            [own.first for own in baked], [own.second for own in baked], [own.sh for own in baked],
            [own.placement.measured for own in baked]))

        # Neither is deringed: that would be the noise of few rays, which a bake does not have.
        @cache
        def estimate(order):
            return shares.irradiance(sh[:, :(order + 1) ** 2])

        halves = [shares.irradiance((sums / HALF_RAYS).astype(np.float32)) for sums in (first, second)]
        model = ErrorModel(len(measured), first.shape[1])
        probes = np.flatnonzero(measured)
        for sums in (first, second):
            model.add(probes, sums[probes], np.full(len(probes), HALF_RAYS))
        return Reading(volumes, len(probes), estimate, HALVES * (halves[0] - halves[1]) ** 2, self, model,
                       shares.mixed, effort)


class _Shares:
    """Which probes each of ``receivers`` reads in ``field``, and in what shares: once, for all that is asked of the same lattices.
    The probes stand one volume after another, each volume's from its one of ``starts`` on."""

    def __init__(self, volumes, receivers: Receivers, field: SparseField, starts: np.ndarray):
        share = field.shares(receivers.points)
        starts = {id(volume): start for volume, start in zip(volumes, starts[:-1], strict=True)}
        self._normals, self._parts = receivers.normals, []
        for column, lookup in enumerate(field.lookups):
            rows = np.flatnonzero(share[:, column])
            index, weight = lookup.weights(receivers.points[rows], receivers.normals[rows])
            self._parts.append((lookup, rows, starts[id(lookup.volume)] + index, weight, share[rows, column, None]))

    def mixed(self, values: np.ndarray) -> np.ndarray:
        """See Reading.mixed."""
        total = np.zeros(len(self._normals))
        for _, rows, index, weight, share in self._parts:
            total[rows] += np.sum(weight * share * values[index], axis=1)
        return total

    def irradiance(self, sh: np.ndarray) -> np.ndarray:
        """Irradiance (n, 3) at the receivers if the probes had the coefficients ``sh`` (m, k, 3)."""
        total = np.zeros((len(self._normals), 3), np.float32)
        for lookup, rows, index, weight, share in self._parts:
            total[rows] += share * lookup.read(sh, index, weight, self._normals[rows])
        return total
