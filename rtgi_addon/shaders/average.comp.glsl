// This frame's sample of a finished picture, averaged with those before.

void main()
{
  ivec2 texel = ivec2(gl_GlobalInvocationID.xy);
  if (any(greaterThanEqual(texel, average.size))) {
    return;
  }
  vec4 value = texelFetch(picture, texel, 0);
  // The first sample takes whatever the image held before, so what it held need not be a number.
  if (average.weight < 1.0) {
    value = mix(imageLoad(mean, texel), value, average.weight);
  }
  imageStore(mean, texel, value);
}
