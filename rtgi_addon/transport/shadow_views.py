"""The views from which lamps are captured into reflective shadow maps, and the power that leaves a lamp through each texel.

A view is a pinhole (spot, point, area) or a parallel projection (sun, an area lamp of spread 0). Through a texel of solid angle Ω a
pinhole sends I(ω)·Ω, through one of area A a parallel beam sends E·A: neither knows the receiver's cosine, because a tilted surface
takes the same power on more area. Point and spot lamps that have a radius are seen from their centre.
"""

from dataclasses import dataclass

import numpy as np

from ..scene import AreaLight, Light, PointLight, SpotLight, SunLight
from .lamps import spot_attenuation

# Faces of a cube, in the order of graphics APIs, and for each an up vector that is not parallel to it.
_CUBE_AXES = np.array([(1, 0, 0), (-1, 0, 0), (0, 1, 0), (0, -1, 0), (0, 0, 1), (0, 0, -1)], np.float64)
_CUBE_UPS = np.array([(0, 0, 1)] * 4 + [(0, 1, 0)] * 2, np.float64)
# A cone wider than this half tangent is cut into the faces of a cube: a single frustum would spend its texels on the rim.
MAX_TANGENT = 2.0
# Rays and rasters begin at this share of the far distance: nothing on the lamp's own plane shadows it.
NEAR_SHARE = 1e-4
_GOLDEN_FRACTION = (np.sqrt(5.0) - 1.0) / 2.0


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
        x, y = self._window(_texel_centres(self.resolution))
        return self._fan() / np.sqrt(1.0 + x[None, :] ** 2 + y[:, None] ** 2).reshape(-1, 1)

    def texel_measure(self) -> np.ndarray:
        """(resolution, resolution) float64: exact solid angle [sr] of each texel, or area [m²] of one of a parallel projection."""
        edges = np.linspace(-1.0, 1.0, self.resolution + 1)
        x, y = self._window(edges)
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
        x, y = self._window(_texel_centres(self.resolution))
        right, up, back = self.world_from_view[:3, :3].T
        return ((y[:, None] * up - back)[:, None] + x[:, None] * right).reshape(-1, 3)

    def _window(self, ndc: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """View-space x and y of normalized device coordinates: at depth 1 of a pinhole, anywhere in a parallel projection."""
        matrix, column = self.clip_from_view, 3 if self.orthographic else 2
        sign = 1.0 if not self.orthographic else -1.0
        return tuple((ndc + sign * matrix[axis, column]) / matrix[axis, axis] for axis in range(2))


def views_of(context, lamp: int, resolution: int = 512, *, focus: np.ndarray | None = None,
             area_points: int = 4) -> tuple[ShadowView, ...]:
    """The views of lamp ``lamp`` of ``context``; none where it gives no light.

    A sun is fitted to the box ``focus`` (2, 3) (None: the whole scene) and moves in whole texels; a point lamp gets the faces of a
    cube, or a frustum around the scene if it is far outside; a spot a frustum around its cone, or cube faces if that is wide; an
    area lamp ``area_points`` stratified points with a hemicube each, or a frustum if its beam is narrow.
    """
    return lit_views(context.scene.lights[lamp], np.array(context.geometry.bounds(), np.float64), resolution, lamp, focus=focus,
                     area_points=area_points)


def lit_views(light: Light, bounds: np.ndarray, resolution: int, lamp: int = 0, *, focus: np.ndarray | None = None,
              area_points: int = 4) -> tuple[ShadowView, ...]:
    """As ``views_of`` for a scene of which only ``bounds`` (2, 3) are known."""
    views = views_of_light(light, bounds, resolution, lamp, focus=focus, area_points=area_points)
    # A wide spot reaches some faces of its cube only.
    return tuple(view for view in views if texel_power(light, view).any()) if isinstance(light, SpotLight) else views


def views_of_light(light: Light, bounds: np.ndarray, resolution: int, lamp: int = 0, *, focus: np.ndarray | None = None,
                   area_points: int = 4) -> tuple[ShadowView, ...]:
    """As ``lit_views``, but a wide spot gets all the faces of its cube."""
    if not np.any(_strength(light) > 0):
        return ()
    if isinstance(light, SunLight):
        placed = [_sun_view(light, bounds, bounds if focus is None else np.asarray(focus, np.float64), resolution)]
    elif isinstance(light, PointLight):
        placed = _point_views(light.position_world, bounds)
    elif isinstance(light, SpotLight):
        placed = _spot_views(light, bounds)
    else:
        placed = _area_views(light, bounds, area_points)
    return tuple(ShadowView(lamp, face, *view[:3], resolution, *view[3:]) for face, view in enumerate(placed))


def texel_power(light: Light, view: ShadowView) -> np.ndarray:
    """Power (resolution, resolution, 3) float32 [W] that ``light`` sends through each texel of ``view``."""
    measure = view.texel_measure().ravel()
    if isinstance(light, SunLight):
        per_measure = np.ones(measure.size)
    elif isinstance(light, PointLight):
        per_measure = np.ones(measure.size)
    elif isinstance(light, SpotLight):
        per_measure = spot_attenuation(light, view.directions())
    elif view.orthographic:
        per_measure = np.pi * _inside(light, view)
    else:
        cosine = view.directions() @ np.asarray(light.normal_world, np.float64)
        per_measure = view.share * light.area * np.maximum(cosine, 0.0) * _spread_gain(light, cosine)
    power = (per_measure * measure)[:, None] * _strength(light)
    return power.reshape(view.resolution, view.resolution, 3).astype(np.float32)


def _strength(light: Light) -> np.ndarray:
    name = {SunLight: "irradiance", AreaLight: "radiance"}.get(type(light), "intensity")
    return np.broadcast_to(np.asarray(getattr(light, name), np.float64), (3,))


def _sun_view(light: SunLight, bounds: np.ndarray, focus: np.ndarray, resolution: int):
    """Fitted to the focus's bounding sphere, whose size does not change as the sun turns; the texel lattice goes through the
    world's origin, so texels stay where they are when the focus moves."""
    rotation = _look_along(light.direction_world)
    radius = max(0.5 * float(np.linalg.norm(focus[1] - focus[0])), 1e-6)
    half = radius * resolution / max(resolution - 2, 1)
    texel = 2.0 * half / resolution
    centre = focus.mean(axis=0) @ rotation
    centre[:2] = np.round(centre[:2] / texel) * texel
    depth = _corners(bounds) @ rotation[:, 2]
    margin = 1e-3 * max(float(np.ptp(depth)), radius)
    # The eye lies before everything that can cast a shadow into the focus.
    centre[2] = float(depth.max()) + 2.0 * margin
    far = centre[2] - float(depth.min()) + margin
    return _pose(rotation, rotation @ centre), _orthographic(half, half, margin, far), True, margin, far


def _point_views(position, bounds: np.ndarray):
    """One frustum around the scene's bounding sphere where that takes less than a cube's face, else a cube."""
    towards = bounds.mean(axis=0) - np.asarray(position, np.float64)
    distance, radius = np.linalg.norm(towards), 0.5 * np.linalg.norm(bounds[1] - bounds[0])
    if distance > 1.5 * radius:
        # The sphere's silhouette; a thousandth more keeps its rim off the map's edge.
        return [_pinhole(_look_along(towards), position, bounds, 1.001 * radius / np.sqrt(distance**2 - radius**2))]
    return _cube_views(position, bounds)


def _cube_views(position, bounds: np.ndarray):
    return [_pinhole(_look_along(axis, up), position, bounds) for axis, up in zip(_CUBE_AXES, _CUBE_UPS, strict=True)]


def _spot_views(light: SpotLight, bounds: np.ndarray):
    rotation = _look_along(light.direction_world)
    axes = rotation if light.world_from_local is None else np.asarray(light.world_from_local, np.float64)
    half = 0.5 * min(light.cone_angle, np.pi)
    if half < 0.5 * np.pi - 1e-3:
        angle = np.linspace(0.0, 2.0 * np.pi, 256, endpoint=False)
        rim = np.stack([np.tan(half) * np.cos(angle), np.tan(half) * np.sin(angle), np.full(angle.size, -1.0)])
        x, y, z = rotation.T @ (axes @ rim)
        if np.all(z < 0):
            # The rim is sampled: a thousandth more than its extremes covers the arcs between.
            tangent = 1.001 * float(np.max(np.abs(np.stack([x, y]) / z)))
            if tangent <= MAX_TANGENT:
                return [_pinhole(rotation, light.position_world, bounds, tangent)]
    return _cube_views(light.position_world, bounds)


def _area_views(light: AreaLight, bounds: np.ndarray, points: int):
    """A hemicube at each of ``points`` stratified points, or a frustum each if the beam is narrow."""
    normal = np.asarray(light.normal_world, np.float64)
    half_u, half_v, centre = (np.asarray(axis, np.float64) for axis in
                              (light.half_u_world, light.half_v_world, light.position_world))
    tangent = np.tan(0.5 * light.spread) if light.spread < np.pi - 1e-6 else np.inf
    front = _look_along(normal, half_v)
    if tangent == 0:
        corners = np.stack([half_u, half_v]) @ front
        width, height = np.abs(corners[:, :2]).sum(axis=0)
        near, far = _depths(front, centre, bounds)
        return [(_pose(front, centre), _orthographic(width, height, near, far), True, near, far)]
    views = []
    for s, t in _shape_points(light.shape, points):
        position = centre + s * half_u + t * half_v
        views.append((*_pinhole(front, position, bounds, min(tangent, 1.0)), 1.0 / points))
        if tangent > 1:
            for side in (front[:, 0], -front[:, 0], front[:, 1], -front[:, 1]):
                views.append((*_pinhole(_look_along(side, normal), position, bounds, bottom=0.0), 1.0 / points))
    return views


def _shape_points(shape: str, count: int) -> np.ndarray:
    """(count, 2) in the square [−1, 1]² or the unit disk: a Fibonacci lattice, moved so that its mean is the middle."""
    index = np.arange(count)
    u, v = (index + 0.5) / count, np.mod(0.5 + index * _GOLDEN_FRACTION, 1.0)
    points = np.stack([2 * u - 1, 2 * v - 1], axis=-1)
    if shape == "ELLIPSE":
        points = np.sqrt(u)[:, None] * np.stack([np.cos(2 * np.pi * v), np.sin(2 * np.pi * v)], axis=-1)
    points -= points.mean(axis=0)
    reach = np.linalg.norm(points, axis=1) if shape == "ELLIPSE" else np.abs(points).max(axis=1)
    return points / max(1.0, float(reach.max()))


def _spread_gain(light: AreaLight, cosine: np.ndarray) -> np.ndarray:
    """Radiance in a direction relative to ``light.radiance``: the slats of a soft box (see ``AreaLight``)."""
    half = 0.5 * light.spread
    if half >= 0.5 * np.pi - 1e-6:
        return np.ones_like(cosine)
    tangent = np.sqrt(np.maximum(1.0 - cosine**2, 0.0)) / np.maximum(cosine, 1e-30)
    # tan x − x by its series where it cancels.
    scale = np.tan(half) - half if half > 0.05 else half**3 / 3.0
    return np.maximum(np.tan(half) - tangent, 0.0) / scale


def _inside(light: AreaLight, view: ShadowView) -> np.ndarray:
    """(n,) bool: texels of a parallel beam's view whose centres lie within the lamp's shape."""
    x, y = view._window(_texel_centres(view.resolution))
    plane = np.stack([part.ravel() for part in np.meshgrid(x, y)], axis=-1)
    axes = np.stack([light.half_u_world, light.half_v_world]).astype(np.float64) @ view.world_from_view[:3, :2]
    s, t = np.linalg.solve(axes.T, plane.T)
    return s * s + t * t <= 1.0 if light.shape == "ELLIPSE" else (np.abs(s) <= 1.0) & (np.abs(t) <= 1.0)


def _look_along(direction, up=None) -> np.ndarray:
    """Rotation (3, 3) whose columns are right, up and −``direction``. Without ``up`` world Z is up, or Y along the poles."""
    back = -np.asarray(direction, np.float64)
    back /= np.linalg.norm(back)
    if up is None:
        up = (0.0, 0.0, 1.0) if abs(back[2]) < 0.99 else (0.0, 1.0, 0.0)
    right = np.cross(up, back)
    right /= np.linalg.norm(right)
    return np.stack([right, np.cross(back, right), back], axis=1)


def _pose(rotation: np.ndarray, position) -> np.ndarray:
    pose = np.eye(4)
    pose[:3, :3], pose[:3, 3] = rotation, position
    return pose


def _pinhole(rotation: np.ndarray, position, bounds: np.ndarray, tangent: float = 1.0, bottom: float | None = None):
    """Pose, projection, whether it is parallel (no), near and far of a view that reaches ``tangent`` to all sides, or to ``bottom``
    below."""
    near, far = _depths(rotation, position, bounds)
    frustum = _frustum(-tangent, tangent, -tangent if bottom is None else bottom, tangent, near, far)
    return _pose(rotation, position), frustum, False, near, far


def _depths(rotation: np.ndarray, position, bounds: np.ndarray) -> tuple[float, float]:
    """Near and far [m] between which all of ``bounds`` lies that is in front: close to it, since rays start at the near plane."""
    offset = _corners(bounds) - np.asarray(position, np.float64)
    reach = 1.001 * max(float(np.linalg.norm(offset, axis=1).max()), 1e-6)
    depth = -(offset @ rotation[:, 2])
    near = max(NEAR_SHARE * reach, 0.999 * float(depth.min()))
    return near, max(1.001 * float(depth.max()), 2.0 * NEAR_SHARE * reach)


def _corners(bounds: np.ndarray) -> np.ndarray:
    return np.stack(np.meshgrid(*bounds.T, indexing="ij"), axis=-1).reshape(-1, 3)


def _frustum(left, right, bottom, top, near, far) -> np.ndarray:
    """OpenGL's perspective matrix with the window given at depth 1."""
    return np.array([[2 / (right - left), 0, (right + left) / (right - left), 0],
                     [0, 2 / (top - bottom), (top + bottom) / (top - bottom), 0],
                     [0, 0, -(far + near) / (far - near), -2 * far * near / (far - near)], [0, 0, -1, 0]], np.float64)


def _orthographic(half_width, half_height, near, far) -> np.ndarray:
    return np.array([[1 / half_width, 0, 0, 0], [0, 1 / half_height, 0, 0],
                     [0, 0, -2 / (far - near), -(far + near) / (far - near)], [0, 0, 0, 1]], np.float64)


def _texel_centres(resolution: int) -> np.ndarray:
    return (np.arange(resolution) + 0.5) / resolution * 2.0 - 1.0
