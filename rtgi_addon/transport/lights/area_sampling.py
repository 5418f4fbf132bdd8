"""Points on area lamps as receivers see them: rectangles by solid angle where they are near, any shape by area.

Solid angle: Ureña, Fajardo and King, "An Area-Preserving Parametrization for Spherical Rectangles" (2013), in the form of Cycles
(`kernel/light/area.h`) that keeps small rectangles from cancelling.
"""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from ...numerics.sampling import disk_from_square
from .kind import Rows

# Beyond this many diagonals a rectangle is sampled by area: its integrand is then almost constant, and cheaper.
FAR_DIAGONALS = 4.0


@dataclass(frozen=True, eq=False)
class AreaRows(Rows):
    """In the orthonormal frame (``u``, ``v``, ``normal``), (m, 3) each, a shape's points are x = a·s + shear·b·t, y = b·t about
    ``position``, with (s, t) in the square [−1, 1]² or, for an ``ellipse`` (m,) bool, in the unit disk. ``spread_gain`` (m,) keeps
    the flux of a beam of ``tan_half_spread`` (m,)."""

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

    @property
    def area(self) -> np.ndarray:
        """Surface areas (m,) [m²]."""
        return self.a * self.b * np.where(self.ellipse, np.float32(np.pi), np.float32(4.0))


class _Part(NamedTuple):
    """What of lamps is sampled, (n,) each: the rectangle from ``low`` to ``high`` relative to the receivers' feet (both (n, 2)) or,
    ``as_ellipse``, the whole ellipse; ``whole``: the shape in its own axes, sheared; its ``area``; ``near``: by solid angle."""

    low: np.ndarray
    high: np.ndarray
    as_ellipse: np.ndarray
    whole: np.ndarray
    area: np.ndarray
    near: np.ndarray


def _part(x, y, z, a, b, shear, ellipse, tan_half) -> _Part:
    x0, x1, y0, y1 = x - a, x + a, y - b, y + b
    narrow = np.isfinite(tan_half) & (shear == 0)
    if narrow.any():
        # Only the part of the lamp within the beam's reach lights the point: sample its bounding rectangle.
        reach = np.where(narrow & (z > 0), z * np.where(narrow, tan_half, np.float32(0.0)), np.float32(np.inf))
        x0, x1, y0, y1 = np.maximum(x0, -reach), np.minimum(x1, reach), np.maximum(y0, -reach), np.minimum(y1, reach)
    width, height = np.maximum(x1 - x0, 0.0), np.maximum(y1 - y0, 0.0)
    rectangle = width * height
    as_ellipse = ellipse & ((np.float32(np.pi) * a * b <= rectangle) | (shear != 0))
    area = np.where(as_ellipse, np.float32(np.pi) * a * b, rectangle) if as_ellipse.any() else rectangle
    whole = as_ellipse | (shear != 0)
    centre_squared = np.square(0.5 * (x0 + x1)) + np.square(0.5 * (y0 + y1)) + z * z
    near = ~ellipse & ~whole & (z > 0) & (rectangle > 0)
    near &= centre_squared < np.float32(FAR_DIAGONALS**2) * (width * width + height * height)
    return _Part(np.stack([x0, y0], axis=-1), np.stack([x1, y1], axis=-1), as_ellipse, whole, area, near)


def sample_shape(rows: AreaRows, x: np.ndarray, y: np.ndarray, z: np.ndarray, uv: np.ndarray):
    """For receivers from which the lamps' centres lie at (``x``, ``y``, −``z``), (n,) each, in the lamps' own frames: a point
    (px, py) on the lamp's plane relative to the receiver's foot, and irradiance per radiance."""
    a, b, shear, ellipse, tan_half, gain = _columns(rows, len(x))
    part = _part(x, y, z, a, b, shear, ellipse, tan_half)
    (x0, y0), (x1, y1) = part.low.T, part.high.T
    width, height = np.maximum(x1 - x0, 0.0), np.maximum(y1 - y0, 0.0)
    s, t = 2.0 * uv[:, 0] - 1.0, 2.0 * uv[:, 1] - 1.0
    px, py = 0.5 * (x0 + x1) + 0.5 * width * s, 0.5 * (y0 + y1) + 0.5 * height * t
    if part.as_ellipse.any():
        disk = disk_from_square(uv)
        s, t = np.where(part.as_ellipse, disk[:, 0], s), np.where(part.as_ellipse, disk[:, 1], t)
    if part.whole.any():
        px, py = np.where(part.whole, x + a * s + shear * b * t, px), np.where(part.whole, y + b * t, py)
    weight = _by_area(part.area, px, py, z)
    near = np.flatnonzero(part.near)
    if near.size:
        px[near], py[near], weight[near] = _sample_solid_angle(x0[near], x1[near], y0[near], y1[near], z[near], uv[near])
    lit = (z > 0) & (part.area > 0)
    outside = ellipse & ~part.as_ellipse
    if outside.any():
        lit &= ~outside | (np.square((px - x) / a) + np.square((py - y) / b) <= 1.0)
    weight = _within_beam(weight, px, py, z, tan_half, gain)
    return px, py, np.where(lit, weight, np.float32(0.0)).astype(np.float32)


