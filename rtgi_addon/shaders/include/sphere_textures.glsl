// What include/sphere_probes.glsl asks its host for, from textures of our own (preview/sphere_textures.py). The program has a struct
// `spheres` with `stack` and `columns`.
#include "include/probe_weights.glsl"

vec4 rtgi_sphere_row(int probe, int row)
{
  return texelFetch(sphere_table, ivec2(row, probe), 0);
}

vec3 rtgi_sphere_texel(int probe, ivec2 texel)
{
  ivec2 place = ivec2(probe % spheres.columns, probe / spheres.columns) * spheres.stack;
  return texelFetch(sphere_maps, place + texel, 0).rgb;
}

vec3 rtgi_sphere_axes(vec3 direction)
{
  return direction;
}

#include "include/sphere_probes.glsl"
