// The fallback of mirrored rays with what sphere probes saw in their directions laid over it (effects/screen_reflections,
// `_fallback`): irradiance across the ray, which the search divides by pi.
#include "include/sphere_textures.glsl"

void main()
{
  ivec2 texel = ivec2(gl_GlobalInvocationID.xy);
  if (any(greaterThanEqual(texel, spheres.size))) {
    return;
  }
  vec4 direction = texelFetch(directions, texel, 0), light = texelFetch(fallback, texel, 0);
  if (direction.w != 0.0) {
    float roughness = texelFetch(weights, texel, 0).w;
    vec4 seen = rtgi_spheres(texelFetch(gbuffer_position, texel, 0).xyz, direction.xyz, spheres.ray_share * roughness * roughness);
    light.rgb = 3.14159265359 * seen.rgb + max(light.rgb, vec3(0.0)) * (1.0 - seen.w);
  }
  imageStore(result, texel, light);
}
