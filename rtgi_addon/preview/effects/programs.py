"""The program of an effect that looks at one pixel after the other, for every host of the shaders.

``shaders/effect_NAME.comp.glsl`` includes include/effect.glsl, defines ``vec4 effect_pixel(ivec2 texel, vec4 lit)`` and includes
include/effect_main.glsl. It finds the frame as ``frame``, what ``Effect.parameters`` gives as ``effect`` and every texture of the
frame by its name.
"""

import re
from collections.abc import Mapping

import numpy as np

from ...transport.views.camera import CameraView
from ...transport.views.gbuffer import GBUFFER
from ..program import Image, Program
from ..sources import source
from ..uniforms import UniformStruct

EFFECT_FRAME = UniformStruct("EffectFrame", (
    ("ivec2", "size"), ("int", "index"), ("int", "orthographic"), ("vec3", "position_world"), ("int", "transparent"),
    ("vec3", "forward_world"), ("vec3", "ray_base"), ("vec3", "ray_across"), ("vec3", "ray_up"), ("mat4", "map_from_world"),
    ("mat4", "clip_from_world")))
# Every texture that an effect may read, by its name in GLSL.
TEXTURES = (*(f"gbuffer_{name}" for name in GBUFFER), "direct_radiance", "indirect_irradiance", "light", "world")


# Pictures for the effects after it that an effect may write beside its own, by their names in GLSL.
BESIDE = ("left_by_mist",)


def pixel_program(name: str, parameters: Mapping) -> Program:
    """The program of the effect ``name`` with what its ``parameters`` are made of."""
    text = source(f"effect_{name}", "comp")
    read = tuple(texture for texture in TEXTURES if re.search(rf"\b{texture}\b", text))
    # A struct without members is none in GLSL.
    members = tuple((kind_of(value), key) for key, value in sorted(parameters.items())) or (("int", "nothing"),)
    beside = (Image(picture) for picture in BESIDE if re.search(rf"\b{picture}\b", text))
    return Program(f"effect_{name}", uniforms=(("frame", EFFECT_FRAME), ("effect", UniformStruct("EffectParameters", members))),
                   samplers=read, images=(Image("result"), *beside), local_size=(8, 8))


def parameter_values(parameters: Mapping) -> dict:
    """Values of the struct that ``pixel_program`` makes of ``parameters``."""
    return dict(parameters) or {"nothing": 0}


def frame_values(view: CameraView, size: tuple[int, int], index: int, offset, transparent: bool, map_from_world) -> dict:
    """Values of the struct EFFECT_FRAME; ``map_from_world`` (4, 4) turns directions into the world's map."""
    base, across, up = view.rays(size, offset)
    return {"size": size, "index": index, "orthographic": int(view.orthographic), "position_world": view.position,
            "transparent": int(transparent), "forward_world": view.forward, "ray_base": base, "ray_across": across, "ray_up": up,
            "map_from_world": map_from_world, "clip_from_world": view.drawn(size, offset).clip_from_world}


def kind_of(value) -> str:
    """The GLSL type of a parameter: a number, a boolean or a tuple of up to four."""
    if isinstance(value, (bool, int, np.integer)):
        return "int"
    return "float" if np.ndim(value) == 0 else {2: "vec2", 3: "vec3", 4: "vec4"}[len(value)]
