"""What a bake of probes will cost: rays, wall-clock seconds and memory, from what the pilot took."""

from dataclasses import dataclass, replace

from ...scene import ProbeVolume
from ...scene.memory import estimate_bytes
from ...techniques.lattice.focus import spacing_of
from ...techniques.lattice.placement import PILOT_RAYS
from ...techniques.probes.bake import cache_rays, texel_for, usual_texel, usual_texels
from ...techniques.probes.relight import MAX_KEPT_RAYS
from ...techniques.probes.settings import ProbeSettings
from .pilot import PILOT_ERROR, Pilot, Reading

# A bake's hits are kept for relighting.
BYTES_PER_RAY = 16
# What a bake takes beside what it holds: a batch of rays.
BATCH_BYTES = 8 << 20


@dataclass(frozen=True)
class Price:
    """``rays`` of all kinds, ``seconds`` of wall clock on this machine as it is now, ``bytes`` of memory at the peak."""

    rays: float
    seconds: float
    bytes: float


class Prices:
    """Prices of bakes of the scene of ``pilot``, which it took ``scene_seconds`` to make ready for rays."""

    def __init__(self, pilot: Pilot, scene_seconds: float = 0.0):
        self._pilot, self._scene_seconds = pilot, scene_seconds
        # Every triangle is looked at for it, whatever the lattices' resolution.
        self._usual = usual_texel(pilot.context, pilot.volumes, ProbeSettings(error=PILOT_ERROR))

    def rays(self, reading: Reading, error: float, kept: float | None = None) -> float:
        """Rays of a bake of the lattices of ``reading`` with the target ``error``, ``kept`` probes of them (None: all)."""
        return self._cache_rays(reading.volumes, error) + self._probe_rays(reading, error, kept)

    def marginal(self, reading: Reading, error: float, kept: float | None = None) -> float:
        """The same after the plan, whose cache serves a bake to its own error."""
        cached = self._cache_rays(reading.volumes, error) if error == PILOT_ERROR else 0.0
        return self.rays(reading, error, kept) - cached

    def price(self, reading: Reading, order: int, error: float, kept: float | None = None) -> Price:
        """The same with time and memory, for SH of ``order``."""
        probe_rays = self._probe_rays(reading, error, kept)
        seconds = self._scene_seconds + self._cache_rays(reading.volumes, error) * self._seconds_per_cache_ray \
            + probe_rays * self._seconds_per_probe_ray
        return Price(self.rays(reading, error, kept), seconds, self.bytes(reading.volumes, order, probe_rays))

    def bytes(self, volumes: tuple[ProbeVolume, ...], order: int, rays: float) -> float:
        """Peak memory of a bake of ``volumes`` that traces ``rays``."""
        held = sum(estimate_bytes(replace(self._pilot.context.scene, volumes=volumes), order).values())
        return BATCH_BYTES + held + BYTES_PER_RAY * min(rays, MAX_KEPT_RAYS)

    def _probe_rays(self, reading: Reading, error: float, kept: float | None) -> float:
        probes = reading.lattice_points if kept is None else kept
        return probes * (float(reading.rays(error).mean()) + 2.0 * PILOT_RAYS)

    def _cache_rays(self, volumes: tuple[ProbeVolume, ...], error: float) -> float:
        pilot = self._pilot
        settings, pilots = ProbeSettings(error=error), ProbeSettings(error=PILOT_ERROR)
        usual = self._usual * (usual_texels(pilot.context, pilots) / usual_texels(pilot.context, settings)) ** 0.5
        size = texel_for(usual, spacing_of(volumes))
        measured = max(pilot.truth_effort.rays - len(pilot.truth.mean) * pilot.receiver_rays,
                       pilot.cache.count * pilot.cache.rays)
        return measured * cache_rays(settings) / cache_rays(pilots) * (pilot.cache.layout.size / size) ** 2

    @property
    def _seconds_per_cache_ray(self) -> float:
        effort = self._pilot.truth_effort
        return effort.seconds / max(effort.rays, 1)

    @property
    def _seconds_per_probe_ray(self) -> float:
        efforts = [reading.effort for reading in self._pilot.readings]
        largest = max(efforts, key=lambda effort: effort.rays)
        return largest.seconds / max(largest.rays, 1)
