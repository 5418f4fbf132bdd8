"""Flat pieces of emissive surfaces, each of even radiance: what they give a receiver in closed form, and directions to them.

What a polygon of radiance L gives a plane is L/2·Σ θ·(n·γ) over its edges, θ the angle that an edge is seen under and γ the unit
normal of its plane through the receiver, once it is clipped to the plane's horizon (Lambert 1760; Arvo 1994, "The Irradiance
Jacobian for Partially Occluded Polyhedral Sources"). Directions are drawn by Arvo, "Stratified Sampling of Spherical Triangles"
(1995), warped by the cosine at its corners (Hart, Pharr, Müller, Lopes, McGuire and Shirley 2020, "Practical Product Sampling by
Fitting and Composing Warps"), in the form of pbrt-v4.
"""

from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np

from ..vectors import dot, luminance

# Triangles are drawn from by solid angle where they are seen under more than this [sr]; smaller ones look alike all over, and
# angles cancel to them.
SMALL = 1e-4
# The least cosine that a corner counts with where directions are drawn.
_LEAST = 0.01
_TINY = 1e-30


class PaneSample(NamedTuple):
    """A direction to a pane from each of n receivers: ``direction`` (n, 3), the ``distance`` (n,) along it, ``index`` (n,) of the
    pane, and ``weight`` (n, 3): what it stands for [W·m⁻²], 0 where no pane shines on the receiver. Its mean is the panes'
    irradiance."""

    direction: np.ndarray
    distance: np.ndarray
    index: np.ndarray
    weight: np.ndarray


@dataclass(frozen=True, eq=False)
class Panes:
    """``corners`` (m, 4, 3) float64 of flat convex quadrilaterals, triangles with their last corner twice, counter-clockwise as
    seen from the one side that shines, with ``radiance`` (m, 3) [W·sr⁻¹·m⁻²]."""

    corners: np.ndarray
    radiance: np.ndarray

    @property
    def count(self) -> int:
        """How many there are."""
        return len(self.corners)

    @cached_property
    def normals(self) -> np.ndarray:
        """Unit normals (m, 3) on the side that shines."""
        across = np.cross(self.corners[:, 2] - self.corners[:, 0], self.corners[:, 3] - self.corners[:, 1])
        across = np.where(np.any(self.corners[:, 2] != self.corners[:, 3], axis=1, keepdims=True), across,
                          np.cross(self.corners[:, 1] - self.corners[:, 0], self.corners[:, 2] - self.corners[:, 0]))
        return across / np.maximum(np.linalg.norm(across, axis=1), _TINY)[:, None]

    @cached_property
    def triangles(self) -> np.ndarray:
        """(m, 2, 3, 3): both halves of each; of a triangle the second has no area."""
        return np.stack([self.corners[:, [0, 1, 2]], self.corners[:, [0, 2, 3]]], axis=1)

    @cached_property
    def areas(self) -> np.ndarray:
        """(m, 2) [m²] of the halves."""
        a, b, c = np.moveaxis(self.triangles, 2, 0)
        return 0.5 * np.linalg.norm(np.cross(b - a, c - a), axis=-1)

    def factors(self, points: np.ndarray, normals: np.ndarray) -> np.ndarray:
        """Irradiance over radiance (m, n) [sr] of each pane at ``points`` with unit ``normals`` (n, 3), with nothing in the way."""
        points, normals = np.asarray(points, np.float64), np.asarray(normals, np.float64)
        result = np.zeros((self.count, len(points)))
        for pane, (corners, normal) in enumerate(zip(self.corners, self.normals, strict=True)):
            rows = np.flatnonzero((dot(points - corners[0], normal) > 0) & self._above(corners, points, normals))
            result[pane, rows] = polygon_factor(corners - points[rows, None], normals[rows])
        return result

    def irradiance(self, points: np.ndarray, normals: np.ndarray) -> np.ndarray:
        """Irradiance (n, 3) [W·m⁻²] of all at ``points`` with unit ``normals`` (n, 3), with nothing in the way."""
        return self.factors(points, normals).T @ self.radiance

    def sample(self, points: np.ndarray, normals: np.ndarray, u: np.ndarray, factors: np.ndarray) -> PaneSample:
        """A direction from each of ``points`` with unit ``normals`` (n, 3) by ``u`` (n, 3) in [0, 1), about as often as light comes
        from there; ``factors`` as the method of that name tells them."""
        n = len(points)
        share = factors * luminance(self.radiance)[:, None]
        total = np.cumsum(share, axis=0)
        target = u[:, 0] * total[-1] if self.count else np.zeros(n)
        index = np.minimum(np.sum(total <= target, axis=0), self.count - 1)
        columns = np.arange(n)
        own = share[index, columns]
        chance = own / np.maximum(total[-1], _TINY)
        # What is left of the number says which half of the pane.
        left = np.clip((target - (total[index, columns] - own)) / np.maximum(own, _TINY), 0.0, 1.0)
        halves = self.triangles[index] - np.asarray(points, np.float64)[:, None, None]
        first = np.clip(np.where(own > 0, polygon_factor(halves[:, 0], normals), 0.0)
                        / np.maximum(factors[index, columns], _TINY), 0.0, 1.0)
        second = left >= first
        half = np.where(second, 1, 0)
        direction, distance, weight = sample_triangle(halves[columns, half], self.areas[index, half], u[:, 1:], normals)
        weight /= np.maximum(np.where(second, 1.0 - first, first) * chance, _TINY)
        weight = np.where((own > 0) & (chance > 0), weight, 0.0)
        return PaneSample(direction, distance, index, weight[:, None] * self.radiance[index])

    @staticmethod
    def _above(corners: np.ndarray, points: np.ndarray, normals: np.ndarray) -> np.ndarray:
        foot = dot(points, normals)
        return np.max(corners @ normals.T - foot, axis=0) > 0


