"""The target that shadow maps are drawn into, one after the other."""

import gpu
import numpy as np

from ..transport.lights.shadow_view import ShadowView
from ..transport.views.camera import View
from .device import RenderTarget
from .surfaces import SurfacePass


class ShadowMap:
    """The depths that one view sees, ``resolution`` × ``resolution`` texels, drawn anew for every part."""

    def __init__(self, resolution: int):
        self.resolution = resolution
        self._target = RenderTarget(resolution, resolution, ("R32F",), depth=True)

    @property
    def texture(self) -> gpu.types.GPUTexture:
        """Depth along the view [m]; 0 where nothing is."""
        return self._target.colors[0]

    def draw(self, surfaces: SurfacePass, view: ShadowView, seed: int, among: np.ndarray | None = None) -> None:
        """Fill the map with the instances ``among`` (i,) bool (None: all); ``seed`` is that of the coins for coverage without a
        threshold."""
        with self._target.drawing():
            surfaces.draw(View(view.clip_from_world, view.world_from_view, view.far, view.orthographic, seed), name="shadow",
                          among=among)
