"""Area lamps: one-sided rectangles and ellipses, with a beam spread (the slats of a soft box, Blender D10594) as in Cycles."""

from dataclasses import replace
from functools import lru_cache

import numpy as np

from ...numerics.sampling import GOLDEN_FRACTION, cosine_hemisphere, disk_from_square
from ...scene import AreaLight, PointLight
from ..vectors import dot, normalized
from .area_sampling import AreaRows, sample_shape, shape_density
from .kind import Emission, LampKind
from .shadow_view import ShadowView, depths, look_along, parallel, pinhole, side_views, texel_centres
from .tabulated import CELLS, cumulated, invert

# A spread this close to π [rad] is none.
NO_SPREAD = 1e-6
# What stands for a tangent without bound in a shader.
UNBOUNDED = 1e30


class Area(LampKind):
    """See the module's docstring."""

    light, name = AreaLight, "AREA"

    def rows(self, lights):
        """See LampKind."""
        return AreaRows.of([_row(light) for light in lights])

    def sample(self, rows, points, uv):
        """See LampKind."""
        n = len(points)
        x, y, z = _local_centre(rows, points)
        radiance = np.broadcast_to(rows.radiance, (n, 3))
        collimated = rows.tan_half_spread == 0
        if collimated.all():
            px, py, weight = np.zeros(n, np.float32), np.zeros(n, np.float32), _collimated(rows, x, y, z)
        else:
            px, py, weight = sample_shape(rows, x, y, z, uv)
            if collimated.any():
                px, py = np.where(collimated, np.float32(0.0), px), np.where(collimated, np.float32(0.0), py)
                weight = np.where(collimated, _collimated(rows, x, y, z), weight)
        distance = np.sqrt(np.maximum(px * px + py * py + z * z, np.finfo(np.float32).tiny))
        direction = (px[:, None] * rows.u + py[:, None] * rows.v - z[:, None] * rows.normal) / distance[:, None]
        return direction, distance, radiance * weight[:, None]

    def meet(self, rows, points, directions):
        """See LampKind."""
        x, y, z = _local_centre(rows, points)
        ahead = -dot(np.broadcast_to(rows.normal, directions.shape), directions)
        # Rays that go past the lamp's plane come to nothing: far aside, where no lamp is.
        reach = np.where((ahead > 0) & (z > 0), z / np.where(ahead > 0, ahead, np.float32(1.0)), np.float32(0.0))
        px, py = (reach * dot(np.broadcast_to(axis, directions.shape), directions) for axis in (rows.u, rows.v))
        density, weight = shape_density(rows, x, y, z, px, py)
        density = np.where((reach > 0) & (rows.tan_half_spread > 0), density, np.float32(0.0))
        return reach, np.broadcast_to(rows.radiance, (len(points), 3)) * weight[:, None], density

    def importance(self, rows, points, normals):
        """See LampKind."""
        x, y, z = _local_centre(rows, points)
        offset_squared = x * x + y * y
        distance_squared = np.maximum(offset_squared + z * z, np.float32(1e-12))
        distance = np.sqrt(distance_squared)
        extent = np.sqrt(np.square(rows.a + np.abs(rows.shear) * rows.b) + np.square(rows.b))
        part = np.minimum(extent / distance, 1.0)
        towards = rows.position - points
        cosine = np.maximum(dot(towards, normals) / distance + part, 0.0) / (1.0 + part)
        nearest = np.maximum(np.sqrt(offset_squared) - extent, 0.0)
        front = z > 0
        tangent = nearest / np.where(front, z, np.float32(1.0))
        with np.errstate(invalid="ignore"):
            spread = np.where(np.isinf(rows.tan_half_spread), np.float32(1.0), (rows.tan_half_spread - tangent) * rows.spread_gain)
        diffuse = rows.area * z / distance / (distance_squared + rows.area / np.float32(np.pi)) * np.maximum(spread, 0.0)
        diffuse = np.minimum(diffuse, np.float32(np.pi))
        beam = np.where(nearest == 0, np.float32(np.pi), np.float32(0.0))
        factor = np.where(rows.tan_half_spread == 0, beam, diffuse)
        return rows.radiance * np.where(front, factor * cosine, np.float32(0.0))[:, None]

    def plain(self, light):
        """See LampKind: of 4π sr, a diffuse side gives π."""
        return PointLight(light.name, light.position_world, np.asarray(light.radiance * (light.area / 4.0), np.float32))

    def is_delta(self, light):
        """See LampKind."""
        return light.spread == 0

    def extent(self, light):
        """See LampKind."""
        return float(np.linalg.norm(light.half_u_world) + np.linalg.norm(light.half_v_world))

    def measure(self, light, scene_radius):
        """See LampKind: the spread only turns the light, it keeps the flux."""
        return np.pi * light.area

    def emit(self, light, u, beam):
        """See LampKind."""
        axes = _frame(light)
        origins = _points(light, u[:, 2:])
        flux = np.pi * light.area * np.asarray(light.radiance, np.float32)
        if light.spread <= 0:
            # A parallel beam spreads out over the lamp's surface alone.
            origins = _points(light, u[:, :2])
            directions = np.repeat(axes[2:].astype(np.float32), len(u), axis=0)
            return Emission(origins, directions, np.tile(flux, (len(u), 1)), origins)
        if light.spread >= np.pi - NO_SPREAD:
            local, gain = cosine_hemisphere(u[:, :2]), np.ones(len(u))
        else:
            half = 0.5 * float(light.spread)
            theta, cdf = _spread_table(half)
            angle, density = invert(theta, cdf, u[:, 0])
            azimuth = 2.0 * np.pi * u[:, 1].astype(np.float64)
            local = np.stack([np.sin(angle) * np.cos(azimuth), np.sin(angle) * np.sin(azimuth), np.cos(angle)], axis=1)
            gain = 2.0 * _spread_profile(angle, half) / _tangent_excess(half) / density
        directions = normalized((local @ axes).astype(np.float32))
        return Emission(origins, directions, flux * gain[:, None].astype(np.float32), _domain(light, directions))

    def connect(self, light, points, u, beam):
        """See LampKind."""
        origins = _points(light, u)
        directions = normalized(points - origins)
        return origins, directions, _domain(light, directions), _shines(light, origins, points)

    def can_follow(self, old, new):
        """See LampKind: a parallel beam's rays do not spread."""
        return new.spread > 0 and old.shape == new.shape

    def views(self, light, bounds, focus, resolution, area_points):
        """A hemicube at each of ``area_points`` stratified points, or a frustum each if the beam is narrow."""
        normal = np.asarray(light.normal_world, np.float64)
        half_u, half_v, centre = (np.asarray(axis, np.float64) for axis in
                                  (light.half_u_world, light.half_v_world, light.position_world))
        tangent = np.tan(0.5 * light.spread) if light.spread < np.pi - NO_SPREAD else np.inf
        front = look_along(normal, half_v)
        if tangent == 0:
            ends = np.stack([half_u, half_v]) @ front
            width, height = np.abs(ends[:, :2]).sum(axis=0)
            return [parallel(front, centre, width, height, *depths(front, centre, bounds))]
        views = []
        for s, t in _shape_points(light.shape, area_points):
            position = centre + s * half_u + t * half_v
            faces = [pinhole(front, position, bounds, min(tangent, 1.0))]
            if tangent > 1:
                faces += side_views(front, position, bounds)
            views += [face._replace(share=1.0 / area_points) for face in faces]
        return views

    def power_per_measure(self, light, view):
        """See LampKind."""
        if view.orthographic:
            return np.pi * _inside(light, view)
        cosine = view.directions() @ np.asarray(light.normal_world, np.float64)
        return view.share * light.area * np.maximum(cosine, 0.0) * _spread_gain(light, cosine)

    def shader_point(self, light, u):
        """See LampKind."""
        row = self.rows([light]).take(0)
        s, t = disk_from_square(u[:2]) if row.ellipse else 2.0 * u[:2] - 1.0
        if row.tan_half_spread == 0:
            s = t = 0.0
        shift = (row.a * s + row.shear * row.b * t) * row.u + row.b * t * row.v
        # Rows that take a point relative to the centre to the square or the disk that stands for the lamp.
        beam = np.zeros((4, 4))
        beam[0, :3] = (row.u - row.shear * row.v) / row.a
        beam[1, :3] = row.v / row.b
        position = np.asarray(light.position_world, np.float64)
        collimated = row.tan_half_spread == 0
        strength = np.asarray(light.radiance, np.float64) * (np.pi if collimated else row.area)
        uniforms = {"position": position, "shift": shift, "axis": row.normal, "strength": strength, "beam": beam,
                    "ellipse": int(row.ellipse), "tan_half_spread": min(float(row.tan_half_spread), UNBOUNDED),
                    "spread_gain": row.spread_gain}
        return replace(light, position_world=position + shift), uniforms


