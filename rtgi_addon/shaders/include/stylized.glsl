// What both programs of the stylized effect ask of a pixel (effects/stylized).
#include "include/effect.glsl"
#include "include/luminance.glsl"
#include "include/list.glsl"

// Objects and materials (preview/effects/stylized.py): axes, place and 1 for no lines; colour of lines with opacity, 1 for no lines.
#define INSTANCE_TEXELS 5
#define MATERIAL_TEXELS 2

bool in_picture(ivec2 texel)
{
  return all(greaterThanEqual(texel, ivec2(0))) && all(lessThan(texel, frame.size));
}

vec3 surface_position(ivec2 texel)
{
  return texelFetch(gbuffer_position, texel, 0).xyz;
}

vec3 surface_normal(ivec2 texel)
{
  return texelFetch(gbuffer_normal, texel, 0).xyz;
}

// How wide a pixel is at its surface [m].
float footprint_at(float depth)
{
  return frame.orthographic != 0 ? effect.pixel_width : depth * effect.pixel_width;
}
