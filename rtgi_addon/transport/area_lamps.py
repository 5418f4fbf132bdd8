"""Area lamps: rectangles sampled by solid angle where they are near, any shape by area, beam spread as in Cycles.

Solid angle: Ureña, Fajardo and King, "An Area-Preserving Parametrization for Spherical Rectangles" (2013), in the form of Cycles
(`kernel/light/area.h`) that keeps small rectangles from cancelling. Spread: the slats of a soft box (Blender D10594).
"""

from dataclasses import dataclass

import numpy as np

from ..numerics.sampling import disk_from_square
from ..scene import AreaLight
from .vectors import dot

# Beyond this many diagonals a rectangle is sampled by area: its integrand is then almost constant, and cheaper.
FAR_DIAGONALS = 4.0


@dataclass(frozen=True, eq=False)
class AreaLamps:
    """Area lamps as rows. In the orthonormal frame (``u``, ``v``, ``normal``) a shape's points are x = a·s + shear·b·t, y = b·t
    about ``position``, with (s, t) in the square [−1, 1]² or, for an ellipse, in the unit disk."""

    position: np.ndarray
    u: np.ndarray
    v: np.ndarray
    normal: np.ndarray
    radiance: np.ndarray
    a: np.ndarray
    b: np.ndarray
    shear: np.ndarray
    ellipse: np.ndarray
    tan_half_spread: np.ndarray
    spread_gain: np.ndarray

    @staticmethod
    def of(lights: list[AreaLight]) -> "AreaLamps":
        """Rows for ``lights``."""
        rows = [_row(light) for light in lights]
        widths = (3, 3, 3, 3, 3, 0, 0, 0, 0, 0, 0)
        columns = [np.array([row[i] for row in rows], np.float32).reshape((len(rows), 3) if width else len(rows))
                   for i, width in enumerate(widths)]
        columns[8] = columns[8] > 0
        return AreaLamps(*columns)

    def take(self, rows) -> "AreaLamps":
        """The rows selected by a slice or an index array."""
        return AreaLamps(*(getattr(self, name)[rows] for name in self.__dataclass_fields__))

    @property
    def area(self) -> np.ndarray:
        """Surface areas (m,) [m²]."""
        return self.a * self.b * np.where(self.ellipse, np.float32(np.pi), np.float32(4.0))


def _row(light: AreaLight):
    half_u, half_v = (np.asarray(axis, np.float64) for axis in (light.half_u_world, light.half_v_world))
    normal = np.cross(half_u, half_v)
    normal /= max(np.linalg.norm(normal), 1e-300)
    if normal @ np.asarray(light.normal_world, np.float64) < 0:
        normal = -normal
    a = np.linalg.norm(half_u)
    u = half_u / max(a, 1e-300)
    v = np.cross(normal, u)
    if half_v @ v < 0:
        v = -v
    b = half_v @ v
    shear = (half_v @ u) / b if b > 0 else 0.0
    shear = 0.0 if abs(shear) < 1e-5 else shear
    half_spread = 0.5 * max(light.spread, 0.0)
    if half_spread >= 0.5 * np.pi - 1e-6:
        tangent, gain = np.inf, 1.0
    else:
        tangent = np.tan(half_spread)
        # 1/∫cos(x)(1 − tan x/tan h)sin(x)dx relative to a cosine lobe, over tan h; by its series where it cancels.
        gain = 0.0 if half_spread == 0 else 1.0 / (tangent - half_spread) if half_spread > 0.05 else 3.0 / half_spread**3
    return light.position_world, u, v, normal, light.radiance, a, b, shear, light.shape == "ELLIPSE", tangent, gain


