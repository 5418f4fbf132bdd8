// Irradiance of all lamps' reflective shadow maps (techniques/rsm/gather.py, gather). A map, in five texels: rows 0, 1 and 3 of
// clip_from_world; (size, place x y, first sample); (samples in the disk, samples by flux, 0, 0).
#include "include/hash.glsl"
#include "include/rsm.glsl"

// The shift of the pattern at a receiver, from the seed and the bits of its position.
vec2 rsm_shift(vec3 position)
{
  uint state = indirect.seed_state;
  for (int axis = 0; axis < 3; axis++) {
    // -0 is the same place as 0.
    state = hash_with(state, position[axis] == 0.0 ? 0u : floatBitsToUint(position[axis]));
  }
  state = hash_with(HASH_START, state);
  return vec2(uvec2(hash_with(state, 0u), hash_with(state, 1u)) >> 8) * exp2(-24.0);
}

// Where a point projects into the map's unit square; the nearest point of it for those outside.
vec2 rsm_centre(int index, vec3 position)
{
  vec4 point = vec4(position, 1.0);
  vec2 clip = vec2(dot(list_texel(maps, index, 5, 0), point), dot(list_texel(maps, index, 5, 1), point));
  float depth = max(dot(list_texel(maps, index, 5, 2), point), 1e-6 * max(abs(clip.x), abs(clip.y)) + 1e-30);
  return clamp(0.5 + 0.5 * clip / depth, 0.0, 1.0);
}

vec3 indirect_irradiance(vec3 position_world, vec3 normal_world)
{
  vec2 shift = rsm_shift(position_world);
  vec3 sum = vec3(0.0);
  for (int index = 0; index < indirect.count; index++) {
    ivec4 place = ivec4(list_texel(maps, index, 5, 3));
    ivec2 samples = ivec2(list_texel(maps, index, 5, 4).xy);
    RsmMap map = RsmMap(place.x, place.yz, samples.x, samples.y, place.w, indirect.disk_radius);
    sum += rsm_irradiance(map, rsm_centre(index, position_world), shift, position_world, normal_world);
  }
  return sum;
}
