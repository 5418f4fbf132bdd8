"""Where a picture is seen from: a camera's or a viewport's matrices, the rays of its background, and its jitter."""

from dataclasses import dataclass

import numpy as np

from ...scene import Camera


@dataclass(frozen=True, eq=False)
class View:
    """Where from and how the scene is drawn: ``clip_from_world`` (4, 4), ``world_from_view`` (4, 4) looking along −Z. ``seed`` is
    that of the coins which decide about coverage without a threshold."""

    clip_from_world: np.ndarray
    world_from_view: np.ndarray
    far: float
    orthographic: bool
    seed: int = 0

    @property
    def uniforms(self) -> dict:
        """Values of the struct VIEW."""
        return {"clip_from_world": self.clip_from_world, "position_world": self.world_from_view[:3, 3], "far": self.far,
                "forward_world": -self.world_from_view[:3, 2], "orthographic": int(self.orthographic),
                "seed": self.seed}


@dataclass(frozen=True, eq=False)
class CameraView:
    """``world_from_camera`` (4, 4) rigid, looking along −Z with +Y up; ``clip_from_camera`` (4, 4) an OpenGL projection,
    perspective or orthographic: a viewport's ``view_matrix.inverted()`` and ``window_matrix``."""

    world_from_camera: np.ndarray
    clip_from_camera: np.ndarray

    @staticmethod
    def of(camera: Camera) -> "CameraView":
        """The view through a camera of the scene."""
        return CameraView(camera.world_from_camera, camera.clip_from_camera)

    @property
    def orthographic(self) -> bool:
        """True for a parallel projection."""
        return bool(self.clip_from_camera[3, 3] != 0)

    @property
    def depths(self) -> tuple[float, float]:
        """Near and far plane [m] along −Z."""
        scale, offset = (float(value) for value in self.clip_from_camera[2, 2:4])
        if self.orthographic:
            return (offset + 1.0) / scale, (offset - 1.0) / scale
        return offset / (scale - 1.0), offset / (scale + 1.0)

    def equals(self, other: "CameraView | None") -> bool:
        """True if both show the same, so that their samples may be mixed."""
        return other is not None and np.array_equal(self.world_from_camera, other.world_from_camera) and np.array_equal(
            self.clip_from_camera, other.clip_from_camera)

    def drawn(self, size: tuple[int, int], offset=(0.0, 0.0), seed: int = 0) -> View:
        """The view to draw ``size`` (width, height) pixels with, shifted by ``offset`` (2,) pixels; ``seed`` as in View."""
        clip_from_world = self._shifted(size, offset) @ np.linalg.inv(np.asarray(self.world_from_camera, np.float64))
        return View(clip_from_world, np.asarray(self.world_from_camera, np.float64), self.depths[1], self.orthographic, seed)

    def rays(self, size: tuple[int, int], offset=(0.0, 0.0)) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """World directions as an affine map of the picture's (x, y) in [0, 1]²: base + x·across + y·up, (3,) each, not unit."""
        world_from_clip = np.asarray(self.world_from_camera, np.float64) @ np.linalg.inv(self._shifted(size, offset))
        ends = np.array([[(x, y, depth, 1.0) for x, y in ((-1, -1), (1, -1), (-1, 1))] for depth in (-1.0, 1.0)])
        ends = ends @ world_from_clip.T
        near, far = ends[..., :3] / ends[..., 3:]
        base, right, top = (far - near) / np.linalg.norm(far[0] - near[0])
        return base, right - base, top - base

    def through(self, x: np.ndarray, y: np.ndarray, size: tuple[int, int] = (1, 1), offset=(0.0, 0.0)):
        """Rays through the picture's (x, y) in [0, 1]² from its lower left corner, (n,) each: origins on the near plane (n, 3),
        unit directions (n, 3), distances (n,) to the far plane [m], all float64; shifted by ``offset`` (2,) pixels of ``size``."""
        world_from_clip = np.asarray(self.world_from_camera, np.float64) @ np.linalg.inv(self._shifted(size, offset))
        # A plane of constant depth is affine in the pixel for every projection a camera has: three of its points say it all.
        frame = np.array([[(a, b, depth, 1.0) for a, b in ((-1, -1), (1, -1), (-1, 1))] for depth in (-1.0, 1.0)])
        frame = frame @ world_from_clip.T
        corners = frame[..., :3] / frame[..., 3:]
        across, up = np.asarray(x, np.float64)[:, None], np.asarray(y, np.float64)[:, None]
        near, far = (c[0] + across * (c[1] - c[0]) + up * (c[2] - c[0]) for c in corners)
        towards = far - near
        reach = np.linalg.norm(towards, axis=1)
        return near, towards / reach[:, None], reach

    def project(self, points: np.ndarray, size: tuple[int, int] = (1, 1), offset=(0.0, 0.0)) -> tuple[np.ndarray, np.ndarray]:
        """Where world ``points`` (n, 3) are in the picture: (x, y) (n, 2) in [0, 1]² from the lower left corner, and clip w (n,);
        not in front of the camera where w ≤ 0. ``size`` and ``offset`` as in ``through``."""
        clip_from_world = self._shifted(size, offset) @ np.linalg.inv(np.asarray(self.world_from_camera, np.float64))
        clip = points @ clip_from_world[:, :3].T + clip_from_world[:, 3]
        w = clip[:, 3]
        return clip[:, :2] / np.where(np.abs(w) > 1e-12, w, 1e-12)[:, None] * 0.5 + 0.5, w

    def footprint(self, points: np.ndarray, normals: np.ndarray, least: float) -> np.ndarray:
        """Area (n,) float64 [m²] that the whole picture would see of planes through world ``points`` (n, 3) under unit ``normals``
        (n, 3), if all of it saw them as it does there: a pixel's share of the picture times this is what the pixel stands for.
        Cosines to the ray count for ``least`` at least: a pixel that grazes a surface would stand for more than it sees."""
        near, towards, _ = self.through(np.array([0.0, 1.0, 0.0]), np.array([0.0, 0.0, 1.0]))
        plane = np.cross(near[1] - near[0], near[2] - near[0])
        area = float(np.linalg.norm(plane))
        plane /= max(area, np.finfo(np.float64).tiny)
        if self.orthographic:
            along = np.broadcast_to(towards[0], np.shape(points))
            return area / np.maximum(np.abs((along * normals).sum(axis=1)), least)
        # A plane that is parallel to the picture's is seen larger by the square of its depth, and a slanted one by the cosines of
        # the ray to both.
        eye = self.position
        way = np.asarray(points, np.float64) - eye
        distance = np.maximum(np.linalg.norm(way, axis=1), np.finfo(np.float64).tiny)
        depth, front = np.abs(way @ plane), abs(float((near[0] - eye) @ plane))
        slant = np.maximum(np.abs((way * normals).sum(axis=1)) / distance, least)
        return area * (depth / max(front, np.finfo(np.float64).tiny)) ** 2 * (depth / distance) / slant

    @property
    def position(self) -> np.ndarray:
        """(3,) float64 where the eye is [m]; of a parallel projection, a point on its middle ray."""
        return np.asarray(self.world_from_camera, np.float64)[:3, 3]

    @property
    def forward(self) -> np.ndarray:
        """(3,) float64 unit direction of the middle of the view."""
        return -np.asarray(self.world_from_camera, np.float64)[:3, 2]

    def corners(self, near: float, far: float) -> np.ndarray:
        """World corners (8, 3) of the part of the view between two depths [m] along −Z."""
        result = []
        for depth in (near, far):
            clip = self.clip_from_camera @ np.array([0.0, 0.0, -depth, 1.0])
            ends = np.array([(x * clip[3], y * clip[3], clip[2], clip[3]) for x in (-1, 1) for y in (-1, 1)])
            result.append(ends @ np.linalg.inv(self.clip_from_camera).T)
        points = np.concatenate(result)
        return (points[:, :3] / points[:, 3:]) @ self.world_from_camera[:3, :3].T + self.world_from_camera[:3, 3]

    def _shifted(self, size: tuple[int, int], offset) -> np.ndarray:
        shift = np.eye(4)
        shift[:2, 3] = 2.0 * np.asarray(offset, np.float64) / size
        return shift @ np.asarray(self.clip_from_camera, np.float64)
