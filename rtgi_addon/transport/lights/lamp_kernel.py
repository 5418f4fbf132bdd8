"""Lamps as the kernels have them: the tables of all kinds in one."""

import numpy as np

from ... import kernels
from .area_sampling import AreaRows
from .kind import Rows
from .point import PointRows
from .spot import SpotRows
from .sun import SunRows

# ``Lamp`` of kernels/src/lamps.c.
_LAMP = np.dtype([(name, np.int32) for name in ("kind", "casts_shadow", "soft", "unused")]
                 + [("position", np.float32, 3), ("strength", np.float32, 3), ("radius", np.float32),
                    ("local_from_world", np.float32, 9), ("cos_half_cone", np.float32), ("inverse_blend", np.float32),
                    ("u", np.float32, 3), ("v", np.float32, 3), ("normal", np.float32, 3)]
                 + [(name, np.float32) for name in ("a", "b", "shear", "tan_half_spread", "spread_gain")])
_SUN, _POINT, _SPOT, _AREA = range(4)


class LampRecords:
    """All lamps of a scene as C reads them. ``tables`` are those of the kinds by ``kind`` (L,), each lamp's at its ``row`` (L,)."""

    def __init__(self, kind: np.ndarray, row: np.ndarray, tables: dict[int, Rows], casts_shadow: np.ndarray):
        self.count = len(kind)
        self._lamps = np.zeros(max(self.count, 1), _LAMP)
        self._lamps["casts_shadow"][:self.count] = casts_shadow
        for number, rows in tables.items():
            chosen = np.flatnonzero(kind == number)
            # Fields of one table in the order of its lamps.
            values = rows.take(row[chosen])
            record = np.zeros(len(chosen), _LAMP)
            record["casts_shadow"] = casts_shadow[chosen]
            _fill(record, values)
            self._lamps[chosen] = record
        self._address = self._lamps.ctypes.data

    def sample(self, source, points: np.ndarray, uv: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Directions (n, 3), distances (n,) and irradiance (n, 3), as ``LampSample`` has them, of lamp ``source`` (an index, or
        (n,)) from ``points`` (n, 3) by ``uv`` (n, 2)."""
        n = len(points)
        directions, irradiance = np.empty((n, 3), np.float32), np.empty((n, 3), np.float32)
        distances = np.empty(n, np.float32)
        kernels.call("sample_lamps", self.count, self._address, n, *self._indices(source, n), _rows(points, n, 3), _rows(uv, n, 2),
                     directions, distances, irradiance)
        return directions, distances, irradiance

    def light(self, tracer: int, source, points, normals, faces, reach, uv, turn: float = 0.0,
              into: np.ndarray | None = None) -> tuple[np.ndarray, int]:
        """As ``Sources.irradiance`` for lamp ``source``, traced through the kernels' ``tracer``; ``uv`` is shifted by ``turn`` on
        the torus. Adds to ``into`` (n, 3) if given. Also how many shadow rays that took."""
        n = len(points)
        result = np.empty((n, 3), np.float32) if into is None else into
        rays = kernels.call("lamp_light", tracer, self.count, self._address, n, *self._indices(source, n),
                            _rows(points, n, 3), _rows(normals, n, 3), _rows(faces, n, 3),
                            None if reach is None else _rows(reach, n), None if uv is None else _rows(uv, n, 2), turn,
                            into is not None, result)
        return result, rays

    def _indices(self, source, n: int) -> tuple[int, np.ndarray | None]:
        """One index for all, or those of each. Raises IndexError for one that is no lamp's."""
        if np.ndim(source) == 0:
            if not 0 <= source < self.count:
                raise IndexError(f"lamp {source} of {self.count}")
            return int(source), None
        source = _rows(np.asarray(source).astype(np.int32, copy=False), n)
        if n and not (0 <= source.min() and source.max() < self.count):
            raise IndexError(f"lamps {source.min()} to {source.max()} of {self.count}")
        return 0, source


def _rows(array: np.ndarray, n: int, width: int | None = None) -> np.ndarray:
    """``array`` (n,) or (n, width) as C takes it. Raises ValueError for another shape."""
    if array.shape != ((n,) if width is None else (n, width)):
        raise ValueError(f"{array.shape} where ({n}, {width or ''}) is expected")
    return np.ascontiguousarray(array, None if array.dtype == np.int32 else np.float32)


def _fill(record: np.ndarray, rows: Rows) -> None:
    if isinstance(rows, SunRows):
        record["kind"], record["position"], record["strength"] = _SUN, rows.direction, rows.irradiance
        record["radius"] = rows.one_minus_cos
    elif isinstance(rows, AreaRows):
        record["kind"], record["position"], record["strength"], record["soft"] = _AREA, rows.position, rows.radiance, rows.ellipse
        for name in ("u", "v", "normal", "a", "b", "shear", "tan_half_spread", "spread_gain"):
            record[name] = getattr(rows, name)
    elif isinstance(rows, PointRows):
        record["kind"], record["position"], record["strength"] = _POINT, rows.position, rows.intensity
        record["radius"], record["soft"] = rows.radius, rows.soft_falloff
        if isinstance(rows, SpotRows):
            record["kind"], record["cos_half_cone"], record["inverse_blend"] = _SPOT, rows.cos_half_cone, rows.inverse_blend
            record["local_from_world"] = rows.local_from_world.reshape(-1, 9)
    else:
        raise TypeError(f"the kernels know no lamp with {type(rows).__name__}")
