// A material's inputs at a fragment: constant * texture(uv) * attribute + offset (scene/material.py, Channel).
#include "include/texture.glsl"

#define INPUT_ALBEDO 0
#define INPUT_EMISSION 1
#define INPUT_ALPHA 2
#define INPUT_BASE_COLOR 3
#define INPUT_METALLIC 4
#define INPUT_ROUGHNESS 5
#define INPUT_SPECULAR 6

// The host writes the two selections: interpolated UVs and attributes are as many as the triangles have.
vec2 uv_of(int slot)
{
  SELECT_UV
  return vec2(0.0);
}

vec3 attribute_of(int slot)
{
  SELECT_COLOR
  return vec3(1.0);
}

// source: uv slot (-1: no texture), component (-1: rgb), attribute slot (-1: none); filtering: extension, closest, sRGB.
vec3 material_input(int index, sampler2D image)
{
  vec3 value = material.factor[index].rgb;
  ivec4 source = material.source[index];
  if (source.x >= 0) {
    vec3 homogeneous = vec3(uv_of(source.x), 1.0);
    vec2 uv = vec2(dot(material.uv_row_x[index].xyz, homogeneous), dot(material.uv_row_y[index].xyz, homogeneous));
    ivec4 filtering = material.filtering[index];
    vec4 texel = filtered_texel(image, uv, filtering.x, filtering.y != 0);
    vec3 sampled = source.y < 0 ? texel.rgb : vec3(texel[max(source.y, 0)]);
    value *= filtering.z != 0 && source.y != 3 ? linear_from_srgb(sampled) : sampled;
  }
  if (source.z >= 0) {
    value *= attribute_of(source.z);
  }
  return value + material.addend[index].rgb;
}

// A coin per texel and triangle for coverage without a threshold, from [0, 1).
float coverage_coin(ivec2 texel, int primitive)
{
  uint state = uint(texel.x) * 0x9E3779B9u ^ uint(texel.y) * 0x85EBCA6Bu ^ uint(primitive) * 0xC2B2AE35u ^
               uint(view.seed) * 0x27D4EB2Fu;
  state ^= state >> 16;
  state *= 0x7FEB352Du;
  state ^= state >> 15;
  state *= 0x846CA68Bu;
  state ^= state >> 16;
  return float(state >> 8) * exp2(-24.0);
}

// Whether the fragment lets light through (transport/rays/alpha.py, AlphaTracer).
bool is_transparent(sampler2D image, int primitive)
{
  float alpha = clamp(material_input(INPUT_ALPHA, image).r, 0.0, 1.0);
  float threshold = material.surface.x;
  return alpha < (threshold < 0.0 ? coverage_coin(ivec2(gl_FragCoord.xy), primitive) : threshold);
}
