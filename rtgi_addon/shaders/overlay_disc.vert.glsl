// A square about each disc in its own plane. A disc: (position, radius), its normal, its colour.
#include "include/list.glsl"

void main()
{
  vec4 place = list_texel(marks, gl_InstanceID, 3, 0);
  vec3 normal = list_texel(marks, gl_InstanceID, 3, 1).xyz;
  vec3 side = abs(normal.z) < 0.9 ? vec3(0.0, 0.0, 1.0) : vec3(1.0, 0.0, 0.0);
  vec3 tangent = normalize(cross(side, normal));
  tint = list_texel(marks, gl_InstanceID, 3, 2);
  across = corner.xy;
  position_world = place.xyz + place.w * (corner.x * tangent + corner.y * cross(normal, tangent));
  gl_Position = overlay.clip_from_world * vec4(position_world, 1.0);
}
