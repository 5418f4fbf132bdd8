// The frame of every indirect pass: an entry file includes the technique's `vec3 indirect_irradiance(vec3 position_world,
// vec3 normal_world)` [W/m2] first and this after it.

void main()
{
  ivec2 texel = ivec2(gl_GlobalInvocationID.xy);
  if (any(greaterThanEqual(texel, frame.size))) {
    return;
  }
  vec3 normal = texelFetch(gbuffer_normal, texel, 0).xyz;
  // Nothing is seen where there is no normal.
  vec3 value = vec3(0.0);
  if (dot(normal, normal) > 0.0) {
    value = max(indirect_irradiance(texelFetch(gbuffer_position, texel, 0).xyz, normal), vec3(0.0));
  }
  imageStore(irradiance, texel, vec4(value, 1.0));
}
