"""The probes of volumes that capture the same light, as they are kept up to date: what they hold, how it is blended, who rests.

A probe's light X follows X ← (1 − w)·X + w·x, where x is what its newest rays bring: linear, so that the mean is exact (blending
in the space of a gamma, as public implementations do, makes noisy light darker). w = 1 − h while the scene changes, with h the
hysteresis: a change is followed by 1 − hᵏ after k updates, and of the variance of x the share (1 − h)/(1 + h) stays. A probe
without a past takes w = 1/k until that is less; one around which nothing changes goes on from there with w = 1/(n + 1), n the
updates that its noise is worth, until it is good enough to rest.

Source: Z. Majercik et al., "Dynamic Diffuse Global Illumination with Ray-Traced Irradiance Fields", JCGT 8(2), 2019.
"""

import math
from dataclasses import dataclass

import numpy as np

from ....numerics import sh
from ....progress import Progress
from ....scene import ProbeVolume
from ....transport.context import LightContext
from ....transport.surfaces.geometry import Geometry
from ...base import ProbeGrid
from ...lamp_light import LampLight
from ...lattice.placement import Placement, place, place_points
from ...lattice.unseen import wanted_probes
from ..distances import mean_distances
from ..gather import GROUP
from ..items import Item
from ..settings import ProbeSettings
from .settings import LiveSettings

# A change counts as followed when no more than this share of it is missing, with the bounces that lag behind one another where
# surfaces reflect up to so much.
UNFOLLOWED, MOST_REFLECTED = 0.002, 0.9
# A probe rests after so many updates at the latest.
MOST_UPDATES = 1024
# A probe that no surface reads takes its turn every so many rounds.
NAP = 8
# A dark probe's noise is judged by this share of the mean light.
DIM = 0.1
# Rays of one work item.
ITEM_RAYS = 1 << 14


