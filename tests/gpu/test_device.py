"""Textures, uniform buffers and state of Blender's gpu module as the preview uses them."""

import numpy as np
import pytest

from rtgi_addon.errors import BakeError
from rtgi_addon.preview.program import Image, Program
from rtgi_addon.preview.uniforms import UniformStruct


@pytest.mark.parametrize("shape", [(5, 7, 4), (5, 7), (1, 1, 4), (300, 2)])
def test_an_array_comes_back_as_it_went(gpu_device, shape):
    from rtgi_addon.preview.textures import download, upload
    values = np.random.default_rng(0).normal(size=shape).astype(np.float32)
    assert np.array_equal(download(upload(values)), values)


def test_a_slice_is_uploaded_as_what_it_shows(gpu_device):
    from rtgi_addon.preview.textures import download, upload
    values = np.arange(480, dtype=np.float32).reshape(10, 12, 4)
    assert np.array_equal(download(upload(values[::-1, ::2])), values[::-1, ::2])


def test_a_new_texture_is_empty_and_a_huge_one_is_refused(gpu_device):
    from rtgi_addon.preview.textures import download, empty, upload
    assert not download(empty(33, 17)).any()
    with pytest.raises(BakeError, match="a texture of 1048576 × 4 is larger than this GPU's limit"):
        empty(1 << 20, 4)
    with pytest.raises(BakeError, match="the image 'sky' of 1048576 × 1 is larger"):
        upload(np.zeros((1, 1 << 20)), name="the image 'sky'")


def test_every_member_of_a_struct_arrives(gpu_device, monkeypatch):
    """The layout of UniformStruct is the driver's own: a program adds up what it reads, each member with its own weight."""
    from rtgi_addon.preview import device, sources, textures
    struct = UniformStruct("Mixed", (("float", "a"), ("vec3", "b"), ("int", "c"), ("vec2", "d"), ("vec4", "e", 2), ("mat4", "m"),
                                     ("ivec3", "f"), ("float", "g"), ("uint", "h")))
    body = """void main() {
      imageStore(result, ivec2(0, 0), vec4(parameters.a, parameters.b));
      imageStore(result, ivec2(1, 0), vec4(float(parameters.c), parameters.d, parameters.e[1].w));
      imageStore(result, ivec2(2, 0), parameters.m * vec4(1.0, 0.0, 0.0, 0.0));
      imageStore(result, ivec2(3, 0), vec4(vec3(parameters.f), parameters.g + float(parameters.h)));
    }"""
    monkeypatch.setattr(device, "source", lambda name, stage: body)
    program = Program("mixed", uniforms=(("parameters", struct),), images=(Image("result"),), local_size=(1, 1))
    result, matrix = textures.empty(4, 1), np.arange(16).reshape(4, 4)
    values = {"a": 1, "b": (2, 3, 4), "c": 5, "d": (6, 7), "e": [(0, 0, 0, 0), (0, 0, 0, 8)], "m": matrix, "f": (9, 10, 11),
              "g": 12, "h": 13}
    device.dispatch(program, (1, 1), uniforms={"parameters": values}, images={"result": result})
    assert textures.download(result)[0].tolist() == [[1, 2, 3, 4], [5, 6, 7, 8], matrix[:, 0].tolist(), [9, 10, 11, 25]]
    assert sources.SHADERS.is_dir()


def test_drawing_leaves_blenders_state_as_it_was(gpu_device):
    import gpu

    from rtgi_addon.preview.device import RenderTarget
    with pytest.raises(ZeroDivisionError), RenderTarget(4, 4, ("RGBA32F",), depth=True).drawing(blend="ADDITIVE_PREMULT"):
        assert gpu.state.depth_mask_get() and gpu.state.blend_get() == "ADDITIVE_PREMULT"
        raise ZeroDivisionError
    assert gpu.state.blend_get() == "NONE" and gpu.state.depth_test_get() == "NONE" and not gpu.state.depth_mask_get()
