// Adds one cascade's irradiance at every receiver: (position in cells, share of the cascade), (normal, 0).
#include "include/list.glsl"
#include "include/lpv.glsl"
#include "include/receiver.glsl"

void main()
{
  ivec2 place;
  int index = receiver_index(place, imageSize(irradiance).x, parameters.first_row, parameters.count);
  if (index < 0) {
    return;
  }
  LpvVolume volume = LpvVolume(parameters.resolution, parameters.columns, ivec2(0), parameters.total, parameters.along,
                               parameters.surface_cells, parameters.dampening != 0);
  vec4 cells = list_texel(receivers, index, 2, 0);
  vec3 normal = list_texel(receivers, index, 2, 1).xyz;
  vec4 sum = imageLoad(irradiance, place);
  imageStore(irradiance, place, sum + vec4(cells.w * lpv_irradiance(volume, cells.xyz, normal), 0.0));
}