@dataclass(eq=False)
class LiveLattice:
    """``volumes`` under ``settings`` and ``probes`` (their bake's) in the light of ``context``, and what their p probes hold.

    ``light`` (p, k, 3) SH; ``distance`` (p, T², 2) and ``distance_weight`` (p, T²), sums for their tiles, and these themselves,
    ``visibility`` (p, T², 2); ``age`` (p,) updates since they stand where they do, ``still`` (p,) since anything changed; ``worth``
    (p,) the independent updates that their noise is that of, and ``spread`` (p,) the variance of one; ``read`` (p,) bool: by
    surfaces.
    """

    volumes: tuple[ProbeVolume, ...]
    settings: LiveSettings
    probes: ProbeSettings
    context: LightContext
    placement: Placement
    lamp_light: LampLight

    def __post_init__(self):
        count, tile = len(self.placement.positions), self.probes.visibility_resolution**2
        self.light = np.zeros((count, sh.coefficient_count(self.probes.order), 3), np.float32)
        self.distance, self.distance_weight = np.zeros((count, tile, 2), np.float32), np.zeros((count, tile), np.float32)
        self.visibility = np.zeros((count, tile, 2), np.float32)
        self.age, self.still = np.zeros(count, np.int64), np.zeros(count, np.int64)
        self.worth, self.spread = np.zeros(count), np.zeros(count)
        self.rounds = self._cursor = 0
        self._look_at_surfaces()
        self._take_lamps()

    @staticmethod
    def begin(volumes, settings: LiveSettings, probes: ProbeSettings, context: LightContext, lamp_light: LampLight,
              progress: Progress) -> "LiveLattice":
        """Probes that hold nothing yet. Raises Cancelled."""
        placement = place(context, volumes, probes.virtual_offset, progress)
        return LiveLattice(volumes, settings, probes, context, placement, lamp_light)

    def _look_at_surfaces(self) -> None:
        surfaces, geometry = self.context.surfaces, self.context.geometry
        every, third = np.arange(geometry.count), np.full(geometry.count, 1 / 3, np.float32)
        albedo = surfaces.albedo_of_side(every, third, third, np.ones(geometry.count, np.float32)).max(axis=1)
        mean = np.average(albedo, weights=geometry.areas) if geometry.areas.any() else 0.0
        self._reflected = min(float(mean), MOST_REFLECTED)
        self.read = self._read_by(geometry)

    def _read_by(self, geometry: Geometry) -> np.ndarray:
        return np.concatenate([wanted_probes(geometry, volume, outermost=True).reshape(-1) for volume in self.volumes])

    def _take_lamps(self) -> None:
        """The direct light of lamps that probes hold: it has no noise, and is followed at once."""
        self._lamps = np.zeros_like(self.light)
        rows = np.flatnonzero(self.placement.measured)
        if self.lamp_light and rows.size:
            self._lamps[rows] = self.lamp_light.coefficients(self.placement.positions[rows], self.probes.order)

    @property
    def rest_after(self) -> int:
        """Updates after which a change has been followed: in a closed room that reflects the share ρ, what is missing of its light
        shrinks by 1 − (1 − h)·(1 − ρ) an update."""
        reflected = 0.0 if self.probes.bounces == 0 else self._reflected
        return math.ceil(math.log(UNFOLLOWED) / math.log(max(1.0 - (1.0 - self.settings.hysteresis) * (1.0 - reflected), 1e-3)))

    @property
    def noise(self) -> np.ndarray:
        """Estimated RMS error (p,) of a probe's coefficients as a share of its light, or for dim ones of a share of the mean's;
        infinite before there are two updates."""
        level = np.sqrt(np.square(self.light, dtype=np.float64).sum(axis=(1, 2)))
        measured = self.placement.measured
        mean = level[measured].mean() if measured.any() else 0.0
        with np.errstate(divide="ignore", invalid="ignore"):
            error = np.sqrt(self.spread / self.worth)
            relative = np.where(error > 0.0, error / np.maximum(level, DIM * mean), 0.0)
        return np.where(self.age > 1, relative, np.inf)

    @property
    def awake(self) -> np.ndarray:
        """Probes (p,) bool that still trace rays."""
        done = (self.still >= self.rest_after) & ((self.noise <= self.settings.noise) | (self.worth >= MOST_UPDATES))
        return self.placement.measured & ~done

    def turns(self, rays: int) -> np.ndarray:
        """The probes (m,) whose turn it is where ``rays`` may be traced, ascending: at least one group of neighbours, at most all.
        A round is over when every probe that is awake has had its turn."""
        awake = np.flatnonzero(self.awake)
        if self.rounds % NAP:
            awake = awake[self.read[awake]]
        if not awake.size and self.awake.any():
            # Nobody's turn in this round.
            self.rounds, self._cursor = self.rounds + 1, 0
            return self.turns(rays)
        left = awake[awake >= self._cursor]
        groups, first = np.unique(left // GROUP, return_index=True)
        # Whole groups, for neighbours share their directions.
        fits = max(1, np.searchsorted(np.append(first[1:], left.size), rays // self.settings.rays_per_probe, side="right"))
        chosen = left[:np.append(first, left.size)[min(fits, groups.size)]]
        return chosen

    def passed(self, chosen: np.ndarray) -> None:
        """Say that the probes ``chosen`` (m,) had their turn."""
        self._cursor = int(chosen[-1]) // GROUP * GROUP + GROUP
        awake = np.flatnonzero(self.awake)
        awake = awake if self.rounds % NAP == 0 else awake[self.read[awake]]
        if not np.any(awake >= self._cursor):
            self.rounds, self._cursor = self.rounds + 1, 0

    def items(self, chosen: np.ndarray) -> list[Item]:
        """The rays of the probes ``chosen`` (m,) in items of groups of one size."""
        rays = self.settings.rays_per_probe
        groups, first, size = np.unique(chosen // GROUP, return_index=True, return_counts=True)
        items = []
        for members in np.unique(size):
            alike = np.flatnonzero(size == members)
            step = max(1, ITEM_RAYS // (rays * int(members)))
            for part in (alike[i:i + step] for i in range(0, len(alike), step)):
                probes = chosen[first[part][:, None] + np.arange(members)]
                items.append(Item(groups[part], probes, np.zeros(len(part), np.int64), rays))
        return items

    def blend(self, probes: np.ndarray, light: np.ndarray, distance: np.ndarray, weight: np.ndarray) -> None:
        """Take in what the newest rays of ``probes`` (m,) brought: ``light`` (m, k, 3), and sums of ``distance`` (m, T², 2) with
        their ``weight`` (m, T²)."""
        self.age[probes] += 1
        self.still[probes] += 1
        age, still, worth = self.age[probes], self.still[probes], self.worth[probes]
        share = np.maximum(1.0 - self.settings.hysteresis, 1.0 / age)
        share = np.where(still > self.rest_after, np.minimum(share, 1.0 / (worth + 1.0)), share)
        with np.errstate(divide="ignore"):
            self.worth[probes] = 1.0 / ((1.0 - share) ** 2 / np.maximum(worth, 1e-12) * (worth > 0) + share**2)
        off = np.square(light - self.light[probes], dtype=np.float64).sum(axis=(1, 2)) / (1.0 + 1.0 / np.maximum(worth, 1.0))
        # The spread is a slow mean, of twice as many updates as the light, and knows nothing from the first.
        slow = np.maximum(0.5 * share, 1.0 / np.maximum(age - 1, 1))
        self.spread[probes] = np.where(age > 1, (1.0 - slow) * self.spread[probes] + slow * off, 0.0)
        part = share.astype(np.float32)
        self.light[probes] += part[:, None, None] * (light - self.light[probes])
        self.distance[probes] += part[:, None, None] * (distance - self.distance[probes])
        self.distance_weight[probes] += part[:, None] * (weight - self.distance_weight[probes])
        self.visibility[probes] = mean_distances(self.distance[probes], self.distance_weight[probes],
                                                 self.probes.visibility_resolution)

    def wake(self) -> None:
        """Something changed that may change all light."""
        self.still[:] = 0

    def relit(self, context: LightContext, lamp_light: LampLight) -> None:
        """Other light on the same surfaces."""
        self.context, self.lamp_light = context, lamp_light
        self._take_lamps()
        self.wake()

    def moved(self, context: LightContext, lamp_light: LampLight, boxes: np.ndarray, instances: np.ndarray | None,
              progress: Progress) -> None:
        """Other surfaces: those of some ``instances`` (None: all) within the ``boxes`` (b, 2, 3) [m], where probes are placed anew,
        and those that move forget their past."""
        self.context = context
        before = self.placement
        lattice = before.positions - before.offset
        near = np.flatnonzero(_within(lattice, boxes, self._margins()))
        if near.size:
            owner = np.repeat(np.arange(len(self.volumes)), [int(np.prod(volume.resolution)) for volume in self.volumes])
            # Those that nobody wants stay left out.
            near = near[before.reach[near] > 0]
            placed = place_points(context, self.volumes, lattice[near], owner[near], self.probes.virtual_offset, progress)
            elsewhere = np.any(placed.offset != before.offset[near], axis=1) | (placed.measured != before.measured[near])
            arrays = [np.array(getattr(before, name)) for name in ("positions", "offset", "validity", "measured", "reach")]
            for array, name in zip(arrays, ("positions", "offset", "validity", "measured", "reach"), strict=True):
                array[near] = getattr(placed, name)
            self.placement = Placement(*arrays)
            self._forget(near[elsewhere])
        if instances is None:
            self._look_at_surfaces()
        else:
            # Where they were, probes are read no more, and need not know.
            geometry = context.geometry
            self.read = self.read | self._read_by(geometry.part(np.flatnonzero(np.isin(geometry.instance, instances))))
        self.relit(context, lamp_light)

    def _margins(self) -> np.ndarray:
        """How far (p,) [m] from a probe a surface may be and still move it: a cell and more."""
        return self.placement.reach if self.placement.reach.size else np.zeros(0, np.float32)

    def _forget(self, probes: np.ndarray) -> None:
        for array in (self.light, self.distance, self.distance_weight, self.age, self.still, self.worth, self.spread):
            array[probes] = 0

    def grids(self, lamps: bool = True) -> tuple[ProbeGrid, ...]:
        """What the probes hold, one grid a volume, with the direct light of ``lamps`` or without it; those that had no turn yet
        count as inside of something."""
        side = self.probes.visibility_resolution
        known = self.age > 0
        validity = np.where(known | ~self.placement.measured, self.placement.validity, 0.0).astype(np.float32)
        offset = np.where(known[:, None], self.placement.offset, np.float32(0.0))
        visibility = np.where(known[:, None, None], self.visibility, np.float32(0.0))
        with np.errstate(divide="ignore", invalid="ignore"):
            error = np.sqrt(self.spread / self.worth / (3.0 * self.light.shape[1]))
        error = np.where(self.age > 1, error, np.nan).astype(np.float32)
        light = np.where(known[:, None, None], self.light + self._lamps if lamps else self.light, np.float32(0.0))
        result, start = [], 0
        for volume in self.volumes:
            shape = tuple(reversed(volume.resolution))
            span = slice(start, start + int(np.prod(shape)))
            start = span.stop
            result.append(ProbeGrid(volume, light[span].reshape(*shape, -1, 3), validity[span].reshape(shape),
                                    visibility[span].reshape(*shape, side, side, 2), offset[span].reshape(*shape, 3),
                                    error[span].reshape(shape)))
        return tuple(result)


def _within(points: np.ndarray, boxes: np.ndarray, margins: np.ndarray) -> np.ndarray:
    """(n,) bool: points (n, 3) in one of ``boxes`` (b, 2, 3), or as far outside as their margin (n,)."""
    inside = np.zeros(len(points), bool)
    for low, high in boxes:
        inside |= np.all((points >= low - margins[:, None]) & (points <= high + margins[:, None]), axis=1)
    return inside
