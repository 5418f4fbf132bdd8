// Irradiance of virtual point lights with known visibility (techniques/vpl/gather.py): the sum of flux/pi times
// G = cos cos' / r^2. A light: (position, 0), (normal, 0), (flux/pi, 0). Visibility has a row of texels a receiver, 24 lights a
// component.
#include "include/list.glsl"
#include "include/receiver.glsl"

void main()
{
  ivec2 place;
  int index = receiver_index(place, imageSize(irradiance).x, parameters.first_row, parameters.count);
  if (index < 0) {
    return;
  }
  vec3 point = list_texel(receivers, index, 2, 0).xyz;
  vec3 normal = list_texel(receivers, index, 2, 1).xyz;
  int words = (parameters.lights + 95) / 96;
  vec3 sum = vec3(0.0);
  for (int word = 0; word < words; word++) {
    vec4 bits = vec4(16777215.0);
    if (parameters.has_visibility != 0) {
      bits = list_texel(visibility, index, words, word);
    }
    // Sums of 96 lights each: one running sum over all would lose the faint ones to rounding.
    vec3 part = vec3(0.0);
    int end = min(96, parameters.lights - 96 * word);
    for (int i = 0; i < end; i++) {
      if ((uint(bits[i / 24]) >> uint(i % 24) & 1u) == 0u) {
        continue;
      }
      int light = 96 * word + i;
      vec3 towards = list_texel(lights, light, 3, 0).xyz - point;
      vec3 light_normal = list_texel(lights, light, 3, 1).xyz;
      float squared = dot(towards, towards);
      float transfer = max(-dot(towards, light_normal), 0.0) * max(dot(towards, normal), 0.0) / max(squared * squared, 1e-30);
      if (parameters.clamp_at > 0.0) {
        transfer = min(transfer, parameters.clamp_at);
      }
      part += transfer * list_texel(lights, light, 3, 2).xyz;
    }
    sum += part;
  }
  imageStore(irradiance, place, imageLoad(irradiance, place) + vec4(sum, 0.0));
}
