// A gather has one invocation a receiver. Receivers are dealt with by bands of rows, so that no dispatch takes longer than a driver
// allows.

// The receiver's place in the result; its index is returned, or -1 for none.
int receiver_index(out ivec2 place, int width, int first_row, int count)
{
  place = ivec2(gl_GlobalInvocationID.xy) + ivec2(0, first_row);
  int index = place.y * width + place.x;
  return place.x < width && index < count ? index : -1;
}
