// Mixes the light of the slices with that of the sample before, where it was seen (effects/media/history.py).
#include "include/froxels.glsl"

ivec2 before_texel(ivec3 froxel)
{
  return froxel.xy + ivec2(froxel.z % before.blocks, froxel.z / before.blocks) * before.columns;
}

void main()
{
  ivec2 texel = ivec2(gl_GlobalInvocationID.xy);
  Froxel froxel = froxel_of(texel);
  if (texel.x >= froxels.columns.x * froxels.blocks || froxel.slice >= froxels.slices) {
    return;
  }
  float enter = texelFetch(slice_depth, texel, 0).w;
  vec4 direct = imageLoad(slice_direct, texel);
  vec4 indirect = imageLoad(slice_indirect, texel);
  if (direct.w <= enter) {
    return;
  }
  vec3 origin;
  vec3 direction;
  froxel_ray(froxel.column, origin, direction);
  vec3 point = origin + direction * (0.5 * (enter + direct.w));
  vec4 clip = before.clip_from_world * vec4(point, 1.0);
  vec2 place = clip.xy / max(clip.w, 1e-12) * 0.5 + 0.5;
  vec3 towards = point - before.position_world;
  float away = before.orthographic != 0 ? dot(towards, before.forward_world) : length(towards);
  if (clip.w <= 0.0 || any(lessThan(place, vec2(0.0))) || any(greaterThan(place, vec2(1.0))) || away < before.start ||
      away > before.far) {
    return;
  }
  vec2 column = place * vec2(froxels.size) / float(before.tile) - before.jitter;
  float along = log(1.0 + (away - before.start) / before.bend) * (float(before.slices) / before.growth) - 0.5;
  vec3 low = floor(vec3(column, along));
  vec3 part = vec3(column, along) - low;
  ivec3 last = ivec3(before.columns, before.slices) - 1;
  vec3 found_direct = vec3(0.0);
  vec3 found_indirect = vec3(0.0);
  float weight = 0.0;
  for (int corner = 0; corner < 8; corner++) {
    ivec3 bit = ivec3(corner & 1, (corner >> 1) & 1, corner >> 2);
    ivec2 at = before_texel(clamp(ivec3(low) + bit, ivec3(0), last));
    vec4 there = texelFetch(before_direct, at, 0);
    float within = there.w - texelFetch(before_depth, at, 0).w;
    vec3 share = mix(1.0 - part, part, vec3(bit));
    float counts = within > 0.0 ? share.x * share.y * share.z : 0.0;
    weight += counts;
    found_direct += there.rgb * (counts / max(within, 1e-12));
    found_indirect += texelFetch(before_indirect, at, 0).rgb * (counts / max(within, 1e-12));
  }
  if (weight <= 0.0) {
    return;
  }
  float scale = (direct.w - enter) / max(weight, 1e-6);
  imageStore(slice_direct, texel, vec4(mix(direct.rgb, found_direct * scale, before.share), direct.w));
  imageStore(slice_indirect, texel, vec4(mix(indirect.rgb, found_indirect * scale, before.share), indirect.w));
}
