"""Every program of the product, described once (see `program`)."""

from dataclasses import replace
from functools import cache
from math import log

from ..scene.lamp_profile import FARTHEST, NEAREST
from ..transport.lights.kinds import DEFINES as LAMP_KINDS
from ..transport.surfaces.materials import MAX_ALBEDO
from ..transport.views.gbuffer import GBUFFER
from .program import Image, Program
from .uniforms import UniformStruct

# The tables of a lamp's profile (scene/lamp_profile.py), one texel each where there is none.
PROFILE_TABLES = ("lamp_directions", "lamp_places", "lamp_distances")
PROFILE_DEFINES = (("PROFILE_NEAREST", repr(NEAREST)), ("PROFILE_RANGE", repr(log(FARTHEST / NEAREST))))
# The material inputs in the order of include/material.glsl.
MATERIAL_INPUTS = ("albedo", "emission", "alpha", "base_color", "metallic", "roughness", "specular")

MATERIAL = UniformStruct("MaterialInputs", (
    ("vec4", "factor", 7), ("vec4", "addend", 7), ("vec4", "uv_row_x", 7), ("vec4", "uv_row_y", 7),
    ("ivec4", "source", 7), ("ivec4", "filtering", 7),
    # Alpha threshold (−1: a coin), the draw's first instance, 1 if it can be transparent, the material's index.
    ("vec4", "surface"),
))
VIEW = UniformStruct("ViewTransform", (
    ("mat4", "clip_from_world"), ("vec3", "position_world"), ("float", "far"), ("vec3", "forward_world"), ("int", "orthographic"),
    ("int", "seed"),
))

# What each pass over the scene's surfaces reads of a material, and its render targets.
SURFACE_PASSES = {
    "rsm_capture": (("albedo", "alpha"), ("position", "normal", "flux")),
    "gbuffer": (MATERIAL_INPUTS, GBUFFER),
    "shadow": (("alpha",), ("depth",)),
}


@cache
def surface_program(name: str, uv_count: int, color_count: int, smooth: bool) -> Program:
    """A pass of SURFACE_PASSES for triangles with that many UV maps and colour attributes, smooth or flat."""
    inputs, outputs = SURFACE_PASSES[name]
    uvs, colors = range(uv_count), range(color_count)
    defines = [
        *PROFILE_DEFINES, ("MAX_ALBEDO", repr(float(MAX_ALBEDO))),
        ("COPY_UVS", " ".join(f"uv{k} = uv_{k};" for k in uvs)),
        ("COPY_COLORS", " ".join(f"color{k} = color_{k};" for k in colors)),
        ("SELECT_UV", " ".join(f"if (slot == {k}) {{ return uv{k}; }}" for k in uvs)),
        ("SELECT_COLOR", " ".join(f"if (slot == {k}) {{ return color{k}; }}" for k in colors)),
    ]
    attributes = [("VEC3", "position"), ("VEC3", "face_normal"), ("INT", "triangle")]
    varyings = [("VEC3", "position_world")]
    if smooth:
        defines.append(("SMOOTH", "1"))
        attributes.append(("VEC3", "normal"))
        varyings.append(("VEC3", "normal_world"))
    attributes += [*(("VEC2", f"uv_{k}") for k in uvs), *(("VEC3", f"color_{k}") for k in colors)]
    varyings += [*(("VEC2", f"uv{k}") for k in uvs), *(("VEC3", f"color{k}") for k in colors)]
    return Program(
        name, vertex="surface", uniforms=(("view", VIEW), ("material", MATERIAL)),
        samplers=("instances", *(f"{item}_image" for item in inputs),
                  *(("power", "lamp_distances", "lit_instances") if name == "rsm_capture" else ())),
        inputs=tuple(attributes), varyings=tuple(varyings),
        flat_varyings=(("VEC3", "face_normal_world"), ("INT", "primitive"), ("INT", "instance_index")),
        outputs=tuple(("VEC4", f"out_{output}") for output in outputs), writes_depth=True, defines=tuple(defines))


