"""The views from which lamps are captured: a pinhole, or a parallel projection, as poses and OpenGL matrices.

A view is a pinhole (spot, point, area) or a parallel projection (sun, an area lamp of spread 0). Through a texel of solid angle Ω a
pinhole sends I(ω)·Ω, through one of area A a parallel beam sends E·A: neither knows the receiver's cosine, because a tilted surface
takes the same power on more area. Point and spot lamps that have a radius are seen from their centre.
"""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

# Faces of a cube, in the order of graphics APIs, and for each an up vector that is not parallel to it.
_CUBE_AXES = np.array([(1, 0, 0), (-1, 0, 0), (0, 1, 0), (0, -1, 0), (0, 0, 1), (0, 0, -1)], np.float64)
_CUBE_UPS = np.array([(0, 0, 1)] * 4 + [(0, 1, 0)] * 2, np.float64)
# Rays and rasters begin at this share of the far distance: nothing on the lamp's own plane shadows it.
NEAR_SHARE = 1e-4
# Near and far planes stand off what they hold by this share of their depth.
_SLACK = 1e-3
# A direction this close to world Z, by its cosine, is looked along with another axis up.
_ALONG_UP = 0.99


class Placed(NamedTuple):
    """A view without a lamp's name on it: see the fields of ``ShadowView``."""

    world_from_view: np.ndarray
    clip_from_view: np.ndarray
    orthographic: bool
    near: float
    far: float
    share: float = 1.0


