"""What media in the slices send to the eye: lamps by the phase functions themselves, shadowed by surfaces and by media; all other
light by its spherical harmonics; emission."""

from dataclasses import dataclass

import numpy as np

from ...numerics.sampling import hash_u32, sobol_owen
from ...scene import Scene
from ...scene.lights import lamps_to_add
from ...scene.medium import Phase
from ...techniques.base import Field
from ...transport.context import LightContext
from ...transport.lights.lamps import LampTable
from ...transport.media.phase import phase_moments, phase_value
from ...transport.media.table import Filling, MediaTable
from ...transport.parallel import chunks, parallel_for
from ...transport.rays.tracer import short_of
from ...transport.vectors import dot
from .ambient import ORDER, Ambient, scattered
from .froxels import Columns, Near, Presence, numbers
from .integrate import Slices

# Each lamp's points on it are drawn by a sequence of its own, the one that surfaces are lit by (effects/lit.py).
_LAMP_SEED = 0x2000
# Keys of the rays that slices send: the letters mr.
_RAY_SEED = 0x6D72
# Slices per unit of work.
_CHUNK = 1 << 14


@dataclass(frozen=True, eq=False)
class Surroundings:
    """The media and lamps of ``scene``, with the surfaces of ``context`` in the way (None: there are none), and the light that
    ``field`` knows (None: no bake)."""

    scene: Scene
    context: LightContext | None
    media: MediaTable
    lamps: LampTable
    added: tuple[int, ...]
    ambient: Ambient
    threads: int | None

    @staticmethod
    def of(scene: Scene, context: LightContext | None, field: Field | None) -> "Surroundings":
        """Ready to be asked; what is the same for every sample is kept with ``context``."""
        media = MediaTable(scene.media) if context is None else context.all_media
        lamps = LampTable(scene.lights) if context is None else context.lamps
        kept = {} if context is None else context.kept
        if "media" not in kept or kept["media"][0] is not field:
            kept["media"] = field, Ambient.of(scene, field)
        held = frozenset() if field is None else field.direct_lamps
        # What the bake holds of lamps would be lit twice.
        added = frozenset(lamps_to_add(scene.lights, held))
        return Surroundings(scene, context, media, lamps, tuple(n for n, light in enumerate(scene.lights) if light in added),
                            kept["media"][1], None if context is None else context.threads)

    @property
    def seen(self) -> list[Filling]:
        """The media that a camera sees."""
        return [filling for filling in self.media.fillings if filling.medium.visible_camera]

    def falls_off(self, lamp: int) -> bool:
        """Whether a lamp's light thins out with the distance: that of suns and of parallel beams does not."""
        return not self.lamps.is_distant[lamp] and getattr(self.scene.lights[lamp], "spread", 1.0) > 0

    def reaching(self, lamp, points: np.ndarray, directions: np.ndarray, distances: np.ndarray) -> np.ndarray | float:
        """The share (n, 3) of the light of ``lamp`` (one for all, or (n,)) that gets to ``points`` (n, 3)."""
        casts = self.lamps.casts_shadow[lamp]
        if not np.any(casts):
            return 1.0
        limits = short_of(distances)
        if self.context is None:
            left = self.media.transmittance(points, directions, limits)
        else:
            blockers = self.context.links.lamp_blockers(lamp) if self.context.links.has_blockers else 0
            left = self.context.lamp_transmittance(self.lamps.is_delta[lamp], points, directions, limits, blockers)
        return left if np.all(casts) else np.where(casts[:, None], left, np.float32(1.0))


def lamp_uv(lamp: int, index: int, n: int) -> np.ndarray:
    """Where on ``lamp`` all of sample number ``index`` is lit from: (n, 2) in [0, 1), n times the same."""
    return np.broadcast_to(sobol_owen(1, 2, _LAMP_SEED + lamp, start=index, shuffle=True)[0], (n, 2))


