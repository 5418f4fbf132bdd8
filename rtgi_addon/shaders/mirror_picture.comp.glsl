// The picture with its reflections: what a layer reflects does not get below it (effects/screen_reflections/__init__.py, `apply`).
#include "include/reflected_look.glsl"

void main()
{
  ivec2 texel = ivec2(gl_GlobalInvocationID.xy);
  if (any(greaterThanEqual(texel, frame.size))) {
    return;
  }
  vec4 lit = texelFetch(light, texel, 0);
  vec4 confidence = vec4(0.0, 0.0, 0.0, 1.0), distance = confidence;
  vec3 normal = texelFetch(gbuffer_normal, texel, 0).xyz;
  if (dot(normal, normal) > 0.0) {
    Mirror mirror = pixel_mirror(texel);
    vec4 total = texelFetch(gathered, texel, 0), carried = texelFetch(carrying, texel, 0);
    vec3 shown = total.rgb / carried.rgb;
    confidence.rgb = vec3(total.w / float(picture.rays));
    distance.rgb = vec3(carried.w / max(total.w, 1e-6));
    vec3 taken = texelFetch(gbuffer_albedo, texel, 0).rgb - mirror.look.diffuse;
    lit.rgb += mirror.look.layer * shown - taken * texelFetch(indirect_irradiance, texel, 0).rgb * INVERSE_PI;
    lit.rgb = max(lit.rgb, vec3(0.0));
  }
  imageStore(result, texel, lit);
  imageStore(mirror_confidence, texel, confidence);
  imageStore(mirror_distance, texel, distance);
}
