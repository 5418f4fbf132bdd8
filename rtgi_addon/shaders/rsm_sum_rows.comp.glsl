// How strong each row of a reflective shadow map is, and how many of its texels are: one invocation a row.
#include "include/luminance.glsl"

void main()
{
  int row = int(gl_GlobalInvocationID.x);
  ivec2 size = textureSize(map_flux, 0);
  if (row >= size.y) {
    return;
  }
  vec2 sum = vec2(0.0);
  for (int column = 0; column < size.x; column++) {
    float strength = luminance(texelFetch(map_flux, ivec2(column, row), 0).rgb);
    sum += vec2(strength, strength > 0.0 ? 1.0 : 0.0);
  }
  imageStore(rows, ivec2(row, 0), vec4(sum, 0.0, 0.0));
}
