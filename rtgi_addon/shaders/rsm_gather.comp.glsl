// Adds one reflective shadow map's irradiance at every receiver: (position, shift x), (normal, shift y), (projection into the map, 0, 0).
#include "include/receiver.glsl"
#include "include/rsm.glsl"

void main()
{
  ivec2 place;
  int index = receiver_index(place, imageSize(irradiance).x, parameters.first_row, parameters.count);
  if (index < 0) {
    return;
  }
  RsmMap map = RsmMap(parameters.size, ivec2(0), parameters.in_disk, parameters.by_flux, 0, parameters.disk_radius);
  vec4 point = list_texel(receivers, index, 3, 0);
  vec4 normal = list_texel(receivers, index, 3, 1);
  vec2 centre = list_texel(receivers, index, 3, 2).xy;
  vec3 sum = rsm_irradiance(map, centre, vec2(point.w, normal.w), point.xyz, normal.xyz);
  imageStore(irradiance, place, imageLoad(irradiance, place) + vec4(sum, 0.0));
}
