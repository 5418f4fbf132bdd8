"""The media of an export as GLSL: shared functions, an engine's uniforms, and a march over as many boxes as there are.

`media.glsl` and `media_march.glsl` are the same text in every engine; uniforms have the same names and differ in how they are said.
"""

from pathlib import Path

from .media import EngineMedia

_HERE = Path(__file__).parent
_MEDIUM = ("\trtgi_medium(rtgi_cells_@N@, rtgi_unit_from_world_@N@, rtgi_cells_size_@N@, rtgi_scattering_@N@,\n"
           "\t\t\trtgi_absorption_@N@, rtgi_emission_@N@, rtgi_moments_@N@, point, extinction, given, scattered0, scattered1,\n"
           "\t\t\tscattered2);\n")
_SPAN = "\t\trtgi_box_span(rtgi_unit_from_world_@N@, origin, direction, length_, first, last);\n"
# Name and type of what all have, and of what each box has.
_ALL = (("rtgi_media_ambient", "sampler3D"), ("rtgi_media_ambient_from_world", "mat4"), ("rtgi_media_ambient_size", "vec3"),
        ("rtgi_media_turn", "mat3"), ("rtgi_media_everywhere", "bool"), ("rtgi_media_extinction", "vec3"),
        ("rtgi_media_emission", "vec3"), ("rtgi_media_scattering", "mat3"))
_BOX = (("rtgi_cells_@N@", "sampler3D"), ("rtgi_unit_from_world_@N@", "mat4"), ("rtgi_cells_size_@N@", "vec4"),
        ("rtgi_scattering_@N@", "vec3"), ("rtgi_absorption_@N@", "vec3"), ("rtgi_emission_@N@", "vec3"),
        ("rtgi_moments_@N@", "vec2"))


def media_functions(scale: float = 1.0) -> str:
    """The functions that any shader of media needs, whatever their number, where the ambient light is stored over ``scale``."""
    return f"#define RTGI_AMBIENT_SCALE {scale!r}\n\n" + (_HERE / "media.glsl").read_text(encoding="utf-8")


def media_shader(media: EngineMedia, sampler: str = "uniform sampler3D {name};", ahead: str = "",
                 functions: str | None = None) -> str:
    """The shader code for ``media``: ``ahead`` of it what the language needs, a ``sampler`` as the language declares one, and what
    brings in ``media_functions`` (None: their text)."""
    count = len(media.boxes)
    names = [*_ALL, *((name.replace("@N@", str(number)), kind) for number in range(count) for name, kind in _BOX)]
    uniforms = "".join((sampler.format(name=name) if kind == "sampler3D" else f"uniform {kind} {name};") + "\n"
                       for name, kind in names)
    march = (_HERE / "media_march.glsl").read_text(encoding="utf-8")
    for mark, text in (("@MEDIA@", _MEDIUM), ("@SPANS@", _SPAN)):
        march = march.replace(mark, "".join(text.replace("@N@", str(number)) for number in range(count)))
    return f"{ahead}{uniforms}\n{media_functions() if functions is None else functions}{march}"
