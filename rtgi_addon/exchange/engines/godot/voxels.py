"""Lit voxels for Godot: their lists as 3D textures, their index, the shader include that traces cones."""

import json
from pathlib import Path

from ..base import write_text
from ..halves import half_scale, over
from ..voxels import LISTS, EngineVoxels, voxels_glsl
from .media import write_slices

INDEX, FOLDER = "voxels.json", "voxels"
# What goes into a project beside what is written here.
FILES = ("voxels.gd", "voxel_cones.gd", "voxel_surface.gdshader")
_HEAD = """\
// RTGI's lit voxels: voxels.gd sets the uniforms.
uniform mat4 rtgi_voxels_cells_from_world = mat4(1.0);
{samplers}
vec4 rtgi_list_texel(sampler3D list, int item, int parts, int part) {{
	ivec3 size = textureSize(list, 0);
	int line = item / (size.x / parts);
	return texelFetch(list, ivec3(item % (size.x / parts) * parts + part, line % size.y, line / size.y), 0);
}}

"""
_TAIL = """
// Irradiance [W/m^2] at a point of a surface under a unit normal.
vec3 rtgi_voxels_irradiance(vec3 position_world, vec3 normal_world) {
	return rtgi_voxel_irradiance((rtgi_voxels_cells_from_world * vec4(position_world, 1.0)).xyz,
			normalize(mat3(rtgi_voxels_cells_from_world) * normal_world));
}

// Radiance [W/(sr m^2)] that a surface of that roughness mirrors from `direction_world`: one cone about half of its lobe.
vec3 rtgi_voxels_mirrored(vec3 position_world, vec3 normal_world, vec3 direction_world, float roughness) {
	float alpha = min(roughness * roughness, 0.5);
	return rtgi_voxel_seen((rtgi_voxels_cells_from_world * vec4(position_world, 1.0)).xyz,
			normalize(mat3(rtgi_voxels_cells_from_world) * direction_world),
			normalize(mat3(rtgi_voxels_cells_from_world) * normal_world), true, 2.0 * alpha / (1.0 - alpha * alpha));
}
"""
_SAMPLER = "uniform sampler3D rtgi_voxel_{name} : filter_nearest, repeat_disable;"


def write_voxels(folder: Path, voxels: EngineVoxels) -> None:
    """Write what depends on ``voxels`` into ``folder``. Raises BakeError for what no 3D texture holds, OSError."""
    lists = voxels.slices
    # Light of dim rooms, and opacity where the widest cells hold next to nothing, but perhaps a lamp.
    scales = {name: half_scale(lists[name]) for name in ("cells", "light")}
    lists |= {name: over(lists[name], scale) for name, scale in scales.items()}
    for name, slices in lists.items():
        write_slices(folder / FOLDER / f"{name}.exr", slices, f"the voxels' {name}")
    grid = voxels.source.tables.grid
    index = {"lists": {name: f"{FOLDER}/{name}.exr" for name in LISTS}, "resolution": list(grid.resolution), "cell": grid.cell,
             "cones": voxels.source.cones, "cells_from_local": voxels.cells_from_world[:3].tolist(),
             "cascades": voxels.cascades, "scales": {"rows": 1.0, **scales}, "lookup": voxels.lookup}
    write_text(folder / INDEX, json.dumps(index, indent=1) + "\n")
    samplers = "".join(_SAMPLER.format(name=name) + "\n" for name in LISTS)
    write_text(folder / "voxels.gdshaderinc", f"{_HEAD.format(samplers=samplers)}{voxels_glsl(voxels, **scales)}{_TAIL}")
