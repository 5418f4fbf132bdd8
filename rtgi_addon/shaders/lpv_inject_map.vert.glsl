// The texels of a reflective shadow map as virtual lights.
#include "include/lpv_inject.glsl"

void main()
{
  int size = textureSize(map_flux, 0).x;
  ivec2 place = ivec2(texel % size, texel / size);
  vec3 flux = texelFetch(map_flux, place, 0).rgb;
  if (flux.r <= 0.0 && flux.g <= 0.0 && flux.b <= 0.0) {
    inject_nothing();
    return;
  }
  vec3 position = texelFetch(map_position, place, 0).xyz;
  inject_light((position - parameters.corner) / parameters.cell, texelFetch(map_normal, place, 0).xyz, flux);
}
