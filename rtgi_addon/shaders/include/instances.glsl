// Whether an instance is among some: preview/packing.py, instance_switch.
#include "include/list.glsl"

bool is_among(sampler2D chosen, int instance)
{
  ivec2 size = textureSize(chosen, 0);
  return list_texel(chosen, min(instance, size.x * size.y - 1), 1, 0).x != 0.0;
}