def lamp_places(light: AreaLight, view: ShadowView) -> tuple[np.ndarray, np.ndarray]:
    """Where on the lamp its views stand, (m, 2) along its half axes, and where ``view``, which is one of them, does (2,)."""
    axes = np.stack([light.half_u_world, light.half_v_world], axis=1).astype(np.float64)
    own = np.linalg.pinv(axes) @ (view.position_world - np.asarray(light.position_world, np.float64))
    return _shape_points(light.shape, round(1.0 / view.share)), own


def _row(light: AreaLight) -> tuple:
    """A lamp's values in ``AreaRows``."""
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
    if half_spread >= 0.5 * (np.pi - 2.0 * NO_SPREAD):
        tangent, gain = np.inf, 1.0
    else:
        # 1/∫cos(x)(1 − tan x/tan h)sin(x)dx relative to a cosine lobe, over tan h.
        tangent, gain = np.tan(half_spread), 1.0 / _tangent_excess(half_spread) if half_spread > 0 else 0.0
    return light.position_world, u, v, normal, light.radiance, a, b, shear, light.shape == "ELLIPSE", tangent, gain


def _tangent_excess(half: float) -> float:
    """tan h − h, by its series where it cancels."""
    return np.tan(half) - half if half > 0.05 else half**3 / 3.0


