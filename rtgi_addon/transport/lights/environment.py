"""The world's radiance by direction, split into bright patches that are sampled like lamps and a smooth rest.

A sun in an HDRI covers a few texels: rays that find it by luck make most of a bake's noise. The split is by texel and both parts
are interpolated alike, so base + bright is the world everywhere.
"""

import numpy as np

from ...scene import World
from ..vectors import dot, luminance
from .concentration import concentration_limit


class Environment:
    """Bilinear lookups in an equirectangular map with the layout of ``scene.World``: columns wrap, rows end at the poles.

    ``bright`` is a table of the concentrated part (``bright.count`` texels, 0 when nothing is concentrated), ``base_pixels`` (h, w,
    3) float32 the rest; ``is_black`` and ``is_constant`` tell the cheap cases.
    """

    def __init__(self, world: World):
        pixels = np.ascontiguousarray(world.equirect, np.float32)
        self._map_from_world = np.asarray(world.map_from_world, np.float64)
        self.is_black = world.is_black
        self.is_constant = bool(np.all(pixels == pixels[:1, :1]))
        limit = np.inf if self.is_constant else _threshold(pixels)
        brightness = luminance(pixels)
        base = pixels * np.minimum(1.0, limit / np.maximum(brightness, 1e-30))[..., None].astype(np.float32)
        self._map = _Equirect(pixels, self._map_from_world)
        self.base_pixels = base
        self._base = self._map if np.isinf(limit) else _Equirect(base, self._map_from_world)
        self.bright = BrightPatches(pixels - base, self._map_from_world)

    def radiance(self, directions: np.ndarray) -> np.ndarray:
        """Radiance (n, 3) [W·sr⁻¹·m⁻²] arriving from world ``directions`` (n, 3), which need not be unit."""
        return self._map.lookup(directions)

    def base_radiance(self, directions: np.ndarray) -> np.ndarray:
        """What ``radiance`` leaves when the bright patches are taken out: (n, 3)."""
        return self._base.lookup(directions)


