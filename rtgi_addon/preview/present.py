"""A finished texture into whatever Blender has bound: a viewport's region."""

import gpu
import numpy as np

from .device import bind, vertex_buffer
from .program import Program
from .uniforms import UniformStruct

PRESENT = Program(
    "present", uniforms=(("region", UniformStruct("PresentRegion", (("ivec2", "size"), ("ivec2", "span")))),),
    samplers=("picture",), inputs=(("VEC2", "corner"),), outputs=(("VEC4", "color"),))

# One triangle that covers the region.
_CORNERS = np.array([[-1.0, -1.0], [3.0, -1.0], [-1.0, 3.0]], np.float32)


def present(picture: gpu.types.GPUTexture, size: tuple[int, int], span: tuple[int, int] | None = None) -> None:
    """Draw ``picture``, premultiplied by its alpha, stretched bilinearly over the bound region of ``size`` (width, height); only
    the columns in ``span`` (first, end) of it, with a line where that begins within the region."""
    values = {"size": size, "span": span or (0, size[0])}
    shader, _alive = bind(PRESENT, uniforms={"region": values}, samplers={"picture": picture})
    gpu.state.blend_set("ALPHA_PREMULT")
    gpu.state.depth_test_set("NONE")
    gpu.types.GPUBatch(type="TRIS", buf=vertex_buffer({"corner": _CORNERS})).draw(shader)
    gpu.state.blend_set("NONE")
