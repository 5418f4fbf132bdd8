// Adds what media close about a small lamp scatter of its light, pixel by pixel (effects/media/near.py).
#include "include/lamp.glsl"
#include "include/shadow.glsl"
#include "include/media.glsl"
#include "include/media_lamp.glsl"
#include "include/froxels.glsl"
#include "include/media_seen.glsl"

// The share of light that media leave before a point of the pixel's ray.
vec3 left_before(ivec2 texel, float distance)
{
  int slice = slice_at(distance);
  vec3 left = vec3(0.0);
  for (int corner = 0; corner < 4; corner++) {
    float weight;
    ivec2 column = column_about(texel, corner, weight);
    vec3 tau;
    float part;
    left += weight * exp(-depth_before(froxel_texel(column, slice), distance, tau, part));
  }
  return left;
}

void main()
{
  ivec2 texel = ivec2(gl_GlobalInvocationID.xy);
  if (any(greaterThanEqual(texel, froxels.size))) {
    return;
  }
  vec3 origin;
  vec3 direction;
  pixel_ray(vec2(texel) + 0.5, origin, direction);
  float nearest = dot(near.centre - origin, direction);
  vec3 past = near.centre - (origin + direction * nearest);
  float half_chord = sqrt(max(near.reach * near.reach - dot(past, past), 0.0));
  float first = max(nearest - half_chord, froxels.start);
  float last = min(min(nearest + half_chord, seen_distance(texel)), froxel_limit(froxels.slices));
  if (last <= first) {
    return;
  }
  float closest = max(length(past), NEAR_CLOSEST * near.reach);
  float begin = atan(first - nearest, closest);
  float angle = atan(last - nearest, closest) - begin;
  uint pixel = uint(texel.y * froxels.size.x + texel.x);
  uint state = hash_with(hash_with(HASH_START, NEAR_SEED), pixel) + uint(froxels.index) * NEAR_STEP;
  float u = float(state >> 8) * 5.9604644775390625e-8;
  vec3 sum = vec3(0.0);
  for (int number = 0; number < NEAR_POINTS; number++) {
    float aside = closest * tan(begin + angle * ((float(number) + u) / float(NEAR_POINTS)));
    float squared = aside * aside + closest * closest;
    float share = max(1.0 - squared / (near.reach * near.reach), 0.0);
    vec3 point = origin + direction * (nearest + aside);
    LampLight light;
    vec3 arriving;
    if (!media_arriving(froxels.media, point, light, arriving)) {
      continue;
    }
    float cosine = dot(direction, light.direction);
    vec3 scattered = vec3(0.0);
    for (int medium = 0; medium < froxels.media; medium++) {
      if (medium_seen(medium)) {
        vec3 scattering = medium_there(medium, point).scattering;
        if (scattering != vec3(0.0)) {
          scattered += scattering * medium_phase(medium, cosine);
        }
      }
    }
    float weight = share * share * squared * angle / (closest * float(NEAR_POINTS));
    sum += weight * scattered * arriving * left_before(texel, nearest + aside);
  }
  imageStore(near_light, texel, imageLoad(near_light, texel) + vec4(sum, 0.0));
}