def polygon_factor(corners: np.ndarray, normals: np.ndarray) -> np.ndarray:
    """Irradiance over radiance (n,) [sr] of convex polygons ``corners`` (n, k, 3) seen from the origin, on planes with unit
    ``normals`` (n, 3); negative where they run clockwise as seen from there. Corners may coincide."""
    count = corners.shape[1]
    height = dot(corners, normals[:, None])
    total = np.zeros(len(corners))
    out, back = np.zeros((2, len(corners), 3))
    for start in range(count):
        end = (start + 1) % count
        a, b, below_a, below_b = corners[:, start], corners[:, end], height[:, start] < 0, height[:, end] < 0
        fall = height[:, start] - height[:, end]
        share = height[:, start] / np.where(below_a != below_b, fall, 1.0)
        crossing = a + np.clip(share, 0.0, 1.0)[:, None] * (b - a)
        out[~below_a & below_b] = crossing[~below_a & below_b]
        back[below_a & ~below_b] = crossing[below_a & ~below_b]
        a, b = np.where(below_a[:, None], crossing, a), np.where(below_b[:, None], crossing, b)
        total += np.where(below_a & below_b, 0.0, _edge(a, b, normals))
    # The horizon closes what it cut.
    return 0.5 * (total + _edge(out, back, normals))


def _edge(a: np.ndarray, b: np.ndarray, normals: np.ndarray) -> np.ndarray:
    across = np.cross(b, a)
    length = np.sqrt(dot(across, across))
    return np.arctan2(length, dot(a, b)) * dot(across, normals) / np.maximum(length, _TINY)


def solid_angle(triangles: np.ndarray) -> np.ndarray:
    """Solid angle (n,) [sr] of ``triangles`` (n, 3, 3) from the origin, negative where they run clockwise as seen from there
    (Van Oosterom and Strackee 1983)."""
    a, b, c = np.moveaxis(triangles, 1, 0)
    la, lb, lc = (np.sqrt(dot(side, side)) for side in (a, b, c))
    numerator = dot(a, np.cross(b, c))
    return 2.0 * np.arctan2(numerator, la * lb * lc + dot(a, b) * lc + dot(b, c) * la + dot(c, a) * lb)


