"""The programs of the stylized effect and what they are given, for every host of the shaders."""

import re
from collections.abc import Mapping

import numpy as np

from ...effects.mist import LEFT
from ...effects.stylized import curvature
from ...effects.stylized.marked import TOLERANCE, Segments
from ...effects.stylized.ramps import SIZE as RAMP_SIZE
from ...transport.views.camera import CameraView
from ..packing import fold
from ..program import Image, Program
from ..sources import source
from ..uniforms import UniformStruct
from .programs import EFFECT_FRAME, TEXTURES, kind_of

_GROUP = (8, 8)
_BENDS = (("CURVATURE_REACH", str(curvature.REACH)), ("CURVATURE_ONE_WAY", repr(curvature.ONE_WAY)),
          ("CURVATURE_ALONG", repr(curvature.ALONG)), ("CURVATURE_HALF", repr(curvature.HALF)))
# Parameters that are textures.
_TABLES = ("instance_excluded", "material_excluded", "line_colors", "anchors")
_RAMPS = ("ramp", "highlight_ramp")
# The rest of what the programs ask of a frame.
_FRAME_VALUES = (("float", "pixel_width"), ("vec3", "right_world"), ("vec3", "up_world"), ("int", "reach"), ("int", "has_marked"),
                 ("int", "in_media"), ("int", "in_mist"))


def style_struct(parameters: Mapping) -> UniformStruct:
    """The struct of the numbers among the effect's ``parameters``."""
    numbers = sorted(name for name in parameters if name not in (*_TABLES, *_RAMPS) and not isinstance(parameters[name], str))
    return UniformStruct("StyleParameters", (
        *((kind_of(parameters[name]), name) for name in numbers), *_FRAME_VALUES, *(("vec4", name, RAMP_SIZE) for name in _RAMPS)))


def style_values(parameters: Mapping, view: CameraView, size: tuple[int, int], reach: int, has_marked: bool,
                 in_media: bool, in_mist: bool) -> dict:
    """Values of ``style_struct``; lines reach ``reach`` pixels; ``in_media`` and ``in_mist`` say that there is what these leave."""
    pose = np.asarray(view.world_from_camera)
    values = {name: value for name, value in parameters.items() if name not in _TABLES and not isinstance(value, str)}
    for name in _RAMPS:
        values[name] = np.concatenate([parameters[name], np.ones((RAMP_SIZE, 1), np.float32)], axis=1)
    return {**values, "pixel_width": 2.0 / (abs(view.clip_from_camera[0, 0]) * size[0]), "right_world": pose[:3, 0],
            "up_world": pose[:3, 1], "reach": reach, "has_marked": int(has_marked), "in_media": int(in_media),
            "in_mist": int(in_mist)}


def compute_program(name: str, parameters: Mapping, image: str) -> Program:
    """One of the two compute programs, which writes ``image``."""
    return Program(name, uniforms=(("frame", EFFECT_FRAME), ("effect", style_struct(parameters))), samplers=_samplers(name, "comp"),
                   images=(Image(image),), local_size=_GROUP, defines=_BENDS)


def marked_program(parameters: Mapping) -> Program:
    """The raster program of marked edges."""
    return Program("stylized_marked", uniforms=(("frame", EFFECT_FRAME), ("effect", style_struct(parameters))),
                   samplers=_samplers("stylized_marked", "frag"), inputs=(("VEC2", "corner"), ("VEC4", "ends"), ("VEC4", "look")),
                   flat_varyings=(("VEC4", "line_ends"), ("VEC4", "line_look")), outputs=(("VEC4", "color"),), writes_depth=True,
                   defines=(("MARKED_TOLERANCE", repr(TOLERANCE)),))


def tables(parameters: Mapping) -> tuple[np.ndarray, np.ndarray]:
    """Instances and materials as texels (include/stylized.glsl)."""
    excluded, anchored = parameters["instance_excluded"], parameters["anchors"]
    instances = np.zeros((len(excluded), 20), np.float32)
    if len(anchored):
        instances.reshape(-1, 5, 4)[:, :4, :3] = anchored
    instances[:, 16] = excluded
    materials = np.zeros((len(parameters["line_colors"]), 8), np.float32)
    materials[:, :4] = parameters["line_colors"]
    left_out = parameters["material_excluded"]
    materials[:len(left_out), 4] = left_out
    return fold(instances), fold(materials)


def strips(found: Segments) -> dict[str, np.ndarray]:
    """Two triangles for each of the segments, a pixel wider than its line all around, as vertex attributes."""
    start, along = found.ends[:, :2], found.ends[:, 2:] - found.ends[:, :2]
    length = np.sqrt(np.sum(along * along, axis=1, keepdims=True))
    along = np.where(length > 1e-6, along / np.maximum(length, 1e-6), np.float32([1.0, 0.0])) * (found.half_width[:, None] + 1.0)
    across = np.stack([-along[:, 1], along[:, 0]], axis=1)
    end = found.ends[:, 2:]
    corners = np.stack([start - along - across, end + along - across, end + along + across, start - along - across,
                        end + along + across, start - along + across], axis=1)
    look = np.column_stack([found.depths, found.half_width, found.material])
    return {"corner": corners.reshape(-1, 2).astype(np.float32), "ends": np.repeat(found.ends, 6, axis=0).astype(np.float32),
            "look": np.repeat(look, 6, axis=0).astype(np.float32)}


def _samplers(name: str, stage: str) -> tuple[str, ...]:
    text = source(name, stage)
    return tuple(texture for texture in (*TEXTURES, "instances", "materials", "borders", "marked", "transmittance", LEFT)
                 if re.search(rf"\b{texture}\b", text) and not (texture, name) == ("borders", "stylized_borders"))
