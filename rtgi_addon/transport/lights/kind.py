"""What light transport and the preview ask of a kind of lamp, and the small things that kinds share.

`sun`, `point`, `spot` and `area` each hold all that is known of one kind; `kinds` lists them.
"""

from dataclasses import dataclass, fields
from typing import ClassVar, NamedTuple

import numpy as np

from ...scene import Light, PointLight
from .beam import Beam
from .shadow_view import Placed, ShadowView


class Emission(NamedTuple):
    """Rays with ``origins`` and unit ``directions`` (n, 3), the ``power`` (n, 3) [W] over density of each (their mean is the power
    that reaches into the scene), and ``domain`` (n, 3): where in the lamp's distribution each lies, near rays close together."""

    origins: np.ndarray
    directions: np.ndarray
    power: np.ndarray
    domain: np.ndarray


@dataclass(frozen=True, eq=False)
class Rows:
    """Lamps of one kind as a structure of arrays, bool or float32."""

    @classmethod
    def of(cls, rows: list[tuple]) -> "Rows":
        """From one tuple of values a lamp, in the order of the fields; a lamp's vectors and matrices become further axes."""
        columns = [np.array([row[i] for row in rows]) for i in range(len(fields(cls)))]
        return cls(*(column if column.dtype == bool else column.astype(np.float32) for column in columns))

    def take(self, rows) -> "Rows":
        """The rows selected by a slice or an index array."""
        return type(self)(*(getattr(self, item.name)[rows] for item in fields(self)))


class LampKind:
    """One kind of lamp. Its number in ``kinds.KINDS`` stands for it in tables and, as ``LAMP_NAME``, in shaders.

    Methods on rows are for many lamps of the kind at once, one row for all points or one each; the others are for one ``Light``.
    """

    light: ClassVar[type]
    name: ClassVar[str]
    # At no place: it shines along directions.
    is_distant: ClassVar[bool] = False
    # Light goes through every one of its ``views``.
    fills_views: ClassVar[bool] = True

    def rows(self, lights: list[Light]) -> Rows:
        """The table that ``sample`` and ``importance`` read."""
        raise NotImplementedError

    def sample(self, rows: Rows, points: np.ndarray, uv: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """One sample of the lamp from each of ``points`` (n, 3) by ``uv`` (n, 2): direction, distance, irradiance as in
        ``lamps.LampSample``."""
        raise NotImplementedError

    def meet(self, rows: Rows, points: np.ndarray, directions: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """What ``sample`` answers where it draws the unit ``directions`` (n, 3) from ``points`` (n, 3): distance (n,) and
        irradiance (n, 3), and the density (n,) [1/sr] with which it draws them. That is 0 where a ray along the direction does not
        meet the lamp, and everywhere for lamps without extent; elsewhere irradiance·density is the radiance that is met."""
        raise NotImplementedError

    def importance(self, rows: Rows, points: np.ndarray, normals: np.ndarray) -> np.ndarray:
        """An estimate (n, 3) of unshadowed irradiance that is positive wherever the true one may be."""
        raise NotImplementedError

    def plain(self, light: Light) -> Light:
        """A bare lamp where ``light`` is, without extent, of the same power: a point, or a sun without a disk."""
        return PointLight(light.name, light.position_world, np.asarray(light.intensity, np.float32))

    def is_delta(self, light: Light) -> bool:
        """Whether samples do not depend on ``uv``: one a point is exact."""
        return light.radius == 0

    def extent(self, light: Light) -> float:
        """How far [m] a lamp that stands somewhere reaches from its centre."""
        return float(light.radius)

    def measure(self, light: Light, scene_radius: float) -> float:
        """What to multiply the lamp's strength by for its power [W]; a sun's is what falls on a disk of ``scene_radius``."""
        raise NotImplementedError

    def emit(self, light: Light, u: np.ndarray, beam: Beam) -> Emission:
        """Rays of ``light`` for ``u`` (n, 4) in [0, 1)."""
        raise NotImplementedError

    def connect(self, light: Light, points: np.ndarray, u: np.ndarray, beam: Beam):
        """The rays by which ``light`` would reach ``points`` (n, 3), each with its second pair of numbers ``u`` (n, 2): origins and
        unit directions (n, 3), the ``domain`` (n, 3) as in Emission, and whether the lamp shines that way at all (n,) bool."""
        raise NotImplementedError

    def near_gain(self, light: Light, points: np.ndarray) -> np.ndarray:
        """What (n,) arrives at ``points`` (n, 3) of what ``emit`` sends there."""
        return np.ones(len(points), np.float32)

    def can_follow(self, old: Light, new: Light) -> bool:
        """Whether rays of ``old`` can be ones of ``new``, which is of the same kind."""
        return True

    def views(self, light: Light, bounds: np.ndarray, focus: np.ndarray | None, resolution: int, area_points: int) -> list[Placed]:
        """Where to look from to see all that ``light`` lights (see ``views.shadow_views.views_of``)."""
        raise NotImplementedError

    def power_per_measure(self, light: Light, view: ShadowView) -> np.ndarray:
        """Power (n,) [W] over the lamp's strength and over ``view.texel_measure()`` that goes through each texel of ``view``."""
        raise NotImplementedError

    def shader_point(self, light: Light, u: np.ndarray) -> tuple[Light, dict]:
        """One point of the lamp for ``u`` (3,): a lamp without extent there, and what the struct LAMP of a shader needs to know."""
        raise NotImplementedError


def per_point(rows: np.ndarray, n: int) -> np.ndarray:
    """(n, …): a copy of ``rows``, which are one for all or already n."""
    return np.repeat(rows, n, axis=0) if len(rows) != n else rows.copy()


def one_minus_cosine(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """1 − cos (n,) of the angle between unit vectors (n, 3), exact for small angles."""
    apart = a - b
    return np.float32(0.5) * np.sum(apart * apart, axis=-1)


def unit_axis(vector) -> np.ndarray:
    """``vector`` (3,) with length 1, float32."""
    direction = np.asarray(vector, np.float64)
    return (direction / np.linalg.norm(direction)).astype(np.float32)
