// A volume aligned with the view (effects/media/froxels.py): in a texture its slices lie side by side, `blocks` to a row of them.
#include "include/hash.glsl"

#define FROXEL_SEED 0x736Cu

struct Froxel {
  int slice;
  ivec2 column;
};

ivec2 froxel_texel(ivec2 column, int slice)
{
  return column + ivec2(slice % froxels.blocks, slice / froxels.blocks) * froxels.columns;
}

Froxel froxel_of(ivec2 texel)
{
  ivec2 block = texel / froxels.columns;
  return Froxel(block.y * froxels.blocks + block.x, texel - block * froxels.columns);
}

float froxel_limit(int slice)
{
  return froxels.start + froxels.bend * (exp(float(slice) / float(froxels.slices) * froxels.growth) - 1.0);
}

// Where a distance lies among the slices.
float froxel_slice(float distance)
{
  float along = clamp((distance - froxels.start) / froxels.bend, 0.0, exp(froxels.growth) - 1.0);
  return min(log(1.0 + along) * (float(froxels.slices) / froxels.growth), float(froxels.slices));
}

// Through a place in the picture in pixels.
void pixel_ray(vec2 pixel, out vec3 origin, out vec3 direction)
{
  vec2 place = pixel / vec2(froxels.size);
  direction = normalize(froxels.ray_base + place.x * froxels.ray_across + place.y * froxels.ray_up);
  origin = froxels.origin_base + place.x * froxels.origin_across + place.y * froxels.origin_up;
}

void froxel_ray(ivec2 column, out vec3 origin, out vec3 direction)
{
  pixel_ray((vec2(column) + froxels.jitter) * float(froxels.tile), origin, direction);
}

// A number in [0, 1) of a froxel in this sample.
float froxel_number(Froxel froxel, uint purpose)
{
  uint index = uint((froxel.slice * froxels.columns.y + froxel.column.y) * froxels.columns.x + froxel.column.x);
  uint state = hash_with(hash_with(hash_with(hash_with(HASH_START, FROXEL_SEED), uint(froxels.index)), index), purpose);
  return float(state >> 8) * 5.9604644775390625e-8;
}
