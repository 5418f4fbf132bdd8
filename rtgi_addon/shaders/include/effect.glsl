// What every effect of one program can ask of a pixel (effects/frame.py has the same names).
#include "include/world.glsl"

// What Blender's own engines write for the depth of nothing.
const float EFFECT_NOWHERE = 1e10;

bool effect_seen(ivec2 texel)
{
  vec3 normal = texelFetch(gbuffer_normal, texel, 0).xyz;
  return dot(normal, normal) > 0.0;
}

// Along the middle of the view [m].
float effect_depth(ivec2 texel)
{
  vec3 towards = texelFetch(gbuffer_position, texel, 0).xyz - frame.position_world;
  return effect_seen(texel) ? dot(towards, frame.forward_world) : EFFECT_NOWHERE;
}

// From the eye [m]; for a parallel projection the depth.
float effect_distance(ivec2 texel)
{
  if (frame.orthographic != 0 || !effect_seen(texel)) {
    return effect_depth(texel);
  }
  return length(texelFetch(gbuffer_position, texel, 0).xyz - frame.position_world);
}

vec3 effect_direction(ivec2 texel)
{
  vec2 place = (vec2(texel) + 0.5) / vec2(frame.size);
  return normalize(frame.ray_base + place.x * frame.ray_across + place.y * frame.ray_up);
}

// What would be seen with no surface in the way.
vec4 effect_background(ivec2 texel)
{
  if (frame.transparent != 0) {
    return vec4(0.0);
  }
  return vec4(world_radiance(world, mat3(frame.map_from_world), effect_direction(texel)), 1.0);
}

// Indices into the scene's tuples, -1 where nothing is seen (transport/views/gbuffer.py).
int effect_instance(ivec2 texel)
{
  return effect_seen(texel) ? int(texelFetch(gbuffer_albedo, texel, 0).w) : -1;
}

int effect_material(ivec2 texel)
{
  int high = int(texelFetch(gbuffer_position, texel, 0).w) / 65536;
  int low = int(texelFetch(gbuffer_normal, texel, 0).w) / 65536;
  return effect_seen(texel) ? high * 256 + low : -1;
}
