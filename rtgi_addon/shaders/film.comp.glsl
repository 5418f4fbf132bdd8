// One pass of the picture (preview/settings.py, PASSES): this frame's sample, averaged with those before.
#include "include/world.glsl"

#define PASS_COMBINED 0
#define PASS_DIRECT 1
#define PASS_INDIRECT 2
#define PASS_IRRADIANCE 3
#define PASS_ALBEDO 4
#define PASS_NORMAL 5
#define PASS_DEPTH 6
#define PASS_OBJECT 7

// What Blender's own engines write for the depth of the background.
const float NOWHERE = 1e10;

vec4 background(ivec2 texel)
{
  if (film.kind == PASS_DEPTH) {
    return vec4(vec3(NOWHERE), 1.0);
  }
  if (film.kind == PASS_COMBINED && film.transparent_world == 0) {
    vec2 place = (vec2(texel) + 0.5) / vec2(film.size);
    vec3 direction = film.ray_base + place.x * film.ray_across + place.y * film.ray_up;
    return vec4(world_radiance(world, mat3(film.map_from_world), direction), 1.0);
  }
  return vec4(0.0);
}

vec4 surface_sample(ivec2 texel, vec3 normal)
{
  vec4 albedo = texelFetch(gbuffer_albedo, texel, 0);
  vec3 irradiance = texelFetch(indirect_irradiance, texel, 0).rgb;
  vec3 indirect = albedo.rgb * irradiance * 0.31830988618;
  vec3 direct = texelFetch(direct_radiance, texel, 0).rgb;
  if (film.kind == PASS_COMBINED) {
    return vec4(direct + indirect + texelFetch(gbuffer_emission, texel, 0).rgb, 1.0);
  }
  if (film.kind == PASS_DIRECT) {
    return vec4(direct, 1.0);
  }
  if (film.kind == PASS_INDIRECT) {
    return vec4(indirect, 1.0);
  }
  if (film.kind == PASS_IRRADIANCE) {
    return vec4(irradiance, 1.0);
  }
  if (film.kind == PASS_ALBEDO) {
    return vec4(albedo.rgb, 1.0);
  }
  if (film.kind == PASS_NORMAL) {
    return vec4(normal, 1.0);
  }
  if (film.kind == PASS_DEPTH) {
    return vec4(vec3(dot(texelFetch(gbuffer_position, texel, 0).xyz - film.position_world, film.forward_world)), 1.0);
  }
  return vec4(vec3(albedo.w + 1.0), 1.0);
}

void main()
{
  ivec2 texel = ivec2(gl_GlobalInvocationID.xy);
  if (any(greaterThanEqual(texel, film.size))) {
    return;
  }
  vec3 normal = texelFetch(gbuffer_normal, texel, 0).xyz;
  vec4 value = dot(normal, normal) > 0.0 ? surface_sample(texel, normal) : background(texel);
  // The first sample takes whatever the image held before, so what it held need not be a number.
  if (film.weight < 1.0) {
    value = mix(imageLoad(mean, texel), value, film.weight);
  }
  imageStore(mean, texel, value);
}
