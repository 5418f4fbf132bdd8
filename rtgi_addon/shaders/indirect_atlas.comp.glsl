// Irradiance from the light atlas over that of the field, where the surface is in it (effects/atlas/surfaces.py).
#include "include/list.glsl"

#define RTGI_ATLAS_SIZE atlas.sheet

// Red, green and blue one below the other.
vec4 rtgi_atlas_texel(ivec2 texel, int channel)
{
  return texelFetch(atlas_texels, ivec2(texel.x, channel * atlas.sheet.y + texel.y), 0);
}

#include "include/light_atlas.glsl"

void main()
{
  ivec2 texel = ivec2(gl_GlobalInvocationID.xy);
  if (any(greaterThanEqual(texel, atlas.size))) {
    return;
  }
  vec4 position = texelFetch(gbuffer_position, texel, 0), normal = texelFetch(gbuffer_normal, texel, 0);
  if (dot(normal.xyz, normal.xyz) == 0.0) {
    return;
  }
  // Where the instance's triangles begin in the table, -1: it is not in the atlas, and the scene's number of its first one.
  vec4 placed = list_texel(atlas_instances, int(texelFetch(gbuffer_albedo, texel, 0).w), 1, 0);
  if (placed.x < 0.0) {
    return;
  }
  int primitive = (int(position.w) & 65535) * 65536 + (int(normal.w) & 65535) - 1;
  int row = int(placed.x) + primitive - (int(placed.y) * 65536 + int(placed.z));
  // The light on the backs of faces is the field's.
  if (dot(list_texel(atlas_triangles, row, 3, 2).xyz, texelFetch(gbuffer_geometry, texel, 0).xyz) <= 0.0) {
    return;
  }
  vec4 point = vec4(position.xyz, 1.0);
  vec2 place = vec2(dot(list_texel(atlas_triangles, row, 3, 0), point), dot(list_texel(atlas_triangles, row, 3, 1), point));
  imageStore(irradiance, texel, vec4(rtgi_atlas_irradiance(place, normal.xyz), 1.0));
}
