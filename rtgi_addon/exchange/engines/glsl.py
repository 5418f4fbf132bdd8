"""The part of the look-up that every engine with GLSL takes as it is: include/probe_weights.glsl, with its numbers in front."""

from pathlib import Path

from ...techniques.lattice.weights import shader_constants

_SHARED = Path(__file__).resolve().parents[2] / "shaders" / "include" / "probe_weights.glsl"


def shared_glsl() -> str:
    """The numbers as defines, then the functions: GLSL that Godot's shaders, three.js's and OpenGL's have in common."""
    defines = "".join(f"#define {name} {value}\n" for name, value in shader_constants().items())
    return f"{defines}\n{_SHARED.read_text(encoding='utf-8')}"


def relight_glsl() -> str:
    """What follows `shared_glsl` in a shader that relights probes; it says what has to stand between the two."""
    return (Path(__file__).parent / "relight.glsl").read_text(encoding="utf-8")
