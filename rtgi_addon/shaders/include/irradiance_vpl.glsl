// Irradiance of virtual point lights and distant lights (techniques/vpl/gather.py), each with what it sees as planes
// (preview/indirect/vpl_shadows.py). A light: (position, 0), (normal, 0), (flux/pi, 0); a distant one: (direction, 0), (irradiance, 0),
// and the axes of its view.
#include "include/hash.glsl"
#include "include/list.glsl"

// The texel's centre of the square [-1, 1] that `square` lies in, as an index.
int vpl_texel(vec2 square, int side)
{
  ivec2 texel = clamp(ivec2((square + 1.0) * (0.5 * float(side))), ivec2(0), ivec2(side - 1));
  return texel.y * side + texel.x;
}

// Whether the light sees the point at -towards from it; half an octahedron about its normal turned by 45 degrees is its view.
bool vpl_sees(int light, vec3 normal, vec3 towards, vec3 point)
{
  float sign_z = normal.z < 0.0 ? -1.0 : 1.0;
  float a = -1.0 / (sign_z + normal.z);
  float b = normal.x * normal.y * a;
  vec3 tangent = vec3(1.0 + sign_z * normal.x * normal.x * a, sign_z * b, -sign_z * normal.x);
  vec3 bitangent = vec3(b, sign_z + normal.y * normal.y * a, -normal.y);
  vec3 local = -vec3(dot(towards, tangent), dot(towards, bitangent), dot(towards, normal));
  vec2 xy = local.xy / (abs(local.x) + abs(local.y) + local.z);
  int texel = vpl_texel(vec2(xy.x + xy.y, xy.x - xy.y), indirect.side);
  vec4 plane = list_texel(planes, light * indirect.side * indirect.side + texel, 1, 0);
  return dot(plane.xyz, point) - plane.w >= -indirect.tolerance * length(towards);
}

bool vpl_distant_sees(int light, vec3 point)
{
  vec3 offset = (point - indirect.focus.xyz) / indirect.focus.w;
  vec2 square = vec2(dot(offset, list_texel(distant_lights, light, 4, 2).xyz), dot(offset, list_texel(distant_lights, light, 4, 3).xyz));
  if (any(greaterThan(abs(square), vec2(1.0)))) {
    return true;
  }
  int side = indirect.distant_side;
  vec4 plane = list_texel(distant_planes, light * side * side + vpl_texel(square, side), 1, 0);
  return dot(plane.xyz, point) - plane.w >= -indirect.distant_tolerance;
}

vec3 indirect_irradiance(vec3 position_world, vec3 normal_world)
{
  vec3 reach = abs(position_world);
  vec3 point = position_world + normal_world * (indirect.self_intersection * max(reach.x, max(reach.y, reach.z)));
  int stride = indirect.stride;
  int first = 0;
  if (stride > 1) {
    uint state = indirect.seed_state;
    for (int axis = 0; axis < 3; axis++) {
      state = hash_with(state, floatBitsToUint(position_world[axis]));
    }
    first = int(state % uint(stride));
  }
  vec3 sum = vec3(0.0);
  // Sums of some lights each: one running sum over all would lose the faint ones to rounding.
  vec3 part = vec3(0.0);
  for (int light = first; light < indirect.count; light += stride) {
    vec3 towards = list_texel(lights, light, 3, 0).xyz - point;
    vec3 light_normal = list_texel(lights, light, 3, 1).xyz;
    float squared = dot(towards, towards);
    float transfer = max(-dot(towards, light_normal), 0.0) * max(dot(towards, normal_world), 0.0) / max(squared * squared, 1e-30);
    if (transfer > 0.0 && vpl_sees(light, light_normal, towards, point)) {
      part += min(transfer, indirect.clamp_at) * list_texel(lights, light, 3, 2).xyz;
    }
    if ((light / stride & 63) == 63) {
      sum += part;
      part = vec3(0.0);
    }
  }
  for (int light = first; light < indirect.distant_count; light += stride) {
    float cosine = dot(list_texel(distant_lights, light, 4, 0).xyz, normal_world);
    if (cosine > 0.0 && vpl_distant_sees(light, point)) {
      part += cosine * list_texel(distant_lights, light, 4, 1).xyz;
    }
  }
  return float(stride) * (sum + part);
}
