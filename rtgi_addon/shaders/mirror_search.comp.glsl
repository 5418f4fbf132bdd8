// What one mirrored ray of every pixel brings, added to what others brought (effects/screen_reflections/__init__.py, `mirrored`).
#include "include/screen_search.glsl"
#ifdef IN_MEDIA
#include "include/hash.glsl"
#include "include/media.glsl"
#include "include/mirror_media.glsl"
#define AMBIENT passed
#include "include/ambient.glsl"

// A number in [0, 1) of this pixel's ray.
float mirror_number(ivec2 texel, uint purpose)
{
  uint state = hash_with(hash_with(HASH_START, 0x736Du + purpose), uint(frame.index));
  state = hash_with(hash_with(hash_with(state, uint(passed.ray)), uint(texel.x)), uint(texel.y));
  return float(state >> 8) * 5.9604644775390625e-8;
}

// What arrives of the `light` of what is met `distance` away, with what media give on the way and scatter of all light but lamps'.
vec3 mirror_through_media(ivec2 texel, vec3 origin, vec3 direction, float distance, vec3 light, float jitter)
{
  light *= media_transmittance(passed.media, origin, direction, distance);
  float begin = 0.0;
  float end = 0.0;
  if (!mirror_span(origin, direction, distance, begin, end)) {
    return light;
  }
  float within = (end - begin) / float(MIRROR_STEPS);
  vec3 shift = vec3(mirror_number(texel, 1u), mirror_number(texel, 2u), mirror_number(texel, 3u));
  vec3 taken = vec3(0.0);
  for (int k = 0; k < MIRROR_STEPS; k++) {
    vec3 point = origin + direction * (begin + (float(k) + jitter) * within);
    int around = ambient_point(point, shift);
    vec3 extinction = vec3(0.0);
    vec3 sent = vec3(0.0);
    for (int medium = 0; medium < passed.media; medium++) {
      Coefficients here = medium_there(medium, point);
      extinction += here.scattering + here.absorption;
      sent += here.emission;
      if (here.scattering != vec3(0.0)) {
        sent += here.scattering * ambient_scattered(around, direction, medium_texel(medium, 10).xyz);
      }
    }
    light += exp(-taken) * sent * mirror_share(extinction * within) * within;
    taken += extinction * within;
  }
  return light;
}
#endif

// Reflections up to this share of the largest roughness do not fade.
const float FADE_FROM = 0.75;

float confidence_of(ScreenRay ray, ScreenHit hit)
{
  vec2 at = (ray.origin + ray.along * hit.s) / vec2(frame.size);
  vec2 edge = smoothstep(0.0, 1.0, min(at, 1.0 - at) / max(mirrors.border, 1e-6));
  float near = 1.0 - smoothstep(0.0, 1.0, hit.behind / mirrors.thickness);
  return edge.x * edge.y * near * near;
}

void main()
{
  ivec2 texel = ivec2(gl_GlobalInvocationID.xy);
  if (any(greaterThanEqual(texel, frame.size))) {
    return;
  }
  vec4 direction = texelFetch(directions, texel, 0), weight = texelFetch(weights, texel, 0);
#ifdef IN_MEDIA
  imageStore(met, texel, vec4(0.0));
#endif
  if (direction.w == 0.0) {
    return;
  }
  vec3 brought = texelFetch(fallback, texel, 0).rgb * 0.31830988618;
  float confidence = 0.0, distance = 0.0;
  float limit = mirrors.max_roughness;
  float fade = 1.0 - smoothstep(0.0, 1.0, (weight.w - FADE_FROM * limit) / max((1.0 - FADE_FROM) * limit, 1e-6));
  if (fade > 0.0 && max(weight.r, max(weight.g, weight.b)) > LEAST_WEIGHT) {
    ScreenRay ray = screen_ray(texelFetch(gbuffer_position, texel, 0).xyz, direction.xyz);
    ScreenHit hit;
    if (mirrors.search == 1) {
      hit = march_steps(ray, direction.xyz);
    } else {
      hit = search_blocks(ray, direction.xyz);
    }
    if (hit.pixel.x >= 0) {
      confidence = fade * confidence_of(ray, hit);
      distance = hit.s * ray.inverse_w.y * ray.reach / mix(ray.inverse_w.x, ray.inverse_w.y, hit.s);
      vec3 shown = texelFetch(light, hit.pixel, 0).rgb;
#ifdef IN_MEDIA
      float jitter = mirror_number(texel, 0u);
      shown = mirror_through_media(texel, texelFetch(gbuffer_position, texel, 0).xyz, direction.xyz, distance, shown, jitter);
      imageStore(met, texel, vec4(distance, confidence, jitter, 0.0));
#endif
      brought = mix(brought, shown, confidence);
    }
  }
  vec4 total = vec4(brought * weight.rgb, confidence), carried = vec4(weight.rgb, confidence * distance);
  if (mirrors.first == 0) {
    total += imageLoad(gathered, texel);
    carried += imageLoad(carrying, texel);
  }
  imageStore(gathered, texel, total);
  imageStore(carrying, texel, carried);
}
