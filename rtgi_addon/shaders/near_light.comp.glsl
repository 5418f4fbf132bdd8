// Adds what a flat piece of an emissive surface gives to the irradiance of pixels, as far as one of its shadow maps sees them
// (techniques/lattice/near_light.py). What stands in the way is told by one point of the piece, which the whole frame shares.
#include "include/shadow.glsl"
#include "include/pane.glsl"

// Less of the piece above the horizon counts as this much: few frames have their point there.
const float LEAST_ABOVE = 1.0 / 32.0;

void main()
{
  ivec2 texel = ivec2(gl_GlobalInvocationID.xy);
  if (any(greaterThanEqual(texel, ivec2(pane.width, pane.height)))) {
    return;
  }
  vec3 normal = texelFetch(gbuffer_normal, texel, 0).xyz;
  vec3 point = texelFetch(gbuffer_position, texel, 0).xyz;
  if (dot(normal, normal) == 0.0 || dot(point - pane.corners[0].xyz, pane.normal) <= 0.0) {
    return;
  }
  vec3 face = texelFetch(gbuffer_geometry, texel, 0).xyz;
  vec3 towards = pane.point - point;
  if (dot(towards, normal) <= 0.0 || dot(towards, face) <= 0.0) {
    return;
  }
  float above;
  float factor = pane_factor(point, normal, above);
  float visible = factor > 0.0 ? shadow_visibility(point, face) : 0.0;
  if (visible > 0.0) {
    vec4 sum = imageLoad(irradiance, texel);
    imageStore(irradiance, texel, sum + vec4(pane.radiance * (factor * visible / max(above, LEAST_ABOVE)), 0.0));
  }
}
