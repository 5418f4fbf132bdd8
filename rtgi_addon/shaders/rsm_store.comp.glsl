// A captured reflective shadow map as include/rsm.glsl reads it, into its place on the sheet: one invocation a row.

const float INVERSE_PI = 0.318309886;

void main()
{
  int row = int(gl_GlobalInvocationID.x);
  ivec2 size = textureSize(map_flux, 0);
  if (row >= size.y) {
    return;
  }
  float before = 0.0;
  float total = 0.0;
  for (int other = 0; other < size.y; other++) {
    before = other == row ? total : before;
    total += texelFetch(quantized_rows, ivec2(other, 0), 0).x;
  }
  float per_density = float(size.x * size.y) / max(total, 1.0);
  float below = 0.0;
  for (int column = 0; column < size.x; column++) {
    ivec2 texel = ivec2(column, row);
    vec3 position = texelFetch(map_position, texel, 0).xyz;
    vec3 normal = texelFetch(map_normal, texel, 0).xyz;
    vec3 flux = INVERSE_PI * texelFetch(map_flux, texel, 0).rgb;
    float measure = texelFetch(map_power, texel, 0).a;
    vec3 offset = position - parameters.eye;
    vec3 direction = parameters.forward;
    if (parameters.orthographic == 0) {
      measure *= dot(offset, offset);
      direction = offset / max(length(offset), 1e-30);
    }
    float area = measure / max(abs(dot(direction, normal)), 1.0 / parameters.max_slant);
    float sum = texelFetch(running, texel, 0).r;
    ivec2 place = ivec2(3 * parameters.place.x, parameters.place.y) + texel;
    imageStore(texels, place, vec4(position, normal.x));
    imageStore(texels, place + ivec2(size.x, 0), vec4(normal.yz, flux.rg));
    imageStore(texels, place + ivec2(2 * size.x, 0), vec4(flux.b, INVERSE_PI * area, (sum - below) * per_density, 0.0));
    imageStore(cumulative, parameters.place + texel, vec4(before + sum));
    below = sum;
  }
}