def lit_slices(around: Surroundings, columns: Columns, index: int, near: dict[int, Near], furthest: np.ndarray, ambient: bool,
               by_rays=None, rays: int = 0) -> Slices:
    """What is in the slices in sample number ``index``, without what pixels have of the lamps ``near`` (near.py) by themselves.
    Nothing sends light beyond ``furthest`` (rows·columns,) [m], where nobody sees it; ``ambient`` says whether light that was
    scattered or reflected before is scattered as well, by what the bake knows of it; ``by_rays`` (points, directions, strengths by
    phase function, keys; see gathered.py) finds it by ``rays`` of its own."""
    shape, fillings = columns.shape, around.seen
    presence = Presence.of(fillings, columns)
    n = len(columns.origins)
    active = np.flatnonzero((presence.leave > presence.enter) & (presence.enter < furthest))
    spans = chunks(len(active), _CHUNK)
    work = _Work(around, columns, presence, fillings, index, near, ambient)
    parts = parallel_for(lambda i: work.at(active[spans[i]]), len(spans), around.threads)
    whole = [np.zeros((shape.slices * n, 3), np.float32) for _ in range(3)]
    for which, part in zip(spans, parts, strict=True):
        for total, values in zip(whole, part, strict=True):
            total[active[which]] = values
    if rays:
        whole[2][active] += work.by_rays(active, by_rays, rays)
    across, up = shape.columns
    # What lies beyond the last surface still takes light where it is in the slice of one: its depth is needed, its light is not.
    return Slices(*(part.reshape(shape.slices, up, across, 3) for part in whole),
                  *(part.reshape(shape.slices, up, across) for part in (presence.enter, presence.leave)))


