// Depth along the middle of the view, as effects/frame.py has it.

void main()
{
  ivec2 texel = ivec2(gl_GlobalInvocationID.xy);
  if (any(greaterThanEqual(texel, frame.size))) {
    return;
  }
  vec3 normal = texelFetch(gbuffer_normal, texel, 0).xyz;
  vec3 towards = texelFetch(gbuffer_position, texel, 0).xyz - frame.position_world;
  imageStore(depth, texel, vec4(dot(normal, normal) > 0.0 ? dot(towards, frame.forward_world) : NOWHERE));
}
