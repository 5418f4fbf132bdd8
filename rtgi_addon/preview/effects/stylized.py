"""The stylized effect on the GPU: borders between pixels, marked edges as strips of the picture, then the picture with lines."""

import gpu

from ...effects import Chosen
from ...effects.mist import LEFT
from ...effects.stylized.grading import changes_colours
from ...effects.stylized.marked import has_marked, segments
from ...effects.stylized.shading import changes_surfaces
from ...effects.stylized.strokes import reach_of
from ...scene import Scene
from ..device import RenderTarget, bind, dispatch, vertex_buffer
from ..textures import empty, upload
from .base import GpuFrame
from .programs import frame_values
from .stylized_programs import compute_program, marked_program, strips, style_values, tables


class StylizedHalf:
    """See Half. Tables of objects and materials stay as long as the scene is the same."""

    def __init__(self, chosen: Chosen):
        self.chosen, self.passes = chosen, {}
        self._scene: Scene | None = None
        self._result: gpu.types.GPUTexture | None = None
        self._nothing = empty(1, 1)

    def draw(self, frame: GpuFrame) -> gpu.types.GPUTexture:
        """See Half."""
        settings = self.chosen.settings
        if settings.strength == 0.0:
            return frame.light
        self._prepare(frame)
        values = self._values
        lines = bool(values["lines"])
        drawn = segments(frame.scene, frame.view, frame.size, frame.offset, values) if lines and self._has_marked else None
        uniforms = {"frame": frame_values(frame.view, frame.size, frame.index, frame.offset, frame.transparent,
                                          frame.background.map_from_world),
                    "effect": style_values(values, frame.view, frame.size, reach_of(values["line_widest"]), drawn is not None,
                                          "transmittance" in frame.passes, LEFT in frame.passes)}
        textures = {**{f"gbuffer_{name}": texture for name, texture in frame.gbuffer.items()}, "direct_radiance": frame.direct,
                    "indirect_irradiance": frame.irradiance, "light": frame.light, "world": frame.background.texture,
                    "instances": self._instances, "materials": self._materials, "borders": self._borders, "marked": self._nothing,
                    **{name: frame.passes.get(name, self._nothing) for name in ("transmittance", LEFT)}}
        if lines:
            self._compute("stylized_borders", "borders", self._borders, frame.size, uniforms, textures)
        if drawn is not None:
            textures["marked"] = self._draw_marked(drawn, frame.size, uniforms, textures)
        self._compute("stylized_picture", "result", self._result, frame.size, uniforms, textures)
        return self._result

    def _prepare(self, frame: GpuFrame) -> None:
        if self._result is None or (self._result.width, self._result.height) != tuple(frame.size):
            self._result, self._borders = empty(*frame.size), empty(*frame.size)
            self._target: RenderTarget | None = None
        if self._scene is frame.scene:
            return
        self._scene = frame.scene
        parameters = self.chosen.effect.parameters(self.chosen.settings, frame.scene)
        self._values = {**parameters, "changes_surfaces": changes_surfaces(parameters),
                        "changes_colours": changes_colours(parameters)}
        self._instances, self._materials = map(upload, tables(parameters))
        self._has_marked = parameters["marked_edges"] and has_marked(frame.scene)

    def _compute(self, name: str, image: str, target, size, uniforms, textures) -> None:
        program = compute_program(name, self._values, image)
        dispatch(program, size, uniforms=uniforms, samplers={key: textures[key] for key in program.samplers},
                 images={image: target})

    def _draw_marked(self, found, size, uniforms, textures) -> gpu.types.GPUTexture:
        if self._target is None:
            self._target = RenderTarget(*size, ("RGBA32F",), depth=True)
        program = marked_program(self._values)
        with self._target.drawing():
            if len(found.ends):
                shader, _alive = bind(program, uniforms=uniforms, samplers={key: textures[key] for key in program.samplers})
                gpu.types.GPUBatch(type="TRIS", buf=vertex_buffer(strips(found))).draw(shader)
        return self._target.colors[0]


HALF = StylizedHalf
