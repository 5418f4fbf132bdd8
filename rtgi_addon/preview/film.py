"""The picture as it settles: one texture a pass, the mean of all samples so far."""

from collections.abc import Mapping

import gpu
import numpy as np

from ..scene import World
from .camera_view import CameraView
from .device import dispatch
from .programs import FILM
from .settings import PASSES
from .textures import empty, upload

# Means of these mean nothing: they keep the first sample, which is taken at the pixels' centres.
_NOT_AVERAGED = {"depth", "object"}


class Background:
    """The world as a texture."""

    def __init__(self, world: World):
        self.world = world
        rgba = np.ones((*world.equirect.shape[:2], 4), np.float32)
        rgba[..., :3] = world.equirect
        self.texture = upload(rgba)
        self.map_from_world = np.eye(4)
        self.map_from_world[:3, :3] = world.map_from_world


class Film:
    """Textures of ``size`` (width, height), RGBA32F, row 0 at the bottom, for the ``passes`` that are wanted."""

    def __init__(self, size: tuple[int, int], passes: tuple[str, ...]):
        self.size = size
        self.samples = 0
        self.textures: dict[str, gpu.types.GPUTexture] = {name: empty(*size) for name in passes}

    def add(self, view: CameraView, offset: np.ndarray, inputs: Mapping[str, gpu.types.GPUTexture], background: Background,
            transparent: bool) -> None:
        """Average in one sample of ``view``, drawn with ``offset`` (2,) pixels; ``inputs`` are the G-buffer's textures with
        ``direct`` and ``irradiance``."""
        base, across, up = view.rays(self.size, offset)
        pose = np.asarray(view.world_from_camera)
        values = {"size": self.size, "weight": 1.0 / (self.samples + 1), "position_world": pose[:3, 3],
                  "forward_world": -pose[:3, 2], "ray_base": base, "ray_across": across, "ray_up": up,
                  "map_from_world": background.map_from_world, "transparent_world": int(transparent)}
        samplers = {"world": background.texture, "direct_radiance": inputs["direct"], "indirect_irradiance": inputs["irradiance"],
                    **{f"gbuffer_{name}": inputs[name] for name in ("position", "normal", "albedo", "emission")}}
        for name, texture in self.textures.items():
            if self.samples == 0 or name not in _NOT_AVERAGED:
                dispatch(FILM, self.size, uniforms={"film": {**values, "kind": PASSES.index(name)}}, samplers=samplers,
                         images={"mean": texture})
        self.samples += 1
