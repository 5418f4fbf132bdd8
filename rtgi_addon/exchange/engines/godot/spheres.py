"""Sphere probes for Godot: their maps as one 3D texture, their index, the shader's look-up."""

import json
from pathlib import Path

import numpy as np

from ..base import write_text
from ..halves import half_scale, over
from ..spheres import EngineSpheres, spheres_glsl
from .media import write_slices

INDEX, MAPS = "spheres.json", "spheres/maps.exr"
# What goes into a project beside what is written here.
FILES = ("spheres.gd",)
# After the volumes' look-up, which has rtgi_octahedral. Uniforms hold the table: there are 32 probes at most. The third number of a
# probe's last row is what its map is stored over.
_HEAD = """\
// What RTGI's sphere probes saw, for mirrors: spheres.gd sets the uniforms.
#define RTGI_HAS_SPHERES
uniform bool rtgi_spheres_ready = false;
uniform mat4 rtgi_spheres_local_from_world = mat4(1.0);
uniform vec4 rtgi_sphere_table[{rows}];
uniform sampler3D rtgi_sphere_maps : filter_nearest, repeat_disable;

vec4 rtgi_sphere_row(int probe, int row) {{
	return rtgi_sphere_table[probe * 8 + row];
}}

vec3 rtgi_sphere_texel(int probe, ivec2 texel) {{
	return rtgi_sphere_row(probe, 7).z * texelFetch(rtgi_sphere_maps, ivec3(texel, probe), 0).rgb;
}}

"""
_TAIL = """
// Radiance [W/(sr m^2)] that a surface of that roughness mirrors from `direction_world`, times the share that the probes know of it
// (a). RADIANCE takes it divided by the share.
vec4 rtgi_mirrored(vec3 position_world, vec3 direction_world, float roughness) {
	if (!rtgi_spheres_ready) {
		return vec4(0.0);
	}
	return rtgi_spheres((rtgi_spheres_local_from_world * vec4(position_world, 1.0)).xyz,
			normalize(mat3(rtgi_spheres_local_from_world) * direction_world), roughness * roughness);
}
"""


def write_spheres(folder: Path, spheres: EngineSpheres) -> None:
    """Write what depends on ``spheres`` into ``folder``. Raises BakeError for what no 3D texture holds, OSError."""
    slices, table = spheres.slices, spheres.table
    scales = np.array([half_scale(probe) for probe in slices])
    table[:, 7, 2] = scales
    write_slices(folder / MAPS, over(slices, scales[:, None, None, None]), "the maps of sphere probes")
    index = {"maps": MAPS, **spheres.sizes, "names": [item.probe.name for item in spheres.probes.maps],
             "table": table.reshape(-1, 4).tolist()}
    write_text(folder / INDEX, json.dumps(index, indent=1) + "\n")


def spheres_include(spheres: EngineSpheres) -> str:
    """What irradiance.gdshaderinc has besides for ``spheres``."""
    return f"\n{_HEAD.format(rows=8 * len(spheres.probes.maps))}{spheres_glsl(spheres)}{_TAIL}"