def _local_centre(rows: AreaRows, points: np.ndarray):
    """The lamp's centre seen from the points along its own axes, and their height above its front."""
    towards = rows.position - points
    return dot(towards, rows.u), dot(towards, rows.v), -dot(towards, rows.normal)


def _collimated(rows: AreaRows, x, y, z) -> np.ndarray:
    """Spread 0 is a parallel beam: E = πL on a facing plane, straight below the shape and nowhere else."""
    t = -y / rows.b
    s = (-x - rows.shear * rows.b * t) / rows.a
    inside = np.where(rows.ellipse, s * s + t * t <= 1.0, (np.abs(s) <= 1.0) & (np.abs(t) <= 1.0))
    return np.where(inside & (z > 0), np.float32(np.pi), np.float32(0.0))


def _frame(light: AreaLight) -> np.ndarray:
    """Rows: an orthonormal frame (3, 3) about the lamp's normal, turning with its axes."""
    normal = np.asarray(light.normal_world, np.float64)
    tangent = np.asarray(light.half_u_world, np.float64)
    tangent = tangent - normal * (tangent @ normal)
    tangent /= max(np.linalg.norm(tangent), 1e-300)
    return np.stack([tangent, np.cross(normal, tangent), normal])


def _points(light: AreaLight, u: np.ndarray) -> np.ndarray:
    st = disk_from_square(u) if light.shape == "ELLIPSE" else 2.0 * u - 1.0
    return (np.asarray(light.position_world, np.float64) + st[:, :1] * np.asarray(light.half_u_world, np.float64)
            + st[:, 1:] * np.asarray(light.half_v_world, np.float64)).astype(np.float32)


def _domain(light: AreaLight, directions: np.ndarray) -> np.ndarray:
    """The projected hemisphere (Nusselt), where cosine emission is uniform."""
    local = directions @ _frame(light).T.astype(np.float32)
    return np.concatenate([local[:, :2], np.zeros((len(local), 1), np.float32)], axis=1)


def _shines(light: AreaLight, origins: np.ndarray, points: np.ndarray) -> np.ndarray:
    cosine = normalized(points - origins) @ np.asarray(light.normal_world, np.float32)
    if light.spread >= np.pi - NO_SPREAD:
        return cosine > 0
    return cosine > max(np.cos(0.5 * light.spread), 1e-6)


def _spread_gain(light: AreaLight, cosine: np.ndarray) -> np.ndarray:
    """Radiance in a direction relative to ``light.radiance`` (see ``AreaLight``)."""
    half = 0.5 * light.spread
    if half >= 0.5 * (np.pi - 2.0 * NO_SPREAD):
        return np.ones_like(cosine)
    tangent = np.sqrt(np.maximum(1.0 - cosine**2, 0.0)) / np.maximum(cosine, 1e-30)
    return np.maximum(np.tan(half) - tangent, 0.0) / _tangent_excess(half)


def _spread_profile(angle: np.ndarray, half: float) -> np.ndarray:
    """Power per angle from the normal: (tan h − tan θ)·cosθ·sinθ."""
    return np.maximum(np.tan(half) * np.cos(angle) - np.sin(angle), 0.0) * np.sin(angle)


@lru_cache(maxsize=64)
def _spread_table(half: float) -> tuple[np.ndarray, np.ndarray]:
    theta = np.linspace(0.0, half, CELLS + 1)
    return theta, cumulated(_spread_profile(0.5 * (theta[1:] + theta[:-1]), half))


def _shape_points(shape: str, count: int) -> np.ndarray:
    """(count, 2) in the square [−1, 1]² or the unit disk: a Fibonacci lattice, moved so that its mean is the middle."""
    index = np.arange(count)
    u, v = (index + 0.5) / count, np.mod(0.5 + index * GOLDEN_FRACTION, 1.0)
    points = np.stack([2 * u - 1, 2 * v - 1], axis=-1)
    if shape == "ELLIPSE":
        points = np.sqrt(u)[:, None] * np.stack([np.cos(2 * np.pi * v), np.sin(2 * np.pi * v)], axis=-1)
    points -= points.mean(axis=0)
    reach = np.linalg.norm(points, axis=1) if shape == "ELLIPSE" else np.abs(points).max(axis=1)
    return points / max(1.0, float(reach.max()))


def _inside(light: AreaLight, view: ShadowView) -> np.ndarray:
    """(n,) bool: texels of a parallel beam's view whose centres lie within the lamp's shape."""
    x, y = view.window(texel_centres(view.resolution))
    plane = np.stack([part.ravel() for part in np.meshgrid(x, y)], axis=-1)
    axes = np.stack([light.half_u_world, light.half_v_world]).astype(np.float64) @ view.world_from_view[:3, :2]
    s, t = np.linalg.solve(axes.T, plane.T)
    return s * s + t * t <= 1.0 if light.shape == "ELLIPSE" else (np.abs(s) <= 1.0) & (np.abs(t) <= 1.0)