@dataclass(frozen=True, eq=False)
class ShadowView:
    """One square image of the scene as a lamp lights it.

    ``lamp`` indexes ``Scene.lights``; ``face`` counts a lamp's views; ``world_from_view`` (4, 4) float64 looks along −Z with +Y up;
    ``clip_from_view`` (4, 4) float64 is OpenGL's (depth −1 … 1); ``near`` and ``far`` [m] along −Z; ``share`` of the lamp's surface
    that this view stands for. Row 0 of the ``resolution`` × ``resolution`` texels is the bottom one.
    """

    lamp: int
    face: int
    world_from_view: np.ndarray
    clip_from_view: np.ndarray
    orthographic: bool
    resolution: int
    near: float
    far: float
    share: float = 1.0

    @property
    def position_world(self) -> np.ndarray:
        """(3,) float64: the pinhole, or the middle of the plane that a parallel projection starts from."""
        return self.world_from_view[:3, 3]

    @property
    def clip_from_world(self) -> np.ndarray:
        """(4, 4) float64."""
        return self.clip_from_view @ np.linalg.inv(self.world_from_view)

    def rays(self) -> tuple[np.ndarray, np.ndarray]:
        """Through every texel's centre, row by row: origins (n, 3) float32 on the near plane and directions (n, 3) float32 that
        reach the far plane at t = 1."""
        fan, back = self._fan(), self.world_from_view[:3, 2]
        # A parallel projection spreads its origins, a pinhole its directions.
        origins = self.position_world + (fan + (1.0 - self.near) * back if self.orthographic else self.near * fan)
        directions = np.broadcast_to(-back, fan.shape) if self.orthographic else fan
        return tuple(np.ascontiguousarray(part, np.float32) for part in (origins, (self.far - self.near) * directions))

    def directions(self) -> np.ndarray:
        """Unit directions (n, 3) float64 in which light travels through the texels' centres."""
        if self.orthographic:
            return np.tile(-self.world_from_view[:3, 2], (self.resolution**2, 1))
        x, y = self.window(texel_centres(self.resolution))
        return self._fan() / np.sqrt(1.0 + x[None, :] ** 2 + y[:, None] ** 2).reshape(-1, 1)

    def texel_measure(self) -> np.ndarray:
        """(resolution, resolution) float64: exact solid angle [sr] of each texel, or area [m²] of one of a parallel projection."""
        edges = np.linspace(-1.0, 1.0, self.resolution + 1)
        x, y = self.window(edges)
        if self.orthographic:
            return np.diff(y)[:, None] * np.diff(x)[None, :]
        corner = np.arctan2(x[None, :] * y[:, None], np.sqrt(x[None, :] ** 2 + y[:, None] ** 2 + 1.0))
        return np.diff(np.diff(corner, axis=0), axis=1)

    def project(self, points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Map coordinates (n, 2) of world ``points`` (n, 3), [0, 1] inside the map, and which of them lie in front (n,) bool; those
        behind a pinhole come out far beyond the edge on their side."""
        clip = np.asarray(points, np.float64) @ self.clip_from_world[:, :3].T + self.clip_from_world[:, 3]
        depth = np.maximum(clip[:, 3], 1e-6 * np.abs(clip[:, :2]).max(axis=1) + 1e-30)
        return 0.5 + 0.5 * clip[:, :2] / depth[:, None], clip[:, 3] > 0

    def _fan(self) -> np.ndarray:
        """From the eye to the texels' centres at depth 1 (n, 3) float64, world axes, row by row."""
        x, y = self.window(texel_centres(self.resolution))
        right, up, back = self.world_from_view[:3, :3].T
        return ((y[:, None] * up - back)[:, None] + x[:, None] * right).reshape(-1, 3)

    def window(self, ndc: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """View-space x and y of normalized device coordinates: at depth 1 of a pinhole, anywhere in a parallel projection."""
        matrix, column = self.clip_from_view, 3 if self.orthographic else 2
        sign = 1.0 if not self.orthographic else -1.0
        return tuple((ndc + sign * matrix[axis, column]) / matrix[axis, axis] for axis in range(2))


def cube_views(position, bounds: np.ndarray) -> list[Placed]:
    """The six faces of a cube about ``position`` (3,) in a scene of ``bounds`` (2, 3)."""
    return [pinhole(look_along(axis, up), position, bounds) for axis, up in zip(_CUBE_AXES, _CUBE_UPS, strict=True)]


def look_along(direction, up=None) -> np.ndarray:
    """Rotation (3, 3) whose columns are right, up and −``direction``. Without ``up`` world Z is up, or Y along the poles."""
    back = -np.asarray(direction, np.float64)
    back /= np.linalg.norm(back)
    if up is None:
        up = (0.0, 0.0, 1.0) if abs(back[2]) < _ALONG_UP else (0.0, 1.0, 0.0)
    right = np.cross(up, back)
    right /= np.linalg.norm(right)
    return np.stack([right, np.cross(back, right), back], axis=1)


def pose(rotation: np.ndarray, position) -> np.ndarray:
    """(4, 4) from a rotation (3, 3) and a position (3,)."""
    matrix = np.eye(4)
    matrix[:3, :3], matrix[:3, 3] = rotation, position
    return matrix


def pinhole(rotation: np.ndarray, position, bounds: np.ndarray, tangent: float = 1.0, bottom: float | None = None) -> Placed:
    """A view that reaches ``tangent`` to all sides, or to ``bottom`` below."""
    near, far = depths(rotation, position, bounds)
    window = frustum(-tangent, tangent, -tangent if bottom is None else bottom, tangent, near, far)
    return Placed(pose(rotation, position), window, False, near, far)


def side_views(front: np.ndarray, position, bounds: np.ndarray) -> list[Placed]:
    """The four halves of a cube's faces beside the ``front`` one that a rotation (3, 3) looks along: what is before a plane."""
    return [pinhole(look_along(side, -front[:, 2]), position, bounds, bottom=0.0)
            for side in (front[:, 0], -front[:, 0], front[:, 1], -front[:, 1])]


def depths(rotation: np.ndarray, position, bounds: np.ndarray) -> tuple[float, float]:
    """Near and far [m] between which all of ``bounds`` lies that is in front: close to it, since rays start at the near plane."""
    offset = corners(bounds) - np.asarray(position, np.float64)
    reach = (1.0 + _SLACK) * max(float(np.linalg.norm(offset, axis=1).max()), 1e-6)
    depth = -(offset @ rotation[:, 2])
    near = max(NEAR_SHARE * reach, (1.0 - _SLACK) * float(depth.min()))
    return near, max((1.0 + _SLACK) * float(depth.max()), 2.0 * NEAR_SHARE * reach)


def parallel(rotation: np.ndarray, position, half_width: float, half_height: float, near: float, far: float) -> Placed:
    """A parallel projection of that half width and height [m]."""
    return Placed(pose(rotation, position), orthographic(half_width, half_height, near, far), True, near, far)


def corners(bounds: np.ndarray) -> np.ndarray:
    """The eight corners (8, 3) of a box (2, 3)."""
    return np.stack(np.meshgrid(*bounds.T, indexing="ij"), axis=-1).reshape(-1, 3)


def frustum(left, right, bottom, top, near, far) -> np.ndarray:
    """OpenGL's perspective matrix with the window given at depth 1."""
    return np.array([[2 / (right - left), 0, (right + left) / (right - left), 0],
                     [0, 2 / (top - bottom), (top + bottom) / (top - bottom), 0],
                     [0, 0, -(far + near) / (far - near), -2 * far * near / (far - near)], [0, 0, -1, 0]], np.float64)


def orthographic(half_width, half_height, near, far) -> np.ndarray:
    """OpenGL's matrix of a parallel projection."""
    return np.array([[1 / half_width, 0, 0, 0], [0, 1 / half_height, 0, 0],
                     [0, 0, -2 / (far - near), -(far + near) / (far - near)], [0, 0, 0, 1]], np.float64)


def texel_centres(resolution: int) -> np.ndarray:
    """Normalized device coordinates (resolution,) of a row of texels."""
    return (np.arange(resolution) + 0.5) / resolution * 2.0 - 1.0