def sample_triangle(triangles: np.ndarray, areas: np.ndarray, u: np.ndarray,
                    normals: np.ndarray | None = None) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Directions (n, 3) from the origin to ``triangles`` (n, 3, 3) of ``areas`` (n,) by ``u`` (n, 2), the distances (n,), and what
    each stands for (n,): solid angle [sr], with ``normals`` (n, 3) times the cosine, 0 below the horizon."""
    a, b, c = np.moveaxis(triangles, 1, 0)
    angle = np.abs(solid_angle(triangles))
    root = np.sqrt(u[:, :1])
    place = a * (1.0 - root) + b * (root * (1.0 - u[:, 1:])) + c * (root * u[:, 1:])
    squared = np.maximum(dot(place, place), _TINY)
    direction = place / np.sqrt(squared)[:, None]
    facing = np.cross(b - a, c - a)
    facing /= np.maximum(np.sqrt(dot(facing, facing)), _TINY)[:, None]
    weight = areas * np.abs(dot(facing, direction)) / squared
    near = np.flatnonzero(angle > SMALL)
    if near.size:
        corners = [part[near] / np.maximum(np.sqrt(dot(part[near], part[near])), _TINY)[:, None] for part in (a, b, c)]
        numbers, density = u[near], np.ones(near.size)
        if normals is not None:
            numbers, density = _warped(numbers, [np.maximum(dot(corner, normals[near]), _LEAST) for corner in corners])
        direction[near] = _on_sphere(*corners, numbers)
        weight[near] = angle[near] / density
    if normals is not None:
        weight = weight * np.maximum(dot(direction, normals), 0.0)
    towards = dot(facing, direction)
    distance = dot(facing, a) / np.where(np.abs(towards) > _TINY, towards, 1.0)
    return direction, np.maximum(distance, 0.0), weight


def _on_sphere(a: np.ndarray, b: np.ndarray, c: np.ndarray, u: np.ndarray) -> np.ndarray:
    """Unit vectors (n, 3) in the spherical triangles of unit ``a``, ``b``, ``c`` (n, 3), even over their area."""
    ab, bc, ca = (_unit(np.cross(*pair)) for pair in ((a, b), (b, c), (c, a)))
    alpha, beta, gamma = (_angle(one, -other) for one, other in ((ab, ca), (bc, ab), (ca, bc)))
    turned = np.pi + u[:, 0] * (alpha + beta + gamma - np.pi)
    cos_alpha, sin_alpha = np.cos(alpha), np.sin(alpha)
    sin_phi = np.sin(turned) * cos_alpha - np.cos(turned) * sin_alpha
    cos_phi = np.cos(turned) * cos_alpha + np.sin(turned) * sin_alpha
    k1, k2 = cos_phi + cos_alpha, sin_phi - sin_alpha * dot(a, b)
    below = (k2 * sin_phi + k1 * cos_phi) * sin_alpha
    cosine = np.clip((k2 + (k2 * cos_phi - k1 * sin_phi) * cos_alpha) / np.where(np.abs(below) > _TINY, below, _TINY), -1.0, 1.0)
    moved = cosine[:, None] * a + np.sqrt(1.0 - cosine * cosine)[:, None] * _unit(c - dot(c, a)[:, None] * a)
    along = 1.0 - u[:, 1] * (1.0 - dot(moved, b))
    across = np.sqrt(np.maximum(1.0 - along * along, 0.0))
    return along[:, None] * b + across[:, None] * _unit(moved - dot(moved, b)[:, None] * b)


def _warped(u: np.ndarray, cosines: list[np.ndarray]) -> tuple[np.ndarray, np.ndarray]:
    """Numbers (n, 2) as often as the cosines at the corners a, b, c say, and their density (n,) in the square."""
    a, b, c = cosines
    y = _linear(u[:, 1], b, 0.5 * (a + c))
    x = _linear(u[:, 0], b + (a - b) * y, b + (c - b) * y)
    density = ((b + (a - b) * y) * (1.0 - x) + (b + (c - b) * y) * x) / (0.5 * b + 0.25 * (a + c))
    return np.stack([x, y], axis=1), density


def _linear(u: np.ndarray, at_0: np.ndarray, at_1: np.ndarray) -> np.ndarray:
    """Numbers (n,) in [0, 1] of a density that goes in a line from one value to the other."""
    return np.minimum(u * (at_0 + at_1) / (at_0 + np.sqrt(at_0 * at_0 + u * (at_1 * at_1 - at_0 * at_0))), 1.0)


def _unit(vectors: np.ndarray) -> np.ndarray:
    return vectors / np.maximum(np.sqrt(dot(vectors, vectors)), _TINY)[:, None]


def _angle(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Angle (n,) between unit vectors (n, 3), exact for small ones."""
    apart, together = a - b, a + b
    return 2.0 * np.arctan2(np.sqrt(dot(apart, apart)), np.sqrt(dot(together, together)))
