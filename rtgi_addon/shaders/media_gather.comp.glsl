// From slices to what reaches the eye from before every limit, column by column (effects/media/integrate.py, gather).
#include "include/froxels.glsl"

void main()
{
  ivec2 column = ivec2(gl_GlobalInvocationID.xy);
  if (any(greaterThanEqual(column, froxels.columns))) {
    return;
  }
  vec3 depth = vec3(0.0);
  vec3 direct = vec3(0.0);
  vec3 indirect = vec3(0.0);
  vec3 left = vec3(1.0);
  for (int k = 0; k <= froxels.slices; k++) {
    ivec2 texel = froxel_texel(column, k);
    imageStore(gathered_depth, texel, vec4(depth, 0.0));
    imageStore(gathered_direct, texel, vec4(direct, 0.0));
    imageStore(gathered_indirect, texel, vec4(indirect, 0.0));
    if (k == froxels.slices) {
      return;
    }
    vec3 tau = texelFetch(slice_depth, texel, 0).rgb;
    depth += tau;
    vec3 after = exp(-depth);
    vec3 share = mix((left - after) / max(tau, vec3(1e-30)), left - 0.5 * left * tau, vec3(lessThan(tau, vec3(1e-3))));
    direct += texelFetch(slice_direct, texel, 0).rgb * share;
    indirect += texelFetch(slice_indirect, texel, 0).rgb * share;
    left = after;
  }
}
