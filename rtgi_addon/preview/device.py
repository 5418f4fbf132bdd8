"""Programs on Blender's GPU: building, dispatching and drawing."""

from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from functools import cache

import gpu
import numpy as np

from .program import Program
from .sources import source
from .textures import empty
from .uniforms import UniformStruct

_QUALIFIERS = {"WRITE": {"WRITE"}, "READ_WRITE": {"READ", "WRITE"}}


@cache
def build(program: Program) -> gpu.types.GPUShader:
    """The program compiled for Blender's GPU; kept for the next call."""
    info = gpu.types.GPUShaderCreateInfo()
    for name, value in program.defines:
        info.define(name, value)
    if program.uniforms:
        info.typedef_source("".join(struct.glsl for _, struct in program.uniforms))
    for unit, (name, struct) in enumerate(program.uniforms):
        info.uniform_buf(unit, struct.name, name)
    for unit, name in enumerate(program.samplers):
        info.sampler(unit, "FLOAT_2D", name)
    for unit, image in enumerate(program.images):
        info.image(unit, image.format, image.kind, image.name, qualifiers=_QUALIFIERS[image.access])
    if program.is_compute:
        info.local_group_size(*program.local_size)
        info.compute_source(source(program.name, "comp"))
        return gpu.shader.create_from_info(info)
    for slot, (kind, name) in enumerate(program.inputs):
        info.vertex_in(slot, kind, name)
    if program.varyings or program.flat_varyings:
        interface = gpu.types.GPUStageInterfaceInfo(f"{program.name}_varyings")
        for kind, name in program.varyings:
            interface.smooth(kind, name)
        for kind, name in program.flat_varyings:
            interface.flat(kind, name)
        info.vertex_out(interface)
    for slot, (kind, name) in enumerate(program.outputs):
        info.fragment_out(slot, kind, name)
    if program.writes_depth:
        info.depth_write("ANY")
    info.vertex_source(source(program.vertex or program.name, "vert"))
    info.fragment_source(source(program.name, "frag"))
    return gpu.shader.create_from_info(info)


def bind(program: Program, *, uniforms: Mapping | None = None, samplers: Mapping[str, gpu.types.GPUTexture] | None = None,
         images: Mapping[str, gpu.types.GPUTexture] | None = None) -> tuple:
    """Bind the program with its resources and return (shader, what must stay alive until the work is issued).

    ``uniforms`` maps the buffers' names to their members' values, or to buffers made of them by ``uniform_buffer``.
    """
    shader = build(program)
    shader.bind()
    buffers = []
    for name, struct in program.uniforms:
        given = uniforms[name]
        buffers.append(given if isinstance(given, gpu.types.GPUUniformBuf) else uniform_buffer(struct, given))
        shader.uniform_block(name, buffers[-1])
    for name in program.samplers:
        shader.uniform_sampler(name, samplers[name])
    for image in program.images:
        shader.image(image.name, images[image.name])
    return shader, buffers


def uniform_buffer(struct: UniformStruct, values: Mapping) -> gpu.types.GPUUniformBuf:
    """The members' ``values`` on the GPU."""
    data = np.frombuffer(struct.pack(**values), np.float32).copy()
    return gpu.types.GPUUniformBuf(gpu.types.Buffer("FLOAT", data.size, data))


def dispatch(program: Program, size: tuple[int, int], **resources) -> None:
    """Run a compute program over ``size`` (width, height) invocations, rounded up to whole groups; see ``bind``."""
    shader, _alive = bind(program, **resources)
    groups = [-(-int(extent) // local) for extent, local in zip(size, program.local_size, strict=True)]
    gpu.compute.dispatch(shader, groups[0], groups[1], 1)


class RenderTarget:
    """Textures of one size to draw into: ``formats`` of the colour slots, and whether there is depth."""

    def __init__(self, width: int, height: int, formats: tuple[str, ...], depth: bool = False):
        self.size = width, height
        self.colors = tuple(empty(width, height, format) for format in formats)
        self.depth = empty(width, height, "DEPTH_COMPONENT32F") if depth else None
        self._framebuffer = gpu.types.GPUFrameBuffer(depth_slot=self.depth, color_slots=self.colors)

    @contextmanager
    def drawing(self, *, blend: str = "NONE", clear: bool = True) -> Iterator[None]:
        """Draw into the target: bound, cleared to 0 (depth to 1), with the depth test on if there is depth; afterwards the state is
        what Blender expects to find."""
        with self._framebuffer.bind():
            gpu.state.viewport_set(0, 0, *self.size)
            gpu.state.blend_set(blend)
            if self.depth is not None:
                gpu.state.depth_test_set("LESS_EQUAL")
                gpu.state.depth_mask_set(True)
            if clear:
                self._framebuffer.clear(color=(0.0, 0.0, 0.0, 0.0), depth=1.0)
            try:
                yield
            finally:
                gpu.state.blend_set("NONE")
                gpu.state.depth_test_set("NONE")
                gpu.state.depth_mask_set(False)
                gpu.state.face_culling_set("NONE")


def vertex_buffer(attributes: Mapping[str, np.ndarray]) -> gpu.types.GPUVertBuf:
    """Vertices from arrays (n, c) by attribute name: float32, or int32 for attributes that the shader reads as integers."""
    arrays = {name: np.ascontiguousarray(values) for name, values in attributes.items()}
    layout = gpu.types.GPUVertFormat()
    for name, values in arrays.items():
        if values.dtype == np.int32:
            layout.attr_add(id=name, comp_type="I32", len=values.shape[1], fetch_mode="INT")
        else:
            layout.attr_add(id=name, comp_type="F32", len=values.shape[1], fetch_mode="FLOAT")
    buffer = gpu.types.GPUVertBuf(layout, len(next(iter(arrays.values()))))
    for name, values in arrays.items():
        buffer.attr_fill(name, values)
    return buffer
