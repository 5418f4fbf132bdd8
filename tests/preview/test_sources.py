"""Shader files: includes, and that every program finds its own."""

import re

import pytest

from rtgi_addon.effects import registry
from rtgi_addon.preview import programs
from rtgi_addon.preview.effects import has_shader
from rtgi_addon.preview.effects.programs import pixel_program
from rtgi_addon.preview.program import Image, Program, declarations
from rtgi_addon.preview.sources import SHADERS, source
from rtgi_addon.preview.uniforms import UniformStruct
from rtgi_addon.scene import Scene

PROGRAMS = {name: value for name, value in vars(programs).items() if isinstance(value, Program)}
SURFACES = {f"{name} {uvs} {colors} {smooth}": programs.surface_program(name, uvs, colors, smooth)
            for name in programs.SURFACE_PASSES for uvs, colors, smooth in ((0, 0, False), (2, 1, True))}
EFFECTS = {f"effect {name}": pixel_program(name, effect.parameters(effect.Settings(), Scene("empty")))
           for name, effect in registry().items() if has_shader(name)}
ALL = {**PROGRAMS, **SURFACES, **EFFECTS}


def stages(program):
    return ("comp",) if program.is_compute else ("vert", "frag")


@pytest.mark.parametrize("name", ALL)
def test_every_program_has_its_files(name):
    program = ALL[name]
    for stage in stages(program):
        body = source(program.vertex or program.name if stage == "vert" else program.name, stage)
        assert "void main()" in body and "#include" not in body
        # Declarations come from the host alone.
        assert not re.search(r"^\s*(layout|uniform|in |out |#version)", body, re.MULTILINE)


def test_every_file_belongs_to_a_program():
    used = {f"{program.vertex or program.name if stage == 'vert' else program.name}.{stage}.glsl"
            for program in ALL.values() for stage in stages(program)}
    files = {path.name for path in SHADERS.glob("*.glsl")}
    assert used <= files
    # Programs of one module alone are described there, by name.
    modules = "".join(path.read_text(encoding="utf-8") for path in (SHADERS.parent / "preview").rglob("*.py"))
    assert {name for name in files - used if f'"{name.split(".")[0]}"' not in modules} == set()
    included = set(re.findall(r'#include "include/([^"]+)"', "".join(path.read_text() for path in SHADERS.rglob("*.glsl"))))
    assert included == {path.name for path in (SHADERS / "include").iterdir()}


def test_an_include_is_taken_in_once():
    assert source("lpv_gather", "comp").count("ivec2 atlas_texel(") == 1


def test_declarations_for_a_bare_context():
    parameters = UniformStruct("P", (("float", "a"),))
    program = Program("p", (("parameters", parameters),), ("one", "two"), (Image("r", access="READ_WRITE"),), (8, 4),
                      defines=(("K", "3"),))
    text = declarations(program, "comp")
    assert text.startswith("#version 430 core\n#define K 3\nstruct P {\n  float a;\n};\n")
    assert "layout(std140, binding = 0) uniform PBlock { P parameters; };" in text
    assert "layout(binding = 1) uniform sampler2D two;" in text
    assert "layout(rgba32f, binding = 0) uniform image2D r;" in text
    assert "layout(local_size_x = 8, local_size_y = 4) in;" in text