@dataclass(frozen=True, eq=False)
class _Work:
    around: Surroundings
    columns: Columns
    presence: Presence
    fillings: list[Filling]
    index: int
    near: dict[int, Near]
    ambient: bool

    def at(self, froxels: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Optical depth, direct and indirect light (n, 3) float32 of the flat ``froxels`` (n,)."""
        u, points, directions, along, enter, leave = self._places(froxels)
        depth, direct, indirect = (np.zeros((len(froxels), 3), np.float32) for _ in range(3))
        scattering: dict[Phase, np.ndarray] = {}
        for filling, lengths in zip(self.fillings, self.presence.length, strict=True):
            length = lengths.ravel()[froxels][:, None]
            found = filling.coefficients(points)
            depth += (found.extinction * length).astype(np.float32)
            direct += (found.emission * length).astype(np.float32)
            strength = (found.scattering * length).astype(np.float32)
            if strength.any():
                phase = filling.medium.phase
                scattering[phase] = scattering.get(phase, 0.0) + strength
        if scattering:
            rows = np.flatnonzero(np.any([strength.max(axis=1) > 0 for strength in scattering.values()], axis=0))
            scattering = {phase: strength[rows] for phase, strength in scattering.items()}
            direct[rows] += self._of_lamps(scattering, points[rows], directions[rows], enter[rows] - along[rows],
                                           leave[rows] - along[rows])
            if self.ambient:
                coefficients = self.around.ambient.at(points[rows], u[rows, 1:4])
                for phase, strength in scattering.items():
                    indirect[rows] += strength * scattered(coefficients, directions[rows], phase_moments(phase, ORDER))
        return depth, direct, indirect

    def by_rays(self, froxels: np.ndarray, gather, rays: int) -> np.ndarray:
        """Light (n, 3) float32 of the flat ``froxels`` (n,) that turns to the eye there from anywhere but lamps, the mean over
        ``rays``."""
        _, points, directions, *_ = self._places(froxels)
        strengths: dict[Phase, np.ndarray] = {}
        for filling, lengths in zip(self.fillings, self.presence.length, strict=True):
            strength = (filling.coefficients(points).scattering * lengths.ravel()[froxels][:, None]).astype(np.float32)
            if strength.any():
                strengths[filling.medium.phase] = strengths.get(filling.medium.phase, 0.0) + strength
        result = np.zeros(points.shape, np.float32)
        rows = np.flatnonzero(sum(strengths.values()).max(axis=1) > 0) if strengths else np.zeros(0, np.intp)
        if rows.size:
            strengths = {phase: strength[rows] for phase, strength in strengths.items()}
            for ray in range(rays):
                key = hash_u32(_RAY_SEED, self.index, froxels[rows], ray)
                result[rows] += gather(points[rows], directions[rows], strengths, key) / np.float32(rays)
        return result

    def _places(self, froxels: np.ndarray) -> tuple:
        """Numbers (n, 4) of the flat ``froxels`` (n,), a point (n, 3) in each and the direction (n, 3) in which it is seen, both
        float32, how far from the eye it is, and where the media in it begin and end (n,) [m]."""
        shape, presence = self.columns.shape, self.presence
        column = froxels % len(self.columns.origins)
        enter, leave = presence.enter.ravel()[froxels], presence.leave.ravel()[froxels]
        u = numbers(shape, self.index, froxels, 4)
        along = enter + u[:, 0] * (leave - enter)
        directions = self.columns.directions[column].astype(np.float32)
        points = (self.columns.origins[column] + self.columns.directions[column] * along[:, None]).astype(np.float32)
        return u, points, directions, along, enter, leave

    def _of_lamps(self, scattering, points, directions, first, last) -> np.ndarray:
        """Light (n, 3) of lamps that is scattered at ``points``, in parts of rays ``first`` to ``last`` (n,) [m] about them."""
        around, result = self.around, np.zeros(points.shape, np.float32)
        for lamp in around.added:
            if around.lamps.scattered[lamp] == 0.0:
                continue
            sample = around.lamps.sample(lamp, points, lamp_uv(lamp, self.index, len(points)))
            rows = np.flatnonzero(np.any(sample.irradiance > 0, axis=1))
            if not rows.size:
                continue
            towards, distance = sample.direction[rows], sample.distance[rows]
            arriving = sample.irradiance[rows] * around.reaching(lamp, points[rows], towards, distance)
            arriving = arriving * around.lamps.scattered[lamp]
            cosine = dot(directions[rows], towards)
            # A wide lamp's light is the same near it: one point of a slice says it.
            if lamp in self.near:
                near = self.near[lamp]
                aside = near.centre.astype(np.float32) - points[rows]
                distance = np.sqrt(dot(aside, aside))
                arriving = arriving * falloff_beyond(distance, dot(directions[rows], aside), first[rows], last[rows],
                                                     near.reach)[:, None]
            for phase, strength in scattering.items():
                result[rows] += strength[rows] * (phase_value(phase, cosine)[:, None] * arriving).astype(np.float32)
        return result


def falloff_beyond(distance: np.ndarray, nearest: np.ndarray, first: np.ndarray, last: np.ndarray, reach: float) -> np.ndarray:
    """How much light (n,) of a lamp falls on a piece of a ray on average by (1 − W)/d², with W = (1 − d²/R²)² within the
    ``reach`` R [m] (near.py) and 0 beyond, of what falls on one of its points by 1/d²: that is at ``distance`` (n,) [m] from the
    lamp, to which the ray comes closest ``nearest`` (n,) [m] further on, and the piece reaches from ``first`` to ``last`` (n,) [m]
    about it.

    Beyond the reach ∫dt/(h² + t²) = (atan(b/h) − atan(a/h))/h; within it (1 − W)/d² is 2/R² − d²/R⁴.
    """
    height = np.sqrt(np.maximum(distance * distance - nearest * nearest, np.float32(1e-12)))
    low, high = first - nearest, last - nearest
    half = np.sqrt(np.maximum(np.float32(reach * reach) - height * height, np.float32(0.0)))
    enter, leave = np.clip(-half, low, high), np.clip(half, low, high)
    total = (_seen_angle(height, low, enter) + _seen_angle(height, leave, high)) / height
    # In units of the reach, in which nothing is too small for its square.
    a, b, h = (part / np.float32(reach) for part in (enter, leave, height))
    total += ((b - a) * (np.float32(2.0) - h * h) - (b**3 - a**3) / np.float32(3.0)) / np.float32(reach)
    return (distance * distance * total / np.maximum(high - low, np.float32(1e-12))).astype(np.float32)


def _seen_angle(height: np.ndarray, low: np.ndarray, high: np.ndarray) -> np.ndarray:
    """atan(high/height) − atan(low/height) without the digits that the two have in common."""
    return np.arctan2(height * (high - low), height * height + high * low)