def sample_area(lamps: AreaLamps, points: np.ndarray, uv: np.ndarray):
    """Direction (n, 3), distance (n,) and irradiance (n, 3) of one sample per point, as in ``LampSample``."""
    n = len(points)
    x, y, z = _local_centre(lamps, points)
    radiance = np.broadcast_to(lamps.radiance, (n, 3))
    collimated = lamps.tan_half_spread == 0
    if collimated.all():
        px, py, weight = np.zeros(n, np.float32), np.zeros(n, np.float32), _collimated(lamps, x, y, z)
    else:
        px, py, weight = _sample_shape(lamps, x, y, z, uv)
        if collimated.any():
            px, py = np.where(collimated, np.float32(0.0), px), np.where(collimated, np.float32(0.0), py)
            weight = np.where(collimated, _collimated(lamps, x, y, z), weight)
    distance = np.sqrt(np.maximum(px * px + py * py + z * z, np.finfo(np.float32).tiny))
    direction = (px[:, None] * lamps.u + py[:, None] * lamps.v - z[:, None] * lamps.normal) / distance[:, None]
    return direction, distance, radiance * weight[:, None]


def area_importance(lamps: AreaLamps, points: np.ndarray, normals: np.ndarray):
    """An estimate ((n, 3),) of unshadowed irradiance that is positive wherever the true one may be."""
    x, y, z = _local_centre(lamps, points)
    offset_squared = x * x + y * y
    distance_squared = np.maximum(offset_squared + z * z, np.float32(1e-12))
    distance = np.sqrt(distance_squared)
    extent = np.sqrt(np.square(lamps.a + np.abs(lamps.shear) * lamps.b) + np.square(lamps.b))
    part = np.minimum(extent / distance, 1.0)
    towards = lamps.position - points
    cosine = np.maximum(dot(towards, normals) / distance + part, 0.0) / (1.0 + part)
    nearest = np.maximum(np.sqrt(offset_squared) - extent, 0.0)
    front = z > 0
    tangent = nearest / np.where(front, z, np.float32(1.0))
    with np.errstate(invalid="ignore"):
        spread = np.where(np.isinf(lamps.tan_half_spread), np.float32(1.0), (lamps.tan_half_spread - tangent) * lamps.spread_gain)
    diffuse = lamps.area * z / distance / (distance_squared + lamps.area / np.float32(np.pi)) * np.maximum(spread, 0.0)
    diffuse = np.minimum(diffuse, np.float32(np.pi))
    beam = np.where(nearest == 0, np.float32(np.pi), np.float32(0.0))
    factor = np.where(lamps.tan_half_spread == 0, beam, diffuse)
    return (lamps.radiance * np.where(front, factor * cosine, np.float32(0.0))[:, None],)


def _local_centre(lamps: AreaLamps, points: np.ndarray):
    """The lamp's centre seen from the points along its own axes, and their height above its front."""
    towards = lamps.position - points
    return dot(towards, lamps.u), dot(towards, lamps.v), -dot(towards, lamps.normal)


def _collimated(lamps: AreaLamps, x, y, z) -> np.ndarray:
    """Spread 0 is a parallel beam: E = πL on a facing plane, straight below the shape and nowhere else."""
    t = -y / lamps.b
    s = (-x - lamps.shear * lamps.b * t) / lamps.a
    inside = np.where(lamps.ellipse, s * s + t * t <= 1.0, (np.abs(s) <= 1.0) & (np.abs(t) <= 1.0))
    return np.where(inside & (z > 0), np.float32(np.pi), np.float32(0.0))


