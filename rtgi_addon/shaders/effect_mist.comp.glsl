// Depth cueing (effects/mist.py).
#include "include/effect.glsl"

float mist_of(float distance)
{
  float mist = clamp((distance - effect.start) * effect.inverse_depth, 0.0, 1.0);
  if (effect.exponent == 2.0) {
    return mist * mist;
  }
  return effect.exponent == 0.5 ? sqrt(mist) : mist;
}

// What the world shows, below the horizon what it shows at the horizon.
vec4 above_horizon(ivec2 texel)
{
  if (frame.transparent != 0) {
    return vec4(0.0);
  }
  vec3 direction = effect_direction(texel);
  direction.z = max(direction.z, effect.lowest_slope * length(direction.xy));
  return vec4(world_radiance(world, mat3(frame.map_from_world), direction), 1.0);
}

vec4 effect_pixel(ivec2 texel, vec4 lit)
{
  if (!effect_seen(texel) && (effect.over_world == 0 || frame.transparent != 0)) {
    imageStore(left_by_mist, texel, vec4(effect_seen(texel) ? 1.0 : 0.0));
    return lit;
  }
  vec4 gone = effect.fades_to_world != 0 ? above_horizon(texel) : vec4(effect.color, 1.0);
  float share = effect.strength * (effect_seen(texel) ? mist_of(effect_distance(texel)) : 1.0);
  imageStore(left_by_mist, texel, vec4(effect_seen(texel) ? 1.0 - share : 0.0));
  return mix(lit, gone, share);
}

#include "include/effect_main.glsl"
