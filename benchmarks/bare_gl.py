"""The product's GPU programs in a bare OpenGL context through moderngl, so that they can be timed where there is no Blender.

Needs moderngl (pip install moderngl) and an OpenGL 4.3 driver. Textures are laid out by rtgi_addon/preview/packing.py and atlas.py,
as for Blender's own gpu module.
"""

import moderngl
import numpy as np

from rtgi_addon.preview.program import Program, declarations
from rtgi_addon.preview.sources import source


class BareContext:
    """An OpenGL context without a window, and the programs built in it."""

    def __init__(self):
        try:
            self.gl = moderngl.create_context(standalone=True, backend="egl", require=430)
        except Exception:  # moderngl raises what its platform raises; a display of its own is the other way
            self.gl = moderngl.create_context(standalone=True, require=430)
        self._built: dict[Program, moderngl.ComputeShader | moderngl.Program] = {}

    @property
    def description(self) -> str:
        """Renderer and driver."""
        return f"{self.gl.info['GL_RENDERER']}, OpenGL {self.gl.info['GL_VERSION']}"

    def build(self, program: Program):
        """The program compiled; raises moderngl.Error with the driver's words."""
        if program not in self._built:
            def text(stage):
                body = source(program.vertex or program.name if stage == "vert" else program.name, stage)
                return declarations(program, stage) + body

            self._built[program] = (self.gl.compute_shader(text("comp")) if program.is_compute else
                                    self.gl.program(vertex_shader=text("vert"), fragment_shader=text("frag")))
        return self._built[program]

    def upload(self, values: np.ndarray) -> moderngl.Texture:
        """A float texture of ``values`` (h, w) or (h, w, 4)."""
        values = np.ascontiguousarray(values, np.float32)
        components = 1 if values.ndim == 2 else values.shape[2]
        texture = self.gl.texture(values.shape[1::-1], components, values.tobytes(), dtype="f4")
        texture.filter = moderngl.NEAREST, moderngl.NEAREST
        return texture

    def empty(self, width: int, height: int) -> moderngl.Texture:
        """A texture of zeros, four floats a texel."""
        return self.upload(np.zeros((height, width, 4), np.float32))

    def download(self, texture: moderngl.Texture) -> np.ndarray:
        """(h, w, components) float32."""
        return np.frombuffer(texture.read(), np.float32).reshape(texture.height, texture.width, texture.components)

    def dispatch(self, program: Program, size: tuple[int, int], *, uniforms: dict, samplers: dict, images: dict) -> None:
        """Run a compute program over ``size`` invocations; arguments as for rtgi_addon.preview.device.dispatch."""
        shader = self.build(program)
        buffers = []
        for unit, (name, struct) in enumerate(program.uniforms):
            buffers.append(self.gl.buffer(struct.pack(**uniforms[name])))
            buffers[-1].bind_to_uniform_block(unit)
        for unit, name in enumerate(program.samplers):
            samplers[name].use(unit)
        for unit, image in enumerate(program.images):
            images[image.name].bind_to_image(unit, read=image.access == "READ_WRITE", write=True)
        shader.run(*(-(-extent // local) for extent, local in zip(size, program.local_size, strict=True)), 1)
        self.gl.memory_barrier()
        for buffer in buffers:
            buffer.release()