def _sample_shape(lamps: AreaLamps, x, y, z, uv):
    """A point (px, py) on the lamp's plane relative to the point's foot, and irradiance per radiance."""
    n = len(x)
    a, b, shear, ellipse, tan_half, gain = (np.broadcast_to(value, (n,)) for value in (
        lamps.a, lamps.b, lamps.shear, lamps.ellipse, lamps.tan_half_spread, lamps.spread_gain))
    x0, x1, y0, y1 = x - a, x + a, y - b, y + b
    narrow = np.isfinite(tan_half) & (shear == 0)
    if narrow.any():
        # Only the part of the lamp within the beam's reach lights the point: sample its bounding rectangle.
        reach = np.where(narrow & (z > 0), z * np.where(narrow, tan_half, np.float32(0.0)), np.float32(np.inf))
        x0, x1, y0, y1 = np.maximum(x0, -reach), np.minimum(x1, reach), np.maximum(y0, -reach), np.minimum(y1, reach)
    width, height = np.maximum(x1 - x0, 0.0), np.maximum(y1 - y0, 0.0)
    rectangle = width * height
    as_ellipse = ellipse & ((np.float32(np.pi) * a * b <= rectangle) | (shear != 0))
    s, t = 2.0 * uv[:, 0] - 1.0, 2.0 * uv[:, 1] - 1.0
    px, py = 0.5 * (x0 + x1) + 0.5 * width * s, 0.5 * (y0 + y1) + 0.5 * height * t
    area = rectangle
    if as_ellipse.any():
        disk = disk_from_square(uv)
        s, t = np.where(as_ellipse, disk[:, 0], s), np.where(as_ellipse, disk[:, 1], t)
        area = np.where(as_ellipse, np.float32(np.pi) * a * b, area)
    whole = as_ellipse | (shear != 0)
    if whole.any():
        px, py = np.where(whole, x + a * s + shear * b * t, px), np.where(whole, y + b * t, py)
    squared = np.maximum(px * px + py * py + z * z, np.finfo(np.float32).tiny)
    weight = area * z / (squared * np.sqrt(squared))
    centre_squared = np.square(0.5 * (x0 + x1)) + np.square(0.5 * (y0 + y1)) + z * z
    near = ~ellipse & ~whole & (z > 0) & (rectangle > 0)
    near = np.flatnonzero(near & (centre_squared < np.float32(FAR_DIAGONALS**2) * (width * width + height * height)))
    if near.size:
        px[near], py[near], weight[near] = _sample_solid_angle(x0[near], x1[near], y0[near], y1[near], z[near], uv[near])
    lit = (z > 0) & (area > 0)
    outside = ellipse & ~as_ellipse
    if outside.any():
        lit &= ~outside | (np.square((px - x) / a) + np.square((py - y) / b) <= 1.0)
    beam = np.isfinite(tan_half)
    if beam.any():
        tangent = np.sqrt(px * px + py * py) / np.where(z > 0, z, np.float32(1.0))
        weight = weight * np.where(beam, np.maximum((np.where(beam, tan_half, 0.0) - tangent) * gain, 0.0), np.float32(1.0))
    return px, py, np.where(lit, weight, np.float32(0.0)).astype(np.float32)


def _sample_solid_angle(x0, x1, y0, y1, z, uv):
    """Ureña's map for rectangles [x0, x1] × [y0, y1] at depth ``z`` below the origin: a point on each, and its solid angle.

    In float64: the angles of a spherical rectangle cancel to its small solid angle.
    """
    x0, x1, y0, y1, z0 = (value.astype(np.float64) for value in (x0, x1, y0, y1, -z))
    z_squared = z0 * z0
    n0, n1, n2, n3 = (edge / np.sqrt(edge * edge + z_squared) for edge in (-y0, x1, y1, -x0))
    g0, g1, g2, g3 = (np.arcsin(np.clip(-value, -1.0, 1.0)) for value in (n0 * n1, n1 * n2, n2 * n3, n3 * n0))
    solid_angle = np.maximum(-(g0 + g1 + g2 + g3), 0.0)
    angle = uv[:, 0] * solid_angle + g2 + g3
    sine = np.sin(angle)
    fu = (np.cos(angle) * n0 + n2) / np.where(sine == 0.0, 1e-300, sine)
    cu = np.clip(np.copysign(1.0 / np.sqrt(fu * fu + n0 * n0), fu), -1.0, 1.0)
    px = np.clip(-(cu * z0) / np.maximum(np.sqrt(1.0 - cu * cu), 1e-15), x0, x1)
    depth_squared = px * px + z_squared
    h0, h1 = y0 / np.sqrt(depth_squared + y0 * y0), y1 / np.sqrt(depth_squared + y1 * y1)
    hv = h0 + uv[:, 1] * (h1 - h0)
    py = np.clip(hv * np.sqrt(depth_squared / np.maximum(1.0 - hv * hv, 1e-15)), y0, y1)
    return px.astype(np.float32), py.astype(np.float32), solid_angle.astype(np.float32)