def shape_density(rows: AreaRows, x: np.ndarray, y: np.ndarray, z: np.ndarray, px: np.ndarray,
                  py: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The density (n,) [1/sr] with which ``sample_shape`` draws (``px``, ``py``) (n,), 0 beside the lamp, and irradiance per
    radiance (n,) there."""
    a, b, shear, ellipse, tan_half, gain = _columns(rows, len(x))
    part = _part(x, y, z, a, b, shear, ellipse, tan_half)
    weight, near = _by_area(part.area, px, py, z), np.flatnonzero(part.near)
    if near.size:
        weight[near] = _solid_angle(*(side[near] for side in (part.low[:, 0], part.high[:, 0], part.low[:, 1], part.high[:, 1])),
                                    z[near])[0]
    t = (py - y) / np.where(b > 0, b, np.float32(1.0))
    s = (px - x - shear * b * t) / np.where(a > 0, a, np.float32(1.0))
    inside = np.where(ellipse, s * s + t * t <= 1.0, (np.abs(s) <= 1.0) & (np.abs(t) <= 1.0))
    inside &= (z > 0) & (part.area > 0) & (weight > 0)
    density = np.where(inside, np.float32(1.0) / np.where(inside, weight, np.float32(1.0)), np.float32(0.0))
    weight = _within_beam(weight, px, py, z, tan_half, gain)
    return density.astype(np.float32), np.where(inside, weight, np.float32(0.0)).astype(np.float32)


def _columns(rows: AreaRows, n: int) -> tuple[np.ndarray, ...]:
    return tuple(np.broadcast_to(value, (n,)) for value in (rows.a, rows.b, rows.shear, rows.ellipse, rows.tan_half_spread,
                                                            rows.spread_gain))


def _by_area(area, px, py, z) -> np.ndarray:
    """Irradiance per radiance, on a facing plane, of points drawn evenly over ``area``."""
    squared = np.maximum(px * px + py * py + z * z, np.finfo(np.float32).tiny)
    return area * z / (squared * np.sqrt(squared))


def _within_beam(weight, px, py, z, tan_half, gain) -> np.ndarray:
    beam = np.isfinite(tan_half)
    if not beam.any():
        return weight
    tangent = np.sqrt(px * px + py * py) / np.where(z > 0, z, np.float32(1.0))
    return weight * np.where(beam, np.maximum((np.where(beam, tan_half, 0.0) - tangent) * gain, 0.0), np.float32(1.0))


def _solid_angle(x0, x1, y0, y1, z) -> tuple[np.ndarray, ...]:
    """The solid angle of rectangles [x0, x1] × [y0, y1] at depth ``z`` below the origin, and what Ureña's map needs beside it.

    In float64: the angles of a spherical rectangle cancel to its small solid angle.
    """
    x0, x1, y0, y1, z0 = (value.astype(np.float64) for value in (x0, x1, y0, y1, -z))
    z_squared = z0 * z0
    n0, n1, n2, n3 = (edge / np.sqrt(edge * edge + z_squared) for edge in (-y0, x1, y1, -x0))
    g0, g1, g2, g3 = (np.arcsin(np.clip(-value, -1.0, 1.0)) for value in (n0 * n1, n1 * n2, n2 * n3, n3 * n0))
    return np.maximum(-(g0 + g1 + g2 + g3), 0.0), n0, n2, g2 + g3


def _sample_solid_angle(x0, x1, y0, y1, z, uv):
    """Ureña's map for rectangles as ``_solid_angle`` has them: a point on each, and its solid angle."""
    solid_angle, n0, n2, first = _solid_angle(x0, x1, y0, y1, z)
    x0, x1, y0, y1, z0 = (value.astype(np.float64) for value in (x0, x1, y0, y1, -z))
    angle = uv[:, 0] * solid_angle + first
    sine = np.sin(angle)
    fu = (np.cos(angle) * n0 + n2) / np.where(sine == 0.0, 1e-300, sine)
    cu = np.clip(np.copysign(1.0 / np.sqrt(fu * fu + n0 * n0), fu), -1.0, 1.0)
    px = np.clip(-(cu * z0) / np.maximum(np.sqrt(1.0 - cu * cu), 1e-15), x0, x1)
    depth_squared = px * px + z0 * z0
    h0, h1 = y0 / np.sqrt(depth_squared + y0 * y0), y1 / np.sqrt(depth_squared + y1 * y1)
    hv = h0 + uv[:, 1] * (h1 - h0)
    py = np.clip(hv * np.sqrt(depth_squared / np.maximum(1.0 - hv * hv, 1e-15)), y0, y1)
    return px.astype(np.float32), py.astype(np.float32), solid_angle.astype(np.float32)
