// No light, as long as there is none to show.
vec3 indirect_irradiance(vec3 position_world, vec3 normal_world)
{
  return vec3(indirect.radiance);
}

#include "include/indirect_frame.glsl"
