"""From where to look at a scene's probes: through its own camera if that sees them, else from around the volumes, and with the
walls in front cut away if nothing else shows them."""

from dataclasses import dataclass

import numpy as np

from ..numerics.grid import box_corners, transform_points
from ..scene import Camera, Scene
from ..techniques.lattice.focus import probes_of, spacing_of
from ..transport.context import LightContext
from ..transport.views.camera import CameraView

# The scene's own camera is taken if it shows at least this share of the probes, a made-up one if it shows that share; below it,
# whatever stands in front is cut away.
ENOUGH, ENOUGH_FROM_OUTSIDE = 0.25, 0.75
# A made-up camera: its frame's height, how high it stands, from where it is tried, and how much of the frame the volumes fill.
FIELD_OF_VIEW = np.radians(40.0)
ELEVATION = np.radians(22.0)
AZIMUTHS = np.radians(np.arange(-60.0, 300.0, 45.0))
FRAME_FILLED = 0.92
# So many probes, about, tell what a view shows.
MOST_PROBES_TRIED = 2000
# What a made-up camera sees begins and ends at these factors of its distance.
_NEAR, _FAR = 0.01, 100.0
# The walls are cut this share of a cell outside the outermost probes.
_CUT = 0.25


@dataclass(frozen=True, eq=False)
class View:
    """A camera for pictures of ``resolution`` (width, height). ``section`` (4, 4) world_from_local is a box that stands open on
    the sides towards the camera: only what is seen through it is drawn. None where nothing is cut away."""

    camera: Camera
    resolution: tuple[int, int]
    section: np.ndarray | None = None

    def rays(self, x: np.ndarray, y: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Origins and unit directions (n, 3) float32 through pixel coordinates ``x``, ``y`` (n,), y down from the top edge.

        With a section, rays start where they enter its box; those that pass beside it point nowhere (direction 0)."""
        width, height = self.resolution
        near, directions, _ = CameraView.of(self.camera).through(x / width, 1.0 - y / height)
        if self.section is not None:
            start = self._entry(near, directions)
            reached = np.isfinite(start)
            near = near + directions * np.where(reached, start, 0.0)[:, None]
            directions = np.where(reached[:, None], directions, 0.0)
        return near.astype(np.float32), directions.astype(np.float32)

    def project(self, points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Pixel coordinates (n, 2), y down, and depth w (n,) of world ``points``; not in front of the camera where w ≤ 0."""
        width, height = self.resolution
        place, w = CameraView.of(self.camera).project(points)
        return np.stack([place[:, 0] * width, (1 - place[:, 1]) * height], axis=1), w

    def _entry(self, origins, directions) -> np.ndarray:
        """Where (n,) rays enter the section's box (0 for origins inside), infinite if they pass beside it: the slab test."""
        local_from_world = np.linalg.inv(self.section)
        start = transform_points(local_from_world, origins)
        way = directions @ local_from_world[:3, :3].T
        way = np.where(np.abs(way) > 1e-12, way, 1e-12)
        first, second = (-1.0 - start) / way, (1.0 - start) / way
        entry = np.maximum(np.minimum(first, second).max(axis=1), 0.0)
        return np.where(entry < np.maximum(first, second).min(axis=1), entry, np.inf)


def choose_view(scene: Scene, context: LightContext, resolution: tuple[int, int]) -> View:
    """The view that shows the probes of ``scene`` best, at most ``resolution`` (width, height) pixels large."""
    points = probes_of(scene.volumes)
    tried = points[::max(1, len(points) // MOST_PROBES_TRIED)]
    for camera in scene.cameras[:1]:
        view = View(camera, _fitted_size(camera.resolution, resolution))
        framed, seen = _shown(view, context, tried)
        if seen >= ENOUGH:
            return view
        if framed >= 2 * ENOUGH:
            return View(camera, view.resolution, _section(scene, points))
    corners = np.concatenate([box_corners(volume.world_from_local) for volume in scene.volumes])
    around = [View(_orbit(corners, azimuth, resolution), resolution) for azimuth in AZIMUTHS]
    shares = [_shown(view, context, tried)[1] for view in around]
    best = around[int(np.argmax(shares))]
    return best if max(shares) >= ENOUGH_FROM_OUTSIDE else View(best.camera, resolution, _section(scene, points))


def _shown(view: View, context: LightContext, points: np.ndarray) -> tuple[float, float]:
    """Shares of ``points`` in the frame, and of those in plain sight in it."""
    pixels, w = view.project(points)
    inside = (w > 0) & np.all((pixels >= 0) & (pixels < view.resolution), axis=1)
    origins, _ = view.rays(pixels[inside, 0], pixels[inside, 1])
    towards = (points[inside] - origins).astype(np.float32)
    hidden = context.tracer.occluded(origins, towards, np.ones(len(towards), np.float32))
    return np.count_nonzero(inside) / len(points), np.count_nonzero(~hidden) / len(points)


def _section(scene: Scene, points: np.ndarray) -> np.ndarray:
    """A box a quarter of a cell outside the outermost probes: nearer than any wall they keep half a cell from."""
    if len(scene.volumes) == 1:
        volume = scene.volumes[0]
        return np.asarray(volume.world_from_local, np.float64) @ np.diag([*(1.0 - 2.0 * _CUT / np.array(volume.resolution)), 1.0])
    margin = _CUT * spacing_of(scene.volumes)
    low, high = points.min(axis=0) - margin, points.max(axis=0) + margin
    box = np.diag([*(0.5 * (high - low)), 1.0])
    box[:3, 3] = 0.5 * (low + high)
    return box


def _orbit(corners, azimuth: float, resolution) -> Camera:
    """A camera at ``azimuth`` about the vertical that just holds ``corners`` (n, 3) in its frame."""
    width, height = resolution
    half = np.tan(0.5 * FIELD_OF_VIEW)
    center = 0.5 * (corners.min(axis=0) + corners.max(axis=0))
    back = np.array([np.cos(ELEVATION) * np.cos(azimuth), np.cos(ELEVATION) * np.sin(azimuth), np.sin(ELEVATION)])
    right = np.cross([0.0, 0.0, 1.0], back)
    right /= np.linalg.norm(right)
    up = np.cross(back, right)
    x, y, z = ((corners - center) @ np.stack([right, up, back], axis=1)).T
    distance = np.max(z + np.maximum(np.abs(x) * height / width, np.abs(y)) / (half * FRAME_FILLED))
    world_from_camera = np.eye(4)
    world_from_camera[:3, :3] = np.stack([right, up, back], axis=1)
    world_from_camera[:3, 3] = center + back * distance
    near, far = _NEAR * distance, _FAR * distance
    clip_from_camera = np.array([
        [height / (width * half), 0, 0, 0], [0, 1 / half, 0, 0],
        [0, 0, -(far + near) / (far - near), -2 * far * near / (far - near)], [0, 0, -1, 0]])
    return Camera("fitted", world_from_camera, clip_from_camera, tuple(resolution))


def _fitted_size(camera: tuple[int, int], largest: tuple[int, int]) -> tuple[int, int]:
    """The camera's own proportions within ``largest``."""
    scale = min(largest[0] / camera[0], largest[1] / camera[1])
    return max(1, round(camera[0] * scale)), max(1, round(camera[1] * scale))
