"""An effect that is one program over the picture's pixels."""

import gpu

from ...effects import Chosen
from ..device import dispatch
from ..textures import empty
from .base import GpuFrame
from .programs import frame_values, parameter_values, pixel_program


class PixelHalf:
    """The half of an effect with a file ``shaders/effect_NAME.comp.glsl``; see Half."""

    def __init__(self, chosen: Chosen):
        self.chosen = chosen
        self.passes: dict[str, gpu.types.GPUTexture] = {}
        self._result: gpu.types.GPUTexture | None = None

    def draw(self, frame: GpuFrame) -> gpu.types.GPUTexture:
        """See Half."""
        parameters = self.chosen.effect.parameters(self.chosen.settings, frame.scene)
        program = pixel_program(self.chosen.effect.name, parameters)
        if self._result is None or (self._result.width, self._result.height) != tuple(frame.size):
            self._result = empty(*frame.size)
            self.passes = {image.name: empty(*frame.size) for image in program.images[1:]}
        textures = {**{f"gbuffer_{name}": texture for name, texture in frame.gbuffer.items()}, "direct_radiance": frame.direct,
                    "indirect_irradiance": frame.irradiance, "light": frame.light, "world": frame.background.texture}
        values = frame_values(frame.view, frame.size, frame.index, frame.offset, frame.transparent,
                              frame.background.map_from_world)
        dispatch(program, frame.size, uniforms={"frame": values, "effect": parameter_values(parameters)},
                 samplers={name: textures[name] for name in program.samplers}, images={"result": self._result, **self.passes})
        return self._result
