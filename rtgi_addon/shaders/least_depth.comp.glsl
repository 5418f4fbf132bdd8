// The next level of a pyramid of least depths: what is beyond the last row or column of an odd size is nowhere
// (effects/screen_reflections/pyramid.py).

void main()
{
  ivec2 texel = ivec2(gl_GlobalInvocationID.xy), size = textureSize(below, 0);
  if (any(greaterThanEqual(texel, (size + 1) / 2))) {
    return;
  }
  float least = NOWHERE;
  for (int corner = 0; corner < 4; corner++) {
    ivec2 place = 2 * texel + ivec2(corner % 2, corner / 2);
    if (all(lessThan(place, size))) {
      least = min(least, texelFetch(below, place, 0).x);
    }
  }
  imageStore(level, texel, vec4(least));
}
