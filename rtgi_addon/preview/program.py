"""What a GPU program reads and writes, described once and for every host.

The GLSL files declare nothing: `device` turns a ``Program`` into Blender's GPUShaderCreateInfo, ``declarations`` into text for a
bare OpenGL context. In the files a uniform buffer's member is ``buffer.member``; samplers and images go by their names.
"""

from dataclasses import dataclass

from .uniforms import UniformStruct

GLSL_TYPES = {"FLOAT": "float", "VEC2": "vec2", "VEC3": "vec3", "VEC4": "vec4", "INT": "int"}


@dataclass(frozen=True)
class Image:
    """A texture that a compute program or a fragment stage writes (``access`` 'WRITE') or also reads ('READ_WRITE'), by whole
    texels of ``kind``: floats, or whole numbers that many add to at once."""

    name: str
    format: str = "RGBA32F"
    access: str = "WRITE"
    kind: str = "FLOAT_2D"


@dataclass(frozen=True)
class Program:
    """A program made of the files ``shaders/NAME.STAGE.glsl``; ``vertex`` names another file for the vertex stage.

    ``uniforms`` are (name, struct) of the buffers. ``samplers`` names the 2D float textures that it fetches from, ``images`` those
    that it, or its fragment stage, writes. A compute program has a ``local_size``; a raster program has ``inputs`` (vertex
    attributes), ``varyings`` and ``outputs`` (one per render target), all (type, name) in GLSL_TYPES; ``flat_varyings`` are not
    interpolated. ``writes_depth`` says that the fragment stage sets gl_FragDepth. ``defines`` are compile-time parameters: (name,
    value).
    """

    name: str
    uniforms: tuple[tuple[str, UniformStruct], ...] = ()
    samplers: tuple[str, ...] = ()
    images: tuple[Image, ...] = ()
    local_size: tuple[int, int] | None = None
    inputs: tuple[tuple[str, str], ...] = ()
    varyings: tuple[tuple[str, str], ...] = ()
    flat_varyings: tuple[tuple[str, str], ...] = ()
    outputs: tuple[tuple[str, str], ...] = ()
    writes_depth: bool = False
    defines: tuple[tuple[str, str], ...] = ()
    vertex: str | None = None

    @property
    def is_compute(self) -> bool:
        """True for a compute program, False for one that rasterizes."""
        return self.local_size is not None


def declarations(program: Program, stage: str, version: str = "430 core") -> str:
    """The head of a stage ('comp', 'vert' or 'frag') for a bare OpenGL context: version, defines, resources."""
    lines = [f"#version {version}", *(f"#define {name} {value}" for name, value in program.defines)]
    for unit, (name, struct) in enumerate(program.uniforms):
        lines += [struct.glsl, f"layout(std140, binding = {unit}) uniform {struct.name}Block {{ {struct.name} {name}; }};"]
    lines += [f"layout(binding = {unit}) uniform sampler2D {name};" for unit, name in enumerate(program.samplers)]
    if stage == "comp":
        lines.append("layout(local_size_x = {}, local_size_y = {}) in;".format(*program.local_size))
    if stage != "vert":
        access, kinds = {"WRITE": "writeonly ", "READ_WRITE": ""}, {"FLOAT_2D": "image2D", "UINT_2D_ATOMIC": "uimage2D"}
        lines += [f"layout({image.format.lower()}, binding = {unit}) uniform {access[image.access]}{kinds[image.kind]} "
                  f"{image.name};" for unit, image in enumerate(program.images)]
    if stage == "vert":
        lines += [f"layout(location = {slot}) in {GLSL_TYPES[kind]} {name};" for slot, (kind, name) in enumerate(program.inputs)]
    if stage in ("vert", "frag"):
        way = "out" if stage == "vert" else "in"
        lines += [f"{way} {GLSL_TYPES[kind]} {name};" for kind, name in program.varyings]
        lines += [f"flat {way} {GLSL_TYPES[kind]} {name};" for kind, name in program.flat_varyings]
    if stage == "frag":
        lines += [f"layout(location = {slot}) out {GLSL_TYPES[kind]} {name};" for slot, (kind, name) in enumerate(program.outputs)]
    return "\n".join(lines) + "\n"
