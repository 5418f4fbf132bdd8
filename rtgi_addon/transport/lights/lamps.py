"""Direct light of lamps: one unbiased sample of a lamp of any kind for every point of an array.

The geometry and the falloffs are those of Cycles (`kernel/light/{sun,point,spot,area}.h`), so that a bake and a render agree.
Results depend on each row alone, never on how rows are grouped into calls.
"""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from ... import kernels
from ...scene import Light
from ..parallel import chunks
from ..vectors import dot, luminance
from .kinds import KINDS, kind_number, kind_of
from .lamp_kernel import LampRecords
from .profile import profile_of

# Of few points many lamps are asked for in one call, for so many pairs: numpy's own cost for a call is that of as many numbers.
_PAIRS_TOGETHER = 1 << 13
# Stands for a lamp's light that may be reflected any number of times.
UNLIMITED = 1 << 30


@dataclass(frozen=True, eq=False)
class LampSample:
    """One sample per point: ``direction`` (n, 3) unit towards the lamp, ``distance`` (n,) [m] to it (infinite for a sun) and
    ``irradiance`` (n, 3) [W·m⁻²] on a plane facing ``direction``: E = mean over samples of irradiance·max(0, n·direction)·V."""

    direction: np.ndarray
    distance: np.ndarray
    irradiance: np.ndarray


class LampMeeting(NamedTuple):
    """Rays that may meet a lamp: ``distance`` (n,) [m] to it, the ``radiance`` (n, 3) [W·sr⁻¹·m⁻²] it sends back along them, and
    the ``density`` (n,) [1/sr] with which its even samples lie there, 0 where it is not met."""

    distance: np.ndarray
    radiance: np.ndarray
    density: np.ndarray


