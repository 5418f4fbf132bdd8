// A virtual light becomes a cosine lobe of intensity in the cell in front of its surface (techniques/lpv/injection.py): one point,
// blended additively into the texel of that cell.
#include "include/standing.glsl"

void inject_light(vec3 cells, vec3 light_normal, vec3 power)
{
  ivec3 resolution = parameters.resolution;
  vec3 place = cells + parameters.distance * light_normal - 0.5;
  ivec3 low = ivec3(floor(place));
  ivec3 cell = standing_cell(level_walls, Walls(resolution, parameters.columns, ivec2(0)), low, place - vec3(low), cells, light_normal);
  lobe = vec4(parameters.per_flux, parameters.per_vector * light_normal.yzx);
  light_flux = power;
  vec2 texel = vec2(atlas_texel(cell, resolution, parameters.columns)) + 0.5;
  gl_Position = is_inside(cell, resolution) ? vec4(texel / parameters.size * 2.0 - 1.0, 0.0, 1.0) : vec4(2.0, 2.0, 2.0, 1.0);
  gl_PointSize = 1.0;
}

void inject_nothing()
{
  lobe = vec4(0.0);
  light_flux = vec3(0.0);
  gl_Position = vec4(2.0, 2.0, 2.0, 1.0);
  gl_PointSize = 1.0;
}
