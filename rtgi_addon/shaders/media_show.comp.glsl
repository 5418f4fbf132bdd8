// Lays media over the picture, between the four columns about each pixel (effects/media/integrate.py, seen_through).
#include "include/froxels.glsl"
#include "include/media_seen.glsl"

vec3 share_of(vec3 depth)
{
  vec3 thin = vec3(lessThan(depth, vec3(1e-3)));
  vec3 safe = mix(depth, vec3(1.0), thin);
  return mix((1.0 - exp(-safe)) / safe, 1.0 - 0.5 * depth, thin);
}

void main()
{
  ivec2 texel = ivec2(gl_GlobalInvocationID.xy);
  if (any(greaterThanEqual(texel, froxels.size))) {
    return;
  }
  float distance = seen_distance(texel);
  int slice = slice_at(distance);
  vec3 left = vec3(0.0);
  vec3 direct = texelFetch(near_light, texel, 0).rgb;
  vec3 indirect = vec3(0.0);
  for (int corner = 0; corner < 4; corner++) {
    float weight;
    ivec2 column = column_about(texel, corner, weight);
    ivec2 at = froxel_texel(column, slice);
    ivec2 above = froxel_texel(column, slice + 1);
    vec3 tau;
    float before;
    left += weight * exp(-depth_before(at, distance, tau, before));
    vec3 share = before * share_of(tau * before) / share_of(tau);
    vec3 first = texelFetch(gathered_direct, at, 0).rgb;
    direct += weight * (first + (texelFetch(gathered_direct, above, 0).rgb - first) * share);
    first = texelFetch(gathered_indirect, at, 0).rgb;
    indirect += weight * (first + (texelFetch(gathered_indirect, above, 0).rgb - first) * share);
  }
  vec4 lit = texelFetch(light, texel, 0);
  float alpha = 1.0 - dot(left, vec3(1.0 / 3.0)) * (1.0 - lit.a);
  imageStore(result, texel, vec4(lit.rgb * left + direct + indirect, alpha));
  imageStore(volume_direct, texel, vec4(direct, 1.0));
  imageStore(volume_indirect, texel, vec4(indirect, 1.0));
  imageStore(transmittance, texel, vec4(left, 1.0));
}