class LampTable:
    """All lamps of a scene as a structure of arrays, in the scene's order.

    ``kind`` (L,) int8 indexes ``kinds.KINDS``; ``casts_shadow`` (L,) bool: False asks for no shadow ray; ``is_delta`` (L,)
    bool: the sample does not depend on ``uv``, so one per point is exact; ``is_distant`` (L,) bool: it stands at no place;
    ``power_estimate`` (L,) float32 luminous power [W], for distant lamps irradiance times ``scene_radius``²·π; ``max_bounces`` (L,)
    int64 as in ``Lamp``, UNLIMITED where there is no limit; ``scattered`` (L,) float32 as in ``Lamp``.
    """

    def __init__(self, lights: tuple[Light, ...], scene_radius: float = 1.0):
        self.count = len(lights)
        self.kind = np.array([kind_number(light) for light in lights], np.int8)
        self.casts_shadow = np.array([light.casts_shadow for light in lights], bool)
        self.is_delta = np.array([kind_of(light).is_delta(light) for light in lights], bool)
        self.is_distant = np.array([kind_of(light).is_distant for light in lights], bool)
        self.power_estimate = np.array([luminous_power(light, scene_radius) for light in lights], np.float32)
        self.max_bounces = np.array([UNLIMITED if light.max_bounces is None else light.max_bounces for light in lights], np.int64)
        self.scattered = np.array([light.scattered for light in lights], np.float32)
        self._profiles = {index: profile_of(light) for index, light in enumerate(lights) if light.profile is not None}
        self._row = np.zeros(self.count, np.intp)
        self._tables = {}
        for number in np.unique(self.kind).tolist():
            of_kind = np.flatnonzero(self.kind == number)
            self._row[of_kind] = np.arange(of_kind.size)
            self._tables[number] = KINDS[number].rows([lights[index] for index in of_kind])
        self._records = LampRecords(self.kind, self._row, self._tables, self.casts_shadow)

    @property
    def records(self) -> LampRecords | None:
        """The lamps for the kernels; None where these cannot follow them all: they are not there, or some lamp has a profile."""
        return self._records if kernels.is_available() and not self._profiles else None

    def sample(self, lamp_index, points: np.ndarray, uv: np.ndarray, even: bool = False) -> LampSample:
        """Sample lamp ``lamp_index`` (one for all, or (n,)) from ``points`` (n, 3) with ``uv`` (n, 2) in [0, 1); ``even``: as if it
        had no profile, not more where that is bright, so that the density is that of ``meet``."""
        if not self._profiles:
            return self._sample(lamp_index, points, uv)
        uv, gain = np.array(uv), np.ones(len(points), np.float32)
        for profile, rows in () if even else self._with_profile(lamp_index, len(points)):
            uv[rows], gain[rows] = profile.warp_receiving(uv[rows])
        sample = self._sample(lamp_index, points, uv)
        for profile, rows in self._with_profile(lamp_index, len(points)):
            direction, distance = sample.direction[rows], sample.distance[rows]
            factor = profile.factor(points[rows] + direction * distance[:, None], -direction) * profile.of_distance(distance)
            sample.irradiance[rows] *= factor * gain[rows, None]
        return sample

    def meet(self, lamp: int, points: np.ndarray, directions: np.ndarray) -> LampMeeting:
        """Where rays from ``points`` (n, 3) along unit ``directions`` (n, 3) meet the lamp of that index. Nothing is in the way."""
        kind, rows = self._kind_and_rows(int(self.kind[lamp]), lamp)
        distance, irradiance, density = kind.meet(rows, points, directions)
        radiance = irradiance * density[:, None]
        if lamp in self._profiles:
            profile, met = self._profiles[lamp], np.flatnonzero(density > 0)
            towards, far = directions[met], distance[met]
            radiance[met] *= profile.factor(points[met] + towards * far[:, None], -towards) * profile.of_distance(far)
        return LampMeeting(distance, radiance, density)

    def _sample(self, lamp_index, points: np.ndarray, uv: np.ndarray) -> LampSample:
        """As ``sample``, without profiles."""
        if kernels.is_available():
            return LampSample(*self._records.sample(lamp_index, points, uv))
        if np.ndim(lamp_index) == 0:
            kind, rows = self._kind_and_rows(int(self.kind[lamp_index]), lamp_index)
            return LampSample(*kind.sample(rows, points, uv))
        n = len(points)
        results = np.empty((n, 3), np.float32), np.empty(n, np.float32), np.empty((n, 3), np.float32)
        for kind, rows, chosen in self._by_kind(lamp_index):
            for result, part in zip(results, kind.sample(rows, points[chosen], uv[chosen]), strict=True):
                result[chosen] = part
        return LampSample(*results)

    def irradiance_unshadowed(self, lamp_index, points: np.ndarray, normals: np.ndarray) -> np.ndarray:
        """Estimate (n, 3) [W·m⁻²] of a lamp's irradiance without occlusion, from its centre: for importance only.

        It is positive wherever the true irradiance may be, also where only part of a lamp is above the horizon.
        """
        estimate = self._estimate(lamp_index, points, normals)
        for profile, rows in self._with_profile(lamp_index, len(points)):
            towards = profile.position - points[rows]
            distance = np.sqrt(np.maximum(dot(towards, towards), np.float32(1e-12)))
            estimate[rows] *= profile.about(towards / distance[:, None], distance)
        return estimate

    def _estimate(self, lamp_index, points: np.ndarray, normals: np.ndarray) -> np.ndarray:
        """As ``irradiance_unshadowed``, without profiles."""
        if np.ndim(lamp_index) == 0:
            kind, rows = self._kind_and_rows(int(self.kind[lamp_index]), lamp_index)
            return kind.importance(rows, points, normals)
        result = np.empty((len(points), 3), np.float32)
        for kind, rows, chosen in self._by_kind(lamp_index):
            result[chosen] = kind.importance(rows, points[chosen], normals[chosen])
        return result

    def luminance_unshadowed(self, points: np.ndarray, normals: np.ndarray) -> np.ndarray:
        """Luminance (L, n) float32 of ``irradiance_unshadowed`` of every lamp."""
        n = len(points)
        result = np.empty((self.count, n), np.float32)
        for lamps in chunks(self.count, max(1, _PAIRS_TOGETHER // max(n, 1))):
            several = len(result[lamps])
            if several == 1:
                result[lamps] = luminance(self.irradiance_unshadowed(lamps.start, points, normals))
            else:
                pairs = np.repeat(np.arange(lamps.start, lamps.start + several), n), *(
                    np.tile(part, (several, 1)) for part in (points, normals))
                result[lamps] = luminance(self.irradiance_unshadowed(*pairs)).reshape(several, n)
        return result

    def _with_profile(self, lamp_index, n: int):
        """Each profile among the lamps (one for all, or (n,)), and which of the n rows are its lamp's."""
        for lamp, profile in self._profiles.items():
            rows = np.flatnonzero(np.broadcast_to(np.asarray(lamp_index) == lamp, (n,)))
            if rows.size:
                yield profile, rows

    def _kind_and_rows(self, number: int, lamp_index):
        row = self._row[lamp_index]
        return KINDS[number], self._tables[number].take(slice(row, row + 1) if np.ndim(row) == 0 else row)

    def _by_kind(self, lamp_index: np.ndarray):
        """Each kind among the lamps (n,) with their rows, and which of the n these are."""
        kinds = self.kind[lamp_index]
        for number in self._tables:
            chosen = np.flatnonzero(kinds == number)
            if chosen.size:
                yield *self._kind_and_rows(number, lamp_index[chosen]), chosen


def luminous_power(light: Light, scene_radius: float) -> float:
    """Power [W] of a lamp's luminance; of a distant one what falls on a disk of ``scene_radius`` [m]."""
    strength = np.asarray(getattr(light, light.STRENGTH))
    return kind_of(light).measure(light, scene_radius) * float(luminance(strength))
