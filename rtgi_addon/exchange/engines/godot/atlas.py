"""The light atlas for Godot: its coefficients as one 3D texture, its index, the shader's look-up."""

import json
from pathlib import Path

from ..atlas import EngineAtlas, atlas_glsl, require_texture
from ..atlas_transfer import EngineAtlasTransfer, relight_glsl
from ..base import write_text
from ..halves import half_scale, over
from .media import write_slices
from .textures import MAX_SIDE

INDEX, TEXELS = "atlas.json", "atlas/texels.exr"
RELIT_INDEX, TABLE, SHADER = "atlas_transfer.json", "atlas/transfer.exr", "atlas_relight.gdshader"
# What goes into a project beside what is written here.
FILES = ("atlas.gd",)
_FILES = Path(__file__).parent / "files" / "rtgi"
# UV maps that Godot imports of a mesh.
TEXCOORDS = 2
_HEAD = """
// RTGI's light atlas: atlas.gd sets the uniforms of materials of the objects in it.
#define RTGI_HAS_ATLAS
uniform bool rtgi_atlas_ready = false;
uniform bool rtgi_atlas_second = false;
uniform vec3 rtgi_atlas_place = vec3(1.0, 0.0, 0.0);
uniform mat4 rtgi_atlas_local_from_world = mat4(1.0);
uniform float rtgi_atlas_scale = 1.0;
uniform sampler3D rtgi_atlas_texels : filter_nearest, repeat_disable;
#define RTGI_ATLAS_SIZE (textureSize(rtgi_atlas_texels, 0).xy)
"""
_BAKED = """
vec4 rtgi_atlas_texel(ivec2 texel, int channel) {
	return rtgi_atlas_scale * texelFetch(rtgi_atlas_texels, ivec3(texel, channel), 0);
}

"""
_RELIT = """// Under other light: what relight.gd draws, red above green above blue.
uniform bool rtgi_atlas_relit = false;
uniform sampler2D rtgi_atlas_shown : filter_nearest, repeat_disable;

vec4 rtgi_atlas_texel(ivec2 texel, int channel) {
	if (rtgi_atlas_relit) {
		return texelFetch(rtgi_atlas_shown, ivec2(texel.x, channel * RTGI_ATLAS_SIZE.y + texel.y), 0);
	}
	return rtgi_atlas_scale * texelFetch(rtgi_atlas_texels, ivec3(texel, channel), 0);
}

"""
_TAIL = """
// Irradiance [W/m^2] at the coordinates `st` of the object's map, UV or UV2 as rtgi_atlas_second says, under a normal.
vec3 rtgi_atlas(vec2 st, vec3 normal_world) {
	return rtgi_atlas_irradiance(st * rtgi_atlas_place.x + rtgi_atlas_place.yz,
			normalize(mat3(rtgi_atlas_local_from_world) * normal_world));
}
"""


def write_atlas(folder: Path, atlas: EngineAtlas, transfer: EngineAtlasTransfer | None = None) -> None:
    """Write what depends on ``atlas`` and its ``transfer`` into ``folder``. Raises BakeError for what no 3D texture holds,
    OSError."""
    require_texture(atlas, MAX_SIDE, "Godot")
    scale = half_scale(atlas.slices)
    write_slices(folder / TEXELS, over(atlas.slices, scale), "the light atlas")
    write_text(folder / INDEX, json.dumps({"texels": TEXELS, "scale": scale, "parts": atlas.entries}, indent=1) + "\n")
    if transfer is not None:
        write_slices(folder / TABLE, transfer.slices, "the light atlas's transfer")
        index = {**transfer.to_json(), "volumes": [{"table": TABLE, "down": 1}]}
        write_text(folder / RELIT_INDEX, json.dumps(index, indent=1) + "\n")


def write_atlas_shader(folder: Path) -> None:
    """The shader that relights the atlas, for the folder that goes into a project."""
    text = (_FILES / f"{SHADER}.in").read_text(encoding="utf-8")
    write_text(folder / SHADER, text.replace("@RELIT@", relight_glsl()))


def atlas_include(relit: bool) -> str:
    """What irradiance.gdshaderinc has besides where there is an atlas, which may be ``relit`` at run time."""
    return f"{_HEAD}{_RELIT if relit else _BAKED}{atlas_glsl()}{_TAIL}"