_RGB = ("red", "green", "blue")
_GROUP = (8, 8)

# A light's cosine lobe goes into one texel a channel; the vertex stages differ in where lights come from.
_INJECT = UniformStruct("InjectParameters", (
    ("ivec3", "resolution"), ("int", "columns"), ("vec2", "size"), ("float", "per_flux"), ("float", "per_vector"),
    ("vec3", "corner"), ("float", "cell"), ("int", "level"), ("float", "distance")))
_LOBES = {"flat_varyings": (("VEC4", "lobe"), ("VEC3", "light_flux")), "outputs": tuple(("VEC4", f"out_{name}") for name in _RGB)}

LPV_INJECT = Program("lpv_inject", uniforms=(("parameters", _INJECT),), samplers=("level_walls",),
                     inputs=(("VEC3", "cell_position"), ("VEC3", "normal"), ("VEC3", "flux")), **_LOBES)

LPV_INJECT_MAP = Program("lpv_inject", vertex="lpv_inject_map", uniforms=(("parameters", _INJECT),),
                         samplers=("map_position", "map_normal", "map_flux", "level_walls"), inputs=(("INT", "texel"),), **_LOBES)


@cache
def lpv_inject_border(cascades: int) -> Program:
    """Into a cascade, what coarser ones of so many in all send through its border."""
    return Program("lpv_inject", vertex="lpv_inject_border",
                   uniforms=(("parameters", _INJECT), ("indirect", lpv_cascades(cascades))),
                   samplers=(*(f"light_{name}" for name in _RGB), "walls", "level_walls"),
                   defines=(("LPV_CASCADES", str(cascades)),),
                   inputs=(("VEC3", "face_position"), ("VEC3", "inward"), ("VEC3", "cell_position"), ("VEC3", "normal"),
                           ("FLOAT", "share")), **_LOBES)


@cache
def lpv_cascades(cascades: int) -> UniformStruct:
    """The uniforms of include/irradiance_lpv.glsl for so many cascades."""
    return UniformStruct("LpvCascades", (
        ("vec4", "corner", cascades), ("ivec4", "resolution", cascades), ("vec4", "factors", cascades),
        ("float", "surface_cells"), ("float", "blend_cells"), ("int", "dampening")))


LPV_STORE = Program(
    "lpv_store", uniforms=(("parameters", UniformStruct("LpvStoreParameters", (
        ("vec4", "scale"), ("ivec2", "size"), ("ivec2", "first_texel")))),),
    samplers=(*(f"light_{name}" for name in _RGB), *(f"added_{name}" for name in _RGB)), local_size=_GROUP,
    images=tuple(Image(f"stored_{name}") for name in _RGB))

LPV_PROPAGATE = Program(
    "lpv_propagate", uniforms=(("parameters", UniformStruct("PropagateParameters", (
        ("ivec3", "resolution"), ("int", "columns"), ("ivec2", "size"), ("int", "bounces"), ("int", "accumulate"), ("int", "media"),
        ("float", "flux_out"), ("float", "vector_out"), ("float", "vector_of_flux"), ("float", "vector_ahead"),
        ("float", "vector_across"), ("float", "lobe_vector")))),),
    samplers=(*(f"light_{name}" for name in _RGB), "faces", "blockers", "kept"), local_size=_GROUP,
    images=(*(Image(f"next_{name}") for name in _RGB), *(Image(f"total_{name}", access="READ_WRITE") for name in _RGB)))

LPV_GATHER = Program(
    "lpv_gather", uniforms=(("parameters", UniformStruct("LpvGatherParameters", (
        ("ivec3", "resolution"), ("int", "columns"), ("int", "count"), ("int", "first_row"), ("int", "dampening"),
        ("float", "total"), ("float", "along"), ("float", "surface_cells")))),),
    samplers=("receivers", *(f"light_{name}" for name in _RGB), "walls"), local_size=_GROUP,
    images=(Image("irradiance", access="READ_WRITE"),))

