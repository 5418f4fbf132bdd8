// Flux as whole numbers that floats hold exactly, summed up along each row (techniques/rsm/gather.py, GatherMap): one invocation a row.
#include "include/luminance.glsl"

// 2^24, less what rounding may add.
const float LARGEST_SUM = 16777216.0 - 4096.0;

void main()
{
  int row = int(gl_GlobalInvocationID.x);
  ivec2 size = textureSize(map_flux, 0);
  if (row >= size.y) {
    return;
  }
  vec2 total = vec2(0.0);
  for (int other = 0; other < size.y; other++) {
    total += texelFetch(rows, ivec2(other, 0), 0).xy;
  }
  float scale = total.x > 0.0 ? max(LARGEST_SUM - total.y, 0.0) / total.x : 0.0;
  float sum = 0.0;
  for (int column = 0; column < size.x; column++) {
    float strength = luminance(texelFetch(map_flux, ivec2(column, row), 0).rgb);
    if (strength > 0.0) {
      sum += floor(strength * scale) + 1.0;
    }
    imageStore(running, ivec2(column, row), vec4(sum));
  }
  imageStore(quantized_rows, ivec2(row, 0), vec4(sum, 0.0, 0.0, 0.0));
}
