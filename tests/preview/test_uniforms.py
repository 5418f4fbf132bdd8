"""std140 by hand (OpenGL 4.6 specification, 7.6.2.2)."""

import numpy as np
import pytest

from rtgi_addon.preview.uniforms import UniformStruct


def test_offsets_follow_std140():
    struct = UniformStruct("S", (("float", "a"), ("vec3", "b"), ("float", "c"), ("vec2", "d"), ("vec4", "e", 2), ("int", "f")))
    offsets = {name: struct.dtype.fields[name][1] for name in struct.dtype.names}
    assert offsets == {"a": 0, "b": 16, "c": 28, "d": 32, "e": 48, "f": 80}
    assert struct.dtype.itemsize == 96


def test_matrices_are_stored_by_columns():
    struct = UniformStruct("S", (("mat4", "m"),))
    assert np.frombuffer(struct.pack(m=np.arange(16).reshape(4, 4)), np.float32)[:4].tolist() == [0, 4, 8, 12]


def test_the_declaration_names_every_member():
    struct = UniformStruct("S", (("float", "a"), ("ivec4", "b", 3)))
    assert struct.glsl == "struct S {\n  float a;\n  ivec4 b[3];\n};\n"


@pytest.mark.parametrize("values", [{}, {"a": 1.0, "b": 2.0}])
def test_a_missing_or_unknown_member_is_named(values):
    with pytest.raises(ValueError, match="missing or unknown"):
        UniformStruct("S", (("float", "a"),)).pack(**values)


def test_arrays_of_scalars_are_refused():
    with pytest.raises(ValueError, match=r"S\.a: arrays hold"):
        UniformStruct("S", (("float", "a", 4),)).pack(a=[0] * 4)
