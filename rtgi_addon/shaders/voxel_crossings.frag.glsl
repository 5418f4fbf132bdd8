// A line meets the triangle: the crossing goes to the end of a list, in two texels, as long as there is room; all are counted.

void main()
{
  color = vec4(0.0);
  float slab = floor(met.x + CROSSING_TIE);
  if (slab < 0.0 || slab >= float(parameters.resolution[parameters.axis])) {
    return;
  }
  int item = int(imageAtomicAdd(counter, ivec2(0), 1u));
  if (item < parameters.capacity) {
    ivec2 texel = ivec2(item % parameters.per_row * 2, item / parameters.per_row);
    imageStore(crossings, texel, vec4(floor(gl_FragCoord.xy), met.x, float(primitive)));
    imageStore(crossings, texel + ivec2(1, 0), vec4(met.yz, 0.0, 0.0));
  }
  // Nothing of the picture is kept. A rasterizer may leave out what lies below a triangle that hides it, and does (Mesa's llvmpipe
  // drops what a tile holds when one covers it); it cannot where pixels are discarded.
  discard;
}
