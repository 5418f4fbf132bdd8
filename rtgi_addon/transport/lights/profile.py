"""What a lamp's profile (`scene.lamp_profile`) does to its light: factors for samples, and where to take these from.

Every kind of lamp draws its samples as if it had no profile, from numbers in the unit square; with one the numbers are first
moved to where the profile is bright (a density over the square, made once a lamp), and each sample counts by the inverse. So no
kind needs to know of profiles, and nothing is left out where a table is dark: a part of the samples stays even.
"""

from functools import cached_property
from weakref import WeakKeyDictionary

import numpy as np

from ...numerics.sampling import disk_from_square
from ...scene import AreaLight, LampProfile, Light
from ...scene.lamp_profile import FARTHEST, NEAREST, directions, solid_angles
from .beam import Beam
from .kinds import kind_of

# Cells of a density over the square along each axis, and the share of samples that stays even.
CELLS, EVEN = 128, 0.1
# Cells along each axis of what a sphere's surface sends to far away.
_FAR_CELLS = 48
# A lamp's estimate at a point is never below this share of what it would be without a profile: its middle is not all of it.
_LEAST = 0.05


class Density:
    """A piecewise constant density over the unit square, from the brightness of (rows, columns) cells: u₁ counts rows."""

    def __init__(self, brightness: np.ndarray):
        values = np.asarray(brightness, np.float64)
        rows, columns = values.shape
        padded = np.pad(values, 1, mode="edge")
        # What lies between the middles of cells is a mixture of these.
        values = sum(padded[i:i + rows, j:j + columns] for i in range(3) for j in range(3)) / 9.0
        mean = values.mean()
        values = (1.0 - EVEN) * values / mean + EVEN if mean > 0.0 else np.ones_like(values)
        self._values = values
        in_row = values.sum(axis=1)
        self._rows = np.concatenate([[0.0], np.cumsum(in_row) / in_row.sum()])
        self._columns = np.concatenate([np.zeros((rows, 1)), np.cumsum(values, axis=1) / in_row[:, None]], axis=1)

    def warp(self, u: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Where ``u`` (n, 2) in [0, 1) lie once they have this density, float32 in [0, 1), and its inverse (n,) there."""
        u = np.asarray(u, np.float64)
        rows, columns = self._values.shape
        row = np.clip(np.searchsorted(self._rows, u[:, 1], side="right") - 1, 0, rows - 1)
        low, high = self._rows[row], self._rows[row + 1]
        v = (row + (u[:, 1] - low) / (high - low)) / rows
        # The cells of each row by bisection: a search over as many sorted lists.
        edges, first, last = self._columns, np.zeros(len(u), np.intp), np.full(len(u), columns, np.intp)
        for _ in range(int(np.ceil(np.log2(columns))) + 1):
            middle = (first + last) // 2
            right = edges[row, middle] <= u[:, 0]
            first, last = np.where(right, middle, first), np.where(right, last, middle)
        column = np.minimum(first, columns - 1)
        low, high = edges[row, column], edges[row, column + 1]
        x = (column + (u[:, 0] - low) / (high - low)) / columns
        # The largest float32 below 1, where rounding would reach it.
        warped = np.minimum(np.stack([x, v], axis=1).astype(np.float32), np.float32(1.0 - 2.0**-24))
        return warped, (1.0 / self._values[row, column]).astype(np.float32)


class Profile:
    """The profile of ``light``, ready to be looked up; ``position`` (3,) float32 is the lamp's middle."""

    def __init__(self, light: Light):
        self._light, self._tables = light, light.profile
        self.position = np.asarray(light.position_world, np.float32)
        self._local_from_world = np.asarray(light.profile.world_from_profile, np.float64).T.astype(np.float32)
        if isinstance(light, AreaLight):
            half_u, half_v = (np.asarray(axis, np.float64) for axis in (light.half_u_world, light.half_v_world))
            self._place_from_world = np.linalg.pinv(np.stack([half_u, half_v], axis=1)).astype(np.float32)

    def factor(self, origins: np.ndarray, travel: np.ndarray) -> np.ndarray:
        """(n, 3): on what leaves the lamp at ``origins`` along unit ``travel`` (n, 3)."""
        result = np.ones((len(travel), 3), np.float32)
        if self._tables.by_direction is not None:
            result *= self.of_direction(self._normals(origins, travel) if self._tables.of_normals else travel)
        if self._tables.by_place is not None:
            result *= self.of_place(origins)
        return result

    def of_direction(self, vectors: np.ndarray) -> np.ndarray:
        """(n, 3) of the directions, or a sphere's normals, ``vectors`` (n, 3)."""
        return _around(self._tables.by_direction, self._tables.reach, self._local(vectors))

    def of_place(self, origins: np.ndarray) -> np.ndarray:
        """(n, 3) of the places ``origins`` (n, 3) on the lamp, in world space."""
        away = origins - self.position
        m = self._place_from_world
        return self._of_st(np.stack([m[i, 0] * away[:, 0] + m[i, 1] * away[:, 1] + m[i, 2] * away[:, 2] for i in range(2)], axis=1))

    def of_distance(self, distance: np.ndarray) -> np.ndarray:
        """(n, 3) at ``distance`` (n,) [m] from where light left the lamp."""
        if self._tables.by_distance is None:
            return np.ones((len(distance), 1), np.float32)
        table = self._tables.by_distance
        with np.errstate(divide="ignore"):
            at = (np.log(np.asarray(distance, np.float64)) - np.log(NEAREST)) * ((len(table) - 1) / np.log(FARTHEST / NEAREST))
        at = np.clip(at, 0.0, len(table) - 1)
        low = np.minimum(at.astype(np.intp), len(table) - 2)
        part = (at - low).astype(np.float32)[:, None]
        return table[low] * (1.0 - part) + table[low + 1] * part

    def to_far(self, travel: np.ndarray) -> np.ndarray:
        """(n, 3): on what goes from the whole lamp along ``travel`` (n, 3)."""
        result = np.ones((len(travel), 3), np.float32)
        if self._tables.by_direction is not None:
            table, reach = self._far
            result *= _around(table, reach, self._local(travel))
        return result

    def about(self, towards: np.ndarray, distance: np.ndarray) -> np.ndarray:
        """An estimate (n, 3) of the factor at points to which unit ``towards`` (n, 3) leads back from the lamp's middle, positive
        wherever the true one may be."""
        far = np.ones((len(towards), 3), np.float32)
        if self._tables.by_direction is not None:
            far = self.to_far(-towards)
            far = far if self._is_point else np.maximum(far, np.float32(_LEAST))
        return far * np.maximum(self.of_distance(distance), np.float32(1e-6))

    def share(self, places: np.ndarray, own: np.ndarray) -> np.ndarray:
        """(3,): the mean of ``by_place`` over what is nearer to ``own`` (2,) than to any other of ``places`` (m, 2) (s, t)."""
        table = self._tables.by_place
        if table is None:
            return np.ones(3, np.float32)
        rows, columns = table.shape[:2]
        t, s = np.meshgrid(*((np.arange(count) + 0.5) / count * 2.0 - 1.0 for count in (rows, columns)), indexing="ij")
        inside = np.ones(s.shape, bool) if self._light.shape != "ELLIPSE" else s * s + t * t <= 1.0
        nearest = np.argmin(np.stack([(s - x) ** 2 + (t - y) ** 2 for x, y in places]), axis=0)
        mine = inside & (nearest == int(np.argmin(np.sum((places - own) ** 2, axis=1))))
        return (table[mine].sum(axis=0) / max(inside.sum() / len(places), 1.0)).astype(np.float32)

    def warp_receiving(self, uv: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """``uv`` (n, 2) moved to the lamp's bright places, and what each then counts (n,)."""
        if not self.has_places:
            return uv, np.ones(len(uv), np.float32)
        return self._places.warp(uv)

    def warp_emitting(self, u: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """As ``warp_receiving``, of the numbers ``u`` (n, 4) of rays that begin at the lamp."""
        first, second = self._emitted
        result, gain = u.copy(), np.ones(len(u), np.float32)
        for columns, density in ((slice(0, 2), first), (slice(2, 4), second)):
            if density is not None:
                result[:, columns], part = density.warp(u[:, columns])
                gain = gain * part
        return result, gain

    @cached_property
    def has_places(self) -> bool:
        """Whether samples have a place on the lamp by which their light differs: not those of a parallel beam, which has one right
        above each point."""
        return self._tables.by_place is not None and self._light.spread > 0

    @cached_property
    def _is_point(self) -> bool:
        return not isinstance(self._light, AreaLight) and self._light.radius == 0

    @cached_property
    def _places(self) -> Density:
        """Brightness over the square that places on an area lamp are drawn from."""
        return Density(self._power(self._of_st(_in_square(self._light, _cells()))).reshape(CELLS, CELLS))

    @cached_property
    def _emitted(self) -> tuple[Density | None, Density | None]:
        """Brightness over the first two numbers of a ray that the lamp emits, and over the last two."""
        cells = _cells()
        middle = np.full_like(cells, 0.5)
        kind, beam = kind_of(self._light), Beam(np.array([[-1.0] * 3, [1.0] * 3]), np.zeros(3), 1.0)
        first = kind.emit(self._light, np.concatenate([cells, middle], axis=1), beam)
        by_place = self._tables.by_place is not None and not self.has_places
        brightness = (first.power * (self.of_place(first.origins) if by_place else self.to_far(first.directions))).sum(axis=1)
        return Density(brightness.reshape(CELLS, CELLS)), self._places if self.has_places else None

    @cached_property
    def _far(self) -> tuple[np.ndarray, float]:
        """``by_direction`` and its reach; of a sphere whose normals it is over, what arrives far away: a cosine's mean around."""
        tables = self._tables
        if not tables.of_normals:
            return tables.by_direction, tables.reach
        coarse = LampProfile(tables.world_from_profile, np.zeros((_FAR_CELLS, 2 * _FAR_CELLS, 3), np.float32))
        around = directions(coarse).reshape(-1, 3)
        measure = np.repeat(solid_angles(coarse), 2 * _FAR_CELLS)
        light = self.of_direction(around.astype(np.float32)) * measure[:, None]
        facing = np.maximum(around @ around.T, 0.0)
        far = facing @ light / (facing @ measure)[:, None]
        return far.reshape(coarse.by_direction.shape).astype(np.float32), float(np.pi)

    def _power(self, factor: np.ndarray) -> np.ndarray:
        """(n,): the sum over colours of the light that ``factor`` (n, 3) makes of the lamp's."""
        return factor @ np.maximum(self._light.strength, 0.0)

    def _local(self, vectors: np.ndarray) -> np.ndarray:
        m = self._local_from_world
        return np.stack([m[i, 0] * vectors[:, 0] + m[i, 1] * vectors[:, 1] + m[i, 2] * vectors[:, 2] for i in range(3)], axis=1)

    def _normals(self, origins: np.ndarray, travel: np.ndarray) -> np.ndarray:
        """(n, 3): outward unit normals where rays from ``origins`` in or on the lamp's sphere leave it along ``travel``."""
        offset = (origins - self.position) / np.float32(max(self._light.radius, 1e-9))
        along = (offset * travel).sum(axis=1)
        on = np.sqrt(np.maximum(along * along - (offset * offset).sum(axis=1) + 1.0, 0.0)) - along
        return offset + travel * on[:, None]

    def _of_st(self, st: np.ndarray) -> np.ndarray:
        rows, columns = self._tables.by_place.shape[:2]
        return _between(self._tables.by_place, (0.5 * st[:, 1] + 0.5) * rows - 0.5, (0.5 * st[:, 0] + 0.5) * columns - 0.5, False)


_profiles: WeakKeyDictionary = WeakKeyDictionary()


def profile_of(light: Light) -> Profile | None:
    """The profile of a lamp, or None if it has none."""
    if light.profile is None:
        return None
    if light not in _profiles:
        _profiles[light] = Profile(light)
    return _profiles[light]


def _cells() -> np.ndarray:
    """(CELLS², 2): the middles of a density's cells, row by row."""
    middle = (np.arange(CELLS, dtype=np.float32) + np.float32(0.5)) / CELLS
    v, u = np.meshgrid(middle, middle, indexing="ij")
    return np.stack([u.ravel(), v.ravel()], axis=1)


def _in_square(light: AreaLight, uv: np.ndarray) -> np.ndarray:
    """(s, t) of an area lamp that numbers ``uv`` (n, 2) stand for."""
    return disk_from_square(uv) if light.shape == "ELLIPSE" else 2.0 * uv - 1.0


def _around(table: np.ndarray, reach: float, local: np.ndarray) -> np.ndarray:
    """``table`` (h, w, 3) of LampProfile.by_direction at ``local`` (n, 3) directions of its frame."""
    rows, columns = table.shape[:2]
    across = np.sqrt(local[:, 0] * local[:, 0] + local[:, 1] * local[:, 1])
    angle = np.arctan2(across, -local[:, 2])
    azimuth = np.arctan2(local[:, 1], local[:, 0])
    turn = np.mod(azimuth * np.float32(0.5 / np.pi), np.float32(1.0))
    return _between(table, angle * np.float32(rows / reach) - 0.5, turn * columns - 0.5, True)


def _between(table: np.ndarray, row: np.ndarray, column: np.ndarray, around: bool) -> np.ndarray:
    """``table`` (h, w, 3) bilinear at cell coordinates (n,); ``around``: its columns go round."""
    rows, columns = table.shape[:2]
    row = np.clip(row, 0.0, rows - 1.0)
    if not around:
        column = np.clip(column, 0.0, columns - 1.0)
    low_row, low_column = np.floor(row), np.floor(column)
    down, along = (row - low_row).astype(np.float32)[:, None], (column - low_column).astype(np.float32)[:, None]
    top, left = low_row.astype(np.intp), low_column.astype(np.intp)
    bottom = np.minimum(top + 1, rows - 1)
    right = (left + 1) % columns if around else np.minimum(left + 1, columns - 1)
    left = left % columns
    upper = table[top, left] * (1.0 - along) + table[top, right] * along
    lower = table[bottom, left] * (1.0 - along) + table[bottom, right] * along
    return upper * (1.0 - down) + lower * down