# A captured map made ready to be sampled, row by row: strengths summed, quantized and summed up along each row, and stored.
_ROWS = (64, 1)
RSM_SUM_ROWS = Program("rsm_sum_rows", samplers=("map_flux",), images=(Image("rows"),), local_size=_ROWS)
RSM_QUANTIZE = Program("rsm_quantize", samplers=("map_flux", "rows"), images=(Image("quantized_rows"), Image("running", "R32F")),
                       local_size=_ROWS)
RSM_STORE = Program(
    "rsm_store", uniforms=(("parameters", UniformStruct("RsmStoreParameters", (
        ("vec3", "eye"), ("int", "orthographic"), ("vec3", "forward"), ("float", "max_slant"), ("ivec2", "place")))),),
    samplers=("map_position", "map_normal", "map_flux", "map_power", "quantized_rows", "running"), local_size=_ROWS,
    images=(Image("texels"), Image("cumulative", "R32F")))

# What media leave of a captured map's flux.
MAP_IN_MEDIA = Program(
    "map_in_media", uniforms=(("parameters", UniformStruct("MapInMedia", (
        ("vec3", "eye"), ("int", "orthographic"), ("vec3", "forward"), ("int", "distant"), ("ivec2", "size"), ("int", "media")))),),
    samplers=("map_position", "map_flux", "media_table", "media_cells"), images=(Image("left"),), local_size=_GROUP)

RSM_GATHER = Program(
    "rsm_gather", uniforms=(("parameters", UniformStruct("RsmGatherParameters", (
        ("int", "size"), ("int", "count"), ("int", "first_row"), ("int", "in_disk"), ("int", "by_flux"),
        ("float", "disk_radius")))),),
    samplers=("receivers", "pattern", "texels", "cumulative"), local_size=_GROUP,
    images=(Image("irradiance", access="READ_WRITE"),))

VPL_GATHER = Program(
    "vpl_gather", uniforms=(("parameters", UniformStruct("VplGatherParameters", (
        ("int", "count"), ("int", "first_row"), ("int", "lights"), ("int", "has_visibility"), ("float", "clamp_at")))),),
    samplers=("receivers", "lights", "visibility"), local_size=_GROUP, images=(Image("irradiance", access="READ_WRITE"),))

LAMP = UniformStruct("LampPoint", (
    ("int", "kind"), ("int", "soft_falloff"), ("int", "ellipse"), ("float", "radius"), ("vec3", "position"),
    ("float", "cos_half_cone"), ("vec3", "shift"), ("float", "inverse_blend"), ("vec3", "axis"), ("float", "tan_half_spread"),
    ("vec3", "strength"), ("float", "spread_gain"), ("mat4", "local_from_world"), ("mat4", "beam"),
    # What its nodes make of its light: include/lamp_profile.glsl.
    ("mat4", "profile_from_world"), ("int", "profile"), ("int", "profile_of_normals"), ("float", "profile_reach"),
    ("float", "scattered"),
))
SHADOW = UniformStruct("ShadowMap", (
    ("mat4", "clip_from_world"), ("vec3", "position_world"), ("float", "texel"), ("vec3", "forward_world"), ("int", "orthographic"),
    ("vec3", "ray_base"), ("int", "outside_lit"), ("vec3", "ray_x"), ("int", "casts_shadow"), ("vec3", "ray_y"),
    # The range of the camera's depth [m] that the map is for.
    ("float", "camera_near"), ("float", "camera_far"),
))
CAMERA = UniformStruct("CameraFrame", (
    ("vec3", "position_world"), ("int", "orthographic"), ("vec3", "forward_world"), ("ivec2", "size"),
))
FILM_FRAME = UniformStruct("FilmFrame", (
    ("ivec2", "size"), ("int", "kind"), ("float", "weight"), ("vec3", "position_world"), ("int", "transparent_world"),
    ("vec3", "forward_world"), ("vec3", "ray_base"), ("vec3", "ray_across"), ("vec3", "ray_up"), ("mat4", "map_from_world"),
))

