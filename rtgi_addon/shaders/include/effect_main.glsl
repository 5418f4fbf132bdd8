// The frame of every effect of one program: an entry file defines `vec4 effect_pixel(ivec2 texel, vec4 lit)` before it.

void main()
{
  ivec2 texel = ivec2(gl_GlobalInvocationID.xy);
  if (all(lessThan(texel, frame.size))) {
    imageStore(result, texel, effect_pixel(texel, texelFetch(light, texel, 0)));
  }
}
