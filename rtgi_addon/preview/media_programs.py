"""The programs that put media into the picture, described once (see `program`)."""

from ..effects.media.near import CLOSEST, POINTS, SEED, STEP
from ..transport.lights.kinds import DEFINES as LAMP_KINDS
from .program import Image, Program
from .programs import CAMERA, LAMP, PROFILE_DEFINES, PROFILE_TABLES, SHADOW
from .uniforms import UniformStruct

FROXELS = UniformStruct("Froxels", (
    ("ivec2", "size"), ("ivec2", "columns"), ("int", "tile"), ("int", "slices"), ("int", "blocks"), ("int", "index"),
    ("float", "start"), ("float", "bend"), ("float", "growth"), ("int", "media"), ("vec2", "jitter"), ("int", "all_orders"),
    ("int", "orthographic"), ("vec3", "ray_base"), ("vec3", "ray_across"), ("vec3", "ray_up"), ("vec3", "origin_base"),
    ("vec3", "origin_across"), ("vec3", "origin_up"), ("vec3", "position_world"), ("vec3", "forward_world"),
    ("mat4", "ambient_from_world"), ("ivec3", "ambient_resolution")))
_SLICES = ("slice_depth", "slice_direct", "slice_indirect")
_GATHERED = ("gathered_depth", "gathered_direct", "gathered_indirect")
_GROUP = (8, 8)
# A lamp about which pixels have its light by themselves, to so far; 0: it is as wide as columns show.
_NEAR = UniformStruct("NearLamp", (("vec3", "centre"), ("float", "reach")))
_LAMP_PART = ("lamp", LAMP), ("shadow", SHADOW), ("camera", CAMERA), ("froxels", FROXELS), ("near", _NEAR)

MEDIA_SLICES = Program("media_slices", uniforms=(("froxels", FROXELS),), samplers=("media_table", "media_cells", "ambient"),
                       images=tuple(Image(name) for name in _SLICES), local_size=_GROUP)

MEDIA_LIGHT = Program(
    "media_light", uniforms=_LAMP_PART,
    samplers=("shadow_map", "slice_depth", "slice_indirect", "media_table", "media_cells", *PROFILE_TABLES),
    defines=(*LAMP_KINDS, *PROFILE_DEFINES), images=(Image("slice_direct", access="READ_WRITE"),), local_size=_GROUP)

MEDIA_NEAR = Program(
    "media_near", uniforms=_LAMP_PART,
    samplers=("shadow_map", "gbuffer_position", "gbuffer_normal", "slice_depth", "slice_direct", "gathered_depth", "media_table",
              "media_cells", *PROFILE_TABLES),
    defines=(*LAMP_KINDS, *PROFILE_DEFINES, ("NEAR_POINTS", str(POINTS)), ("NEAR_SEED", f"{SEED}u"), ("NEAR_STEP", f"{STEP}u"),
             ("NEAR_CLOSEST", str(CLOSEST))),
    images=(Image("near_light", access="READ_WRITE"),), local_size=_GROUP)

# The volume of the sample before, and how much of it counts.
FROXELS_BEFORE = UniformStruct("FroxelsBefore", (
    ("mat4", "clip_from_world"), ("vec3", "position_world"), ("int", "orthographic"), ("vec3", "forward_world"), ("int", "tile"),
    ("ivec2", "columns"), ("vec2", "jitter"), ("int", "slices"), ("int", "blocks"), ("float", "start"), ("float", "far"),
    ("float", "bend"), ("float", "growth"), ("float", "share")))

MEDIA_HISTORY = Program(
    "media_history", uniforms=(("froxels", FROXELS), ("before", FROXELS_BEFORE)),
    samplers=("slice_depth", "before_depth", "before_direct", "before_indirect"),
    images=tuple(Image(name, access="READ_WRITE") for name in _SLICES[1:]), local_size=_GROUP)

MEDIA_GATHER = Program("media_gather", uniforms=(("froxels", FROXELS),), samplers=_SLICES,
                       images=tuple(Image(name) for name in _GATHERED), local_size=_GROUP)

MEDIA_SHOW = Program(
    "media_show", uniforms=(("froxels", FROXELS),),
    samplers=("gbuffer_position", "gbuffer_normal", "light", "near_light", "slice_depth", "slice_direct", *_GATHERED),
    images=tuple(Image(name) for name in ("result", "volume_direct", "volume_indirect", "transmittance")), local_size=_GROUP)
