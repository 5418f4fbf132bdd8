"""The picture as it settles: one texture a pass, the mean of all samples so far."""

from collections.abc import Callable, Mapping
from typing import NamedTuple

import gpu
import numpy as np

from ..effects import EFFECT_PASSES
from ..scene import World
from ..transport.views.camera import CameraView
from .device import dispatch
from .programs import AVERAGE, FILM
from .settings import PASSES
from .textures import empty, upload

# Means of these mean nothing: they keep the first sample, which is taken at the pixels' centres.
_NOT_AVERAGED = {"depth", "object"}


class Made(NamedTuple):
    """What effects made of a picture, and the passes that they delivered beside it, by name."""

    picture: gpu.types.GPUTexture
    passes: Mapping[str, gpu.types.GPUTexture]


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
        self._lit: gpu.types.GPUTexture | None = None
        self.textures: dict[str, gpu.types.GPUTexture] = {name: empty(*size) for name in passes}

    def add(self, view: CameraView, offset: np.ndarray, inputs: Mapping[str, gpu.types.GPUTexture], background: Background,
            transparent: bool, effects: Callable[[gpu.types.GPUTexture], Made] | None = None) -> None:
        """Average in one sample of ``view``, drawn with ``offset`` (2,) pixels; ``inputs`` are the G-buffer's textures with
        ``direct`` and ``irradiance``. ``effects`` makes the combined pass of the lit picture, which is that pass without them,
        and delivers those of EFFECT_PASSES."""
        base, across, up = view.rays(self.size, offset)
        pose = np.asarray(view.world_from_camera)
        values = {"size": self.size, "position_world": pose[:3, 3],
                  "forward_world": -pose[:3, 2], "ray_base": base, "ray_across": across, "ray_up": up,
                  "map_from_world": background.map_from_world, "transparent_world": int(transparent)}
        samplers = {"world": background.texture, "direct_radiance": inputs["direct"], "indirect_irradiance": inputs["irradiance"],
                    **{f"gbuffer_{name}": inputs[name] for name in ("position", "normal", "albedo", "emission")}}

        def sample(name: str, texture: gpu.types.GPUTexture, weight: float) -> None:
            dispatch(FILM, self.size, uniforms={"film": {**values, "kind": PASSES.index(name), "weight": weight}},
                     samplers=samplers, images={"mean": texture})

        def average(picture: gpu.types.GPUTexture, texture: gpu.types.GPUTexture) -> None:
            dispatch(AVERAGE, self.size, uniforms={"average": {"size": self.size, "weight": weight}},
                     samplers={"picture": picture}, images={"mean": texture})

        weight = 1.0 / (self.samples + 1)
        made: Made | None = None
        if effects is not None and any(name == "combined" or name in EFFECT_PASSES for name in self.textures):
            self._lit = self._lit or empty(*self.size)
            sample("combined", self._lit, 1.0)
            made = effects(self._lit)
        for name, texture in self.textures.items():
            if name == "combined" and made is not None:
                average(made.picture, texture)
            elif name in EFFECT_PASSES:
                if made is not None and name in made.passes:
                    average(made.passes[name], texture)
                else:
                    texture.clear(format="FLOAT", value=(*[EFFECT_PASSES[name]] * 3, 1.0))
            elif self.samples == 0 or name not in _NOT_AVERAGED:
                sample(name, texture, weight)
        self.samples += 1
