// Copies a level of a pyramid to its place in the texture that has all of them side by side.

void main()
{
  ivec2 texel = ivec2(gl_GlobalInvocationID.xy);
  if (all(lessThan(texel, textureSize(level, 0)))) {
    imageStore(atlas, texel + ivec2(place.left, 0), texelFetch(level, texel, 0));
  }
}
