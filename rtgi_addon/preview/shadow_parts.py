"""Which shadow maps a lamp needs for one frame: a sun's cascades, the faces of a cube, the frustum of a cone."""

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from ..transport.lights.kinds import kind_of
from ..transport.lights.shadow_view import ShadowView
from ..transport.views.camera import CameraView
from .lamp_sample import LampSample

# Splits are this much nearer to a geometric series than to even steps (Zhang et al. 2006, parallel-split shadow maps).
_LOGARITHMIC = 0.8
# The first cascade starts at this share of the farthest depth at the least: near planes are often put far too near.
_NEAREST_SHARE = 0.005
# Cascades end where frames' random share of this fraction of them puts it, so that their seams dissolve over frames.
_SEAM = 0.15
# And no nearer to the farthest depth than this share of it.
_LATEST_SHARE = 0.5
# Depths [m] that no pixel is outside of.
_EVERYWHERE = -1e30, 1e30


@dataclass(frozen=True, eq=False)
class ShadowPart:
    """A shadow map to draw and the pixels it is for: those between two depths (2,) [m] of the camera. ``view`` None: no shadow."""

    view: ShadowView | None
    depths: tuple[float, float] = _EVERYWHERE
    outside_lit: bool = True

    @property
    def uniforms(self) -> dict:
        """Values of the struct SHADOW."""
        values = {"camera_near": self.depths[0], "camera_far": self.depths[1], "outside_lit": int(self.outside_lit),
                  "casts_shadow": int(self.view is not None)}
        if self.view is None:
            return {**values, "clip_from_world": np.eye(4), "position_world": np.zeros(3), "texel": 0.0, "orthographic": 0,
                    "forward_world": np.zeros(3), "ray_base": np.zeros(3), "ray_x": np.zeros(3), "ray_y": np.zeros(3)}
        view, matrix = self.view, self.view.clip_from_view
        right, up, back = view.world_from_view[:3, :3].T
        # The window at depth 1, or anywhere in a parallel projection: as in ShadowView.
        offset = -matrix[:2, 3] if view.orthographic else matrix[:2, 2]
        x, y = offset / np.diag(matrix)[:2]
        base = x * right + y * up - (0.0 if view.orthographic else 1.0) * back
        texel = 2.0 / (float(np.diag(matrix)[:2].min()) * view.resolution)
        return {**values, "clip_from_world": view.clip_from_world, "position_world": view.position_world, "texel": texel,
                "forward_world": -back, "orthographic": int(view.orthographic), "ray_base": base,
                "ray_x": right / matrix[0, 0], "ray_y": up / matrix[1, 1]}


def shadow_parts(sample: LampSample, camera: CameraView, bounds: np.ndarray, resolution: int, cascades: int,
                 jitter: np.ndarray) -> Iterator[ShadowPart]:
    """The maps of one lamp for the picture of ``camera`` of a scene within ``bounds`` (2, 3). ``jitter`` (3,) in [0, 1) moves the
    seams between cascades and the texels of every map."""
    if not sample.light.casts_shadow:
        yield ShadowPart(None)
        return
    if kind_of(sample.light).is_distant:
        splits = cascade_splits(camera, bounds, cascades, jitter[2])
        for near, far in pairwise(splits):
            focus = _focus(camera, bounds, near, far)
            depths = (near if near > splits[0] else _EVERYWHERE[0], far if far < splits[-1] else _EVERYWHERE[1])
            for view in sample.shadow_views(bounds, resolution, focus):
                yield ShadowPart(_jittered(view, jitter), depths)
        return
    views = sample.shadow_views(bounds, resolution)
    for view in views:
        yield ShadowPart(view if len(views) > 1 else _jittered(view, jitter), outside_lit=len(views) == 1)


def cascade_splits(camera: CameraView, bounds: np.ndarray, count: int, jitter: float = 0.5) -> list[float]:
    """Camera depths (count + 1) [m] between which each cascade lies, from the nearest to the farthest of the scene."""
    corners = np.stack(np.meshgrid(*np.asarray(bounds).T, indexing="ij"), axis=-1).reshape(-1, 3)
    depth = (np.asarray(camera.world_from_camera)[:3, 3] - corners) @ np.asarray(camera.world_from_camera)[:3, 2]
    near, far = camera.depths
    far = max(min(far, float(depth.max())), 1e-6)
    near = min(max(near, float(depth.min()), _NEAREST_SHARE * far), _LATEST_SHARE * far)
    if camera.orthographic:
        return [float(value) for value in np.linspace(camera.depths[0], far, 2)]
    splits = []
    for index in range(count + 1):
        t = (index + _SEAM * (jitter - 0.5) * (0 < index < count)) / count
        splits.append(float(_LOGARITHMIC * near * (far / near) ** t + (1.0 - _LOGARITHMIC) * (near + (far - near) * t)))
    return splits


def _focus(camera: CameraView, bounds: np.ndarray, near: float, far: float) -> np.ndarray:
    """World box (2, 3) of the part of the view between two depths, as far as the scene reaches."""
    corners = camera.corners(near, far)
    low, high = np.maximum(corners.min(axis=0), bounds[0]), np.minimum(corners.max(axis=0), bounds[1])
    middle = 0.5 * (bounds[0] + bounds[1])
    return np.array([low, high]) if np.all(high >= low) else np.array([middle, middle])


def _jittered(view: ShadowView, jitter: np.ndarray) -> ShadowView:
    """The same view moved by part of a texel: what staircases a map has lie elsewhere in every frame."""
    shift = np.eye(4)
    shift[:2, 3] = (2.0 * np.asarray(jitter[:2]) - 1.0) / view.resolution
    clip_from_view = shift @ view.clip_from_view
    return ShadowView(view.lamp, view.face, view.world_from_view, clip_from_view, view.orthographic, view.resolution, view.near,
                      view.far, view.share)