DIRECT_LIGHT = Program(
    "direct_light", uniforms=(("lamp", LAMP), ("shadow", SHADOW), ("camera", CAMERA)),
    samplers=("shadow_map", "ggx_energy", "lit_instances", *PROFILE_TABLES, *(f"gbuffer_{name}" for name in GBUFFER)),
    defines=(*LAMP_KINDS, *PROFILE_DEFINES),
    images=(Image("direct", access="READ_WRITE"),), local_size=_GROUP)

# The same, with what media leave of the light on its way.
DIRECT_LIGHT_IN_MEDIA = replace(
    DIRECT_LIGHT, uniforms=(*DIRECT_LIGHT.uniforms, ("media", UniformStruct("MediaCount", (("int", "count"),)))),
    samplers=(*DIRECT_LIGHT.samplers, "media_table", "media_cells"), defines=(*DIRECT_LIGHT.defines, ("IN_MEDIA", "1")))

# What a flat piece of an emissive surface gives, through one shadow map.
NEAR_LIGHT = Program(
    "near_light", uniforms=(("pane", UniformStruct("NearPane", (
        ("vec4", "corners", 4), ("vec3", "normal"), ("float", "area"), ("vec3", "radiance"), ("int", "width"), ("vec3", "point"),
        ("int", "height")))), ("shadow", SHADOW)),
    samplers=("shadow_map", *(f"gbuffer_{name}" for name in ("position", "normal", "geometry"))),
    images=(Image("irradiance", access="READ_WRITE"),), local_size=_GROUP)

FILM = Program(
    "film", uniforms=(("film", FILM_FRAME),),
    samplers=("world", "direct_radiance", "indirect_irradiance",
              *(f"gbuffer_{name}" for name in ("position", "normal", "albedo", "emission"))),
    images=(Image("mean", access="READ_WRITE"),), local_size=_GROUP)

AVERAGE = Program("average", uniforms=(("average", UniformStruct("AverageFrame", (("ivec2", "size"), ("float", "weight")))),),
                  samplers=("picture",), images=(Image("mean", access="READ_WRITE"),), local_size=_GROUP)

INDIRECT_ATLAS = Program(
    "indirect_atlas", uniforms=(("atlas", UniformStruct("AtlasFrame", (("ivec2", "size"), ("ivec2", "sheet")))),),
    samplers=(*(f"gbuffer_{name}" for name in ("position", "normal", "albedo", "geometry")), "atlas_texels", "atlas_instances",
              "atlas_triangles"),
    images=(Image("irradiance"),), local_size=_GROUP)

# What a lattice of pixels sees, without its mirrors.
POINT_TARGETS = ("position", "normal", "albedo", "emission", "geometry")
CAMERA_POINTS = Program(
    "camera_points", uniforms=(("points", UniformStruct("CameraPointsFrame", (
        ("ivec2", "corner"), ("ivec2", "extent"), ("ivec2", "count"), ("ivec2", "shift")))),),
    samplers=tuple(f"gbuffer_{name}" for name in POINT_TARGETS), images=tuple(Image(f"point_{name}") for name in POINT_TARGETS),
    local_size=_GROUP)

INDIRECT_FRAME = UniformStruct("IndirectFrame", (("ivec2", "size"),))


def indirect_program(name: str, uniforms: tuple = (), samplers: tuple[str, ...] = (), defines: tuple = ()) -> Program:
    """The program of ``shaders/NAME.comp.glsl`` with the frame's resources in front of the technique's own."""
    return Program(name, uniforms=(("frame", INDIRECT_FRAME), *uniforms), defines=defines, images=(Image("irradiance"),),
                   samplers=("gbuffer_position", "gbuffer_normal", *samplers), local_size=_GROUP)
