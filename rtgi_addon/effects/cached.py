"""The surface cache that rays of pixels and of slices of media read: one for all effects and pictures of a scene."""

import numpy as np

from ..transport.cache.look import CachedScene
from ..transport.context import LightContext
from .frame import Frame

# The cache is most accurate where this share of the pixels look.
_FOCUS_SHARE = 0.9
_KEPT = "cached scene"


def cached_scene(context: LightContext, frame: Frame) -> CachedScene:
    """The scene with its surface cache, made for what ``frame`` shows and kept with ``context`` for all pictures of it."""
    if _KEPT not in context.kept:
        points = frame.gbuffer.position[frame.gbuffer.seen][:, :3]
        if not len(points):
            points = np.float32([frame.view.position])
        center = np.median(points, axis=0)
        radius = float(np.quantile(np.linalg.norm(points - center, axis=1), _FOCUS_SHARE))
        context.kept[_KEPT] = CachedScene.about(context, center, max(radius, 1e-6))
    return context.kept[_KEPT]
