"""Uniform buffers, described once: the GLSL struct and the bytes that fill it come from the same list of members.

Layout is std140 (OpenGL 4.6 specification, 7.6.2.2), without arrays of scalars, whose stride no two people expect alike.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from ..errors import BakeError

# Alignment [bytes] and numpy type of what a struct may hold.
_TYPES = {
    "float": (4, np.dtype(np.float32)), "int": (4, np.dtype(np.int32)), "uint": (4, np.dtype(np.uint32)),
    "vec2": (8, np.dtype((np.float32, 2))), "ivec2": (8, np.dtype((np.int32, 2))),
    "vec3": (16, np.dtype((np.float32, 3))), "ivec3": (16, np.dtype((np.int32, 3))),
    "vec4": (16, np.dtype((np.float32, 4))), "ivec4": (16, np.dtype((np.int32, 4))),
    "mat4": (16, np.dtype((np.float32, (4, 4)))),
}
# What every GPU can bind as one uniform buffer (Vulkan promises 16 KB, OpenGL 16 KB, all desktop drivers 64 KB).
MAX_BYTES = 65536


@dataclass(frozen=True)
class UniformStruct:
    """A struct of uniforms: ``members`` are (GLSL type, name) or (GLSL type, name, count) for arrays of 16-byte elements."""

    name: str
    members: tuple[tuple, ...]

    @cached_property
    def dtype(self) -> np.dtype:
        """The struct as a numpy record of the same layout."""
        names, formats, offsets, offset = [], [], [], 0
        for kind, name, *count in self.members:
            align, dtype = _TYPES[kind]
            if count:
                if dtype.itemsize % 16:
                    raise ValueError(f"{self.name}.{name}: arrays hold vec4, ivec4 or mat4")
                dtype = np.dtype((dtype.base, (count[0], *dtype.shape)))
            offset = -(-offset // align) * align
            names.append(name)
            formats.append(dtype)
            offsets.append(offset)
            offset += dtype.itemsize
        size = -(-offset // 16) * 16
        if size > MAX_BYTES:
            raise BakeError(f"{self.name} would take {size} bytes of uniforms", f"keep it below {MAX_BYTES}")
        return np.dtype({"names": names, "formats": formats, "offsets": offsets, "itemsize": size})

    @property
    def glsl(self) -> str:
        """The struct's declaration."""
        lines = [f"  {kind} {name}{f'[{count[0]}]' if count else ''};" for kind, name, *count in self.members]
        return "\n".join([f"struct {self.name} {{", *lines, "};"]) + "\n"

    def pack(self, **values) -> bytes:
        """Bytes for a buffer. Every member must be given; matrices as numpy writes them (row major), stored column major."""
        record = np.zeros((), self.dtype)
        missing = {name for _, name, *_ in self.members} ^ values.keys()
        if missing:
            raise ValueError(f"{self.name}: {', '.join(sorted(missing))} missing or unknown")
        for kind, name, *_ in self.members:
            value = np.asarray(values[name])
            record[name] = np.swapaxes(value, -1, -2) if kind == "mat4" else value
        return record.tobytes()
