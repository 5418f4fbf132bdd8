// Adds what media in the slices scatter of one lamp, as far as one of its shadow maps sees them.
#include "include/lamp.glsl"
#include "include/shadow.glsl"
#include "include/media.glsl"
#include "include/media_lamp.glsl"
#include "include/froxels.glsl"

float seen_angle(float height, float low, float high)
{
  return atan(height * (high - low), height * height + high * low);
}

// How much of a lamp's light falls on a piece of the ray on average beyond what pixels have of it (effects/media/lighting.py).
float falloff_beyond(float distance, float nearest, float first, float last)
{
  float height = sqrt(max(distance * distance - nearest * nearest, 1e-12));
  float low = first - nearest;
  float high = last - nearest;
  float half_chord = sqrt(max(near.reach * near.reach - height * height, 0.0));
  float enter = clamp(-half_chord, low, high);
  float leave = clamp(half_chord, low, high);
  float total = (seen_angle(height, low, enter) + seen_angle(height, leave, high)) / height;
  float a = enter / near.reach;
  float b = leave / near.reach;
  float h = height / near.reach;
  total += ((b - a) * (2.0 - h * h) - (b * b * b - a * a * a) / 3.0) / near.reach;
  return distance * distance * total / max(high - low, 1e-12);
}

void main()
{
  ivec2 texel = ivec2(gl_GlobalInvocationID.xy);
  Froxel froxel = froxel_of(texel);
  if (texel.x >= froxels.columns.x * froxels.blocks || froxel.slice >= froxels.slices) {
    return;
  }
  float enter = texelFetch(slice_depth, texel, 0).w;
  vec4 sum = imageLoad(slice_direct, texel);
  if (sum.w <= enter) {
    return;
  }
  vec3 origin;
  vec3 direction;
  froxel_ray(froxel.column, origin, direction);
  float along = texelFetch(slice_indirect, texel, 0).w;
  vec3 point = origin + direction * along;
  LampLight light;
  vec3 arriving;
  if (!media_arriving(froxels.media, point, light, arriving)) {
    return;
  }
  if (near.reach > 0.0) {
    vec3 aside = near.centre - point;
    arriving *= falloff_beyond(length(aside), dot(aside, direction), enter - along, sum.w - along);
  }
  float cosine = dot(direction, light.direction);
  float low = froxel_limit(froxel.slice);
  float high = froxel_limit(froxel.slice + 1);
  vec3 scattered = vec3(0.0);
  for (int medium = 0; medium < froxels.media; medium++) {
    vec2 span = medium_span(medium, origin, direction, high);
    float within = span.y - max(span.x, low);
    if (medium_seen(medium) && within > 0.0 && medium_texel(medium, 0).rgb != vec3(0.0)) {
      scattered += medium_at(medium, point).scattering * (within * medium_phase(medium, cosine));
    }
  }
  imageStore(slice_direct, texel, vec4(sum.rgb + scattered * arriving, sum.w));
}