class BrightPatches:
    """The concentrated part of a world as texels with hat-shaped footprints.

    ``count`` texels; ``irradiance_estimate`` (3,) [W·m⁻²] is their radiance integrated over solid angle: E on a plane that faces
    them, if they lie close together.
    """

    def __init__(self, pixels: np.ndarray, map_from_world: np.ndarray):
        height, width = pixels.shape[:2]
        self._size = width, height
        self._world_from_map = np.asarray(map_from_world, np.float32).T
        cos_latitude = np.cos((np.arange(height) + 0.5) / height * np.pi - 0.5 * np.pi)
        weight = np.maximum(luminance(pixels), 0.0).astype(np.float64) * cos_latitude[:, None]
        rows, columns = np.nonzero(weight)
        self.count = rows.size
        texel = cos_latitude * (2.0 * np.pi**2 / (width * height))
        self.irradiance_estimate = np.einsum("rcx,r->x", pixels.astype(np.float64), texel).astype(np.float32)
        if self.count == 0:
            return
        self._total = float(weight.sum())
        self._columns = columns
        self._cdf = np.cumsum(weight[rows, columns])
        self._rows, starts = np.unique(rows, return_index=True)
        self._row_bounds = np.append(starts, self.count)
        # Cumulative weight at which each row begins; the last entry is the total.
        self._row_cdf = np.append(np.concatenate(([0.0], self._cdf))[starts], self._cdf[-1])
        self._map = _Equirect(np.concatenate([pixels, weight[..., None]], axis=-1).astype(np.float32), map_from_world)

    def radiance(self, directions: np.ndarray) -> np.ndarray:
        """The bright part's radiance (n, 3) from ``directions`` (n, 3)."""
        if self.count == 0:
            return np.zeros((len(directions), 3), np.float32)
        return self._map.lookup(directions)[:, :3]

    def sample(self, u: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Unit world directions (n, 3) for ``u`` (n, 2) in [0, 1), and their radiance over density (n, 3) [W·m⁻²]: the mean of
        that times max(0, n·direction)·V is the irradiance the bright part gives."""
        width, height = self._size
        # Choose a row, then a texel in it; what is left of each number places the direction within the texel's hat.
        target = u[:, 1].astype(np.float64) * self._row_cdf[-1]
        row = np.clip(np.searchsorted(self._row_cdf, target, side="right") - 1, 0, len(self._rows) - 1)
        low, high = self._row_cdf[row], self._row_cdf[row + 1]
        remainder_v = (target - low) / (high - low)
        target = low + u[:, 0] * (high - low)
        texel = np.clip(np.searchsorted(self._cdf, target, side="right"), self._row_bounds[row], self._row_bounds[row + 1] - 1)
        start = np.where(texel > 0, self._cdf[texel - 1], 0.0)
        remainder_u = (target - start) / (self._cdf[texel] - start)
        x = self._columns[texel] + 0.5 + _hat(remainder_u)
        # Beyond a pole the lookup repeats the last row: folding back gives just that density.
        y = np.abs(self._rows[row] + 0.5 + _hat(remainder_v))
        y = np.where(y > height, 2.0 * height - y, y)
        azimuth, latitude = (0.5 - x / width) * (2.0 * np.pi), (y / height - 0.5) * np.pi
        cosine = np.cos(latitude)
        local = np.stack([cosine * np.cos(azimuth), cosine * np.sin(azimuth), np.sin(latitude)], axis=1).astype(np.float32)
        column = (x - 0.5) % width
        value = self._map.at(column.astype(np.float32), (y - 0.5).astype(np.float32))
        # Density in the map's unit square is width·height·weight/total, and dω = 2π²·cos(latitude) du dv.
        scale = (2.0 * np.pi**2 * self._total / (width * height)) * cosine / np.maximum(value[:, 3], 1e-30)
        return _rotate(self._world_from_map, local), value[:, :3] * scale[:, None].astype(np.float32)


class _Equirect:
    """A padded map: one column more at each side (wrapped) and one row (repeated), so that four texels need no modulo."""

    def __init__(self, pixels: np.ndarray, map_from_world: np.ndarray):
        self._height, self._width, channels = pixels.shape
        self._constant = pixels[0, 0].copy() if bool(np.all(pixels == pixels[:1, :1])) else None
        padded = np.pad(np.pad(pixels, ((0, 0), (1, 1), (0, 0)), mode="wrap"), ((1, 1), (0, 0), (0, 0)), mode="edge")
        self._texels = np.ascontiguousarray(padded, np.float32).reshape(-1, channels)
        rotation = np.asarray(map_from_world, np.float32)
        self._rotation = None if np.array_equal(rotation, np.eye(3)) else rotation

    def lookup(self, directions: np.ndarray) -> np.ndarray:
        """Values (n, channels) at world ``directions`` (n, 3)."""
        if self._constant is not None:
            return np.tile(self._constant, (len(directions), 1))
        directions = np.asarray(directions, np.float32)
        local = directions if self._rotation is None else _rotate(self._rotation, directions)
        x, y, z = local[:, 0], local[:, 1], local[:, 2]
        u = np.float32(0.5) - np.arctan2(y, x) * np.float32(0.5 / np.pi)
        v = np.arctan2(z, np.sqrt(x * x + y * y)) * np.float32(1.0 / np.pi) + np.float32(0.5)
        return self.at(u * np.float32(self._width) - np.float32(0.5), v * np.float32(self._height) - np.float32(0.5))

    def at(self, x: np.ndarray, y: np.ndarray) -> np.ndarray:
        """Bilinear values (n, channels) at texel coordinates (integers are centres): x in [−½, width], y in [−½, height − ½]."""
        column, row = np.floor(x), np.floor(y)
        fx, fy = (x - column)[:, None], (y - row)[:, None]
        stride = self._width + 2
        index = np.clip(row.astype(np.int64) + 1, 0, self._height) * stride + np.clip(column.astype(np.int64) + 1, 0, self._width)
        take = self._texels.take
        lower = take(index, axis=0) * (1 - fx) + take(index + 1, axis=0) * fx
        upper = take(index + stride, axis=0) * (1 - fx) + take(index + (stride + 1), axis=0) * fx
        return lower * (1 - fy) + upper * fy


def _threshold(pixels: np.ndarray) -> float:
    """The luminance above which radiance counts as concentrated, over solid angle."""
    brightness = luminance(pixels).astype(np.float64)
    height = len(brightness)
    share = np.cos((np.arange(height) + 0.5) / height * np.pi - 0.5 * np.pi)
    share = np.repeat((share / share.sum())[:, None], brightness.shape[1], axis=1) / brightness.shape[1]
    return concentration_limit(brightness, share)


def _hat(u: np.ndarray) -> np.ndarray:
    """Offsets in (−1, 1) with density 1 − |x| from ``u`` in [0, 1]."""
    return np.where(u < 0.5, np.sqrt(np.maximum(2.0 * u, 0.0)) - 1.0, 1.0 - np.sqrt(np.maximum(2.0 - 2.0 * u, 0.0)))


def _rotate(matrix: np.ndarray, vectors: np.ndarray) -> np.ndarray:
    return np.stack([dot(matrix[i : i + 1], vectors) for i in range(3)], axis=1)
